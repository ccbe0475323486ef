#include "whirl/diagnosis/passages.hpp"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;
using Eigen::VectorXcd;
using Eigen::VectorXd;
constexpr double kBeats = 1.5;  // of a window in which ringing and steady vector are told apart

constexpr Index kEdge = 3;  // vectors at either end, where a run settles

std::vector<Index> maxima(const VectorXd& amplitude, double needed) {
  std::vector<Index> found;
  for (Index i = kEdge; i + kEdge < amplitude.size(); ++i) {
    const double top = amplitude[i];
    if (!(top > amplitude[i - 1] && top >= amplitude[i + 1])) continue;
    // The valley on either side, up to a higher top or the end.
    double left = top, right = top;
    for (Index k = i - 1; k >= 0 && amplitude[k] <= top; --k) left = std::min(left, amplitude[k]);
    for (Index k = i + 1; k < amplitude.size() && amplitude[k] <= top; ++k) right = std::min(right, amplitude[k]);
    if (top - std::max(left, right) > needed) found.push_back(i);
  }
  return found;
}

class Run {
 public:
  explicit Run(const signal::SynchronousCurve& curve) : curve_(curve), time_(curve.time) {
    const Index n = curve.speed.size();
    if (time_.size() != n) {
      time_ = VectorXd::Zero(n);
      for (Index k = 1; k < n; ++k) time_[k] = time_[k - 1] + 2 * kTwoPi / (curve.speed[k] + curve.speed[k - 1]);
    }
    rate_ = std::abs(curve.speed[n - 1] - curve.speed[0]) / kTwoPi / (time_[n - 1] - time_[0]);
  }

  // Hz: two frequencies closer than this pass as one.
  double resolution() const { return kBeats * std::sqrt(rate_); }
  double apart(Index i, const Passage& p) const { return std::abs(curve_.speed[i] - p.speed) / kTwoPi; }

  // The vector at i with the ringing of the passages taken off.
  std::complex<double> steady(Index i, const std::vector<Passage>& found) const {
    double nearest = INFINITY;
    for (const Passage& p : found) nearest = std::min(nearest, apart(i, p));
    if (!(nearest > resolution())) return curve_.vector[i];
    const double half = 0.5 * kBeats / nearest, t = time_[i];
    Index first = i, last = i;
    const Index n = time_.size(), least = static_cast<Index>(2 * (2 + found.size()));
    while (first > 0 && (t - time_[first - 1] <= half || last - first < least / 2)) --first;
    while (last + 1 < n && (time_[last + 1] - t <= half || last - first < least)) ++last;
    const Index rows = last - first + 1;
    if (rows < least) return curve_.vector[i];
    // The ringing frequency of a nonlinear rotor moves with its amplitude: the best of a few.
    std::complex<double> best = curve_.vector[i];
    double smallest = INFINITY;
    for (const double bend : {0.0, -0.02, 0.02, -0.04, 0.04, -0.07, 0.07, -0.1, 0.1}) {
      Eigen::MatrixXcd a(rows, 2 + static_cast<Index>(found.size()));
      for (Index k = 0; k < rows; ++k) {
        const double s = time_[first + k] - t;
        a(k, 0) = 1;
        a(k, 1) = s;
        // Whole turns lie between two vectors, so that beta is the same at the middle of each.
        for (std::size_t p = 0; p < found.size(); ++p)
          a(k, 2 + static_cast<Index>(p)) = std::polar(1.0, found[p].speed * (1 + bend) * s);
      }
      const VectorXcd z = curve_.vector.segment(first, rows);
      const VectorXcd fit = Eigen::MatrixXcd(a.adjoint() * a).ldlt().solve(Eigen::VectorXcd(a.adjoint() * z));
      const double left = (z - a * fit).squaredNorm();
      if (left < smallest) smallest = left, best = fit[0];
    }
    return best;
  }

  // End and ringing of a passage: the frequency that leaves least beside a parabola, over the first beats after it.
  void follow(Passage& p) const {
    const Index n = time_.size();
    Index ends = p.at;
    while (ends < n && apart(ends, p) <= resolution()) ++ends;
    Index last = ends;
    while (last + 1 < n && apart(last + 1, p) <= 3 * resolution()) ++last;
    const Index rows = last - ends + 1;
    if (ends >= n || rows < 8) return;
    const VectorXcd z = curve_.vector.segment(ends, rows);
    double smallest = INFINITY;
    for (double bend = -0.15; bend < 0.15; bend += 0.005) {
      Eigen::MatrixXcd a(rows, 5);
      for (Index k = 0; k < rows; ++k) {
        const double s = (time_[ends + k] - time_[ends]) / (time_[last] - time_[ends]);
        const auto free = std::polar(1.0, p.speed * (1 + bend) * (time_[ends + k] - time_[ends]));
        a.row(k) << 1.0, s, s * s, free, s * free;
      }
      const double left =
          (z - a * Eigen::MatrixXcd(a.adjoint() * a).ldlt().solve(Eigen::VectorXcd(a.adjoint() * z))).squaredNorm();
      if (left < smallest) smallest = left, p.ringing = p.speed * (1 + bend);
    }
  }

 private:
  const signal::SynchronousCurve& curve_;
  VectorXd time_;    // s
  double rate_ = 0;  // Hz/s
};

}  // namespace

std::vector<Passage> passages(const signal::SynchronousCurve& curve, double prominence) {
  std::vector<Passage> found;
  const Index n = curve.vector.size();
  if (n < 2 * kEdge + 1) return found;
  const VectorXd amplitude = curve.vector.cwiseAbs();
  const double needed = prominence * amplitude.maxCoeff();
  const auto passage = [&](Index i) { return Passage{i, curve.speed[i], amplitude[i], curve.speed[i]}; };
  const std::vector<Index> tops = maxima(amplitude, needed);
  if (tops.empty()) return found;
  const Run run(curve);
  found.push_back(passage(*std::ranges::max_element(tops, {}, [&](Index i) { return amplitude[i]; })));
  while (found.size() < 6) {
    VectorXd rest(n);
    for (Index i = 0; i < n; ++i) rest[i] = std::abs(run.steady(i, found));
    std::vector<Index> left = maxima(rest, needed);
    std::erase_if(left, [&](Index i) {
      return std::ranges::any_of(found, [&](const Passage& p) { return run.apart(i, p) <= run.resolution(); });
    });
    if (left.empty()) break;
    found.push_back(passage(*std::ranges::max_element(left, {}, [&](Index i) { return rest[i]; })));
  }
  for (Passage& p : found) run.follow(p);
  std::ranges::sort(found, {}, &Passage::at);
  return found;
}

}  // namespace whirl::diagnosis
