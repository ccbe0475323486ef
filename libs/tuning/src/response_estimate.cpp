#include "response_estimate.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace whirl::tuning {
namespace {

using Complex = std::complex<double>;

/// A local parabola about the middle of 2 reach + 1 lines, in orthogonal polynomials of their number.
struct Parabola {
  Complex middle;
  double rest = 0;     ///< sum of the squared distances of the lines from it, by their noise
  double largest = 0;  ///< largest of those squares
};
/// `s` and `noise` point to the middle.
Parabola parabola(const Complex* s, const double* noise, int reach) {
  const double n = 2 * reach + 1, m2 = reach * (reach + 1) / 3.0;
  Complex sum = 0, slope = 0, bend = 0;
  double squares2 = 0, squares4 = 0;
  for (int i = -reach; i <= reach; ++i) {
    const double p2 = i * i - m2;
    sum += s[i];
    slope += static_cast<double>(i) * s[i];
    bend += p2 * s[i];
    squares2 += i * i;
    squares4 += p2 * p2;
  }
  const Complex a0 = sum / n, a1 = slope / squares2, a2 = bend / squares4;
  Parabola out{a0 - a2 * m2};
  for (int i = -reach; i <= reach; ++i) {
    const double square = std::norm(s[i] - a0 - a1 * static_cast<double>(i) - a2 * (i * i - m2)) / noise[i];
    out.rest += square;
    out.largest = std::max(out.largest, square);
  }
  return out;
}

/// Variance of the middle of the parabola by that of a line (Savitzky and Golay 1964).
double share_of_noise(int reach) {
  const double w = reach;
  return 3 * (3 * w * w + 3 * w - 1) / ((2 * w - 1) * (2 * w + 1) * (2 * w + 3));
}

/// Upper limit of the mean of k unit exponentials: by Wilson and Hilferty, passed once in a million.
double rest_limit(double k) {
  constexpr double kDeviate = 4.75;
  const double root = 1 - 1 / (9 * k) + kDeviate / (3 * std::sqrt(k));
  return root * root * root;
}

}  // namespace

ResponseEstimate::ResponseEstimate(Eigen::Index samples)
    : sum_(Eigen::VectorXcd::Zero(samples)), squares_(Eigen::VectorXd::Zero(samples)) {}

void ResponseEstimate::add(const Eigen::VectorXcd& answer, const Eigen::VectorXcd& excitation) {
  const Eigen::VectorXcd s = (1.0 + answer.array() / excitation.array()).matrix();
  sum_ += s;
  squares_ += s.cwiseAbs2();
  ++count_;
}

LoopResponse ResponseEstimate::response(double sample_time) const {
  const Eigen::Index window = sum_.size();
  LoopResponse out;
  std::vector<Complex> s;
  std::vector<double> noise;  // E|error|^2 of the mean
  const double n = count_;
  for (Eigen::Index k = 0; k < window; ++k) {
    const Eigen::Index line = (k + window - window / 2) % window;
    if (line == 0) continue;
    out.frequency.push_back(static_cast<double>(k - window / 2) / (static_cast<double>(window) * sample_time));
    s.push_back(sum_[line] / n);
    noise.push_back(count_ > 1 ? std::max(squares_[line] - n * std::norm(s.back()), 0.0) / (n * (n - 1)) : 0);
  }
  if (count_ < 2) {
    for (const Complex& line : s) out.loop.push_back(1.0 / line - 1.0);
    return out;
  }
  const auto lines = static_cast<int>(s.size());
  std::vector<double> before(s.size() + 1, 0);  // sums of the noise
  for (std::size_t i = 0; i < s.size(); ++i) before[i + 1] = before[i] + noise[i];
  const auto noise_over = [&](int at, int reach) {
    const int from = std::max(0, at - reach), to = std::min(lines, at + reach + 1);
    return (before[static_cast<std::size_t>(to)] - before[static_cast<std::size_t>(from)]) / (to - from);
  };
  constexpr int kShared = 8;        // lines to either side share their noise
  constexpr double kRare = 16.5;    // of one unit exponential: once in 1.5e7
  constexpr double kExact = 1e-18;  // |S|^2: noise of the arithmetic
  constexpr std::array kReach{2, 4, 8, 16, 32, 64};
  // A line with more noise than its neighbours (a multiple of the speed) has its own.
  for (int at = 0; at < lines; ++at) {
    double& own = noise[static_cast<std::size_t>(at)];
    own = std::max({own, noise_over(at, kShared), kExact});
  }
  // The response of a sampled loop repeats itself: beyond the last line stands the first.
  const int most = std::min(kReach.back(), (lines - 1) / 2);
  std::vector<Complex> around(s.end() - most, s.end());
  around.insert(around.end(), s.begin(), s.end());
  around.insert(around.end(), s.begin(), s.begin() + most);
  std::vector<double> noise_around(noise.end() - most, noise.end());
  noise_around.insert(noise_around.end(), noise.begin(), noise.end());
  noise_around.insert(noise_around.end(), noise.begin(), noise.begin() + most);
  for (int at = 0; at < lines; ++at) {
    const auto i = static_cast<std::size_t>(at);
    Complex best = s[i];
    double variance = noise[i];
    for (const int reach : kReach) {
      if (reach > most) break;
      const Parabola p = parabola(&around[static_cast<std::size_t>(at + most)],
                                  &noise_around[static_cast<std::size_t>(at + most)], reach);
      const double free = 2 * reach - 2;
      if (p.rest > free * rest_limit(free) || p.largest > kRare) break;
      best = p.middle;
      variance = noise_over(at, std::max(reach, kShared)) * share_of_noise(reach);
    }
    out.loop.push_back(1.0 / best - 1.0);
    // dL = -dS / S^2; half of the variance is that of a part.
    out.deviation.push_back(std::sqrt(0.5 * variance) / std::norm(best));
  }
  return out;
}

bool peak_is_certain(const LoopResponse& r) {
  constexpr double kDeviations = 2, kShare = 0.05;
  if (r.deviation.size() != r.loop.size()) return false;
  double peak = 0, upper = 0;
  for (std::size_t i = 0; i < r.loop.size(); ++i) {
    const double s = 1 / std::abs(1.0 + r.loop[i]);
    peak = std::max(peak, s);
    upper = std::max(upper, s + kDeviations * r.deviation[i] * s * s);
  }
  return upper <= (1 + kShare) * peak;
}

}  // namespace whirl::tuning
