#include "near_repeats.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/nan.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

bool nearly_same(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) {
  for (Index p = 0; p < a.size(); ++p) {
    const double one = std::abs(a[p]), other = std::abs(b[p]), larger = std::max(one, other);
    if (std::abs(one - other) > kNearMass * larger) return false;
    if (larger > 0 && std::abs(std::arg(a[p] * std::conj(b[p]))) > kNearAngle) return false;
  }
  return true;
}

}  // namespace

std::vector<std::vector<std::size_t>> near_repeats(const BalancingJob& job, const std::vector<bool>& used) {
  std::vector<std::vector<std::size_t>> groups;
  for (std::size_t r = 0; r < job.runs.size(); ++r) {
    if (!used[r]) continue;
    const auto same = std::find_if(groups.begin(), groups.end(), [&](const auto& group) {
      return nearly_same(job.runs[group.front()].masses, job.runs[r].masses);
    });
    if (same == groups.end())
      groups.push_back({r});
    else
      same->push_back(r);
  }
  return groups;
}

RepeatScatter repeat_scatter(const BalancingJob& job, const InfluenceFit& fit, const RunDesign& design) {
  RepeatScatter result;
  double sum = 0, freedom = 0, level = 0, readings = 0, most = 0;
  for (const std::vector<std::size_t>& group : near_repeats(job, fit.used)) {
    double own = 0, own_freedom = 0;
    for (Index m = 0; m < static_cast<Index>(job.rows.size()); ++m) {
      std::vector<std::complex<double>> at_first;  // as if all had the masses of the first
      for (const std::size_t r : group) {
        const BalancingRun& run = job.runs[r];
        if (std::isnan(std::abs(run.vibration[m]))) continue;
        const Eigen::VectorXcd more = run.masses - job.runs[group.front()].masses;
        at_first.push_back(run.vibration[m] - fit.drift[m] * (run.time - design.reference) -
                           (fit.influence.row(m) * more)(0));
        level += std::norm(run.vibration[m]);
        readings += 1;
      }
      if (at_first.size() < 2) continue;
      std::complex<double> mean = 0;
      for (const auto& v : at_first) mean += v / static_cast<double>(at_first.size());
      for (const auto& v : at_first) own += std::norm(v - mean);
      own_freedom += static_cast<double>(at_first.size()) - 1;
    }
    sum += own;
    freedom += own_freedom;
    if (own_freedom > 0 && own / own_freedom > most) most = own / own_freedom, result.worst = group;
  }
  result.sd = freedom > 0 ? std::sqrt(sum / (2 * freedom)) : kNaN;
  result.share = freedom > 0 && level > 0 ? std::sqrt(sum / freedom / (level / readings)) : kNaN;
  return result;
}

}  // namespace whirl::diagnosis
