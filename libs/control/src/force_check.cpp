#include "whirl/control/force_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace whirl::control {
namespace {

// Times in s, rates in 1/s; the exported C has the same numbers (libs/deploy/c/force_check.c).
constexpr double kPole = 600, kWindow = 8e-3, kLate = 8e-3, kBlock = 1e-3;
constexpr double kShare = 0.7, kSlowPartOfStiffness = 0.02;  // of level, of k1
constexpr double kEdge = 20e-3, kStart = 0.15, kSettled = 0.02, kLearn = 0.1, kRelearn = 0.03, kStuck = 0.15;
constexpr double kUsual = 0.3, kRisen = 4;
constexpr double kLeft = 0.2, kOther = 0.25, kBetter = 0.7, kLow = 0.35, kHigh = 1.4, kLeast = -1.6, kReverse = -0.4;
constexpr double kLateLeast = 0.6, kLateMost = 1.6;
constexpr double kTest = 16e-3, kTestWindow = 3e-3, kAgain = 0.5, kClear = 0.25, kUnlike = 0.5, kRemains = 0.3;
constexpr double kProof = 1, kIdle = 0.25;
constexpr double kTold = 6e-3, kSure = 0.3, kEarlyLeft = 0.3, kEarlyLow = 0.1;
constexpr double kConfirm = 8e-3, kQuick = 2e-3, kUnclear = 17e-3, kEarly = 10e-3, kLarge = 2;

double real_part(std::complex<double> a, std::complex<double> b) noexcept {
  return a.real() * b.real() + a.imag() * b.imag();
}

}  // namespace

ForceCheck::ForceCheck(const ForceCheckSettings& settings) noexcept : settings_(settings) {
  threshold_ = kShare * settings.level * settings.model.k1;
  const double ph = kPole * settings.sample_time;
  share_ = ph / (1 + ph);
  samples_ = std::max(1, static_cast<int>(std::min(std::floor(kBlock / settings.sample_time + 0.5), 1e6)));
  blocks_ = std::clamp(static_cast<int>(std::min(std::floor(kLate / (samples_ * settings.sample_time) + 0.5), 1e6)), 1,
                       kBlocks);
  reset();
}

void ForceCheck::reset() noexcept {
  readings_ = summed_ = at_ = 0;
  z1_ = z2_ = a1_ = forcing1_ = sum_ = now_ = fd_ = fx_ = fy_ = fl_ = 0;
  ring_.fill({});
  filter_ = {};
  eps_ = settings_.eps;
  ff_ = dd_ = xx_ = yy_ = xd_ = yd_ = ll_ = ld_ = 0;
  time_ = loud_ = gain_time_ = late_time_ = usual_ = 0;
  test_ = before_ = 0;
  tested_ = kAgain;
  suspected_ = ForceFault::none;
  proven_ = idle_ = 0;
  changed_ = risen_ = false;
}

// The same poles for all signals, side by side in vector registers.
void ForceCheck::low_pass(Signals& in) noexcept {
  typedef double Vector __attribute__((vector_size(sizeof(Signals))));
  Vector now;
  std::memcpy(&now, in.data(), sizeof now);
  for (Signals& state : filter_) {
    Vector kept;
    std::memcpy(&kept, state.data(), sizeof kept);
    now = kept + share_ * (now - kept);
    std::memcpy(state.data(), &now, sizeof now);
  }
  std::memcpy(in.data(), &now, sizeof now);
}

// u as it was about 8 ms ago, in blocks of about a millisecond.
std::complex<double> ForceCheck::delayed(Complex u) noexcept {
  const auto at = static_cast<std::size_t>(at_);
  const Complex old = ring_[at];
  sum_ += u;
  if (++summed_ >= samples_) {
    ring_[at] = (1.0 / samples_) * sum_;
    at_ = (at_ + 1) % blocks_;
    sum_ = 0;
    summed_ = 0;
  }
  return old;
}

void ForceCheck::collect(Complex y, Complex u, Complex late, Complex unbalance) noexcept {
  const double w = std::min(settings_.sample_time / (test_ > 0 ? kTestWindow : kWindow), 1.0);
  const auto mean = [w](auto& sum, auto value) { sum += w * (value - sum); };
  const Complex d = y - u, back = std::conj(unbalance), l = late - u;
  now_ = product(d, back);  // times |f|^2 the eccentricity of this sample
  mean(ff_, std::norm(unbalance));
  mean(fd_, now_);
  mean(fx_, -u.real() * back);
  mean(fy_, product({0, -u.imag()}, back));
  mean(fl_, product(l, back));
  mean(dd_, std::norm(d));
  mean(xx_, u.real() * u.real());
  mean(yy_, u.imag() * u.imag());
  mean(xd_, -u.real() * d.real());
  mean(yd_, -u.imag() * d.imag());
  mean(ll_, std::norm(l));
  mean(ld_, real_part(l, d));
}

ForceFault ForceCheck::judge() noexcept {
  const double h = settings_.sample_time, least = 1e-9;
  const bool starting = time_ < kStart;
  // While starting, e is fitted with the rest: each product loses what lies along the unbalance. Later e is known.
  const double ff = ff_ + least, per = starting ? 1 / ff : 0;
  const Complex e = starting ? Complex{} : eps_;
  const Complex fr = fd_ - ff_ * e;
  const double rr = dd_ - 2 * real_part(e, fd_) + std::norm(e) * ff_ - per * std::norm(fr);
  const bool loud = rr > threshold_ * threshold_;
  usual_ += std::min(h / kUsual, 1.0) * (rr - usual_);
  risen_ = rr > kRisen * usual_;
  if (!loud && test_ <= 0) {
    loud_ = gain_time_ = late_time_ = 0;
    tested_ = std::min(tested_ + h, kAgain);
    return ForceFault::none;
  }
  const double changed = rr - (starting ? 0 : std::norm(fr) / ff);
  const double xr = xd_ - real_part(fx_, e) - per * real_part(fx_, fr);
  const double yr = yd_ - real_part(fy_, e) - per * real_part(fy_, fr);
  const double lr = ld_ - real_part(fl_, e) - per * real_part(fl_, fr);
  const double xx = xx_ - per * std::norm(fx_) + least, yy = yy_ - per * std::norm(fy_) + least;
  const double xy = -per * real_part(fx_, fy_), det = xx * yy - xy * xy + least * least;
  const double px = (xr * yy - yr * xy) / det, py = (yr * xx - xr * xy) / det,
               share = lr / (ll_ - per * std::norm(fl_) + least);
  const double low = 1 - std::max(px, py), high = 1 - std::min(px, py);
  const double by_gain = rr - px * xr - py * yr, by_delay = rr - share * lr;

  if (test_ > 0) {
    if (low < kReverse) suspected_ = ForceFault::reversed;
    return test_ended(rr, fr, by_gain, changed);
  }

  loud_ = loud ? loud_ + h : 0;
  const bool gain = loud && by_gain < kLeft * rr && by_gain < (low < kReverse ? 1 : kBetter) * changed &&
                    by_gain < by_delay && low < kLow && low > kLeast && high < kHigh;
  const bool late = loud && by_delay < kLeft * rr && by_delay < kBetter * changed && by_delay < by_gain &&
                    share > kLateLeast && share < kLateMost;
  gain_time_ = gain ? gain_time_ + h : 0;
  late_time_ = late ? late_time_ + h : 0;
  const bool large = low < kReverse && rr > kLarge * kLarge * threshold_ * threshold_;
  // An unbalance that doubles under a force that cancels it looks like a lost actuator at first.
  const bool other = changed < kOther * rr && low > kReverse;
  const double confirm = starting ? kEarly : large ? kQuick : other ? kUnclear : kConfirm;
  tested_ = std::min(tested_ + h, kAgain);
  const bool open = !starting && tested_ >= kAgain && changed < kUnlike * rr;  // a test may tell more
  const bool early = open && rr > kLarge * kLarge * threshold_ * threshold_ && by_gain < kEarlyLeft * rr &&
                     by_gain < changed && by_gain < by_delay && low < kEarlyLow && low > kLeast && high < kHigh;
  if (gain_time_ > confirm || early) {
    const ForceFault found = low < kReverse ? ForceFault::reversed : ForceFault::lost;
    if (!early && (!open || by_gain < kClear * changed)) return found;
    suspected_ = found;
    before_ = rr;
    test_ = h;
    return ForceFault::none;
  }
  return late_time_ > kConfirm ? ForceFault::late : ForceFault::none;
}

/// The force ends while the unbalance turns on: soon one of them alone explains r. At the end, what is left of r
/// without force is no fault of the force.
ForceFault ForceCheck::test_ended(double rr, Complex fr, double by_gain, double changed) noexcept {
  test_ += settings_.sample_time;
  const bool told = test_ > kTold && std::min(by_gain, changed) < kSure * std::max(by_gain, changed);
  if (!told && test_ < kTest) return ForceFault::none;
  test_ = tested_ = loud_ = gain_time_ = late_time_ = 0;
  if (told ? by_gain < changed : rr < kRemains * before_) return suspected_;
  eps_ += (1 / (ff_ + 1e-9)) * fr;
  changed_ = true;
  return ForceFault::none;
}

/// Until the force has been seen to act: if the rotor moves as the unbalance designed with does without it, it is let
/// go, to see whether anything changes.
void ForceCheck::prove() noexcept {
  const double loud = threshold_ * threshold_, least = 1e-9;
  if (time_ < kStart || test_ > 0 || proven_ > kProof || xx_ + yy_ <= loud) return;
  const Complex e = settings_.eps;
  const double rr = dd_ - 2 * real_part(e, fd_) + std::norm(e) * ff_;
  if (rr < 0.5 * (xx_ + yy_)) proven_ += settings_.sample_time;
  const double xr = xd_ - real_part(fx_, e), yr = yd_ - real_part(fy_, e);
  const double px = xr / (xx_ + least), py = yr / (yy_ + least);
  const bool idle =
      rr > loud && rr - px * xr - py * yr < kLeft * rr && std::abs(1 - px) < kIdle && std::abs(1 - py) < kIdle;
  idle_ = idle ? idle_ + settings_.sample_time : 0;
  if (idle_ <= kConfirm || tested_ < kAgain) return;
  eps_ = e;
  suspected_ = ForceFault::lost;
  before_ = rr;
  test_ = settings_.sample_time;
}

// The unbalance that acts, while nothing else is to be explained, or while what is left stands: not what has just risen
// out of it.
void ForceCheck::follow() noexcept {
  const Signals& f = filter_.back();
  const double slow = kSlowPartOfStiffness * settings_.model.k1, size = f[6] * f[6] + f[7] * f[7];
  const bool starting = kStart > time_, stuck = !risen_ && kStuck < loud_;
  if (test_ > 0 || size <= slow * slow || (loud_ > 0 && !starting && !stuck)) return;
  const double tau = starting ? kSettled : stuck ? kRelearn : kLearn;
  eps_ += std::min(settings_.sample_time / tau, 1.0) * ((1 / size) * now_ - eps_);
}

ForceFault ForceCheck::step(Complex z, bool fresh, Complex a, Complex forcing) noexcept {
  const double h = settings_.sample_time;
  const Complex u = 0.5 * (a + a1_);
  changed_ = false;
  a1_ = a;
  const Complex late = delayed(u), before = forcing1_;
  forcing1_ = forcing;
  if (!fresh) {
    readings_ = 0;
    return ForceFault::none;
  }
  ForceFault out = ForceFault::none;
  if (readings_ >= 2) {
    // Exact for a force that is held: the mean of both intervals is the second difference.
    const Complex second = (1 / (h * h)) * (z - 2.0 * z1_ + z2_);
    const Complex y = second - settings_.model.acceleration(z1_, (0.5 / h) * (z - z2_));
    Signals all{y.real(), y.imag(), u.real(), u.imag(), late.real(), late.imag(), before.real(), before.imag()};
    low_pass(all);
    // When the first force begins to act is known to some ms only: its edge is no evidence, what follows is.
    if (time_ > 0 || std::norm(u) > 0) time_ = std::min(time_ + h, 1.0);
    if (time_ > kEdge) {
      collect({all[0], all[1]}, {all[2], all[3]}, {all[4], all[5]}, {all[6], all[7]});
      prove();
      out = judge();
      follow();
    }
  }
  z2_ = z1_;
  z1_ = z;
  readings_ = std::min(readings_ + 1, 2);
  return out;
}

}  // namespace whirl::control
