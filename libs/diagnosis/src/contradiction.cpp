#include "contradiction.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <boost/math/distributions/chi_squared.hpp>
#include <boost/math/distributions/fisher_f.hpp>
#include <cmath>
#include <numbers>

#include "whirl/core/decompositions.hpp"
#include "whirl/core/error.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

struct Slip {
  std::string text;
  Eigen::VectorXcd masses, vibration;
};

/// The usual slips of the bench, as what would then have been on the rotor or read.
std::vector<Slip> usual_slips(const BalancingJob& job, std::size_t r) {
  const BalancingRun& run = job.runs[r];
  const auto planes = static_cast<Index>(job.planes.size()), rows = static_cast<Index>(job.rows.size());
  std::vector<Slip> slips;
  const auto masses = [&](std::string text, Eigen::VectorXcd w) {
    if ((w - run.masses).norm() > 1e-9 * (w.norm() + run.masses.norm()))
      slips.push_back({std::move(text), std::move(w), run.vibration});
  };
  const auto readings = [&](std::string text, Eigen::VectorXcd v) {
    slips.push_back({std::move(text), run.masses, std::move(v)});
  };
  for (Index p = 0; p < planes; ++p) {
    const std::string& plane = job.planes[static_cast<std::size_t>(p)];
    if (run.masses[p] == 0.0) continue;
    const auto changed = [&](std::complex<double> w) {
      Eigen::VectorXcd all = run.masses;
      all[p] = w;
      return all;
    };
    masses(fmt::format("plane {} carried nothing", plane), changed(0));
    masses(fmt::format("the mass of plane {} was on the opposite side", plane), changed(-run.masses[p]));
    masses(fmt::format("the angle of plane {} was counted the other way", plane), changed(std::conj(run.masses[p])));
    for (const double quarter : {1.0, -1.0})
      masses(fmt::format("the mass of plane {} was {} deg from where it is written", plane, quarter * 90),
             changed(run.masses[p] * std::complex<double>(0, quarter)));
    masses(fmt::format("plane {} carried twice the mass written", plane), changed(2.0 * run.masses[p]));
    masses(fmt::format("plane {} carried half of the mass written", plane), changed(0.5 * run.masses[p]));
    for (Index q = 0; q < planes; ++q) {
      if (q == p) continue;
      Eigen::VectorXcd all = run.masses;
      std::swap(all[p], all[q]);
      masses(fmt::format("the mass of plane {} was on plane {}", plane, job.planes[static_cast<std::size_t>(q)]), all);
    }
  }
  if ((run.masses.array() != std::complex<double>()).count() > 1) {
    masses("every mass was on the opposite side", -run.masses);
    masses("every angle was counted the other way", run.masses.conjugate());
    masses("every plane carried twice the mass written", 2 * run.masses);
    masses("every plane carried half of the mass written", 0.5 * run.masses);
  }
  if (r > 0) masses("the masses of the run before were still on the rotor", run.masses + job.runs[r - 1].masses);
  masses("the rotor carried none of the masses written", Eigen::VectorXcd::Zero(planes));
  readings("its phases were read with the other sign", run.vibration.conjugate());
  readings("its amplitudes are twice too large (peak-to-peak read as zero-to-peak)", 0.5 * run.vibration);
  readings("its amplitudes are half of the others' (zero-to-peak read as peak-to-peak)", 2.0 * run.vibration);
  readings("its phases are 180 deg off (the other edge or probe side)", -run.vibration);
  for (Index a = 0; a < rows; ++a) {
    for (Index b = a + 1; b < rows; ++b) {
      Eigen::VectorXcd v = run.vibration;
      std::swap(v[a], v[b]);
      readings(fmt::format("the readings of {} and {} were exchanged", job.rows[static_cast<std::size_t>(a)],
                           job.rows[static_cast<std::size_t>(b)]),
               v);
    }
  }
  return slips;
}

}  // namespace

ContradictionSearch::Difference ContradictionSearch::difference(const InfluenceFit& fit, std::size_t run,
                                                                const Eigen::VectorXcd& masses,
                                                                const Eigen::VectorXcd& vibration) const {
  Difference d;
  const Eigen::RowVectorXcd x = design_.row(job_.runs[run], masses);
  double freedom = 0;
  std::vector<double> seen;
  for (Index m = 0; m < fit.baseline.size(); ++m) {
    if (std::isnan(std::abs(vibration[m])) || !(fit.noise[m] > 0)) continue;
    std::complex<double> expected = fit.baseline[m] + (fit.influence.row(m) * masses)(0);
    if (fit.with_drift) expected += fit.drift[m] * x[1];
    const double leverage =
        (x.conjugate() * fit.cofactor[static_cast<std::size_t>(m)].conjugate() * x.transpose())(0, 0).real();
    d.square += std::norm(vibration[m] - expected) / (2 * fit.noise[m] * fit.noise[m] * (1 + std::max(0.0, leverage)));
    d.freedom += 2;
    const auto s = static_cast<double>(fit.speed[static_cast<std::size_t>(m)]);
    if (std::find(seen.begin(), seen.end(), s) == seen.end()) {
      seen.push_back(s);
      freedom += fit.freedom[m];
    }
  }
  d.tested = d.freedom > 0 && freedom > 0;
  if (!d.tested) return d;
  const double statistic = 2 * d.square / d.freedom;
  d.chance = std::isinf(freedom)
                 ? boost::math::cdf(boost::math::complement(boost::math::chi_squared(d.freedom), 2 * d.square))
                 : boost::math::cdf(boost::math::complement(boost::math::fisher_f(d.freedom, freedom), statistic));
  return d;
}

Contradiction ContradictionSearch::name_slip(const InfluenceFit& others, std::size_t run,
                                             const Difference& as_written) const {
  Contradiction c;
  c.run = static_cast<int>(run);
  double best = as_written.square;
  for (const Slip& slip : usual_slips(job_, run)) {
    const Difference d = difference(others, run, slip.masses, slip.vibration);
    if (!d.tested || d.square >= best || d.chance < 1e-4) continue;
    best = d.square;
    c.slip = slip.text;
  }
  c.explained = 1 - best / as_written.square;
  return c;
}

/// All angles counted the other way: the same runs with conjugated masses leave a far smaller sum of squares.
void ContradictionSearch::test_reversed(const std::vector<bool>& used) {
  BalancingJob reversed = job_;
  for (BalancingRun& run : reversed.runs) run.masses = run.masses.conjugate();
  const InfluenceFit plain = solve_runs(job_, design_, used, 0), other = solve_runs(reversed, design_, used, 0);
  double ratio = 0;
  for (Index m = 0; m < plain.noise.size(); ++m) {
    if (!(plain.freedom[m] > 0)) return;
    ratio += std::log(plain.noise[m] / std::max(other.noise[m], 1e-300 + 1e-9 * plain.noise[m]));
  }
  double freedom = 0;
  for (Index m = 0; m < plain.noise.size(); ++m)
    freedom += plain.freedom[m] / static_cast<double>(std::count(plain.speed.begin(), plain.speed.end(),
                                                                 plain.speed[static_cast<std::size_t>(m)]));
  // Mean log ratio of the standard deviations times the degrees of freedom: a likelihood ratio.
  angles_reversed_ = freedom * ratio / static_cast<double>(plain.noise.size()) > 12;
}

std::vector<ContradictionSearch::LeftOut> ContradictionSearch::leave_out_each(const std::vector<bool>& kept) {
  std::vector<LeftOut> tests;
  untested_.clear();
  for (std::size_t r = 0; r < job_.runs.size(); ++r) {
    if (!kept[r]) continue;
    std::vector<bool> without = kept;
    without[r] = false;
    bool told = true;
    for (std::size_t m = 0; m < job_.rows.size() && told; ++m) {
      const Eigen::MatrixXcd x = design_.rows_of(job_, static_cast<Index>(m), without);
      Eigen::ColPivHouseholderQR<Eigen::MatrixXcd> qr(x);
      qr.setThreshold(1e-6);
      told = x.rows() >= x.cols() && qr.rank() == x.cols();
    }
    LeftOut test;
    test.run = r;
    if (told) {
      test.others = solve_runs(job_, design_, without, options_.noise);
      test.difference = difference(test.others, r, job_.runs[r].masses, job_.runs[r].vibration);
    }
    if (!test.difference.tested) {
      untested_.push_back(job_.runs[r].name);
      continue;
    }
    const InfluenceFit free = options_.noise > 0 ? solve_runs(job_, design_, without, 0) : test.others;
    for (Index m = 0; m < free.noise.size(); ++m) {
      const auto rows = static_cast<double>(
          std::count(free.speed.begin(), free.speed.end(), free.speed[static_cast<std::size_t>(m)]));
      if (free.freedom[m] > 0) test.misfit += free.freedom[m] / rows * 2 * std::log(std::max(free.noise[m], 1e-300));
    }
    tests.push_back(std::move(test));
  }
  return tests;
}

Contradiction ContradictionSearch::choose(const std::vector<LeftOut>& tests, std::size_t worst) const {
  // Runs whose absence leaves the rest in no visibly worse agreement: a difference of 12 in -2 log likelihood.
  constexpr double kAlike = 12;
  std::vector<Contradiction> named;
  for (std::size_t k = 0; k < tests.size(); ++k) {
    if (k != worst && tests[k].misfit - tests[worst].misfit > kAlike) continue;
    named.push_back(name_slip(tests[k].others, tests[k].run, tests[k].difference));
    named.back().chance = tests[k].difference.chance * static_cast<double>(tests.size());
    if (k == worst) std::swap(named.front(), named.back());
  }
  const auto with_slip = [](const Contradiction& c) { return !c.slip.empty(); };
  if (std::count_if(named.begin(), named.end(), with_slip) == 1)
    return *std::find_if(named.begin(), named.end(), with_slip);
  for (std::size_t k = 1; k < named.size(); ++k) named[0].or_run.push_back(named[k].run);
  return named[0];
}

std::vector<Contradiction> ContradictionSearch::run(std::vector<bool>& used) {
  std::vector<Contradiction> found;
  test_reversed(used);
  std::vector<bool> kept = used;
  while (!angles_reversed_ && found.size() < job_.runs.size() / 3) {
    const std::vector<LeftOut> tests = leave_out_each(kept);
    if (tests.empty()) break;
    double smallest = 1;
    for (const LeftOut& t : tests)
      smallest = std::min(smallest, t.difference.chance * static_cast<double>(tests.size()));
    if (!(smallest < options_.alarm)) break;
    std::size_t worst = 0;
    for (std::size_t k = 1; k < tests.size(); ++k)
      if (tests[k].misfit < tests[worst].misfit) worst = k;
    found.push_back(choose(tests, worst));
    kept[static_cast<std::size_t>(found.back().run)] = false;
    if (!found.back().or_run.empty()) break;
  }
  if (options_.exclude) used = kept;
  return found;
}

}  // namespace whirl::diagnosis
