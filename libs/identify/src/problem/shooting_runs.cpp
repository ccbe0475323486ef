#include "problem/shooting_runs.hpp"

#include <algorithm>

#include "whirl/expr/tape.hpp"
#include "whirl/signal/resample.hpp"

namespace whirl::identification::detail {

std::vector<FreeRun> cut_runs(const CompiledModel& model, const std::vector<Stretch>& stretches,
                              const SindyOptions& options, Eigen::Index length, Eigen::Index most, int steps) {
  std::vector<FreeRun> runs;
  const std::size_t states = options.states.size();
  for (const Stretch& s : stretches) {
    const Eigen::Index n = s.samples();
    const Eigen::Index fine = 2 * steps * (n - 1) + 1;
    Eigen::MatrixXd inputs(fine, static_cast<Eigen::Index>(model.inputs().size()));
    for (std::size_t k = 0; k < model.inputs().size(); ++k) {
      const Eigen::Index column = static_cast<Eigen::Index>(k);
      const auto at = std::find(options.inputs.begin(), options.inputs.end(), model.inputs()[k]);
      if (at == options.inputs.end()) {
        inputs.col(column).setLinSpaced(fine, s.t0, s.t0 + s.dt * static_cast<double>(n - 1));
      } else {
        inputs.col(column) =
            signal::upsample(s.inputs.col(static_cast<Eigen::Index>(at - options.inputs.begin())), 2 * steps);
      }
    }
    const Eigen::Index pieces = std::max<Eigen::Index>(1, n / length);
    for (Eigen::Index p = 0; p < pieces; ++p) {
      const Eigen::Index first = p * n / pieces, count = (p + 1) * n / pieces - first;
      FreeRun run;
      run.start.resize(static_cast<Eigen::Index>(model.states().size()));
      for (std::size_t k = 0; k < model.states().size(); ++k) {
        // Order 2: displacements, then their rates (fit_sindy builds the model so).
        const Eigen::Index column = static_cast<Eigen::Index>(k % states);
        run.start[static_cast<Eigen::Index>(k)] = k < states ? s.smooth(first, column) : s.rate(first, column);
      }
      run.inputs = inputs.middleRows(2 * steps * first, 2 * steps * (count - 1) + 1);
      run.measured = s.raw.middleRows(first, count);
      runs.push_back(std::move(run));
    }
  }
  const std::size_t limit =
      std::max<std::size_t>(4, static_cast<std::size_t>(most / std::max<Eigen::Index>(1, length)));
  if (runs.size() <= limit) return runs;
  std::vector<FreeRun> spread;
  for (std::size_t k = 0; k < limit; ++k) spread.push_back(std::move(runs[k * runs.size() / limit]));
  return spread;
}

Shares::Shares(const Candidates& candidates, const std::vector<Stretch>& stretches, const SindyOptions& options)
    : stretches_(stretches), options_(options), names_(library_names(options)) {
  names_.push_back("t");
  for (const auto& [lhs, terms] : candidates) {
    for (const expr::Expr& e : terms) size_.emplace(e.str(), 0.0);
  }
  std::vector<expr::Expr> functions;
  for (const auto& [text, size] : size_) functions.push_back(expr::Expr::parse(text));
  const Eigen::VectorXd rms = rms_of(functions);
  Eigen::Index i = 0;
  for (auto& [text, size] : size_) size = rms[i++];
}

double Shares::of(const std::string& function) const {
  const auto at = size_.find(function);
  return at == size_.end() ? 0 : at->second;
}

double Shares::of(const Equation& equation) const {
  std::vector<expr::Expr> terms;
  for (const EquationTerm& t : equation.terms)
    terms.push_back(expr::Expr(t.coefficient.value) * expr::Expr::parse(t.function));
  return rms_of({expr::Expr::sum(terms)})[0];
}

Eigen::VectorXd Shares::rms_of(const std::vector<expr::Expr>& functions) const {
  const expr::Tape tape = expr::compile(functions, names_);
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(functions.size()));
  double rows = 0;
  for (const Stretch& s : stretches_) {
    sum += tape.evaluate(library_variables(s, options_)).colwise().squaredNorm().transpose();
    rows += static_cast<double>(s.samples());
  }
  return (sum / rows).cwiseSqrt();
}

}  // namespace whirl::identification::detail
