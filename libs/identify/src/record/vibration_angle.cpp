#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/signal/envelope.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::identification {
namespace {

using Complex = std::complex<double>;

/// Finite readings about their mean; a missing one repeats the one before.
Eigen::VectorXd about_mean(const Eigen::VectorXd& v) {
  Eigen::VectorXd out = v;
  double last = 0, sum = 0, count = 0;
  for (double& s : out) {
    if (std::isfinite(s)) {
      last = s;
      sum += s;
      ++count;
    }
    s = last;
  }
  return (out.array() - sum / std::max(count, 1.0)).matrix();
}

/// x + i y, or of one axis its analytic signal; turned so that it whirls forward.
Eigen::VectorXcd motion_of(const Recording& r, const RotorRecordOptions& names) {
  const auto finite = [&](const std::string& name) {
    const Channel* c = r.find(name);
    return c != nullptr && c->samples.array().isFinite().count() > r.size() / 2;
  };
  const bool x = finite(names.x), y = finite(names.y);
  if (!x && !y) throw Error(fmt::format("{}: has neither channel {} nor {}", r.source, names.x, names.y));
  if (x != y) return signal::analytic_signal(about_mean(r[x ? names.x : names.y]));
  Eigen::VectorXcd z(r.size());
  z.real() = about_mean(r[names.x]);
  z.imag() = about_mean(r[names.y]);
  return z;
}

/// Means of stretches of the record.
struct Tracked {
  Eigen::VectorXd u;      ///< time over the length of the record, 0 to 1
  Eigen::VectorXd value;  ///< rad/s, or rad
  Eigen::VectorXd size;   ///< m
};

/// Angular frequency of the largest line of each stretch, positive where the motion turns forward.
Tracked frequencies(const Eigen::VectorXcd& z, double dt, Eigen::Index length) {
  const Eigen::Index n = z.size(), step = length / 2, count = (n - length) / step + 1;
  const Eigen::Index lines = signal::fast_fft_length(4 * length);
  Eigen::ArrayXd window(length);
  for (Eigen::Index i = 0; i < length; ++i)
    window[i] = 1 - std::cos(kTwoPi * (static_cast<double>(i) + 0.5) / static_cast<double>(length));
  Tracked t{Eigen::VectorXd(count), Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    Eigen::VectorXcd padded = Eigen::VectorXcd::Zero(lines);
    padded.head(length) = (z.segment(k * step, length).array() * window).matrix();
    const Eigen::VectorXd power = signal::fft(padded).cwiseAbs();
    Eigen::Index top = 0;
    power.maxCoeff(&top);
    const double before = power[(top + lines - 1) % lines], after = power[(top + 1) % lines];
    const double bend = before - 2 * power[top] + after;
    const double line =
        static_cast<double>(top < lines / 2 ? top : top - lines) + (bend < 0 ? 0.5 * (before - after) / bend : 0.0);
    t.u[k] = (static_cast<double>(k * step) + 0.5 * static_cast<double>(length)) / static_cast<double>(n - 1);
    t.value[k] = kTwoPi * line / (static_cast<double>(lines) * dt);
    t.size[k] = power[top] / window.sum();
  }
  return t;
}

/// Coefficients of powers 0 .. degree of u, by least squares that leaves far points out (Tukey's bisquare); `scale`:
/// the median deviation. `period` > 0: values are known up to multiples of it (free vibration beside the motion turns a
/// phase by whole turns).
Eigen::VectorXd robust_polynomial(const Tracked& t, const Eigen::VectorXd& weight, int degree,
                                  const Eigen::VectorXd& given, double period, double& scale) {
  Eigen::VectorXd value = given;
  const Eigen::Index n = t.u.size();
  Eigen::MatrixXd base(n, degree + 1);
  for (int k = 0; k <= degree; ++k) base.col(k) = t.u.array().pow(k);
  Eigen::ArrayXd w = weight.array();
  Eigen::VectorXd found;
  for (int pass = 0; pass < 30; ++pass) {
    const Eigen::VectorXd root = w.sqrt().matrix();
    found = (root.asDiagonal() * base).colPivHouseholderQr().solve(root.cwiseProduct(value));
    if (period > 0) {
      const Eigen::VectorXd curve = base * found;
      for (Eigen::Index i = 0; i < n; ++i) value[i] = curve[i] + std::remainder(value[i] - curve[i], period);
    }
    const Eigen::ArrayXd off = (value - base * found).array().abs();
    std::vector<double> sorted;
    for (Eigen::Index i = 0; i < n; ++i) {
      if (weight[i] > 0) sorted.push_back(off[i]);
    }
    std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 2), sorted.end());
    scale = sorted[sorted.size() / 2];
    const Eigen::ArrayXd far = off / std::max(7 * scale, 1e-12);
    w = weight.array() * (far < 1).select((1 - far.square()).square(), 0.0);
  }
  return found;
}

double at(const Eigen::VectorXd& polynomial, double u) {
  double sum = 0;
  for (Eigen::Index k = polynomial.size() - 1; k >= 0; --k) sum = sum * u + polynomial[k];
  return sum;
}

/// Stretches that show a motion well above the quietest.
Eigen::VectorXd weights(const Tracked& t) {
  std::vector<double> sizes(t.size.begin(), t.size.end());
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  const double usual = sizes[sizes.size() / 2];
  return t.size.unaryExpr([&](double s) { return std::min(1.0, std::pow(s / usual, 2)); });
}

/// Phase of the motion behind an angle, unwrapped from stretch to stretch.
Tracked phases(const Eigen::VectorXcd& z, const Eigen::VectorXd& angle, Eigen::Index length) {
  const Eigen::Index n = z.size(), step = length / 2, count = (n - length) / step + 1;
  Tracked t{Eigen::VectorXd(count), Eigen::VectorXd(count), Eigen::VectorXd(count)};
  for (Eigen::Index k = 0; k < count; ++k) {
    Complex sum = 0;
    for (Eigen::Index i = k * step; i < k * step + length; ++i) sum += z[i] * std::polar(1.0, -angle[i]);
    t.u[k] = (static_cast<double>(k * step) + 0.5 * static_cast<double>(length)) / static_cast<double>(n - 1);
    const double before = k > 0 ? t.value[k - 1] : 0.0;
    t.value[k] = before + std::remainder(std::arg(sum) - before, kTwoPi);
    t.size[k] = std::abs(sum) / static_cast<double>(length);
  }
  return t;
}

/// Angle by which a linear rotor lags its unbalance at the speeds given.
Eigen::VectorXd lag(const Eigen::VectorXd& speed, double critical, double zeta) {
  return speed.unaryExpr(
      [&](double w) { return -std::arg(Complex(critical * critical - w * w, 2 * zeta * critical * std::abs(w))); });
}

}  // namespace

Recording with_angle_from_vibration(const Recording& record, const RotorRecordOptions& names, int& degree) {
  constexpr int kMost = 5;
  const Eigen::VectorXcd read = motion_of(record, names);
  const Eigen::Index n = read.size(), length = n / 48;
  if (length < 16) throw Error::in_field("samples", fmt::format("{}", n), "at least 768 to track the vibration");
  // The sense of the whirl is that of most of its energy.
  Tracked f = frequencies(read, record.dt, length);
  const double sense = (f.value.array().sign() * f.size.array().square()).sum() < 0 ? -1 : 1;
  const Eigen::VectorXcd z = sense < 0 ? Eigen::VectorXcd(read.conjugate()) : read;
  if (sense < 0) f.value = -f.value;
  const double horizon = record.dt * static_cast<double>(n - 1);
  double scale = 0, smallest = INFINITY;
  Eigen::VectorXd speed;
  // Free vibration beside the critical speed and a slow end are far points.
  degree = 2;
  for (int d = 1; d < kMost; ++d) {
    const Eigen::VectorXd trial = robust_polynomial(f, weights(f), d, f.value, 0, scale);
    if (!(scale < 0.6 * smallest)) continue;
    smallest = scale;
    speed = trial;
    degree = d + 1;
  }
  const auto angle_of = [&](const Eigen::VectorXd& rate) {
    Eigen::VectorXd beta(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double u = static_cast<double>(i) / static_cast<double>(n - 1);
      double sum = 0;
      for (Eigen::Index k = rate.size() - 1; k >= 0; --k) sum = (sum + rate[k] / static_cast<double>(k + 1)) * u;
      beta[i] = horizon * sum;
    }
    return beta;
  };
  Eigen::VectorXd beta = angle_of(speed);
  // The phase behind that angle: a polynomial, and the lag of a rotor through its critical speed.
  const Tracked p = phases(z, beta, length);
  Eigen::VectorXd speeds(p.u.size());
  for (Eigen::Index k = 0; k < speeds.size(); ++k) speeds[k] = at(speed, p.u[k]);
  Eigen::Index peak = 0;
  p.size.maxCoeff(&peak);
  double least = INFINITY;
  Eigen::VectorXd best = Eigen::VectorXd::Zero(degree + 1);
  for (int i = -10; i <= 10; ++i) {
    for (const double zeta : {0.005, 0.01, 0.02, 0.04, 0.08}) {
      const Eigen::VectorXd rest = p.value - lag(speeds, std::abs(speeds[peak]) * (1 + 0.015 * i), zeta);
      const Eigen::VectorXd trial = robust_polynomial(p, weights(p), degree, rest, kTwoPi, scale);
      if (!(scale < least)) continue;
      least = scale;
      best = trial;
    }
  }
  for (Eigen::Index i = 0; i < n; ++i)
    beta[i] += at(best, static_cast<double>(i) / static_cast<double>(n - 1)) - best[0];
  Recording out = record;
  std::erase_if(out.channels, [&](const Channel& c) { return c.name == names.angle; });
  out.add(names.angle, Quantity::angle, sense * beta);
  return out;
}

}  // namespace whirl::identification
