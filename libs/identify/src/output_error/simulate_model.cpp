#include "whirl/identify/simulate_model.hpp"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <tuple>

#include "whirl/core/error.hpp"
#include "whirl/signal/resample.hpp"

namespace whirl::identification {
namespace {

constexpr std::size_t kMostFunctions = 4096;  // compile() takes no more

/// Replaces what depends on inputs alone by new symbols, so that it need not be evaluated at every stage of every step.
class Hoist {
 public:
  explicit Hoist(const std::vector<std::string>& states) : states_(states) {}

  expr::Expr operator()(const expr::Expr& e) {
    if (!uses_states(e)) return e.is_number() ? e : symbol_for(e);
    if (e.kind() == expr::Expr::Kind::symbol) return e;
    std::vector<expr::Expr> kept, alone;
    const bool gathers = e.kind() == expr::Expr::Kind::sum || e.kind() == expr::Expr::Kind::product;
    for (const expr::Expr& part : e.args()) {
      (gathers && !uses_states(part) ? alone : kept).push_back(gathers && !uses_states(part) ? part : (*this)(part));
    }
    switch (e.kind()) {
      case expr::Expr::Kind::sum:
        if (!alone.empty()) kept.push_back((*this)(expr::Expr::sum(alone)));
        return expr::Expr::sum(kept);
      case expr::Expr::Kind::product:
        if (!alone.empty()) kept.push_back((*this)(expr::Expr::product(alone)));
        return expr::Expr::product(kept);
      case expr::Expr::Kind::power:
        return pow(kept[0], kept[1]);
      default:
        return expr::Expr::call(e.function(), kept);
    }
  }

  const std::vector<expr::Expr>& signals() const { return signals_; }
  static std::string name(std::size_t k) { return fmt::format("_signal{}", k); }

 private:
  bool uses_states(const expr::Expr& e) const {
    const std::vector<std::string> names = expr::variables(e);
    return std::any_of(names.begin(), names.end(), [&](const std::string& n) {
      return std::find(states_.begin(), states_.end(), n) != states_.end();
    });
  }
  expr::Expr symbol_for(const expr::Expr& e) {
    const auto at = std::find(signals_.begin(), signals_.end(), e);
    const auto k = static_cast<std::size_t>(at - signals_.begin());
    if (at == signals_.end()) signals_.push_back(e);
    return expr::Expr::symbol(name(k));
  }

  const std::vector<std::string>& states_;
  std::vector<expr::Expr> signals_;
};

}  // namespace

CompiledModel::CompiledModel(const IdentifiedModel& model) {
  const auto equation_of = [&](const std::string& state) -> const Equation* {
    for (const Equation& e : model.equations) {
      if (e.lhs == state + "'" || e.lhs == state + "[k+1]") return &e;
    }
    return nullptr;
  };
  const auto is_state = [&](const std::string& name) {
    return std::find(model.states.begin(), model.states.end(), name) != model.states.end();
  };
  inputs_ = model.inputs;
  std::vector<expr::Expr> rates;
  for (const std::string& state : model.states) {
    if (const Equation* e = equation_of(state)) {
      std::vector<expr::Expr> terms;
      for (const EquationTerm& t : e->terms)
        terms.push_back(expr::Expr(t.coefficient.value) * expr::Expr::parse(t.function));
      rates.push_back(expr::Expr::sum(terms));
      discrete_ = e->lhs.ends_with("[k+1]");
    } else if ((state == "X1" && is_state("X2")) || (state == "X3" && is_state("X4"))) {
      rates.push_back(expr::Expr::symbol(state == "X1" ? "X2" : "X4"));
    } else {
      inputs_.push_back(state);
      continue;
    }
    states_.push_back(state);
  }
  if (states_.empty()) throw Error("the model has no equation of a state");
  for (const Equation& e : model.equations) {
    const bool known = std::any_of(states_.begin(), states_.end(), [&](const std::string& s) {
      return e.lhs == s + "'" || (discrete_ && e.lhs == s + "[k+1]");
    });
    if (!known) throw Error(fmt::format("equation of {}: no such state, or maps and derivatives mixed", e.lhs));
  }
  const auto uses_time = [](const expr::Expr& e) {
    const std::vector<std::string> names = expr::variables(e);
    return std::find(names.begin(), names.end(), "t") != names.end();
  };
  if (std::any_of(rates.begin(), rates.end(), uses_time) &&
      std::find(inputs_.begin(), inputs_.end(), "t") == inputs_.end()) {
    inputs_.push_back("t");
  }
  std::vector<std::string> all = states_;
  all.insert(all.end(), inputs_.begin(), inputs_.end());
  tape_ = expr::compile(rates, all);
  Hoist hoist(states_);
  for (expr::Expr& rate : rates) rate = hoist(rate);
  signals_ = expr::compile(hoist.signals(), inputs_);
  std::vector<std::string> symbols = states_;
  for (std::size_t k = 0; k < hoist.signals().size(); ++k) symbols.push_back(Hoist::name(k));
  std::vector<expr::Expr> functions;
  std::vector<std::tuple<std::size_t, std::size_t, double>> entries;
  for (std::size_t i = 0; i < rates.size(); ++i) {
    const bool sum = rates[i].kind() == expr::Expr::Kind::sum;
    for (const expr::Expr& summand : sum ? rates[i].args() : std::vector<expr::Expr>{rates[i]}) {
      const auto [number, function] = expr::split_coefficient(summand);
      const auto at = std::find(functions.begin(), functions.end(), function);
      entries.emplace_back(i, at - functions.begin(), number);
      if (at == functions.end()) functions.push_back(function);
    }
  }
  functions_ = expr::compile(functions, symbols);
  const std::size_t padded = (states_.size() + 3) / 4 * 4;
  coefficients_.setZero(static_cast<Eigen::Index>(padded), static_cast<Eigen::Index>(functions.size()));
  for (const auto& [i, k, number] : entries)
    coefficients_(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) += number;
}

void CompiledModel::rate_of(const double* states_and_signals, double* out) const noexcept {
  double value[kMostFunctions];
  functions_.evaluate_point(states_and_signals, value);
  const Eigen::Index rows = coefficients_.rows(), states = static_cast<Eigen::Index>(states_.size());
  for (Eigen::Index first = 0; first < rows; first += 4) {
    Eigen::Array4d sum = Eigen::Array4d::Zero();
    for (Eigen::Index k = 0; k < coefficients_.cols(); ++k) {
      sum += Eigen::Map<const Eigen::Array4d>(&coefficients_(first, k)) * value[k];
    }
    for (Eigen::Index i = first; i < std::min(first + 4, states); ++i) out[i] = sum[i - first];
  }
}

Eigen::VectorXd ModelRun::state(const std::string& name) const {
  for (std::size_t k = 0; k < states.size(); ++k) {
    if (states[k] == name) return values.col(static_cast<Eigen::Index>(k));
  }
  throw Error::in_field("state", name, fmt::format("one of {}", fmt::join(states, ", ")));
}

namespace {

// Row-major: every stage reads one row.
using Rows = Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

/// Runge-Kutta of order 4 over rows of signals: those of the beginning, the middle and the end of a step.
class Runge {
 public:
  Runge(const CompiledModel& model, const Rows& signals)
      : model_(model),
        signals_(signals),
        n_(static_cast<Eigen::Index>(model.states().size())),
        in_(n_ + signals.cols()),
        k1_(n_),
        k2_(n_),
        k3_(n_),
        k4_(n_),
        stage_(n_) {}

  void rate(const Eigen::VectorXd& at, Eigen::Index row, Eigen::VectorXd& out) {
    in_.head(n_) = at;
    if (signals_.cols() > 0) in_.tail(signals_.cols()) = signals_.row(row);
    model_.rate_of(in_.data(), out.data());
  }
  /// From row `first` over 2 `half` rows.
  void step(double h, Eigen::Index first, Eigen::Index half, Eigen::VectorXd& x) {
    rate(x, first, k1_);
    stage_ = x + 0.5 * h * k1_;
    rate(stage_, first + half, k2_);
    stage_ = x + 0.5 * h * k2_;
    rate(stage_, first + half, k3_);
    stage_ = x + h * k3_;
    rate(stage_, first + 2 * half, k4_);
    x += h / 6 * (k1_ + 2 * (k2_ + k3_) + k4_);
  }

 private:
  const CompiledModel& model_;
  const Rows& signals_;
  Eigen::Index n_;
  Eigen::VectorXd in_, k1_, k2_, k3_, k4_, stage_;
};

ModelRun run_with(const CompiledModel& model, const Rows& signals, const Eigen::VectorXd& start, double dt,
                  Eigen::Index samples, double limit, int substeps) {
  ModelRun run;
  run.dt = dt;
  run.states = model.states();
  run.values = Eigen::MatrixXd::Constant(samples, start.size(), std::numeric_limits<double>::quiet_NaN());
  Runge runge(model, signals);
  Eigen::VectorXd x = start, next = start;
  for (Eigen::Index i = 0; i < samples; ++i) {
    if (!(x.cwiseAbs().maxCoeff() <= limit) || !x.allFinite()) {
      run.diverged = true;
      break;
    }
    run.values.row(i) = x;
    run.valid = i + 1;
    if (i + 1 == samples) break;
    if (model.discrete()) {
      runge.rate(x, 2 * i, next);
      x = next;
      continue;
    }
    for (int k = 0; k < substeps; ++k) runge.step(dt / substeps, 2 * (substeps * i + k), 1, x);
  }
  return run;
}

/// Error of one step over a sample, largest share of a state's range over probes along the run: a step of twice the
/// length against two steps.
double step_error(const CompiledModel& model, const Rows& signals, double dt, const ModelRun& run) {
  constexpr Eigen::Index kProbes = 64;
  if (run.valid < 5) return 0;
  const auto valid = run.values.topRows(run.valid);
  const Eigen::ArrayXd range =
      (valid.colwise().maxCoeff() - valid.colwise().minCoeff()).transpose().array().cwiseMax(1e-300);
  Runge runge(model, signals);
  double largest = 0;
  const Eigen::Index stride = std::max<Eigen::Index>(1, (run.valid - 3) / kProbes);
  for (Eigen::Index i = 0; i + 2 < run.valid; i += stride) {
    Eigen::VectorXd x = run.values.row(i);
    runge.step(2 * dt, 2 * i, 2, x);
    const double error = ((x - run.values.row(i + 2).transpose()).array().abs() / range).maxCoeff() / 30;
    if (std::isfinite(error)) largest = std::max(largest, error);
  }
  return largest;
}

}  // namespace

int input_steps(Eigen::Index rows, Eigen::Index samples) {
  if (samples < 2) return rows == 1 ? 1 : 0;
  const Eigen::Index pairs = 2 * (samples - 1);
  return rows > 1 && (rows - 1) % pairs == 0 ? static_cast<int>((rows - 1) / pairs) : 0;
}

int input_steps_of(const IdentifiedModel& model) {
  const bool time_alone = model.inputs.size() == 1 && model.inputs.front() == "t";
  return model.timing.empty() && !time_alone ? 1 : 8;
}

ModelRun simulate(const CompiledModel& model, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                  const Eigen::Ref<const Eigen::VectorXd>& start, double dt, Eigen::Index samples, double limit,
                  int substeps) {
  constexpr double kStepError = 1e-7;
  constexpr int kMostSubsteps = 16;
  const Eigen::Index n = static_cast<Eigen::Index>(model.states().size());
  const Eigen::Index m = static_cast<Eigen::Index>(model.inputs().size());
  if (start.size() != n) throw Error(fmt::format("start of {} values for {} states", start.size(), n));
  if (samples < 1) throw Error::in_field("samples", std::to_string(samples), "at least 1");
  if (model.discrete() && substeps > 1) throw Error::in_field("substeps", std::to_string(substeps), "1 for a map");
  const int given = m > 0 ? input_steps(inputs.rows(), samples) : 0;
  if (m > 0 && (inputs.cols() != m || given == 0 || (model.discrete() && given > 1))) {
    throw Error(fmt::format("inputs of size {} x {}: must be {} x {} ({})", inputs.rows(), inputs.cols(),
                            2 * samples - 1, m, fmt::join(model.inputs(), ", ")));
  }
  if (m > 0) {
    if (substeps > 0 && substeps != given)
      throw Error::in_field("substeps", std::to_string(substeps), fmt::format("{} with these inputs", given));
    return run_with(model, Rows(model.signals(inputs)), start, dt, samples, limit, given);
  }
  if (model.discrete()) return run_with(model, Rows(2 * samples - 1, 0), start, dt, samples, limit, 1);
  const auto run_at = [&](int steps) {
    return run_with(model, Rows(2 * steps * (samples - 1) + 1, 0), start, dt, samples, limit, steps);
  };
  if (substeps > 0) return run_at(substeps);
  ModelRun run = run_at(1);
  const double error = step_error(model, Rows(2 * samples - 1, 0), dt, run);
  const int steps = std::clamp(static_cast<int>(std::ceil(std::sqrt(std::sqrt(error / kStepError)))), 1, kMostSubsteps);
  return steps == 1 ? run : run_at(steps);
}

Eigen::MatrixXd half_grid_inputs(const CompiledModel& model, const AngleSignal& angle, double t0) {
  Eigen::MatrixXd u(angle.beta.size(), static_cast<Eigen::Index>(model.inputs().size()));
  for (std::size_t k = 0; k < model.inputs().size(); ++k) {
    const std::string& name = model.inputs()[k];
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    if (name == "X5")
      u.col(column) = angle.beta;
    else if (name == "X6")
      u.col(column) = angle.omega;
    else if (name == "X7")
      u.col(column) = angle.alpha;
    else if (name == "t")
      u.col(column).setLinSpaced(u.rows(), t0, t0 + 0.5 * angle.dt * static_cast<double>(u.rows() - 1));
    else
      throw Error::in_field("input of a rotor model", name, "X5, X6, X7 or t");
  }
  return u;
}

Eigen::MatrixXd half_grid_inputs(const CompiledModel& model, const Recording& recording, int steps) {
  const Eigen::Index rows = 2 * steps * (recording.size() - 1) + 1;
  Eigen::MatrixXd u(rows, static_cast<Eigen::Index>(model.inputs().size()));
  for (std::size_t k = 0; k < model.inputs().size(); ++k) {
    const std::string& name = model.inputs()[k];
    const Eigen::Index column = static_cast<Eigen::Index>(k);
    if (name == "t" && !recording.has("t")) {
      u.col(column).setLinSpaced(rows, recording.t0,
                                 recording.t0 + recording.dt * static_cast<double>(recording.size() - 1));
    } else {
      u.col(column) = signal::upsample(recording[name], 2 * steps);
    }
  }
  return u;
}

}  // namespace whirl::identification
