#include "whirl/control/force_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "whirl/control/supervision_numbers.hpp"

namespace whirl::control {
namespace {

namespace n = force_check;

double real_part(std::complex<double> a, std::complex<double> b) noexcept {
  return a.real() * b.real() + a.imag() * b.imag();
}

}  // namespace

ForceCheck::ForceCheck(const ForceCheckSettings& settings) noexcept : settings_(settings) {
  const double h = settings.sample_time, seen = n::share * settings.level * settings.model.k1;
  const double play = settings.hysteresis > 0 ? 0.5 * settings.hysteresis : n::play * settings.limit;
  const double slew = settings.slew > 0 ? settings.slew : settings.limit / n::full;
  threshold_ = seen * seen;
  play_ = play * play;
  least_ = std::max(threshold_, play_);
  change_ = slew * h;
  model_ = n::model * settings.model.k1;
  const double ph = n::pole * h;
  share_ = ph / (1 + ph);
  samples_ = std::max(1, static_cast<int>(std::min(std::floor(n::block / h + 0.5), 1e6)));
  const auto blocks = [&](double time) {
    return std::clamp(static_cast<int>(std::min(std::floor(time / (samples_ * h) + 0.5), 1e6)), 1, kBlocks);
  };
  near_ = blocks(n::late);
  blocks_ = blocks(n::later);
  reset();
}

void ForceCheck::reset() noexcept {
  readings_ = summed_ = at_ = 0;
  z1_ = z2_ = a1_ = forcing1_ = sum_ = now_ = fd_ = fx_ = fy_ = fl_ = fm_ = fz_ = zd_ = zx_ = zy_ = zl_ = zm_ = 0;
  ring_.fill({});
  filter_ = {};
  eps_ = settings_.eps;
  ff_ = dd_ = xx_ = yy_ = xd_ = yd_ = ll_ = ld_ = mm_ = md_ = zz_ = 0;
  time_ = loud_ = gain_time_ = late_time_ = proof_time_ = unsure_ = usual_ = 0;
  test_ = before_ = 0;
  suspected_ = ForceFault::none;
  tested_ = n::again;
  proven_ = idle_ = found_ = 0;
  changed_ = risen_ = known_ = false;
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

// u as it was about 8 ms and 12 ms ago, in blocks of about a millisecond.
ForceCheck::Late ForceCheck::delayed(Complex u) noexcept {
  const auto at = static_cast<std::size_t>(at_);
  const Late old{ring_[static_cast<std::size_t>((at_ + blocks_ - near_) % blocks_)], ring_[at]};
  sum_ += u;
  if (++summed_ >= samples_) {
    ring_[at] = (1.0 / samples_) * sum_;
    at_ = (at_ + 1) % blocks_;
    sum_ = 0;
    summed_ = 0;
  }
  return old;
}

void ForceCheck::collect(Complex y, Complex u, const Late& late, Complex unbalance, Complex z) noexcept {
  const double w = std::min(settings_.sample_time / (test_ > 0 && known_ ? n::known_window : n::window), 1.0);
  const auto mean = [w](auto& sum, auto value) { sum += w * (value - sum); };
  const Complex d = y - u, back = std::conj(unbalance), l = late.near - u, m = late.far - u, other = std::conj(z);
  now_ = product(d, back);  // times |f|^2 the eccentricity of this sample
  mean(ff_, std::norm(unbalance));
  mean(fd_, now_);
  mean(fx_, -u.real() * back);
  mean(fy_, product({0, -u.imag()}, back));
  mean(fl_, product(l, back));
  mean(fm_, product(m, back));
  mean(fz_, product(z, back));
  mean(dd_, std::norm(d));
  mean(xx_, u.real() * u.real());
  mean(yy_, u.imag() * u.imag());
  mean(xd_, -u.real() * d.real());
  mean(yd_, -u.imag() * d.imag());
  mean(ll_, std::norm(l));
  mean(ld_, real_part(l, d));
  mean(mm_, std::norm(m));
  mean(md_, real_part(m, d));
  mean(zz_, std::norm(z));
  mean(zd_, product(d, other));
  mean(zx_, -u.real() * other);
  mean(zy_, product({0, -u.imag()}, other));
  mean(zl_, product(l, other));
  mean(zm_, product(m, other));
}

/// Least squares of r with the unbalance `e`, or with any: then each product loses what lies along the unbalance.
ForceCheck::Fit ForceCheck::fit(Complex e, bool known, double share) const noexcept {
  constexpr double kLeast = 1e-9;
  const double ff = ff_ + kLeast, per = known ? 0 : 1 / ff;
  const Complex fr = fd_ - ff_ * e;
  // What an error of the stiffness explains.
  const Complex back = std::conj(fz_), zr = zd_ - product(back, e) - per * product(back, fr);
  const double zz = zz_ - per * std::norm(fz_) + 1e-30;
  const double size = std::sqrt(std::norm(zr)), model = share * model_, most = model * zz;
  const Complex q = (size > most ? model / size : 1 / zz) * zr;
  const Complex zx = zx_ - per * product(back, fx_), zy = zy_ - per * product(back, fy_),
                zl = zl_ - per * product(back, fl_), zm = zm_ - per * product(back, fm_);
  Fit out;
  out.rr =
      dd_ - 2 * real_part(e, fd_) + std::norm(e) * ff_ - per * std::norm(fr) - 2 * real_part(q, zr) + std::norm(q) * zz;
  const Complex fq = fr - product(q, fz_);
  out.changed = out.rr - (known ? std::norm(fq) / ff : 0);
  const double xr = xd_ - real_part(fx_, e) - per * real_part(fx_, fr) - real_part(zx, q);
  const double yr = yd_ - real_part(fy_, e) - per * real_part(fy_, fr) - real_part(zy, q);
  const double lr = ld_ - real_part(fl_, e) - per * real_part(fl_, fr) - real_part(zl, q);
  const double mr = md_ - real_part(fm_, e) - per * real_part(fm_, fr) - real_part(zm, q);
  const double xx = xx_ - per * std::norm(fx_) + kLeast, yy = yy_ - per * std::norm(fy_) + kLeast;
  const double xy = -per * real_part(fx_, fy_), det = xx * yy - xy * xy + kLeast * kLeast;
  const double px = (xr * yy - yr * xy) / det, py = (yr * xx - xr * xy) / det;
  const double near = lr / (ll_ - per * std::norm(fl_) + kLeast), far = mr / (mm_ - per * std::norm(fm_) + kLeast);
  const bool later = known && far * mr > near * lr;
  out.share = later ? far : near;
  out.delay = later ? far * n::later : near * n::late;
  out.gain_x = 1 - px, out.gain_y = 1 - py;
  out.sure_x = det / yy, out.sure_y = det / xx;
  out.by_gain = out.rr - px * xr - py * yr;
  out.by_delay = out.rr - (later ? far * mr : near * lr);
  out.eps = e + (1 / ff) * (fq - px * fx_ - py * fy_);
  return out;
}

/// A gain of this size fits, and that of a sound actuator does not.
bool ForceCheck::lost(const Fit& f, double proof) const noexcept {
  const double bound = proof * std::max(f.by_gain, 0.0) + play_;
  const auto axis = [bound](double gain, double sure) {
    const double short_of = n::sound - gain;
    return gain < n::low && short_of * short_of * sure > bound;
  };
  return f.low() > n::least && f.high() < n::high && f.by_gain < f.by_delay &&
         (axis(f.gain_x, f.sure_x) || axis(f.gain_y, f.sure_y));
}

ForceFault ForceCheck::judge() noexcept {
  const double h = settings_.sample_time;
  const bool starting = time_ < n::start;
  // While starting, e is fitted with the rest. Later it is known.
  const Fit f = starting ? fit({}, false) : fit(eps_, true);
  usual_ += std::min(h / n::usual, 1.0) * (f.rr - usual_);
  risen_ = f.rr > n::risen * usual_;
  if (f.rr <= threshold_ && test_ <= 0) {
    loud_ = gain_time_ = late_time_ = proof_time_ = 0;
    tested_ = std::min(tested_ + h, n::again);
    return ForceFault::none;
  }
  if (test_ > 0) return test_ended(f);

  loud_ += h;
  tested_ = std::min(tested_ + h, n::again);
  const double low = f.low();
  const bool large = f.rr > n::large * n::large * least_, reversed = low < n::reverse;
  const bool fault = f.rr > least_ && low > n::least && f.high() < n::high && f.by_gain < f.by_delay;
  // What limits a force neither takes nearly all of it nor shifts nearly all of it in time.
  const bool known = unsure_ <= 0, plain = n::plain * f.rr > std::min(f.by_gain, f.by_delay);
  const bool gain = fault && low < n::low && f.by_gain < (starting && !known ? n::unlike : n::left) * f.rr &&
                    (!known || f.by_gain < (reversed ? 1 : n::better) * f.changed);
  const auto delayed = [this](const Fit& g, double left) {
    return g.rr > least_ && g.by_delay < left * g.rr && g.by_delay < n::better * g.changed && g.by_delay < g.by_gain &&
           g.share > n::late_least && g.share < n::late_most;
  };
  // A delay that explains nearly all needs no error of the stiffness beside it.
  const Fit stiff = starting ? f : fit(eps_, true, 0);
  const bool alone = !starting && delayed(stiff, n::alone), late = (known || plain) && (alone || delayed(f, n::left));
  if (late) found_ = (alone ? stiff : f).delay;
  gain_time_ = gain ? gain_time_ + h : 0;
  late_time_ = late ? late_time_ + h : 0;
  // An unbalance that doubles under a force that cancels it looks like a lost actuator at first.
  const bool other = f.changed < n::other * f.rr && !reversed;
  // Nothing that limits a force turns its sign.
  proof_time_ = reversed && fault && lost(starting ? f : fit({}, false), n::proof) ? proof_time_ + h : 0;
  if (proof_time_ > n::confirm) return ForceFault::reversed;
  const double confirm = starting ? n::early : large && reversed ? n::quick : other ? n::unclear : n::confirm;
  const bool open = tested_ >= n::again && (!starting || !known);  // a test may tell more
  const bool early = open && !starting && f.changed < n::unlike * f.rr && large && fault &&
                     f.by_gain < n::early_left * f.rr && f.by_gain < f.changed && low < n::early_low;
  if (gain_time_ > confirm || early) {
    const bool sure = starting ? (known || plain) && lost(f, n::proof) : known,
               apart = f.by_gain < (f.changed >= n::unlike * f.rr ? n::better : n::clear) * f.changed;
    suspected_ = reversed ? ForceFault::reversed : ForceFault::lost;
    if (!early && sure && apart) return suspected_;
    if (open) {
      known_ = sure;
      before_ = f.rr;
      test_ = h;
    }
    return ForceFault::none;
  }
  return late_time_ > n::confirm ? ForceFault::late : ForceFault::none;
}

/// The gain is negative, and none would fit worse.
bool ForceCheck::turned(const Fit& f) const noexcept {
  const double sure = f.gain_x < f.gain_y ? f.sure_x : f.sure_y, low = f.low();
  return low < n::reverse && low * low * sure > n::proof * std::max(f.by_gain, 0.0) + play_;
}

/// The force ends while the unbalance turns on: soon one of them alone explains r. At the end, what is left of r
/// without force is no fault of the force. Where what was delivered before is not known, the gains of what ended are
/// all that counts.
ForceFault ForceCheck::test_ended(const Fit& f) noexcept {
  test_ += settings_.sample_time;
  if (f.low() < n::reverse) suspected_ = ForceFault::reversed;
  if (test_ <= n::told) return ForceFault::none;
  const Fit free = fit({}, false);
  const double by_gain = std::max(f.by_gain, 0.0), changed = std::max(free.rr, 0.0);
  const bool missing = !known_ && lost(free, settings_.slew > 0 ? n::proof : n::blind_proof),
             told = known_ && std::min(by_gain, changed) < n::told_by * std::max(by_gain, changed);
  if (!missing && !told && test_ < (known_ ? n::known_test : n::test)) return ForceFault::none;
  test_ = tested_ = loud_ = gain_time_ = late_time_ = proof_time_ = 0;
  if (missing) return turned(free) ? ForceFault::reversed : ForceFault::lost;
  if (told ? by_gain < changed : known_ && f.rr < n::remains * before_) return suspected_;
  eps_ = free.eps;
  changed_ = true;
  return ForceFault::none;
}

/// Until the force has been seen to act: if the rotor moves as the unbalance designed with does without it, it is let
/// go, to see whether anything changes.
void ForceCheck::prove() noexcept {
  if (time_ < n::start || test_ > 0 || proven_ > n::proof_time || xx_ + yy_ <= least_) return;
  const Fit f = fit(settings_.eps, true);
  if (f.rr < 0.5 * (xx_ + yy_)) proven_ += settings_.sample_time;
  const bool idle =
      f.rr > least_ && f.by_gain < n::left * f.rr && std::abs(f.gain_x) < n::idle && std::abs(f.gain_y) < n::idle;
  idle_ = idle ? idle_ + settings_.sample_time : 0;
  if (idle_ <= n::confirm || tested_ < n::again) return;
  eps_ = settings_.eps;
  suspected_ = ForceFault::lost;
  known_ = true;
  before_ = f.rr;
  test_ = settings_.sample_time;
}

// The unbalance that acts, while nothing else is to be explained, or while what is left stands: not what has just risen
// out of it.
void ForceCheck::follow() noexcept {
  const Signals& f = filter_.back();
  const double slow = n::slow * settings_.model.k1, size = f[6] * f[6] + f[7] * f[7];
  const bool starting = n::start > time_, stuck = !risen_ && n::stuck < loud_;
  if (test_ > 0 || size <= slow * slow || (loud_ > 0 && !starting && !stuck)) return;
  const double tau = starting ? n::settled : stuck ? n::relearn : n::learn;
  eps_ += std::min(settings_.sample_time / tau, 1.0) * ((1 / size) * now_ - eps_);
}

ForceFault ForceCheck::step(Complex z, bool fresh, Complex a, Complex forcing, bool limited) noexcept {
  const double h = settings_.sample_time;
  const Complex u = 0.5 * (a + a1_);
  const bool slewing =
      change_ > 0 && (std::abs(a.real() - a1_.real()) > change_ || std::abs(a.imag() - a1_.imag()) > change_);
  unsure_ = limited || slewing ? n::unsure + settings_.delay : std::max(unsure_ - h, 0.0);
  changed_ = false;
  a1_ = a;
  const Late late = delayed(u);
  const Complex before = forcing1_;
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
    Signals all{y.real(),      y.imag(),      u.real(),   u.imag(),   late.near.real(), late.near.imag(),
                before.real(), before.imag(), z1_.real(), z1_.imag(), late.far.real(),  late.far.imag()};
    low_pass(all);
    // When the first force begins to act is known to some ms only: its edge is no evidence, what follows is.
    if (time_ > 0 || std::norm(u) > 0) time_ = std::min(time_ + h, 1.0);
    if (time_ > n::edge) {
      collect({all[0], all[1]}, {all[2], all[3]}, {{all[4], all[5]}, {all[10], all[11]}}, {all[6], all[7]},
              {all[8], all[9]});
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
