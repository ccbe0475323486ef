#include "whirl/identify/hidden_states.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <set>

#include "evidence/channel_units.hpp"
#include "evidence/sindy_verdict.hpp"
#include "evidence/verdict.hpp"
#include "hidden/hidden_kinds.hpp"
#include "record/bridge_gaps.hpp"
#include "rules/rules.hpp"
#include "timing/sindy_timing.hpp"
#include "trajectory/trajectory_runs.hpp"
#include "trajectory/trajectory_score.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/evidence.hpp"
#include "whirl/identify/refine.hpp"
#include "whirl/identify/trajectory.hpp"

namespace whirl::identification {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

/// A model fitted to the first part of the records, and how it predicts the last.
struct Fitted {
  IdentifiedModel model;
  double error = kNever;  // share of the motion, of the part held out
  double rmse = 0;        // on the part fitted, by the spread
  bool converged = false;
  Eigen::VectorXd output_rmse;  // of each state, on the part fitted
};

class Search {
 public:
  Search(const std::vector<Recording>& records, const SindyOptions& options) : options_(options) {
    const HoldoutSplit split = split_holdout(records, 0.3);
    held_ = detail::longest_whole_stretch(split.test);
    train_ = prepare(split.train);
    all_ = prepare(records);
    std::vector<Stretch> stretches = detail::finite_stretches(split.train, options);
    detail::smooth_stretches(stretches);
    scales_.rate = detail::characteristic_rate(stretches);
    dt_ = stretches.front().dt;
    const Eigen::MatrixXd& x = train_.states.front();
    for (Eigen::Index k = 0; k < x.cols(); ++k) scales_.state_spread.push_back(spread(x.col(k)));
    for (std::size_t k = 0; k < options.states.size(); ++k)
      sd_.conservativeResize(sd_.size() + 1), sd_[sd_.size() - 1] = spread(x.col(static_cast<Eigen::Index>(k)));
    for (const std::string& u : options.inputs)
      scales_.input_size.push_back(std::sqrt(train_.records.front()[u].array().square().mean()));
    period_ = std::max<Eigen::Index>(20, std::lround(2 * std::numbers::pi / scales_.rate / dt_));
    for (const Recording& r : train_.records) longest_ = std::max(longest_, r.size());
  }

  const detail::HiddenScales& scales() const { return scales_; }

  /// Error of the part held out.
  double held_error(const IdentifiedModel& model) const {
    double worst = 0;
    for (const StateScore& s : score(model, held_)) worst = std::isfinite(s.nrmse) ? std::max(worst, s.nrmse) : kNever;
    return worst;
  }

  /// Fits a model on runs of `length` samples of the part not held out.
  Fitted fit(const IdentifiedModel& model, Eigen::Index length, Eigen::Index most, int iterations,
             const std::vector<Equation>* candidates = nullptr, std::vector<TermScore>* scores = nullptr) const {
    return fit_on(train_, model, length, most, iterations, candidates, scores);
  }

  /// From some periods to the whole record.
  Fitted mature(IdentifiedModel model, Eigen::Index from, int iterations) const {
    Fitted best = fit(model, from, kSearch, iterations);
    if (!std::isfinite(best.rmse)) return best;
    for (Eigen::Index length = 4 * from;; length *= 4) {
      const Fitted longer = fit(best.model, length, kSearch, iterations);
      if (!std::isfinite(longer.rmse)) break;
      best = longer;
      if (length >= longest_) break;
    }
    best.error = held_error(best.model);
    return best;
  }

  /// Adds candidates by score while the part held out gains, then drops what it does not miss.
  Fitted grow(Fitted now) const {
    std::set<std::string> refused;
    for (int added = 0; added < kMostAdded; ++added) {
      const std::vector<Equation> candidates = detail::hidden_candidates(now.model, options_, levels_of(now.model));
      std::vector<TermScore> scores;
      fit(now.model, longest_, kGrow, 1, &candidates, &scores);
      Fitted best;
      int tried = 0;
      for (const TermScore& s : scores) {
        if (tried >= 5 || s.score < rules::kHiddenTerm) break;
        if (refused.contains(s.equation + s.function)) continue;
        ++tried;
        IdentifiedModel larger = now.model;
        for (Equation& e : larger.equations) {
          if (e.lhs != s.equation) continue;
          Estimate start;
          start.value = 0.3 * s.coefficient;
          e.terms.push_back({s.function, start, ""});
        }
        Fitted trial = fit(larger, longest_, kGrow, 25);
        if (!std::isfinite(trial.rmse)) continue;
        trial.error = held_error(trial.model);
        if (trial.error < best.error) best = std::move(trial);
        if (best.error > rules::kHiddenTermGain * now.error) refused.insert(s.equation + s.function);
      }
      if (!(best.error < rules::kHiddenTermGain * now.error)) break;
      now = std::move(best);
    }
    return prune(std::move(now));
  }

  Fitted prune(Fitted now) const {
    for (bool again = true; again;) {
      again = false;
      // Least certain first.
      std::vector<std::pair<double, std::pair<std::size_t, std::size_t>>> order;
      for (std::size_t e = 0; e < now.model.equations.size(); ++e) {
        for (std::size_t t = 0; t < now.model.equations[e].terms.size(); ++t) {
          const Estimate& c = now.model.equations[e].terms[t].coefficient;
          if (c.sd != 0) order.push_back({std::abs(c.value) / c.sd, {e, t}});
        }
      }
      std::sort(order.begin(), order.end(), [](const auto& a, const auto& b) { return !(a.first >= b.first); });
      for (std::size_t k = 0; k < std::min<std::size_t>(4, order.size()) && !again; ++k) {
        IdentifiedModel smaller = now.model;
        auto& terms = smaller.equations[order[k].second.first].terms;
        if (terms.size() < 2) continue;
        terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(order[k].second.second));
        Fitted trial = fit(smaller, longest_, kGrow, 20);
        if (!std::isfinite(trial.rmse)) continue;
        trial.error = held_error(trial.model);
        if (trial.error > 1.01 * now.error) continue;
        now = std::move(trial);
        again = true;
      }
    }
    return now;
  }

  /// The last word, by the whole records.
  Fitted conclude(const IdentifiedModel& model) const {
    Fitted f = fit_on(all_, model, 1 << 30, kFinal, 80, nullptr, nullptr);
    return f;
  }

 private:
  using Stretch = detail::Stretch;
  static constexpr Eigen::Index kSearch = 8000, kGrow = 16000, kFinal = 60000;
  static constexpr int kMostAdded = 8;

  static double spread(const Eigen::VectorXd& y) {
    return std::max(std::sqrt((y.array() - y.mean()).square().mean()), std::numeric_limits<double>::min());
  }

  detail::RunRecords prepare(const std::vector<Recording>& records) const {
    std::vector<Stretch> stretches = detail::finite_stretches(records, options_);
    detail::smooth_stretches(stretches);
    return detail::runs_of(options_, stretches);
  }

  /// Levels that hidden states are above in a quarter and a twentieth of the time.
  std::map<std::string, std::vector<double>> levels_of(const IdentifiedModel& model) const {
    const TrajectoryModel trajectory = trajectory_model(model, options_.states);
    const detail::RunRecords data = with_hidden(train_, trajectory);
    std::map<std::string, std::vector<double>> levels;
    for (Eigen::Index k = train_.states.front().cols(); k < data.states.front().cols(); ++k) {
      Eigen::VectorXd h = data.states.front().col(k);
      std::sort(h.begin(), h.end());
      const auto at = [&](double share) {
        return h[static_cast<Eigen::Index>(share * static_cast<double>(h.size() - 1))];
      };
      if (at(0.95) > at(0.05)) levels[trajectory.states[static_cast<std::size_t>(k)]] = {at(0.75), at(0.95)};
    }
    return levels;
  }

  /// States of the model at every sample of the records: measured ones as they are, hidden ones by a free run from 0.
  detail::RunRecords with_hidden(const detail::RunRecords& data, const TrajectoryModel& model) const {
    detail::RunRecords out = data;
    const auto n = static_cast<Eigen::Index>(model.states.size());
    for (std::size_t r = 0; r < out.records.size(); ++r) {
      const Eigen::Index known = data.states[r].cols(), rows = data.states[r].rows();
      if (known == n) continue;
      TrajectoryRun run{0, 0, rows, Eigen::VectorXd::Zero(n)};
      run.start.head(known) = data.states[r].row(0);
      Eigen::MatrixXd states;
      const bool follows = follow(model, out.records[r], run, 0, &states).size() > 0;
      out.states[r].conservativeResize(Eigen::NoChange, n);
      if (follows)
        out.states[r].rightCols(n - known) = states.rightCols(n - known);
      else
        out.states[r].rightCols(n - known).setZero();
    }
    return out;
  }

  Fitted fit_on(const detail::RunRecords& data, const IdentifiedModel& model, Eigen::Index length, Eigen::Index most,
                int iterations, const std::vector<Equation>* candidates, std::vector<TermScore>* scores) const {
    IdentifiedModel larger = model;
    std::vector<std::pair<std::string, std::string>> names;  // of the candidates
    if (candidates != nullptr) {
      for (Equation& e : larger.equations) {
        for (const Equation& c : *candidates) {
          if (c.lhs != e.lhs) continue;
          for (EquationTerm t : c.terms) {
            t.coefficient = {};
            t.coefficient.value = 0;
            e.terms.push_back(t);
          }
        }
      }
    }
    TrajectoryModel trajectory = trajectory_model(larger, options_.states);
    TrajectoryOptions o;
    o.output_sd = sd_;
    o.max_iterations = iterations;
    // A state more may take over what was read as dead time.
    for (const InputTiming& t : larger.timing) {
      if (!options_.timing.dead_time.contains(t.input)) o.free_dead_time.push_back(t.input);
    }
    std::size_t at = 0;
    for (const Equation& e : larger.equations) {
      std::size_t own = e.terms.size();
      if (candidates != nullptr) {
        for (const Equation& c : *candidates) own -= c.lhs == e.lhs ? c.terms.size() : 0;
      }
      for (std::size_t t = 0; t < e.terms.size(); ++t, ++at) {
        if (t < own) continue;
        o.scored.push_back(trajectory.parameters[at].name);
        names.emplace_back(e.lhs, e.terms[t].function);
      }
    }
    const detail::RunRecords runs = with_hidden(data, trajectory);
    TrajectoryFit fit = fit_trajectory(trajectory, runs.records, detail::cut_trajectory_runs(runs, length, most), o);
    Fitted out;
    out.model = model;
    out.rmse = fit.diverged || !std::isfinite(fit.rmse) ? kNever : fit.rmse;
    out.converged = fit.converged;
    out.output_rmse = fit.output_rmse;
    if (scores != nullptr) {
      for (const TrajectoryScore& s : fit.scores) {
        const auto k = std::find(o.scored.begin(), o.scored.end(), s.name) - o.scored.begin();
        const auto& [lhs, function] = names[static_cast<std::size_t>(k)];
        scores->push_back({lhs, function, s.score, s.step});
      }
    }
    if (candidates == nullptr && std::isfinite(out.rmse)) take_over(fit, out.model);
    return out;
  }

  const SindyOptions& options_;
  Recording held_;
  detail::RunRecords train_, all_;
  detail::HiddenScales scales_;
  Eigen::VectorXd sd_;
  double dt_ = 0;
  Eigen::Index period_ = 0, longest_ = 0;

 public:
  Eigen::Index period() const { return period_; }
};

/// Chi-square of the worst state, and the warnings that it asks for.
void judge_noise(const std::vector<Recording>& records, const SindyOptions& plain, const Fitted& final,
                 Summary& summary) {
  detail::SindyData data(plain);
  data.add(records, std::numeric_limits<Eigen::Index>::max());
  const detail::OutputWeights weights = detail::output_weights(data);
  if (!weights.noisy || final.output_rmse.size() != weights.sd.size()) return;
  summary.chi_square = final.output_rmse.cwiseQuotient(weights.sd).array().square().maxCoeff();
  detail::judge_chi_square(summary.chi_square, "", summary);
}

void set_parameters(IdentifiedModel& model) {
  model.parameters.clear();
  model.parameter_covariance.clear();
  for (const Equation& e : model.equations) {
    for (const EquationTerm& t : e.terms) {
      if (t.coefficient.sd != 0) model.parameters.emplace_back(e.lhs + ": " + t.function, t.coefficient);
    }
  }
}

}  // namespace

IdentifiedModel fit_hidden(const std::vector<Recording>& records, const SindyOptions& options,
                           std::vector<HiddenTrial>* trials) {
  if (options.discrete || !options.refine) throw Error("hidden states need differential equations and refinement");
  require_range("hidden", options.hidden, 1, 4);
  SindyOptions plain = options;
  plain.hidden = 0;
  const IdentifiedModel base = fit_sindy(records, plain);
  if (base.equations.empty()) return base;
  const Search search(records, plain);
  Fitted now;
  now.model = fit_sindy(split_holdout(records, 0.3).train, plain);
  now.error = search.held_error(now.model);
  std::vector<HiddenTrial> all{{"none", now.error, false}};
  const double without = now.error;
  std::string taken;
  for (int h = 0; h < options.hidden; ++h) {
    const std::string name = fmt::format("h{}", h + 1);
    std::vector<std::pair<std::string, Fitted>> found;
    for (const detail::HiddenStart& start : detail::hidden_starts(now.model, options, search.scales(), name)) {
      Fitted f = search.mature(start.model, 6 * search.period(), 10);
      if (!std::isfinite(f.rmse)) continue;
      found.emplace_back(start.kind, std::move(f));
    }
    std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) { return a.second.error < b.second.error; });
    // The best of each kind, and the best two with more terms.
    // Among equals the one with fewer coefficients.
    std::set<std::string> kinds;
    Fitted best;
    std::string best_kind;
    const auto coefficients = [](const Fitted& f) {
      std::size_t n = 0;
      for (const Equation& e : f.model.equations) n += e.terms.size();
      return n;
    };
    for (auto& [kind, f] : found) {
      if (!kinds.insert(kind).second) continue;
      if (kinds.size() <= 3) f = search.grow(std::move(f));
      all.push_back({kind, f.error, false});
      const bool fewer = !best_kind.empty() && coefficients(f) < coefficients(best);
      if (f.error < (fewer ? 1.02 : 0.98) * best.error || best_kind.empty()) {
        best = f;
        best_kind = kind;
      }
    }
    if (!(best.error < rules::kHiddenGain * now.error)) break;
    now = std::move(best);
    for (HiddenTrial& t : all) t.chosen = t.chosen || (t.kind == best_kind && t.error == now.error);
    taken += (taken.empty() ? "" : ", ") + best_kind;
  }
  if (trials != nullptr) *trials = all;
  if (taken.empty()) {
    IdentifiedModel model = base;
    model.summary.warnings.push_back(fmt::format(
        "no hidden state lowers the free-run error of the part held out ({:.2g} % of the motion) by a tenth",
        100 * without));
    return model;
  }
  const Fitted final = search.conclude(now.model);
  IdentifiedModel model = std::isfinite(final.rmse) ? final.model : now.model;
  detail::set_coefficient_units(model, records.front());
  set_parameters(model);
  model.summary = {};
  model.summary.residual = final.rmse;
  if (!final.converged) model.summary.warn("the fit on free runs did not converge");
  judge_noise(records, plain, final, model.summary);
  if (now.error > rules::kUnexplained && now.error <= rules::kLost)
    model.summary.warn(fmt::format("model error: {:.2g} % of the motion held out unexplained", 100 * now.error));
  if (!(now.error <= rules::kLost))
    model.summary.fail(fmt::format("free runs leave {:.0f} % of the motion held out unexplained", 100 * now.error));
  model.summary.trust =
      model.summary.status == Status::unusable
          ? "Do not use this model."
          : fmt::format(
                "Hidden state: {}. Free run over the part held out: {:.2g} % of the motion off, {:.2g} % without it.",
                taken, 100 * now.error, 100 * without);
  return model;
}

}  // namespace whirl::identification
