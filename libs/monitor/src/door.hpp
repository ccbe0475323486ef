#pragma once
#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <string>

namespace whirl::monitor {

/// Connections that are no client of the stream yet: whoever opens thousands and says nothing must not keep out the
/// person with the token. Beyond `most` the address with the most places loses the one that has waited longest without
/// a whole request. Used by one thread.
class Door {
 public:
  struct Place {
    std::function<void()> close;
    std::string address;  ///< of the other end
    bool asked = false;   ///< its request is complete
  };
  explicit Door(std::size_t most) : most_(most) {}
  ~Door();
  Door(const Door&) = delete;
  Door& operator=(const Door&) = delete;

  /// A place until the pointer is dropped; `close` ends the connection when it has to go before. The door must outlive
  /// it.
  std::shared_ptr<Place> enter(std::function<void()> close, std::string address);
  /// False when there is none.
  bool close_one();
  std::size_t size() const { return places_.size(); }

  /// A descriptor that is kept for the moment when the process has no more.
  void reserve();
  /// Gives it back to the system; false when it is not there.
  bool release();

 private:
  std::size_t most_;
  std::list<Place*> places_;
  int reserved_ = -1;
};

/// An eighth of the descriptors that the process may open, 128 at most.
std::size_t most_unfinished();

}  // namespace whirl::monitor
