#include "whirl/identify/evidence.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "trajectory/trajectory_score.hpp"
#include "weak/integral_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {
namespace {

/// States and inputs of the model at the samples of a rotor record, states by smoothing.
Eigen::MatrixXd rotor_columns(const CompiledModel& model, const Recording& recording) {
  const RotorRecord record = rotor_record(recording);
  const signal::SmoothedSignal x = detail::without_noise(record.z.real(), record.dt, record.noise_x);
  const signal::SmoothedSignal y = detail::without_noise(record.z.imag(), record.dt, record.noise_y);
  Eigen::MatrixXd all(record.size(), 4 + static_cast<Eigen::Index>(model.inputs().size()));
  all << x.value, x.first, y.value, y.first,
      half_grid_inputs(model, record.angle, recording.t0)(Eigen::seq(0, Eigen::last, Eigen::fix<2>), Eigen::all);
  return all;
}

/// States without a channel as the free run shows them; without rows when it diverges.
Eigen::MatrixXd general_columns(const IdentifiedModel& model, const CompiledModel& compiled, const Recording& record) {
  Eigen::MatrixXd states;
  if (detail::hidden_states(model, record).empty()) {
    states = smoothed_states(compiled, record);
  } else {
    const ModelRun run = simulate(model, record);
    if (run.diverged) return {};
    states = run.values;
  }
  Eigen::MatrixXd all(record.size(), states.cols() + static_cast<Eigen::Index>(compiled.inputs().size()));
  all << states, half_grid_inputs(compiled, record)(Eigen::seq(0, Eigen::last, Eigen::fix<2>), Eigen::all);
  return all;
}

}  // namespace

std::vector<CollinearGroup> collinear_groups(const Eigen::MatrixXd& gram, const std::vector<std::string>& names,
                                             double limit) {
  std::vector<CollinearGroup> groups;
  const Eigen::Index n = gram.rows();
  if (n < 2 || !gram.allFinite()) return groups;
  const Eigen::VectorXd unit = gram.diagonal().unaryExpr([](double d) { return d > 0 ? 1 / std::sqrt(d) : 0.0; });
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(
      Eigen::MatrixXd(unit.asDiagonal() * gram * unit.asDiagonal()));
  const double largest = eigen.eigenvalues()[n - 1];
  for (Eigen::Index k = 0; k < n; ++k) {
    const double index = std::sqrt(largest / std::max(eigen.eigenvalues()[k], 1e-300));
    if (!(index > limit)) break;
    CollinearGroup group;
    group.condition_index = index;
    for (Eigen::Index j = 0; j < n; ++j) {
      if (std::abs(eigen.eigenvectors()(j, k)) > 0.2) group.terms.push_back(names[static_cast<std::size_t>(j)]);
    }
    if (group.terms.size() >= 2) groups.push_back(std::move(group));
  }
  return groups;
}

std::vector<CollinearGroup> collinear_groups(const IdentifiedModel& model, const Recording& record) {
  if (model.rotor && model.rotor_covariance.size() == 25) {
    const Eigen::MatrixXd covariance = Eigen::Map<const Eigen::MatrixXd>(model.rotor_covariance.data(), 5, 5);
    const Eigen::VectorXd sd = covariance.diagonal().cwiseSqrt();
    // The information matrix is the Gram matrix of the sensitivities.
    const Eigen::MatrixXd correlation = sd.cwiseInverse().asDiagonal() * covariance * sd.cwiseInverse().asDiagonal();
    return collinear_groups(Eigen::MatrixXd(correlation.inverse()), {"k1", "k2", "c", "e cos", "e sin"});
  }
  std::vector<CollinearGroup> all;
  if (model.equations.empty()) return all;
  const CompiledModel compiled(model);
  const bool rotor = compiled.states() == std::vector<std::string>{"X1", "X2", "X3", "X4"} && !record.has("X1");
  const Eigen::MatrixXd variables = rotor ? rotor_columns(compiled, record) : general_columns(model, compiled, record);
  if (variables.rows() == 0) return all;
  std::vector<std::string> symbols = compiled.states();
  symbols.insert(symbols.end(), compiled.inputs().begin(), compiled.inputs().end());
  for (const Equation& e : model.equations) {
    std::vector<expr::Expr> functions;
    std::vector<std::string> names;
    for (const EquationTerm& t : e.terms) {
      if (t.coefficient.sd == 0) continue;  // known
      functions.push_back(expr::Expr::parse(t.function));
      names.push_back(t.function);
    }
    if (functions.size() < 2) continue;
    const Eigen::MatrixXd theta = expr::compile(functions, symbols).evaluate(variables);
    for (CollinearGroup& g : collinear_groups(Eigen::MatrixXd(theta.transpose() * theta), names)) {
      g.equation = e.lhs;
      all.push_back(std::move(g));
    }
  }
  return all;
}

double worst_nrmse(const std::vector<StateScore>& scores) {
  double worst = 0;
  for (const StateScore& s : scores) worst = std::isfinite(s.nrmse) ? std::max(worst, s.nrmse) : INFINITY;
  return worst;
}

Recording part_of(const Recording& record, Eigen::Index first, Eigen::Index count) {
  Recording part = record;
  part.t0 = record.t0 + record.dt * static_cast<double>(first);
  for (Channel& c : part.channels) c.samples = c.samples.segment(first, count).eval();
  return part;
}

Eigen::Index holdout_start(Eigen::Index samples, double share) {
  return std::clamp<Eigen::Index>(std::lround((1 - share) * static_cast<double>(samples)), 0, samples);
}

std::string held_out_part(Eigen::Index first, Eigen::Index samples, const std::string& source) {
  const double rest = 1 - static_cast<double>(first) / static_cast<double>(std::max<Eigen::Index>(1, samples));
  return fmt::format("the last {:.0f} % of {}", 100 * rest, source.empty() ? "the record" : source);
}

/// 1 over the square of the speed of each sample, relative to the top speed; a tenth of that is the least that counts.
static Eigen::ArrayXd by_speed(const Eigen::VectorXd& beta) {
  constexpr double kLeast = 0.1;
  constexpr Eigen::Index kReach = 25;
  const Eigen::Index n = beta.size();
  const Eigen::VectorXd turned = signal::unwrapped(beta);
  Eigen::ArrayXd speed(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index from = std::max<Eigen::Index>(0, i - kReach), to = std::min(n - 1, i + kReach);
    speed[i] = std::abs(turned[to] - turned[from]) / static_cast<double>(std::max<Eigen::Index>(1, to - from));
  }
  const double top = speed.maxCoeff();
  return (speed / top).max(kLeast).square().inverse();
}

HoldoutSplit split_holdout(const std::vector<Recording>& records, double share, const std::vector<std::string>& energy,
                           const std::string& angle) {
  require_range("share held out", share, 0.01, 0.9);
  if (records.empty()) throw Error("no record to split");
  HoldoutSplit split;
  if (records.size() > 1) {
    split.train.assign(records.begin(), records.end() - 1);
    split.test = records.back();
    split.what = split.test.source.empty() ? "the last record" : split.test.source;
    return split;
  }
  const Recording& record = records.front();
  const Eigen::Index n = record.size();
  Eigen::Index first = holdout_start(n, share);
  if (!energy.empty()) {
    Eigen::VectorXd power = Eigen::VectorXd::Zero(n);
    for (const std::string& name : energy) {  // a missing sample has none
      const Eigen::ArrayXd x = record[name].array();
      const auto whole = x.isFinite();
      const double mean = whole.select(x, 0.0).sum() / std::max<double>(1, static_cast<double>(whole.count()));
      power.array() += whole.select(x - mean, 0.0).square();
    }
    const Channel* beta = record.find(angle);
    if (record.at(energy.front()).quantity == Quantity::acceleration && beta != nullptr && beta->samples.allFinite())
      power.array() *= by_speed(beta->samples);
    const double limit = (1 - share) * power.sum();
    double passed = 0;
    for (first = 0; first < n && passed < limit; ++first) passed += power[first];
    // A run starts from what its first samples show.
    constexpr Eigen::Index kStart = 64;
    const auto whole_from = [&](Eigen::Index i) {
      return std::all_of(energy.begin(), energy.end(),
                         [&](const std::string& name) { return record[name].segment(i, kStart).allFinite(); });
    };
    for (Eigen::Index i = first; i + kStart <= n; ++i) {
      if (!whole_from(i)) continue;
      first = i;
      break;
    }
  }
  split.train = {part_of(record, 0, first)};
  split.test = part_of(record, first, n - first);
  split.what = held_out_part(first, n, record.source);
  if (!energy.empty()) split.what += fmt::format(", {:.0f} % of its vibration energy", 100 * share);
  return split;
}

}  // namespace whirl::identification
