#include "whirl/control/force_check.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "whirl/control/supervision_numbers.hpp"

namespace whirl::control {
namespace {

namespace n = force_check;

constexpr double kLeast = 1e-9;  // that no sum of squares is zero

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
  rate_ = 1 / h;
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
  z1_ = z2_ = a1_ = forcing1_ = sum_ = now_ = 0;
  ring_.fill({});
  first_ = second_ = {};
  eps_ = settings_.eps;
  means_ = {};
  time_ = loud_ = gain_time_ = late_time_ = proof_time_ = unsure_ = usual_ = 0;
  test_ = before_ = 0;
  suspected_ = ForceFault::none;
  tested_ = n::again;
  proven_ = idle_ = found_ = 0;
  changed_ = risen_ = known_ = false;
}

// The same poles for all signals, side by side in vector registers.
void ForceCheck::low_pass(Vector& now, LowPass& poles) const noexcept {
  for (Row& state : poles) {
    Vector kept;
    std::memcpy(&kept, state.data(), sizeof kept);
    now = kept + share_ * (now - kept);
    std::memcpy(state.data(), &now, sizeof now);
  }
}

// u as it was about 8 ms and 12 ms ago, in blocks of about a millisecond.
ForceCheck::Late ForceCheck::delayed(Complex u) noexcept {
  const auto at = static_cast<std::size_t>(at_);
  const int near = at_ >= near_ ? at_ - near_ : at_ + blocks_ - near_;
  const Late old{ring_[static_cast<std::size_t>(near)], ring_[at]};
  sum_ += u;
  if (++summed_ >= samples_) {
    ring_[at] = (1.0 / samples_) * sum_;
    at_ = at_ + 1 < blocks_ ? at_ + 1 : 0;
    sum_ = 0;
    summed_ = 0;
  }
  return old;
}

void ForceCheck::collect(const Vector& first, const Vector& second) noexcept {
  const double w = std::min(settings_.sample_time * (test_ > 0 && known_ ? 1 / n::known_window : 1 / n::window), 1.0);
  const Complex y{first[0], first[1]}, u{first[2], first[3]}, unbalance{first[6], first[7]}, z{second[0], second[1]};
  const Complex d = y - u, l = Complex{first[4], first[5]} - u, m = Complex{second[2], second[3]} - u;
  now_ = product(d, std::conj(unbalance));  // times |f|^2 the eccentricity of this sample
  // In the order of Factor; from registers, because what was just stored piece by piece is slow to load as a whole.
  const Vector re{d.real(), -u.real(), 0, l.real(), m.real(), z.real(), unbalance.real(), 0};
  const Vector im{d.imag(), 0, -u.imag(), l.imag(), m.imag(), z.imag(), unbalance.imag(), 0};
  const auto mean = [w](Row& row, const Vector& value) {
    Vector sum;
    std::memcpy(&sum, row.data(), sizeof sum);
    sum += w * (value - sum);
    std::memcpy(row.data(), &sum, sizeof sum);
  };
  mean(means_.f_re, re * unbalance.real() + im * unbalance.imag());
  mean(means_.f_im, im * unbalance.real() - re * unbalance.imag());
  mean(means_.z_re, re * z.real() + im * z.imag());
  mean(means_.z_im, im * z.real() - re * z.imag());
  mean(means_.square, re * re + im * im);
  mean(means_.with_d, re * d.real() + im * d.imag());
}

/// Least squares of r with the unbalance `e`, or with any: then each product loses what lies along the unbalance.
ForceCheck::Rest ForceCheck::rest(Complex e, bool known, double share) const noexcept {
  const double ff = means_.square[kF];
  Rest out;
  out.per = known ? 0 : 1 / (ff + kLeast);
  const Complex fd = means_.f(kD), fz = means_.f(kZ), back = std::conj(fz);
  out.fr = fd - ff * e;
  // What an error of the stiffness explains.
  out.zr = means_.z(kD) - product(back, e) - out.per * product(back, out.fr);
  out.zz = means_.square[kZ] - out.per * std::norm(fz) + 1e-30;
  const double square = std::norm(out.zr), model = share * model_, most = model * out.zz;
  out.q = (square > most * most ? model / std::sqrt(square) : 1 / out.zz) * out.zr;
  out.rr = means_.square[kD] - 2 * real_part(e, fd) + std::norm(e) * ff - out.per * std::norm(out.fr) -
           2 * real_part(out.q, out.zr) + std::norm(out.q) * out.zz;
  return out;
}

ForceCheck::Fit ForceCheck::fit(Complex e, bool known, double share) const noexcept {
  const Rest r = rest(e, known, share);
  const double ff = means_.square[kF] + kLeast, per = r.per;
  const Complex fr = r.fr, q = r.q, back = std::conj(means_.f(kZ));
  // Of an axis or a delay: its product with f, with z, with what is left, and its square.
  const auto with_z = [&](Factor k) { return means_.z(k) - per * product(back, means_.f(k)); };
  const auto with_rest = [&](Factor k) {
    const Complex f = means_.f(k);
    return means_.with_d[k] - real_part(f, e) - per * real_part(f, fr) - real_part(with_z(k), q);
  };
  const auto square = [&](Factor k) { return means_.square[k] - per * std::norm(means_.f(k)) + kLeast; };
  Fit out;
  out.rr = r.rr;
  const Complex fq = fr - product(q, means_.f(kZ));
  out.changed = out.rr - (known ? std::norm(fq) / ff : 0);
  const double xr = with_rest(kX), yr = with_rest(kY), lr = with_rest(kL), mr = with_rest(kM);
  const double xx = square(kX), yy = square(kY);
  const double xy = -per * real_part(means_.f(kX), means_.f(kY)), det = xx * yy - xy * xy + kLeast * kLeast;
  const double px = (xr * yy - yr * xy) / det, py = (yr * xx - xr * xy) / det;
  const double near = lr / square(kL), far = mr / square(kM);
  const bool later = known && far * mr > near * lr;
  out.share = later ? far : near;
  out.delay = later ? far * n::later : near * n::late;
  out.gain_x = 1 - px, out.gain_y = 1 - py;
  out.sure_x = det / yy, out.sure_y = det / xx;
  out.by_gain = out.rr - px * xr - py * yr;
  out.by_delay = out.rr - (later ? far * mr : near * lr);
  out.eps = e + (1 / ff) * (fq - px * means_.f(kX) - py * means_.f(kY));
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
  const double left = (starting ? rest({}, false) : rest(eps_, true)).rr;
  usual_ += std::min(h * (1 / n::usual), 1.0) * (left - usual_);
  risen_ = left > n::risen * usual_;
  if (left <= threshold_ && test_ <= 0) {
    loud_ = gain_time_ = late_time_ = proof_time_ = 0;
    tested_ = std::min(tested_ + h, n::again);
    return ForceFault::none;
  }
  return judge(starting ? fit({}, false) : fit(eps_, true), starting);
}

ForceFault ForceCheck::judge(const Fit& f, bool starting) noexcept {
  const double h = settings_.sample_time;
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
  if (time_ < n::start || test_ > 0 || proven_ > n::proof_time) return;
  const double acted = means_.square[kX] + means_.square[kY];
  if (acted <= least_) return;
  const Fit f = fit(settings_.eps, true);
  if (f.rr < 0.5 * acted) proven_ += settings_.sample_time;
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
  const Row& f = first_.back();
  const double slow = n::slow * settings_.model.k1, size = f[6] * f[6] + f[7] * f[7];
  const bool starting = n::start > time_, stuck = !risen_ && n::stuck < loud_;
  if (test_ > 0 || size <= slow * slow || (loud_ > 0 && !starting && !stuck)) return;
  const double rate = starting ? 1 / n::settled : stuck ? 1 / n::relearn : 1 / n::learn;
  eps_ += std::min(settings_.sample_time * rate, 1.0) * ((1 / size) * now_ - eps_);
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
    const Complex bent = (rate_ * rate_) * (z - 2.0 * z1_ + z2_);
    const Complex y = bent - settings_.model.acceleration(z1_, (0.5 * rate_) * (z - z2_));
    Vector first{y.real(),         y.imag(),         u.real(),      u.imag(),
                 late.near.real(), late.near.imag(), before.real(), before.imag()};
    Vector second{z1_.real(), z1_.imag(), late.far.real(), late.far.imag()};
    low_pass(first, first_);
    low_pass(second, second_);
    // When the first force begins to act is known to some ms only: its edge is no evidence, what follows is.
    if (time_ > 0 || std::norm(u) > 0) time_ = std::min(time_ + h, 1.0);
    if (time_ > n::edge) {
      collect(first, second);
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
