#include "whirl/signal/order.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::signal {
namespace {

using Eigen::Index;
constexpr double kHalfWidth = 24;  // of the interpolation kernel, in its own samples

// Modified Bessel function of order 0 by its series: the Kaiser window's shape (beta = 10 puts its side lobes below
// -100 dB).
double bessel0(double x) {
  double sum = 1, term = 1;
  for (int k = 1; term > 1e-17 * sum; ++k) {
    term *= (x / (2 * k)) * (x / (2 * k));
    sum += term;
  }
  return sum;
}

// Kaiser-windowed sinc of cutoff `cutoff` (1 = half the sample rate), tabulated: it is evaluated for every sample.
class Kernel {
 public:
  Kernel() : table_(kSteps + 2) {
    for (int i = 0; i < kSteps + 2; ++i) {
      const double u = std::min(1.0, static_cast<double>(i) / kSteps) * kHalfWidth;
      const double w = bessel0(10 * std::sqrt(1 - u * u / (kHalfWidth * kHalfWidth))) / bessel0(10);
      table_[i] = (u == 0 ? 1 : std::sin(kPi * u) / (kPi * u)) * w;
    }
  }
  double at(double u) const {
    const double place = std::abs(u) / kHalfWidth * kSteps;
    if (place >= kSteps) return 0;
    const int i = static_cast<int>(place);
    return table_[i] + (place - i) * (table_[i + 1] - table_[i]);
  }

 private:
  static constexpr int kSteps = 24 * 2000;
  Eigen::VectorXd table_;
};

double interpolate(const Eigen::Ref<const Eigen::VectorXd>& x, double position, double cutoff) {
  static const Kernel kernel;
  const double reach = kHalfWidth / cutoff;
  double sum = 0, norm = 0;
  for (auto i = static_cast<Index>(std::ceil(position - reach)); i <= static_cast<Index>(std::floor(position + reach));
       ++i) {
    const double weight = kernel.at((static_cast<double>(i) - position) * cutoff);
    // Beyond the ends the signal goes on by odd reflection, which keeps a slope.
    const Index last = x.size() - 1;
    double value = 0;
    if (i < 0) {
      value = 2 * x[0] - x[std::min(-i, last)];
    } else if (i > last) {
      value = 2 * x[last] - x[std::max<Index>(2 * last - i, 0)];
    } else {
      value = x[i];
    }
    sum += weight * value;
    norm += weight;
  }
  return sum / norm;
}

void check(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& angle, double dt) {
  require_range("dt", dt, 1e-15, 1e6, "s");
  if (x.size() != angle.size() || x.size() < 4) {
    throw Error(fmt::format("order analysis of {} samples with {} angles: must be equally many, at least 4", x.size(),
                            angle.size()));
  }
  for (Index i = 1; i < angle.size(); ++i) {
    if (!(angle[i] > angle[i - 1])) {
      throw Error(
          fmt::format("rotor angle falls or stops at sample {} ({:g} rad): must rise (not wrapped, forward rotation)",
                      i, angle[i]));
    }
  }
}

}  // namespace

AngularSignal resample_in_angle(const Eigen::Ref<const Eigen::VectorXd>& x,
                                const Eigen::Ref<const Eigen::VectorXd>& angle, double dt, int per_turn) {
  check(x, angle, dt);
  require_range("per_turn", per_turn, 4, 1 << 16);
  const double step = kTwoPi / per_turn;
  const Index n = angle.size();
  const double first_turn = std::ceil(angle[0] / kTwoPi - 1e-9);
  const auto turns = static_cast<Index>(std::floor(angle[n - 1] / kTwoPi + 1e-9) - first_turn);
  if (turns < 1)
    throw Error(fmt::format("record of {:.2f} turns: must hold a whole one", (angle[n - 1] - angle[0]) / kTwoPi));
  AngularSignal result;
  result.per_turn = per_turn;
  result.first_angle = first_turn * kTwoPi;
  result.samples.resize(turns * per_turn);
  result.time.resize(turns * per_turn);
  Index i = 0;
  for (Index k = 0; k < result.samples.size(); ++k) {
    const double target = result.first_angle + step * static_cast<double>(k);
    while (i + 2 < n && angle[i + 1] < target) ++i;
    const double rise = angle[i + 1] - angle[i];
    const double position = static_cast<double>(i) + (target - angle[i]) / rise;
    // Fewer output than input samples here: the kernel is widened so that nothing folds back.
    result.samples[k] = interpolate(x, position, std::min(1.0, rise / step));
    result.time[k] = position * dt;
  }
  return result;
}

OrderVectors order_vectors(const Eigen::Ref<const Eigen::VectorXd>& x, const Eigen::Ref<const Eigen::VectorXd>& angle,
                           double dt, double order, int turns) {
  require_range("turns", turns, 1, 100000);
  require_range("order", order, 1.0 / turns, 1000);
  const double lines = order * turns;
  if (std::abs(lines - std::round(lines)) > 1e-9 * lines) {
    throw Error(fmt::format("order = {:g} with {} turns per block: must be a multiple of 1/{}", order, turns, turns));
  }
  const int per_turn = std::max(64, static_cast<int>(std::ceil(8 * order)));
  const AngularSignal angular = resample_in_angle(x, angle, dt, per_turn);
  const Index block = static_cast<Index>(turns) * per_turn;
  const Index blocks = angular.samples.size() / block;
  if (blocks < 1) throw Error(fmt::format("record of {} whole turns: must hold a block of {}", angular.turns(), turns));
  OrderVectors result;
  result.order = order;
  result.time.resize(blocks);
  result.speed.resize(blocks);
  result.value.resize(blocks);
  Eigen::VectorXcd phase(block);
  for (Index i = 0; i < block; ++i) {
    phase[i] = std::polar(1.0, -order * (angular.first_angle + kTwoPi * static_cast<double>(i) / per_turn));
  }
  for (Index b = 0; b < blocks; ++b) {
    const Index first = b * block;
    const Index last = std::min(first + block, angular.samples.size() - 1);
    // A block begins at a whole number of turns, but a fractional order goes on turning from block to block.
    const auto shift = std::polar(1.0, -order * kTwoPi * static_cast<double>(b * turns));
    result.value[b] = 2.0 / static_cast<double>(block) * shift *
                      (angular.samples.segment(first, block).cast<std::complex<double>>().cwiseProduct(phase)).sum();
    result.time[b] = 0.5 * (angular.time[first] + angular.time[last]);
    result.speed[b] =
        kTwoPi / per_turn * static_cast<double>(last - first) / (angular.time[last] - angular.time[first]);
  }
  return result;
}

OrbitEllipse orbit_ellipse(std::complex<double> x, std::complex<double> y) {
  const std::complex<double> j(0, 1);
  OrbitEllipse e;
  e.forward = (x + j * y) / 2.0;
  e.backward = (std::conj(x) + j * std::conj(y)) / 2.0;
  const double f = std::abs(e.forward), b = std::abs(e.backward);
  e.semi_major = f + b;
  e.semi_minor = std::abs(f - b);
  e.axis = (std::arg(e.forward) + std::arg(e.backward)) / 2;
  e.area = kPi * (f * f - b * b);
  return e;
}

}  // namespace whirl::signal
