#include "work.hpp"

#include <algorithm>

namespace whirl::modal {
namespace {
thread_local WorkLimit* g_innermost = nullptr;
}

WorkLimit::WorkLimit(double operations) : limit_(operations), outer_(g_innermost) { g_innermost = this; }

WorkLimit::~WorkLimit() { g_innermost = outer_; }

void WorkLimit::add(double operations) {
  for (WorkLimit* one = g_innermost; one != nullptr; one = one->outer_) one->spent_ += operations;
}

bool WorkLimit::over() {
  WorkLimit* last = nullptr;  // outermost that is used up: all within it stop
  for (WorkLimit* one = g_innermost; one != nullptr; one = one->outer_)
    if (one->spent_ >= one->limit_) last = one;
  for (WorkLimit* one = g_innermost; last != nullptr; one = one->outer_) {
    one->stopped_ = true;
    if (one == last) break;
  }
  return last != nullptr;
}

void WorkLimit::stop() {
  if (g_innermost != nullptr) g_innermost->stopped_ = true;
}

double WorkLimit::left() {
  double left = 1e300;
  for (const WorkLimit* one = g_innermost; one != nullptr; one = one->outer_)
    left = std::min(left, std::max(0.0, one->limit_ - one->spent_));
  return left;
}

}  // namespace whirl::modal
