#include "whirl/control/reidentifier.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/control/reidentifier_numbers.hpp"

namespace whirl::control {
namespace {

namespace numbers = reidentification;
using Complex = std::complex<double>;
constexpr std::size_t kN = Reidentifier::kUnknowns;
using Normal = std::array<std::array<double, kN>, kN>;

constexpr double kWindowAngle = 6 * std::numbers::pi;

double along(Complex a, Complex b) noexcept { return a.real() * b.real() + a.imag() * b.imag(); }

/// The lower triangle becomes that of L, L L' = m.
void factorise(Normal& m) noexcept {
  for (std::size_t j = 0; j < kN; ++j) {
    for (std::size_t i = j; i < kN; ++i) {
      double sum = m[i][j];
      for (std::size_t k = 0; k < j; ++k) sum -= m[i][k] * m[j][k];
      m[i][j] = i == j ? std::sqrt(sum) : sum / m[j][j];
    }
  }
}

/// L x = b, for a b that is zero before `first`.
std::array<double, kN> solve(const Normal& l, const std::array<double, kN>& b, std::size_t first) noexcept {
  std::array<double, kN> x{};
  for (std::size_t i = first; i < kN; ++i) {
    double sum = b[i];
    for (std::size_t k = first; k < i; ++k) sum -= l[i][k] * x[k];
    x[i] = sum / l[i][i];
  }
  return x;
}

}  // namespace

Reidentifier::Reidentifier(const ReidentifierSettings& settings) noexcept
    : settings_(settings), slow_(numbers::slow * std::sqrt(std::max(settings.model.k1, 0.0))) {
  reset();
}

void Reidentifier::reset() noexcept {
  out_ = {};
  forget();
}

void Reidentifier::forget() noexcept {
  theta_ = -1;
  information_ = {};
  moment_.fill(0);
  square_ = 1;
  target_.fill(0);
  out_.estimate.fill(0);
  for (std::size_t i = 0; i < 3; ++i) out_.sd[i] = numbers::prior * settings_.bounds[i];
  out_.word = kUndetermined;
}

const Reidentification& Reidentifier::step(const ReidentifierInput& in) noexcept {
  const double turned = std::abs(in.omega) * settings_.sample_time;
  if (in.taken) forget();
  for (std::size_t i = 0; i < 3; ++i) {
    const double most = (settings_.acts ? numbers::rate : 0) / (2 * std::numbers::pi) * turned * settings_.bounds[i];
    out_.acting[i] += std::clamp(target_[i] - out_.acting[i], -most, most);
  }
  if (in.frozen || in.taken || std::abs(in.omega) < slow_ || turned > numbers::fast) {
    out_.word |= kReidentifierFrozen;
    theta_ = -1;
    return out_;
  }
  out_.word &= ~kReidentifierFrozen;
  theta_ += turned;
  if (theta_ >= kWindowAngle) close();
  if (theta_ < turned || theta_ >= kWindowAngle) {
    theta_ = weight_ = 0;
    y_ = z_ = v_ = a_ = f_ = 0;
  }
  collect(in);
  return out_;
}

void Reidentifier::collect(const ReidentifierInput& in) noexcept {
  const Complex third = unit_phasor(theta_ / 3), back = std::conj(in.turn);
  const double omega = in.omega, rest = 1 - third.real(), side = omega < 0 ? -third.imag() : third.imag();
  // w and its derivatives by the angle of the rotor.
  const double w = 0.25 * rest * rest, w1 = rest * side / 6,
               w2 = (third.real() * rest + third.imag() * third.imag()) / 18;
  const Complex phi = w * back, per_angle = product({w1, -w}, back);
  const Complex phi1 = omega * per_angle;
  const Complex phi2 = (omega * omega) * product({w2 - w, -2 * w1}, back) + in.omega_dot * per_angle;
  const Complex a = product(in.a, product(phi, in.half)), f = product(in.forcing, phi);
  const LateralModel& m = settings_.model;
  y_ += product(in.z, phi2) - product(m.acceleration(in.z, 0), phi) + product(m.acceleration(0, in.z), phi1) - a -
        product(settings_.eps, f);
  z_ += product(in.z, phi);
  v_ += product(in.z, phi1);
  a_ += a;
  f_ += f;
  weight_ += w;
}

void Reidentifier::close() noexcept {
  const double k1 = settings_.model.k1, per = 1 / weight_, runout = k1 * numbers::runout;
  const Complex y = per * y_, a = per * a_, f = (per * (std::abs(settings_.eps) + numbers::eccentric)) * f_;
  const Row x{(-k1 * per) * z_,   (settings_.model.c * per) * v_,  a, f, product({0, 1}, f), runout,
              Complex{0, runout}, product({0, numbers::across}, a)};
  const double floor = k1 * numbers::floor, size = numbers::error * (std::abs(x[0]) + std::abs(a));
  const double sure = 1 / (floor * floor + size * size);
  Normal l;
  for (std::size_t i = 0; i < kN; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      information_[i][j] = numbers::keep * information_[i][j] + sure * along(x[i], x[j]);
      l[i][j] = information_[i][j];
    }
    moment_[i] = numbers::keep * moment_[i] + sure * along(x[i], y);
    const double prior = i < 3 ? numbers::prior * settings_.bounds[i] : 1;
    l[i][i] += 1 / (prior * prior);
  }
  factorise(l);
  const Vector half = solve(l, moment_, 0);
  Vector mean{}, variance{};
  Complex left = y;
  for (std::size_t i = 0; i < kN; ++i) {
    Vector unit{};
    unit[i] = 1;
    const Vector column = solve(l, unit, i);
    for (std::size_t k = i; k < kN; ++k) {
      mean[i] += column[k] * half[k];
      variance[i] += column[k] * column[k];
    }
    left -= mean[i] * x[i];
  }
  judge(0.5 * sure * std::norm(left), mean, variance);
}

void Reidentifier::judge(double square, const Vector& mean, const Vector& variance) noexcept {
  square_ += numbers::memory * (square - square_);
  if (!std::isfinite(square_)) return forget();
  std::uint32_t word = square_ > numbers::unlike ? std::uint32_t{kOtherMachine} : 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const double bound = settings_.bounds[i], sd = std::sqrt(variance[i] * std::max(1.0, square_));
    out_.sd[i] = sd;
    out_.estimate[i] = std::clamp(mean[i], -bound, bound);
    if (sd < numbers::known * bound) word |= kStiffnessKnown << i;
    if (std::abs(mean[i]) > bound) word |= kStiffnessBound << i;
    if (std::abs(mean[i]) > numbers::beyond * bound + numbers::differs * sd) word |= kOtherMachine;
  }
  if ((word & (kStiffnessKnown | kDampingKnown | kActuatorKnown)) == 0) word |= kUndetermined;
  for (std::size_t i = 0; i < 3; ++i) {
    const double differs = (target_[i] != 0 ? numbers::remains : numbers::differs) * out_.sd[i];
    if ((word & kOtherMachine) != 0) {
      target_[i] = 0;
    } else if ((word & kActuatorKnown) != 0 && (word & (kStiffnessKnown << i)) != 0) {
      target_[i] = std::abs(out_.estimate[i]) > differs ? out_.estimate[i] : 0;
    }
  }
  out_.word = word;
}

std::string reidentification_text(const Reidentification& last) {
  constexpr std::array kNames{"stiffness", "damping", "gain of the actuators"};
  if ((last.word & kOtherMachine) != 0) return "no stiffness, damping and gain within the bounds explain the motion";
  if ((last.word & kUndetermined) != 0) return "the motion determines neither stiffness nor damping nor gain";
  std::string out;
  for (std::size_t i = 0; i < 3; ++i) {
    if ((last.word & (kStiffnessKnown << i)) == 0) continue;
    const bool bound = (last.word & (kStiffnessBound << i)) != 0;
    out += fmt::format("{}{} {:+.1f} +- {:.1f} %{}", out.empty() ? "" : ", ", kNames[i], 100 * last.estimate[i],
                       200 * last.sd[i], bound ? " (at its bound)" : "");
    if (last.acting[i] != 0) out += fmt::format(", corrected {:+.1f} %", 100 * last.acting[i]);
  }
  return out;
}

}  // namespace whirl::control
