#include "whirl/identify/sindy_library.hpp"

#include <fmt/ranges.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <numbers>

#include "evidence/channel_units.hpp"
#include "evidence/compare_all.hpp"
#include "evidence/record_quality.hpp"
#include "evidence/sindy_verdict.hpp"
#include "output_error/substeps.hpp"
#include "problem/sindy_prepare.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/identify/refine.hpp"

namespace whirl::identification {
namespace {

bool contains(const std::vector<std::string>& list, const std::string& name) {
  return std::find(list.begin(), list.end(), name) != list.end();
}

expr::Expr known_part(const expr::CandidateLibrary& library, std::size_t equation) {
  return library.known.empty() ? expr::Expr(0.0) : library.known[equation];
}

/// States, inputs, order and candidate columns that the library asks for.
SindyOptions options_of(const expr::CandidateLibrary& library, SindyOptions o) {
  if (!o.equations.signs.empty()) throw Error("sign bounds are for fits without a library of ties and known parts");
  o.states.clear();
  o.inputs.clear();
  o.library.clear();
  o.equations.library_of.clear();
  o.equations.known.clear();
  std::vector<int> orders;  // 0: map
  for (const std::string& lhs : library.lhs) {
    const bool map = lhs.ends_with("[k+1]");
    const std::size_t end = map ? lhs.size() - 5 : std::min(lhs.find('\''), lhs.size());
    orders.push_back(map ? 0 : static_cast<int>(lhs.size() - end));
    o.states.push_back(lhs.substr(0, end));
  }
  if (orders.empty() ||
      *std::min_element(orders.begin(), orders.end()) != *std::max_element(orders.begin(), orders.end()) ||
      orders.front() > 2 || (orders.front() == 0 && !library.lhs.front().ends_with("[k+1]"))) {
    throw Error(fmt::format("equations of {}: must all be x' or all x'' or all x[k+1]", fmt::join(library.lhs, ", ")));
  }
  o.discrete = orders.front() == 0;
  o.order = std::max(1, orders.front());
  for (const std::string& name : library.variables) {
    const bool rate = o.order == 2 && name.ends_with('\'') && contains(o.states, name.substr(0, name.size() - 1));
    if (name != "t" && !rate && !contains(o.states, name)) o.inputs.push_back(name);
  }
  for (std::size_t i = 0; i < library.lhs.size(); ++i) {
    std::vector<std::string>& terms = o.equations.library_of[library.lhs[i]];
    for (const expr::TiedGroup& g : library.groups) {
      for (const expr::TiedEntry& e : g.entries) {
        if (e.equation == i && !contains(terms, e.function.str())) terms.push_back(e.function.str());
      }
    }
    const std::string known = known_part(library, i).str();
    if (!known_part(library, i).is_number(0) && !contains(terms, known)) terms.push_back(known);
    if (terms.empty()) throw Error(fmt::format("the library has no term of {}", library.lhs[i]));
  }
  return o;
}

bool stays(const expr::TiedGroup& group) { return group.entries.size() > 1 || !group.coefficient.empty(); }

/// The regression of equation i in the unknowns of the groups.
regression::Problem in_unknowns(const detail::SindyData& data, const expr::CandidateLibrary& library, std::size_t i) {
  const regression::Problem columns = data.problem(i);
  const auto column = [&](const expr::Expr& f) {
    // The library of a front end is unique up to a numeric factor: split it off.
    const auto [factor, rest] = expr::split_coefficient(f);
    for (std::size_t j = 0; j < columns.names.size(); ++j) {
      const auto [number, other] = expr::split_coefficient(expr::Expr::parse(columns.names[j]));
      if (other == rest) return std::pair{static_cast<Eigen::Index>(j), factor / number};
    }
    throw Error(fmt::format("term {} has no column", f.str()));
  };
  regression::Elimination elimination;
  const Eigen::Index q = columns.total.terms();
  elimination.map = Eigen::MatrixXd::Zero(q, static_cast<Eigen::Index>(library.groups.size()));
  elimination.fixed = Eigen::VectorXd::Zero(q);
  for (std::size_t g = 0; g < library.groups.size(); ++g) {
    for (const expr::TiedEntry& e : library.groups[g].entries) {
      if (e.equation != i) continue;
      const auto [j, factor] = column(e.function);
      elimination.map(j, static_cast<Eigen::Index>(g)) += factor * e.factor;
    }
  }
  if (!known_part(library, i).is_number(0)) {
    const auto [j, factor] = column(known_part(library, i));
    elimination.fixed[j] += factor;
  }
  return regression::reduce(columns, elimination);
}

class LibraryFit {
 public:
  LibraryFit(const detail::SindyData& data, const expr::CandidateLibrary& library, regression::SolveOptions solver)
      : data_(data), library_(library), solver_(std::move(solver)) {
    for (std::size_t g = 0; g < library.groups.size(); ++g) {
      if (stays(library.groups[g])) solver_.rules.keep.push_back(static_cast<int>(g));
    }
    if (solver_.noise_floor == 0) solver_.noise_floor = data.options().search.least_share;
    model_.method = "sindy";
    model_.states = data.options().states;
    model_.inputs = data.options().inputs;
    model_.sample_time = data.stretches().front().dt;
    model_.noise_sd = data.noise_sd().mean();
    model_.provenance.version = std::string(version());
    if (data.options().order == 2) {
      for (const std::string& s : data.options().states) model_.states.push_back(s + "'");
    }
    if (contains(library.variables, "t")) model_.inputs.emplace_back("t");
  }

  IdentifiedModel run() {
    regression();
    if (model_.summary.status == Status::unusable) return model_;
    if (data_.options().discrete || !data_.options().refine) {
      take_regression();
      detail::judge_regression(data_, model_);
      return model_;
    }
    refine();
    return model_;
  }

 private:
  void regression() {
    const std::size_t equations = library_.lhs.size();
    std::vector<regression::Problem> problems;
    std::vector<double> weights;
    for (std::size_t i = 0; i < equations; ++i) {
      problems.push_back(in_unknowns(data_, library_, i));
      weights.push_back(1 / std::max(problems.back().total.energy / problems.back().total.rows, 1e-300));
    }
    regression::SparseFit fit;
    regression::Problem stacked;
    for (int pass = 0; pass < 3; ++pass) {
      stacked = regression::stack(problems, weights);
      fit = regression::solve(stacked, solver_);
      for (std::size_t i = 0; i < equations; ++i) {
        const double variance = problems[i].total.residual(fit.xi) / problems[i].total.rows;
        weights[i] = 1 / std::max(variance, 1e-12 * problems[i].total.energy / problems[i].total.rows);
      }
    }
    model_.summary.condition_number = fit.summary.condition_number;
    for (std::size_t i = 0; i < equations; ++i) {
      const double residual =
          std::sqrt(problems[i].total.residual(fit.xi) / std::max(problems[i].total.energy, 1e-300));
      if (residual > least_.residual) least_ = {library_.lhs[i], residual};
    }
    model_.summary.residual = least_.residual;
    std::vector<int> wanted = fit.support;  // with those that should stay although no solution was found for them
    for (int g : solver_.rules.keep) {
      if (std::find(wanted.begin(), wanted.end(), g) == wanted.end()) wanted.push_back(g);
    }
    const Eigen::MatrixXd gram = stacked.total.gram(wanted, wanted);
    std::vector<std::string> names;
    for (int g : wanted) names.push_back(library_.groups[static_cast<std::size_t>(g)].name);
    for (const CollinearGroup& c : collinear_groups(gram, names, 1e6)) {
      model_.summary.fail(
          fmt::format("the records cannot tell {} apart (condition index {:.1e}): tie them or leave some out",
                      fmt::join(c.terms, ", "), c.condition_index));
    }
    if (fit.support.empty()) model_.summary.fail("no candidate term explains any left-hand side");
    support_ = fit.support;
    values_ = fit.xi(support_);
    sd_ = fit.sd(support_);
    if (model_.summary.status == Status::unusable) model_.summary.trust = "Do not use this model.";
  }

  /// Equations with the present unknowns; `ties_` maps them to the coefficients.
  void write_equations() {
    model_.equations.clear();
    if (data_.options().order == 2) {
      for (const std::string& s : data_.options().states)
        model_.equations.push_back({s + "'", {{s + "'", {1, 0, 1, 1}, ""}}});
    }
    std::vector<Eigen::VectorXd> rows;
    for (std::size_t i = 0; i < library_.lhs.size(); ++i) {
      Equation equation{library_.lhs[i], {}};
      if (!known_part(library_, i).is_number(0)) {
        const auto [number, function] = expr::split_coefficient(known_part(library_, i));
        equation.terms.push_back({function.str(), {number, 0, number, number}, ""});
      }
      for (std::size_t k = 0; k < support_.size(); ++k) {
        const Eigen::Index j = static_cast<Eigen::Index>(k);
        const expr::TiedGroup& g = library_.groups[static_cast<std::size_t>(support_[k])];
        for (const expr::TiedEntry& e : g.entries) {
          if (e.equation != i) continue;
          Estimate c;
          c.value = e.factor * values_[j];
          equation.terms.push_back({e.function.str(), c, g.unit});
          rows.emplace_back(Eigen::VectorXd::Unit(static_cast<Eigen::Index>(support_.size()), j) * e.factor);
        }
      }
      model_.equations.push_back(std::move(equation));
    }
    ties_.resize(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(support_.size()));
    for (std::size_t r = 0; r < rows.size(); ++r) ties_.row(static_cast<Eigen::Index>(r)) = rows[r].transpose();
  }

  void set_parameters(const Eigen::MatrixXd& covariance) {
    model_.parameters.clear();
    model_.parameter_covariance.clear();
    for (std::size_t k = 0; k < support_.size(); ++k) {
      const Eigen::Index j = static_cast<Eigen::Index>(k);
      const expr::TiedGroup& group = library_.groups[static_cast<std::size_t>(support_[k])];
      const auto same = [&](const expr::TiedGroup& g) { return g.name == group.name; };
      const bool alone = std::count_if(library_.groups.begin(), library_.groups.end(), same) == 1;
      model_.parameters.emplace_back(
          alone ? group.name : library_.lhs[group.entries.front().equation] + ": " + group.name,
          Estimate::from_sd(values_[j], std::sqrt(covariance(j, j))));
    }
    model_.parameter_covariance.assign(covariance.data(), covariance.data() + covariance.size());
  }

  void take_regression() {
    write_equations();
    std::size_t row = 0;
    for (Equation& e : model_.equations) {
      for (EquationTerm& t : e.terms) {
        if (t.coefficient.sd == 0) continue;
        const Eigen::VectorXd scaled = ties_.row(static_cast<Eigen::Index>(row++)).transpose().cwiseProduct(sd_);
        t.coefficient = Estimate::from_sd(t.coefficient.value, scaled.norm());
      }
    }
    set_parameters(sd_.cwiseAbs2().asDiagonal());
  }

  void refine() {
    const SindyOptions& o = data_.options();
    const detail::OutputWeights weights = detail::output_weights(data_);
    RefineOptions options;
    options.outputs = o.states;
    options.output_sd = weights.sd;
    options.tolerance = 1e-6;
    write_equations();
    const double dt = model_.sample_time;
    Eigen::Index longest = 0;
    for (const detail::Stretch& s : data_.stretches()) longest = std::max(longest, s.samples());
    Eigen::Index length =
        std::min(longest, std::max<Eigen::Index>(20, std::lround(2 * std::numbers::pi / data_.rate() / dt)));
    int steps = 1;  // a sample, of driven systems
    const auto runs_at = [&](Eigen::Index at, int with) {
      return detail::cut_runs(CompiledModel(model_), data_.stretches(), o, at, kMostSamples, with);
    };
    const auto refined_at = [&](Eigen::Index at) {
      options.ties = ties_;
      return refine_free_run(model_, runs_at(at, steps), dt, options);
    };
    Refined best = refined_at(length);
    while (best.starts.empty() && length > 20) best = refined_at(length /= 2);
    if (best.starts.empty()) {
      detail::judge_refined(data_, weights, {}, least_, model_);
      return;
    }
    take(best);
    const auto take_finer_steps = [&] {
      if (model_.inputs.empty() || steps >= kMostSteps) return false;
      options.ties = ties_;
      const auto begun = [&](int with) {
        std::vector<FreeRun> runs = runs_at(length, with);
        for (std::size_t k = 0; k < runs.size(); ++k) runs[k].start = best.starts[k];
        return runs;
      };
      detail::FinerSteps finer = detail::finer_steps(model_, begun, steps, dt, options);
      if (finer.steps == steps) return false;
      steps = finer.steps;
      take(best = std::move(finer.fit));
      return true;
    };
    take_finer_steps();
    for (;;) {
      if (length < longest) {  // longer runs hold more information, kept while the model follows
        Refined next = refined_at(std::min(4 * length, longest));
        if (!next.starts.empty() && next.rmse * next.rmse <= 1.2 * best.rmse * best.rmse + 1e-3) {
          length = std::min(4 * length, longest);
          best = std::move(next);
          take(best);
          continue;
        }
      }
      if (!drop_weakest(best.covariance)) {
        if (take_finer_steps()) continue;
        break;
      }
      write_equations();
      best = refined_at(length);
      if (best.starts.empty()) {
        detail::judge_refined(data_, weights, {}, least_, model_);
        return;
      }
      take(best);
    }
    set_parameters(best.covariance);
    model_.summary.chi_square = best.rmse * best.rmse;
    model_.summary.residual = best.rmse;
    if (!best.converged) model_.summary.warn("the refinement on free runs did not converge");
    if (steps > 1) {
      for (const std::string& u : o.inputs) model_.timing.push_back({u, Hold::band_limited, {0, 0, 0, 0}});
    }
    detail::judge_refined(data_, weights, {static_cast<double>(length) * dt, best.output_rmse}, least_, model_);
  }

  void take(const Refined& refined) {
    model_.equations = refined.model.equations;
    Eigen::VectorXd coefficients(ties_.rows());
    Eigen::Index row = 0;
    for (const Equation& e : model_.equations) {
      for (const EquationTerm& t : e.terms) {
        if (t.coefficient.sd != 0) coefficients[row++] = t.coefficient.value;
      }
    }
    values_ = (ties_.transpose() * ties_).inverse() * (ties_.transpose() * coefficients);
  }

  /// False when every candidate that may go is significant.
  bool drop_weakest(const Eigen::MatrixXd& covariance) {
    double least = data_.options().search.t_value;
    std::ptrdiff_t weakest = -1;
    for (std::size_t k = 0; k < support_.size(); ++k) {
      const Eigen::Index j = static_cast<Eigen::Index>(k);
      const double t = std::abs(values_[j]) / std::sqrt(covariance(j, j));
      if (stays(library_.groups[static_cast<std::size_t>(support_[k])]) || t >= least) continue;
      least = t;
      weakest = static_cast<std::ptrdiff_t>(k);
    }
    if (weakest < 0 || support_.size() == 1) return false;
    support_.erase(support_.begin() + weakest);
    const Eigen::VectorXd before = values_;
    values_.resize(before.size() - 1);
    values_ << before.head(weakest), before.tail(before.size() - 1 - weakest);
    return true;
  }

  static constexpr Eigen::Index kMostSamples = 100000;
  static constexpr int kMostSteps = 16;

  const detail::SindyData& data_;
  const expr::CandidateLibrary& library_;
  regression::SolveOptions solver_;
  IdentifiedModel model_;
  std::vector<int> support_;  // groups in the model
  Eigen::VectorXd values_, sd_;
  Eigen::MatrixXd ties_;
  detail::LeastExplained least_;
};

/// A library in the names of the channels with the options and the records' sums that it asks for.
struct PreparedLibrary {
  expr::CandidateLibrary library;
  Recording like;   ///< channels and derivatives with their quantities, no samples
  Summary summary;  ///< unusable: no sums
  std::unique_ptr<detail::SindyData> data;
};

PreparedLibrary prepare(const std::vector<Recording>& given, const expr::CandidateLibrary& any_names,
                        const SindyOptions& options) {
  if (given.empty()) throw Error("no record to identify from");
  PreparedLibrary p;
  p.library = given.front().has("X1") ? any_names : in_channel_names(any_names);
  const SindyOptions o = options_of(p.library, options);
  std::vector<Recording> records;
  for (const Recording& r : given) records.push_back(with_derivatives(r, o.inputs));
  detail::require_equal_steps(records);
  std::vector<std::string> measured;  // an exact ramp has a constant rate: derivatives need no variation
  for (const std::string& name : o.inputs) {
    if (!name.ends_with('\'')) measured.push_back(name);
  }
  detail::check_signals(records, o.states, measured, o.discrete, p.summary);
  if (p.summary.status == Status::unusable) return p;
  for (const Channel& c : records.front().channels) p.like.add(c.name, c.quantity, {});
  p.data = std::make_unique<detail::SindyData>(o);
  p.data->add(records, std::numeric_limits<Eigen::Index>::max());
  p.data->finish();
  return p;
}

}  // namespace

IdentifiedModel fit_library(const std::vector<Recording>& records, const expr::CandidateLibrary& library,
                            const SindyOptions& options) {
  const PreparedLibrary p = prepare(records, library, options);
  IdentifiedModel model;
  if (p.data == nullptr) {
    model.method = "sindy";
    model.summary = p.summary;
    model.summary.trust = "Do not use this model.";
    return model;
  }
  model = LibraryFit(*p.data, p.library, options.solver).run();
  detail::set_coefficient_units(model, p.like);
  for (const Recording& r : records) model.provenance.inputs.push_back(r.source);
  return model;
}

std::vector<ComparedFit> compare_regressors(const std::vector<Recording>& records,
                                            const expr::CandidateLibrary& library, const SindyOptions& options) {
  SindyOptions regression = options;
  regression.refine = false;
  const PreparedLibrary p = prepare(records, library, regression);
  if (p.data == nullptr) throw Error(p.summary.reason);
  return detail::compare_all(p.library.groups.size(), options.solver, [&](const regression::SolveOptions& solver) {
    IdentifiedModel model = LibraryFit(*p.data, p.library, solver).run();
    detail::set_coefficient_units(model, p.like);
    return model;
  });
}

}  // namespace whirl::identification
