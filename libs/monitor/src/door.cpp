#include "door.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <map>
#include <string_view>
#include <utility>

namespace whirl::monitor {

Door::~Door() { release(); }

std::shared_ptr<Door::Place> Door::enter(std::function<void()> close, std::string address) {
  while (places_.size() >= most_ && close_one()) {
  }
  std::shared_ptr<Place> place(new Place{std::move(close), std::move(address)}, [this](Place* p) {
    places_.remove(p);
    delete p;
  });
  places_.push_back(place.get());
  return place;
}

bool Door::close_one() {
  if (places_.empty()) return false;
  std::map<std::string_view, std::size_t> held;
  for (const Place* p : places_) ++held[p->address];
  // Who holds most, then who has not asked, then who came first.
  const auto rank = [&](const Place* p) { return std::pair(held[p->address], !p->asked); };
  const auto one = std::max_element(places_.begin(), places_.end(),
                                    [&](const Place* a, const Place* b) { return rank(a) < rank(b); });
  const auto close = std::exchange((*one)->close, nullptr);
  places_.erase(one);
  close();
  return true;
}

void Door::reserve() {
  if (reserved_ < 0) reserved_ = open("/dev/null", O_RDONLY | O_CLOEXEC);
}

bool Door::release() { return reserved_ >= 0 && ::close(std::exchange(reserved_, -1)) == 0; }

std::size_t most_unfinished() {
  rlimit descriptors{};
  if (getrlimit(RLIMIT_NOFILE, &descriptors) != 0 || descriptors.rlim_cur == RLIM_INFINITY) return 128;
  return std::clamp<std::size_t>(descriptors.rlim_cur / 8, 4, 128);
}

}  // namespace whirl::monitor
