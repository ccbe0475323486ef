#include "whirl/rt/loop_delay.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::rt {
namespace {

constexpr int kHalf = 25, kEvery = 5, kMostPeriods = 20, kParts = 4;

// phi = (1 - r^2)^4 for |r| < 1 with its derivatives and its integral from -1.
double integral(double r) {
  if (r <= -1) return 0;
  r = std::min(r, 1.0);
  const auto primitive = [](double q) {
    const double s = q * q;
    return q * (1 + s * (-4.0 / 3 + s * (6.0 / 5 + s * (-4.0 / 7 + s / 9))));
  };
  return primitive(r) - primitive(-1);
}

/// One row per test function, in units of the period.
struct WeakForm {
  Eigen::VectorXd acceleration;  ///< int x phi''
  Eigen::MatrixXd left;          ///< int x phi', - int x phi, int phi
  Eigen::VectorXi centre;        ///< sample in the middle
};

WeakForm weak_form(const Eigen::Ref<const Eigen::VectorXd>& z, long begin, long end) {
  const long first = begin + kHalf + kMostPeriods, count = std::max(0L, (end - kHalf - first - 1) / kEvery + 1);
  WeakForm out{Eigen::VectorXd::Zero(count), Eigen::MatrixXd::Zero(count, 3), Eigen::VectorXi(count)};
  for (long i = 0; i < count; ++i) {
    const long c = first + i * kEvery;
    out.centre(i) = static_cast<int>(c);
    for (int k = -kHalf; k <= kHalf; ++k) {
      const double r = static_cast<double>(k) / kHalf, q = 1 - r * r;
      const double phi = q * q * q * q, d1 = -8 * r * q * q * q / kHalf,
                   d2 = (48 * r * r * q * q - 8 * q * q * q) / (kHalf * kHalf);
      out.acceleration(i) += d2 * z(c + k);
      out.left.row(i) += Eigen::RowVector3d(d1 * z(c + k), -phi * z(c + k), phi);
    }
  }
  return out;
}

struct Fit {
  Eigen::VectorXd solution;  // c, k, g, b in units of the period
  double residual = 0;
};

Fit solve(const Eigen::MatrixXd& a, const Eigen::VectorXd& y) {
  const Eigen::VectorXd scale = a.colwise().norm().transpose().cwiseMax(1e-300);
  const Eigen::MatrixXd scaled = a * scale.cwiseInverse().asDiagonal();
  Fit out;
  out.solution = scaled.colPivHouseholderQr().solve(y).cwiseQuotient(scale);
  out.residual = (y - a * out.solution).squaredNorm();
  return out;
}

Fit fit(const WeakForm& w, const Eigen::Ref<const Eigen::VectorXd>& u, double delay) {
  // int u(t - d) phi: the force of row k is held from k to k + 1.
  const long n = w.left.rows();
  Eigen::MatrixXd a(n, 4);
  a.leftCols(3) = w.left;
  const int back = kHalf + static_cast<int>(std::ceil(delay)) + 1;
  for (long i = 0; i < n; ++i) {
    double sum = 0;
    for (int k = std::max(-back, -w.centre(i)); k <= kHalf; ++k) {
      const double from = k + delay;
      sum += u(w.centre(i) + k) * kHalf * (integral((from + 1) / kHalf) - integral(from / kHalf));
    }
    a(i, 3) = sum;
  }
  return solve(a, w.acceleration);
}

double best_delay(const WeakForm& w, const Eigen::Ref<const Eigen::VectorXd>& u) {
  const auto residual = [&](double d) { return fit(w, u, d).residual; };
  double best = 0, least = residual(0);
  for (int i = 1; i <= 2 * kMostPeriods; ++i) {
    const double r = residual(0.5 * i);
    if (r < least) least = r, best = 0.5 * i;
  }
  const double low = std::max(0.0, best - 0.5), high = std::min<double>(kMostPeriods, best + 0.5);
  return boost::math::tools::brent_find_minima(residual, low, high, 16).first;
}

}  // namespace

Eigen::VectorXd telegraph(double amplitude, long samples, unsigned seed) {
  std::mt19937_64 random(seed);
  Eigen::VectorXd out(samples);
  double value = amplitude;
  for (long k = 0, left = 0; k < samples; ++k, --left) {
    if (left == 0) {
      left = 8 + static_cast<long>(random() % 33);
      value = random() % 2 == 0 ? amplitude : -amplitude;
    }
    out(k) = value;
  }
  return out;
}

LoopDelay loop_delay(const Eigen::Ref<const Eigen::VectorXd>& u, const Eigen::Ref<const Eigen::VectorXd>& z, double h) {
  if (u.size() != z.size()) throw Error("loop delay: force and displacement differ in length");
  if (u.size() < 400) throw Error::in_field("samples for the loop delay", fmt::format("{}", u.size()), "at least 400");
  const WeakForm all = weak_form(z, 0, z.size());
  LoopDelay out;
  const double d = best_delay(all, u);
  const Fit f = fit(all, u, d);
  out.delay = d * h;
  out.gain = f.solution(3) / (h * h);
  out.frequency = std::sqrt(std::max(0.0, f.solution(1))) / h / (2 * std::numbers::pi);
  const double without = solve(all.left, all.acceleration).residual;
  out.explained = without > 0 ? std::max(0.0, 1 - f.residual / without) : 0;
  std::array<double, kParts> part;
  double mean = 0, square = 0;
  for (int i = 0; i < kParts; ++i) {
    part[static_cast<std::size_t>(i)] =
        best_delay(weak_form(z, z.size() * i / kParts, z.size() * (i + 1) / kParts), u) * h;
    mean += part[static_cast<std::size_t>(i)] / kParts;
  }
  for (const double p : part) square += (p - mean) * (p - mean);
  out.deviation = std::sqrt(square / (kParts - 1) / kParts);
  return out;
}

}  // namespace whirl::rt
