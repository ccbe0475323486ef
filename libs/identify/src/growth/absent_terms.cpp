#include "growth/absent_terms.hpp"

#include <fmt/format.h>

#include <Eigen/Cholesky>
#include <algorithm>

#include "output_error/score.hpp"

namespace whirl::identification::detail {
namespace {

/// `active` with what it lacks of the usual terms, at 0.
OutputErrorOptions with_all(const OutputErrorFit& fit, OutputErrorOptions active, const std::vector<RotorTerm>& terms,
                            bool sensor, bool displacement) {
  active.modes.decays = fit.decays;
  active.terms = fit.terms;
  active.probes.start = fit.sensor;
  active.clock.start_drift = fit.clock_drift;
  const std::vector<Eigen::Index> references = reference_lanes(fit.terms);
  const auto lanes = static_cast<std::size_t>(kMostLanes - kProfile - active.clock.profile_degree - active.clock.delay -
                                              active.clock.drift -
                                              (references.empty() ? 0 : *std::ranges::max_element(references) + 1));
  for (RotorTerm t : terms) {
    if (t.entry->usual == nullptr || active.terms.size() >= lanes) continue;
    if (std::ranges::any_of(fit.terms, [&](const RotorTerm& f) { return f.is(*t.entry); })) continue;
    t.value = 0;
    active.terms.push_back(t);
  }
  for (const TermEntry* entry : term_catalogue()) {
    if (!displacement && entry->of_displacement) continue;
    if (sensor && entry->sensor != nullptr && entry->usual != nullptr && !active.estimates(*entry))
      active.probes.errors.push_back(entry);
  }
  return active;
}

const TermEntry& term_of(const Parameter& q, const OutputErrorOptions& all) {
  return q.kind == Kind::sensor ? *q.sensor : *all.terms[static_cast<std::size_t>(q.index)].entry;
}

}  // namespace

std::vector<AbsentTerm> absent_terms(const std::vector<RotorRecord>& records, const OutputErrorFit& fit,
                                     const OutputErrorOptions& active, const std::vector<RotorTerm>& terms, bool sensor,
                                     const KnownForces& forces) {
  const bool displacement = records.front().quantity == Quantity::displacement;
  const OutputErrorOptions all = with_all(fit, active, terms, sensor, displacement);
  OutputErrorProblem problem(records, all, fit.model.modes.size(), forces);
  Point point = point_of(fit, all, problem.parameters());
  SquareSum sum;
  problem.linearise(point, sum);
  if (!std::isfinite(sum.cost)) return {};

  const std::vector<Parameter>& parameters = problem.parameters();
  std::vector<int> known;
  std::vector<std::vector<int>> absent;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    const int at = static_cast<int>(j);
    fit.index(parameters[j].name) >= 0 ? known.push_back(at) : absent.push_back({at});
  }
  const auto place = [&](const std::string& name) {
    const auto at = std::find_if(known.begin(), known.end(),
                                 [&](int j) { return parameters[static_cast<std::size_t>(j)].name == name; });
    return at == known.end() ? Eigen::Index{-1} : static_cast<Eigen::Index>(at - known.begin());
  };
  std::vector<Eigen::Index> rotor = {place("k1"), place("k2"), place("c")};
  for (std::size_t r = 0; r < records.size(); ++r) {
    const std::string suffix = r == 0 ? "" : fmt::format("_{}", r + 1);
    rotor.push_back(place("eps_re" + suffix));
    rotor.push_back(place("eps_im" + suffix));
  }

  const Eigen::VectorXd scale = sum.normal.diagonal()(known).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
  const Eigen::LDLT<Eigen::MatrixXd> own(
      Eigen::MatrixXd(scale.asDiagonal() * sum.normal(known, known) * scale.asDiagonal()));
  const std::vector<Remainder> left = remainders(sum.normal, sum.gradient, known, absent);
  std::vector<AbsentTerm> out;
  for (std::size_t k = 0; k < absent.size(); ++k) {
    const int j = absent[k].front();
    const Evidence e = evidence(left[k], 1);
    if (!(e.score > 0)) continue;
    const Eigen::VectorXd follow = -(scale.asDiagonal() * own.solve(scale.asDiagonal() * sum.normal(known, absent[k])));
    AbsentTerm t{&term_of(parameters[static_cast<std::size_t>(j)], all), e.score, e.coefficient[0], e.sd,
                 Eigen::VectorXd::Zero(static_cast<Eigen::Index>(rotor.size()))};
    for (std::size_t i = 0; i < rotor.size(); ++i) {
      if (rotor[i] >= 0) t.moves[static_cast<Eigen::Index>(i)] = follow[rotor[i]];
    }
    out.push_back(std::move(t));
  }
  return out;
}

}  // namespace whirl::identification::detail
