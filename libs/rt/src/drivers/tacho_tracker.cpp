#include "whirl/rt/drivers/tacho_tracker.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace whirl::rt {
namespace {

constexpr double kTurn = 2 * std::numbers::pi;
constexpr double kDeviations = 5;      // an edge farther off is none of this mark: of a normal scatter 1 in 2 million
constexpr double kTrusted = 2.5;       // up to here an edge moves the state in full: what is added near a mark cannot
constexpr double kTickScatter = 0.29;  // ticks: an edge without a sample on its way is known to one
constexpr double kLeastDeviation = 0.015;  // of the distance between marks: what a change of torque moves within one
constexpr double kMostGate = 0.3;          // of it: an edge in the middle belongs to neither mark
constexpr double kLeastPole = 0.7;         // of the filter: few marks a turn are still averaged over some of them
constexpr double kMemory = 0.05;           // share of the newest edge in the scatter
constexpr long kMostMissing = 3;           // marks in a row without an edge
constexpr long kMostExtra = 5, kMostAtRest = 2;  // edges in a row that are no marks: a disturbance may bring a few
constexpr double kResting = 2;                   // marks a second, and slower: the next one says little of the speed
constexpr double kUnseen = 3.2;      // turns/s^2 that any rotor may speed up or slow down without being seen
constexpr double kOtherSpeed = 0.3;  // share: no acceleration hides that from the filter

}  // namespace

TachoTracker::TachoTracker(const TachoMarks& marks, double beta, double omega, double omega_dot)
    : tacho_(marks),
      search_(marks.marks, marks.sample_time),
      most_missing_(std::max<double>(kMostMissing, 0.5 * static_cast<double>(marks.marks.size()))),
      turn_(beta / kTurn),
      speed_(omega / kTurn),
      acceleration_(omega_dot / kTurn) {
  const std::vector<double>& m = marks.marks;
  for (std::size_t i = 0; i < m.size(); ++i) {
    least_room_ = std::min(least_room_, (i + 1 < m.size() ? m[i + 1] : m.front() + 1) - m[i]);
  }
  const double turn = std::floor(turn_);
  next_ = static_cast<long>(turn) * static_cast<long>(marks.marks.size());
  while (place(next_) <= turn_) ++next_;
  since_ = speed_ > 0 ? (turn_ - place(next_ - 1)) / speed_ : 0;
}

double TachoTracker::beta() const noexcept { return kTurn * turn_; }
double TachoTracker::omega() const noexcept { return kTurn * speed_; }
double TachoTracker::omega_dot() const noexcept { return kTurn * acceleration_; }

double TachoTracker::place(long mark) const noexcept {
  const auto n = static_cast<long>(tacho_.marks.size());
  const long turn = mark >= 0 ? mark / n : -((n - 1 - mark) / n);
  return static_cast<double>(turn) + tacho_.marks[static_cast<std::size_t>(mark - n * turn)];
}

double TachoTracker::deviation() const noexcept {
  const double tick = kTickScatter * std::abs(speed_) * tacho_.sample_time;
  return std::max(std::sqrt(scatter_ + tick * tick), kLeastDeviation * room());
}

double TachoTracker::room() const noexcept {
  return std::min(place(next_) - place(next_ - 1), place(next_ + 1) - place(next_));
}

double TachoTracker::unseen() const noexcept { return kUnseen + 0.5 * std::abs(acceleration_); }

double TachoTracker::gate() const noexcept {
  const double wider = std::ldexp(1.0, static_cast<int>(std::clamp(in_a_row_ - 1, 0L, 8L)));
  // Between the marks of a slow rotor the acceleration has time to change by half.
  const double slow = 0.25 * std::abs(acceleration_) * since_ * since_;
  return std::min(std::max({kDeviations * deviation() * wider, slack_, slow}), kMostGate * room());
}

void TachoTracker::advance(double time) noexcept {
  since_ += time;
  time_ += time;
  if (lost_) return;
  // A rotor that slows down comes to rest; it does not turn back.
  const double rest = acceleration_ < 0 ? -speed_ / acceleration_ : time;
  const double t = std::min(time, rest);
  turn_ += t * (speed_ + 0.5 * t * acceleration_);
  speed_ += t * acceleration_;
  if (t < time) speed_ = acceleration_ = 0;
}

void TachoTracker::pass_marks() noexcept {
  while (!lost_ && turn_ > place(next_) + gate()) {
    ++next_, ++missing_;
    acceleration_ *= 0.5;  // what was learned from the edges before is old
    lost_ = static_cast<double>(++in_a_row_) > most_missing_;
  }
}

// Ticks left out: whatever passed meanwhile was not seen. An edge says that its mark passed, not where.
void TachoTracker::cross_gap(double time, bool edge) noexcept {
  const double from = turn_;
  const double wider = std::ldexp(1.0, static_cast<int>(std::clamp(in_a_row_, 0L, 8L)));
  // What was off before counts once, however many gaps there are between two marks.
  const double off = std::max(slack_, 3 * wider * deviation()) + 0.5 * speed_ * time / room() * deviation() +
                     0.5 * unseen() * time * time;
  search_.clear();
  extra_in_a_row_ = 0;
  advance(time);
  if (lost_) return;
  lost_ = off > kMostGate * least_room_;
  if (lost_) return;
  slack_ = off;
  if (edge && place(next_) > from - gate() && place(next_) < turn_ + gate()) {
    ++next_, in_a_row_ = std::max(in_a_row_ - 1, 0L);
  }
  for (; turn_ > place(next_) + gate(); ++next_) ++missing_;
}

// What the last edges say by themselves.
void TachoTracker::find() noexcept {
  unsearched_ = 0;
  const TachoSearch::Found f = search_.look();
  if (!f.steady) return;
  const double at = tacho_.marks[f.mark];
  if (!lost_) {
    const bool other_mark = f.unique && std::abs(std::remainder(at - turn_, 1.0)) > 0.5 * least_room_;
    lost_ = other_mark || std::abs(f.speed - speed_) > kOtherSpeed * f.speed;
    return;
  }
  if (!f.unique) return;
  // The angle does not go back.
  const double turns = std::ceil(turn_ - at);
  turn_ = turns + at;
  next_ = static_cast<long>(turns) * static_cast<long>(tacho_.marks.size()) + static_cast<long>(f.mark) + 1;
  speed_ = f.speed, acceleration_ = f.acceleration;
  scatter_ = slack_ = since_ = 0;
  in_a_row_ = extra_in_a_row_ = 0;
  lost_ = false;
}

void TachoTracker::take_edge() noexcept {
  search_.edge(time_);
  const bool was_lost = lost_;
  if (search_.full() && (lost_ || ++unsearched_ >= tacho_.marks.size())) find();
  if (lost_ || was_lost) return;
  const double off = place(next_) - turn_;
  if (std::abs(off) <= gate()) return follow(off);
  ++extra_;
  lost_ = ++extra_in_a_row_ >= (speed_ > kResting * room() ? kMostExtra : kMostAtRest);
}

void TachoTracker::follow(double off) noexcept {
  const double h = std::max(since_, tacho_.sample_time);
  if (slack_ > deviation()) {
    // The first mark after ticks left out tells what the rotor did meanwhile.
    turn_ += off;
    const double most = unseen() * h;
    speed_ += std::clamp(1.5 * off / h, -most, most);
  } else {
    // One pulse may be lost; after two the state itself may be what is off.
    const bool in_step = in_a_row_ < 2;
    const double most = in_step ? kTrusted * deviation() : gate(), e = std::clamp(off, -most, most);
    const double q = std::max(std::exp(-kTurn * tacho_.bandwidth * h), kLeastPole), p = 1 - q;
    turn_ += (1 - q * q * q) * e;
    speed_ += 1.5 * p * p * (1 + q) / h * e;
    if (in_step) acceleration_ += p * p * p / (h * h) * e;
    if (in_step) scatter_ += kMemory * (e * e - scatter_);
  }
  speed_ = std::max(speed_, 0.0);
  // One edge alone may have been an added one: the gate stays wide for the next.
  slack_ = slack_ > deviation() ? 0.5 * slack_ : 0;
  ++next_, in_a_row_ = std::max(in_a_row_ - 1, 0L), extra_in_a_row_ = 0, since_ = 0;
}

void TachoTracker::update(double volts, long ticks) noexcept {
  const double range = tacho_.top - tacho_.bottom, arm = tacho_.arm * range;
  const double middle_up = tacho_.bottom + tacho_.middle * range, middle_down = tacho_.top - tacho_.middle * range;
  const double step = tacho_.sample_time * static_cast<double>(std::max(ticks, 1L));
  bool edge = false;
  double part = 1;
  if (started_) {
    const bool up = low_ && last_volts_ < middle_up && volts >= middle_up;
    const bool down = high_ && last_volts_ > middle_down && volts <= middle_down;
    edge = (up && tacho_.rising) || (down && tacho_.falling);
    if (up || down) part = ((up ? middle_up : middle_down) - last_volts_) / (volts - last_volts_);
    if (up) low_ = false;
    if (down) high_ = false;
  }
  if (volts < tacho_.bottom + arm) low_ = true;
  if (volts > tacho_.top - arm) high_ = true;
  last_volts_ = volts;
  started_ = true;
  if (ticks > 1) {
    const double moved = (0.5 * speed_ + 0.5 * unseen() * step) * step;
    if (lost_ || moved > kDeviations * deviation()) return cross_gap(step, edge);
    part = 0.5;  // somewhere in it, and no mark beside it
  }
  advance(edge ? part * step : step);
  pass_marks();
  if (!edge) return;
  take_edge();
  advance((1 - part) * step);
  pass_marks();
}

}  // namespace whirl::rt
