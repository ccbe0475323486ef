#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fit/evidence.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/shaft/modes.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr Index kBlocks = 120;    // of a run that is only thought of
constexpr double kPassed = 1.15;  // a critical speed is passed where the run ends so far above it
constexpr double kHighest = 3;    // times the highest speed: no further critical speed is looked for

struct Candidate {
  std::string words;
  double highest = 0;  ///< of its speeds, rad/s
  std::optional<Trial> trial;
};

std::vector<Candidate> candidates(const FitProblem& problem, const VectorXd& t) {
  const ParameterSet& set = problem.model().parameters();
  std::vector<Candidate> list;
  double size = 0;
  for (Index k = 0; k < set.stations; ++k) size = std::max(size, std::abs(set.complex_value(t, set.unbalance + 2 * k)));
  for (Index k = 0; k < set.stations; ++k) {
    const double at = problem.model().drawn().unbalances[static_cast<std::size_t>(k)].position;
    list.push_back({fmt::format("a trial mass of {:.3g} gmm at {:.4g} mm", 1e6 * size, 1e3 * at), set.highest,
                    Trial{"next", at, size, 0}});
  }
  const Rotor rotor = with_values(problem.model().drawn(), set, t, true);
  for (const Critical& c : criticals(assemble(rotor), kHighest * set.highest)) {
    if (c.direction < 0 || c.speed * kPassed <= set.highest) continue;
    list.push_back({fmt::format("a run up to {:.0f} rpm, through the critical speed of {:.0f} rpm",
                                kPassed * c.speed * kRpmPerRadPerSec, c.speed * kRpmPerRadPerSec),
                    kPassed * c.speed, std::nullopt});
    break;
  }
  list.push_back({"the same run again", set.highest, std::nullopt});
  return list;
}

/// Information of a run that is only thought of: steady, as noisy as those made.
MatrixXd expected(const FitProblem& problem, const VectorXd& t, const Candidate& c) {
  const FitModel& model = problem.model();
  const ParameterSet& set = model.parameters();
  std::vector<Trial> trials = model.trials();
  std::shared_ptr<FitModel> with;
  if (c.trial) {
    trials.push_back(*c.trial);
    with = std::make_shared<FitModel>(model.drawn(), set, trials, t, model.modes());
  } else {
    with = std::make_shared<FitModel>(model);
  }
  const OrderRun& like = problem.runs().front();
  std::vector<OrderRun> runs(1);
  runs[0].name = "next";
  runs[0].speed = VectorXd::LinSpaced(kBlocks, set.lowest, c.highest);
  runs[0].samples = VectorXd::Constant(kBlocks, like.samples.sum() / kBlocks);
  runs[0].vectors = Eigen::MatrixXcd::Zero(set.probes, kBlocks);
  FitProblem next(with, runs);
  for (Index p = 0; p < set.probes; ++p) next.set_noise(0, p, problem.noise(0, p));
  return next.information_at(t);
}

VectorXd half_widths(const MatrixXd& information, const VectorXd& units) {
  return 1.959964 * inverse(information).diagonal().cwiseMax(0).cwiseSqrt().cwiseProduct(units);
}

}  // namespace

std::vector<NextRun> next_runs(const FitProblem& problem, const VectorXd& t, const VectorXd& units) {
  const ParameterSet& set = problem.model().parameters();
  const MatrixXd now = open_information(set, problem.information(), units);
  const VectorXd before = half_widths(now, units);
  Index worst = 0;
  before.maxCoeff(&worst);
  std::vector<NextRun> list;
  for (const Candidate& c : candidates(problem, t)) {
    const VectorXd after = half_widths(now + expected(problem, t, c), units);
    list.push_back({c.words, set.all[static_cast<std::size_t>(worst)].name, after[worst], before[worst]});
  }
  std::ranges::stable_sort(list, {}, &NextRun::half_width);
  return list;
}

}  // namespace whirl::shaft
