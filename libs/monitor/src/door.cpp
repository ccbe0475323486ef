#include "door.hpp"

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <utility>

namespace whirl::monitor {

Door::~Door() { release(); }

std::shared_ptr<Door::Place> Door::enter(std::function<void()> close) {
  while (places_.size() >= most_ && close_oldest()) {
  }
  std::shared_ptr<Place> place(new Place{std::move(close)}, [this](Place* p) {
    places_.remove(p);
    delete p;
  });
  places_.push_back(place.get());
  return place;
}

bool Door::close_oldest() {
  if (places_.empty()) return false;
  auto silent = std::find_if(places_.begin(), places_.end(), [](const Place* p) { return !p->asked; });
  if (silent == places_.end()) silent = places_.begin();
  const auto close = std::exchange((*silent)->close, nullptr);
  places_.erase(silent);
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
