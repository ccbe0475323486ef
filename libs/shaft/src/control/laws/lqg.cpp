#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "control/laws/law.hpp"
#include "whirl/core/riccati.hpp"

namespace whirl::shaft {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

constexpr double kRiccatiResidual = 1e-6;  // of a Riccati equation that counts as solved
constexpr double kStillRate = 50;          // at which forces that do not change are learned, at most, 1/s

/// What the observer estimates: the plant, and forces that do not change beside those of the magnets, which carry the
/// rotor. `cancel`: minus them.
struct Observed {
  MatrixXd a, b, c, disturbance, cancel;
};

Observed observed(const SampledPlant& p, const std::vector<Actuator>& actuators) {
  std::vector<Index> carrying;
  for (std::size_t j = 0; j < actuators.size(); ++j)
    if (actuators[j].bias_stiffness < 0) carrying.push_back(static_cast<Index>(j));
  const Index n = p.a.rows(), m = p.b.cols(), still = static_cast<Index>(carrying.size()), half = p.motion / 2;
  Observed s{MatrixXd::Identity(n + still, n + still), MatrixXd::Zero(n + still, m),
             MatrixXd::Zero(p.c.rows(), n + still), 1e-6 * MatrixXd::Identity(n + still, n + still),
             MatrixXd::Zero(m, n + still)};
  s.a.topLeftCorner(n, n) = p.a;
  s.b.topRows(n) = p.b;
  s.c.leftCols(n) = p.c;
  s.disturbance.block(half, half, half, half).setIdentity();
  for (Index k = 0; k < still; ++k) {
    const Index j = carrying[static_cast<std::size_t>(k)];
    s.a.block(0, n + k, n, 1) = p.b.col(j);
    s.cancel(j, n + k) = -1;
    // Beside unit kicks of the speeds in every sample a walk of this size is followed at kStillRate.
    s.disturbance(n + k, n + k) = std::pow(kStillRate / p.push, 2);
  }
  return s;
}

/// Linear-quadratic regulator and observer at each speed (Anderson and Moore, Optimal Control, 1990, ch. 8). Each hangs
/// on one rate alone, and a search tries all pairs of them: what is solved is kept.
class LqgGains {
 public:
  explicit LqgGains(const LawTask& task) : task_(&task) {
    for (const SampledPlant& p : task.plants) observed_.push_back(observed(p, task.actuators));
  }
  std::vector<ControlGains> operator()(const std::vector<double>& rates) {
    const std::vector<MatrixXd>&feedback = kept(feedback_, rates[0], &LqgGains::regulators),
          &readings = kept(readings_, rates[1], &LqgGains::observers);
    std::vector<ControlGains> out;
    if (feedback.empty() || readings.empty()) return out;
    for (std::size_t k = 0; k < observed_.size(); ++k) {
      const Observed& seen = observed_[k];
      out.push_back({task_->speeds[k], seen.a - readings[k] * seen.c, readings[k], seen.b, feedback[k]});
    }
    return out;
  }

 private:
  using Kept = std::map<double, std::vector<MatrixXd>>;
  const std::vector<MatrixXd>& kept(Kept& all, double rate, std::vector<MatrixXd> (LqgGains::*make)(double) const) {
    const auto found = all.find(rate);
    return found != all.end() ? found->second : all.emplace(rate, (this->*make)(rate)).first->second;
  }

  /// Feedback at each speed; none where one has no solution.
  std::vector<MatrixXd> regulators(double rate) const {
    std::vector<MatrixXd> out;
    double largest = 0;
    for (const Actuator& a : task_->actuators) largest = std::max(largest, a.force_limit);
    for (std::size_t k = 0; k < observed_.size(); ++k) {
      const SampledPlant& p = task_->plants[k];
      const Index n = p.motion, m = p.b.cols();
      MatrixXd force = MatrixXd::Zero(m, m);
      for (Index j = 0; j < m; ++j)
        force(j, j) = std::pow(p.push / rate * largest / task_->actuators[static_cast<std::size_t>(j)].force_limit, 2);
      MatrixXd weight = MatrixXd::Zero(p.a.rows(), p.a.rows());
      weight.topLeftCorner(n, n).setIdentity();
      const auto regulator = solve_riccati<MatrixXd>(p.a, p.b, weight, force);
      if (!(regulator.residual < kRiccatiResidual)) return {};
      MatrixXd gain = -observed_[k].cancel;
      gain.leftCols(p.a.rows()) += riccati_gain<MatrixXd>(p.a, p.b, force, regulator.solution);
      out.push_back(std::move(gain));
    }
    return out;
  }

  /// Gains of the readings at each speed; none where one has no solution.
  std::vector<MatrixXd> observers(double rate) const {
    std::vector<MatrixXd> out;
    for (std::size_t k = 0; k < observed_.size(); ++k) {
      const SampledPlant& p = task_->plants[k];
      const Observed& seen = observed_[k];
      const Index q = p.c.rows();
      const double read = p.c.colwise().norm().maxCoeff();
      const MatrixXd noise = std::pow(read / (rate * task_->sample_time), 2) * MatrixXd::Identity(q, q);
      const MatrixXd back = seen.a.transpose(), read_back = seen.c.transpose();
      const auto observer = solve_riccati<MatrixXd>(back, read_back, seen.disturbance, noise);
      if (!(observer.residual < kRiccatiResidual)) return {};
      out.push_back(riccati_gain<MatrixXd>(back, read_back, noise, observer.solution).transpose());
    }
    return out;
  }

  const LawTask* task_;
  std::vector<Observed> observed_;
  Kept feedback_, readings_;
};

}  // namespace

const Law kLqg{"lqg",
               {{"feedback_rate", "1/s", 1e-4, 1, 17}, {"observer_rate", "1/s", 1e-3, 10, 9}},
               [](const LawTask& task) -> LawGains { return LqgGains(task); }};

}  // namespace whirl::shaft
