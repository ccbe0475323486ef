#include "whirl/modal/stiffness.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "blows/cubic_fit.hpp"
#include "blows/lack_of_fit.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/magnitude.hpp"

namespace whirl::modal {
namespace {

Estimate with_interval(double value, double sd, double t) { return {value, sd, value - t * sd, value + t * sd}; }

// Force at deflection `at` on a branch given by points ascending in deflection.
double interpolate(const std::vector<std::pair<double, double>>& branch, double at) {
  const auto upper = std::lower_bound(branch.begin(), branch.end(), std::pair<double, double>{at, -INFINITY});
  if (upper == branch.begin()) return upper->second;
  const auto lower = upper - 1;
  if (upper == branch.end() || upper->first == lower->first) return lower->second;
  const double share = (at - lower->first) / (upper->first - lower->first);
  return lower->second + share * (upper->second - lower->second);
}

// Largest difference of the residual (which is flat, so linear interpolation is exact enough) between the points where
// the deflection grows and those where it falls, over the range both cover. 0 when there is one direction only.
double branch_difference(const Eigen::VectorXd& d, const Eigen::VectorXd& residual) {
  std::vector<std::pair<double, double>> branches[2];
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    const bool rises = i > 0 ? d[i] > d[i - 1] : d[1] > d[0];
    const bool turns = i > 0 && i + 1 < d.size() && (d[i] - d[i - 1]) * (d[i + 1] - d[i]) < 0;
    branches[rises ? 0 : 1].emplace_back(d[i], residual[i]);
    if (turns) branches[rises ? 1 : 0].emplace_back(d[i], residual[i]);
  }
  if (branches[0].size() < 2 || branches[1].size() < 2) return 0;
  for (auto& branch : branches) std::sort(branch.begin(), branch.end());
  const double low = std::max(branches[0].front().first, branches[1].front().first);
  const double high = std::min(branches[0].back().first, branches[1].back().first);
  double largest = 0;
  for (int b = 0; b < 2; ++b) {
    for (const auto& [at, value] : branches[b]) {
      if (at >= low && at <= high) largest = std::max(largest, std::abs(value - interpolate(branches[1 - b], at)));
    }
  }
  return largest;
}

/// What is to be said of a law, its fit and the table. `ds` m, the largest deflection, and `fs` N are the fit's units.
void judge(StiffnessLaw& law, const CubicFit& fit, const StiffnessOptions& options, double ds, double fs) {
  const Eigen::Index n = fit.residual.size();
  const double freedom = fit.freedom();
  if (freedom < 3) law.summary.warn(fmt::format("only {} more points than parameters: wide intervals", freedom));
  if (law.cubic_p_value > 0.05) {
    law.summary.warn(fmt::format("cubic term not significant (p = {:.2g}): a larger deflection is needed to see it",
                                 law.cubic_p_value));
  }
  if (options.fit_offset && (law.offset.low > 0 || law.offset.high < 0)) {
    law.summary.warn(fmt::format("deflection at zero force is {:.3g} m, significantly not zero", law.offset.value));
  }
  // The largest of n differences of two noisy values stays below about 4 sqrt(2) standard deviations.
  // Hysteresis inflates the scatter itself, so it is compared with the scatter between neighbours of one branch.
  double steps = 0;
  for (Eigen::Index i = 1; i < n; ++i) steps += std::pow((fit.residual[i] - fit.residual[i - 1]) * fs, 2);
  const double scatter = freedom > 0 ? std::sqrt(fit.cost / freedom) * fs : 0;
  const double neighbour = std::min(scatter, std::sqrt(steps / static_cast<double>(2 * (n - 1))));
  if (law.hysteresis > 5.6 * neighbour && law.hysteresis > 1e-9 * fs) {
    law.summary.warn(fmt::format("loading and unloading differ by up to {:.3g} N", law.hysteresis));
  }
  // Last, as what makes the numbers unusable.
  if (!fit.converged) law.summary.fail("stiffness fit did not converge");
  if (law.k1.value <= 0) law.summary.fail("linear stiffness is not positive: check the signs of the table");
  if (ds > 0.2)
    law.summary.fail(fmt::format(
        "deflections up to {:.3g} m ({:.3g} mm): no shaft is pulled that far; is their unit mm, not m (or um, not mm)?",
        ds, 1e3 * ds));
}

constexpr double kOutlierChance = 1e-3;  // of one table without an outlier

Eigen::VectorXd all_but(const Eigen::Ref<const Eigen::VectorXd>& v, const std::vector<Eigen::Index>& odd) {
  std::vector<double> kept;
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    if (std::find(odd.begin(), odd.end(), i) == odd.end()) kept.push_back(v[i]);
  }
  return Eigen::Map<const Eigen::VectorXd>(kept.data(), static_cast<Eigen::Index>(kept.size()));
}

// With the noise of the gauge known, that of the force follows from what is left.
CubicFit fit_with_gauge(const Eigen::VectorXd& x, const Eigen::VectorXd& f, Eigen::Index parameters, double gauge) {
  const CubicFit plain = fit_cubic(x, f, parameters, 0);
  if (!(gauge > 0) || plain.freedom() < 1 || plain.cost < 1e-20 * f.squaredNorm()) return plain;
  double low = 0, high = 1e6 / std::abs(plain.p[0]);  // of the ratio: the cost in units of the gauge's noise grows
  CubicFit fit = plain;
  for (int i = 0; i < 60; ++i) {
    const double ratio = i == 0 ? high : std::sqrt(std::max(low, 1e-9 * high) * high);
    fit = fit_cubic(x, f, parameters, ratio);
    const double force_sd = std::sqrt(fit.cost / fit.freedom());
    if (ratio * force_sd > gauge) {
      high = ratio;
    } else {
      low = ratio;
      if (i == 0) break;  // less is left than the gauge alone explains
    }
    if (high < 1.0001 * low) break;
  }
  return fit;
}

/// The same table where the force, not the gauge, has another zero: F = f0 + K1 d + K2 d^3.
struct ForceZero {
  double zero = 0;        ///< f0
  Eigen::Vector2d p, sd;  ///< K1, K2
  double cost = 0;
};

ForceZero fit_force_zero(const Eigen::VectorXd& x, const Eigen::VectorXd& f, double gauge) {
  ForceZero out;
  CubicFit fit;
  for (int i = 0; i < 20; ++i) {  // linear but for the weights
    fit = fit_with_gauge(x, f.array() - out.zero, 2, gauge);
    Eigen::MatrixXd jacobian(x.size(), 3);
    jacobian << fit.jacobian, fit.weight;
    const Eigen::Vector3d step = jacobian.colPivHouseholderQr().solve(fit.weight.cwiseProduct(fit.residual));
    out.zero += step[2];
    out.p = fit.p.head<2>();
    out.cost = fit.cost;
    const double variance = fit.cost / std::max(1.0, static_cast<double>(x.size() - 3));
    out.sd = (variance * inverse(Eigen::MatrixXd(jacobian.transpose() * jacobian)).diagonal().head<2>()).cwiseSqrt();
    if (std::abs(step[2]) < 1e-9 * f.cwiseAbs().maxCoeff()) break;
  }
  return out;
}

void cover(const Estimate& other, double t, Estimate& e) {
  e.low = std::min(e.low, other.low);
  e.high = std::max(e.high, other.high);
  e.sd = std::max({e.sd, (e.high - e.value) / t, (e.value - e.low) / t});
}

/// An offset bends a table that pulls to one side alike whether it is the gauge's or the force's (a load cell that does
/// not read zero, friction): where the table does not tell, the intervals cover both readings.
void cover_force_zero(const Eigen::VectorXd& x, const Eigen::VectorXd& f, const CubicFit& fit, double gauge, double ds,
                      double fs, double t, StiffnessLaw& law) {
  constexpr double kToldApart = 9;  // likelihood ratio: three deviations
  const double freedom = fit.freedom();
  if (freedom < 1 || !(law.offset.low > 0 || law.offset.high < 0)) return;
  const ForceZero other = fit_force_zero(x, f, gauge);
  const double least = 1e-20 * f.squaredNorm();
  const double worse = freedom * std::log(std::max(other.cost, least) / std::max(fit.cost, least));
  if (worse > kToldApart) return;
  const Estimate k1 = with_interval(other.p[0] * fs / ds, other.sd[0] * fs / ds, t),
                 k2 = with_interval(other.p[1] * fs / std::pow(ds, 3), other.sd[1] * fs / std::pow(ds, 3), t);
  cover(k1, t, law.k1);
  cover(k2, t, law.k2);
  law.cubic_p_value =
      std::max(law.cubic_p_value, 2 * students_t_tail(std::max(1.0, freedom), std::abs(k2.value) / k2.sd));
  law.summary.warn(fmt::format(
      "a zero offset of the force of {:.3g} N {} an offset of the gauge (K1 {:.5g} N/m, K2 {:.4g} N/m^3 with it): the "
      "intervals cover both; readings to both sides, or a force that reads zero at rest, decide",
      other.zero * fs, worse < -kToldApart ? "explains the table better than" : "explains the table as well as",
      k1.value, k2.value));
}

void require_table(const Eigen::Ref<const Eigen::VectorXd>& deflection,
                   const Eigen::Ref<const Eigen::VectorXd>& force) {
  const Eigen::Index n = deflection.size();
  if (force.size() != n) {
    throw Error(
        fmt::format("force-deflection table with {} deflections and {} forces: must be equally many", n, force.size()));
  }
  if (!deflection.allFinite() || !force.allFinite()) throw Error("force-deflection table: every value must be finite");
  const std::set<double> distinct(deflection.data(), deflection.data() + n);
  if (distinct.size() < 4) {
    throw Error(
        fmt::format("force-deflection table with {} different deflections: must have at least 4", distinct.size()));
  }
}

}  // namespace

StiffnessLaw fit_stiffness(const Eigen::Ref<const Eigen::VectorXd>& deflection,
                           const Eigen::Ref<const Eigen::VectorXd>& force, const StiffnessOptions& options) {
  require_table(deflection, force);
  require_range("confidence", options.confidence, 0.5, 0.999999);
  const Eigen::Index n = deflection.size(), parameters = options.fit_offset ? 3 : 2;

  // Scaled to deflection and force of order 1, so that the parameters are comparable.
  const double ds = deflection.cwiseAbs().maxCoeff();
  const double fs = std::max(force.cwiseAbs().maxCoeff(), 1e-300);
  const Eigen::VectorXd x = deflection / ds;
  const Eigen::VectorXd f = force / fs;

  StiffnessLaw law;
  for (const int sign : {1, -1}) {
    const std::vector<Eigen::Index> limit = at_limit(x, force, sign);
    if (limit.empty()) continue;
    law = fit_stiffness(all_but(deflection, limit), all_but(force, limit), options);
    law.summary.warn(fmt::format("the force reads {:.4g} N at {} points: a load cell at its limit? They are left out",
                                 force[limit.front()], limit.size()));
    return law;
  }
  const std::vector<Eigen::Index> odd =
      options.leave_out_outliers ? outliers_of(x, f, parameters, kOutlierChance) : std::vector<Eigen::Index>{};
  if (!odd.empty()) {
    StiffnessOptions without = options;
    without.leave_out_outliers = false;
    law = fit_stiffness(all_but(deflection, odd), all_but(force, odd), without);
    for (const Eigen::Index i : odd) {
      law.summary.warn(fmt::format("point {} ({:.4g} m, {:.4g} N) lies far off the law of the others: left out", i + 1,
                                   deflection[i], force[i]));
    }
    return law;
  }
  const CubicFit fit = fit_with_gauge(x, f, parameters, options.deflection_sd / ds);
  const Eigen::Vector3d& p = fit.p;
  const Eigen::MatrixXd& jacobian = fit.jacobian;
  const double freedom = fit.freedom();
  const double variance = freedom > 0 ? fit.cost / freedom : 0;
  const Eigen::MatrixXd information = jacobian.transpose() * jacobian;
  const Eigen::MatrixXd covariance = variance * inverse(information);
  const double least = std::max(freedom, 1.0);
  const double t = students_t_quantile(least, 0.5 + options.confidence / 2);
  Eigen::VectorXd unit = information.diagonal().cwiseSqrt().cwiseInverse();

  const LackOfFit lack = lack_of_fit(x, fit.residual, fit.weight, jacobian, p[2]);
  const Eigen::VectorXd sd =
      (lack.widening * lack.widening * covariance.diagonal().array() + lack.shift.array().square()).sqrt();

  law.points = n;
  law.k1 = with_interval(p[0] * fs / ds, sd[0] * fs / ds, t);
  law.k2 = with_interval(p[1] * fs / std::pow(ds, 3), sd[1] * fs / std::pow(ds, 3), t);
  law.offset = options.fit_offset ? with_interval(p[2] * ds, sd[2] * ds, t) : Estimate{0, 0, 0, 0};
  const double sd_k2 = sd[1];
  law.cubic_p_value = sd_k2 > 0 ? 2 * students_t_tail(least, std::abs(p[1]) / sd_k2) : (p[1] == 0 ? 1.0 : 0.0);
  law.hysteresis = branch_difference(deflection, fit.residual * fs);

  law.summary.residual = std::sqrt(fit.cost / static_cast<double>(n)) * fs;
  const Eigen::MatrixXd scaled = unit.asDiagonal() * information * unit.asDiagonal();
  const Eigen::VectorXd eigenvalues = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(scaled).eigenvalues();
  law.summary.condition_number = std::sqrt(eigenvalues.maxCoeff() / std::max(eigenvalues.minCoeff(), 1e-300));
  law.summary.trust = fmt::format("force within {:.3g} N rms for deflections from {:.4g} to {:.4g} m",
                                  law.summary.residual, deflection.minCoeff(), deflection.maxCoeff());
  if (options.fit_offset) cover_force_zero(x, f, fit, options.deflection_sd / ds, ds, fs, t, law);
  judge(law, fit, options, ds, fs);
  if (!lack.law.empty()) {
    Eigen::Index at = 0;
    const double most = fit.residual.cwiseAbs().maxCoeff(&at) * fs;
    law.summary.warn(
        fmt::format("the force does not follow k1 d + k2 d^3: {}; up to {:.3g} N off, at {:.3g} m: K1 and K2 are those "
                    "of the whole range, their intervals are widened",
                    lack.law, most, deflection[at]));
  }
  return law;
}

AnisotropicStiffness fit_anisotropic_stiffness(const std::vector<DirectedStiffnessTable>& tables,
                                               const StiffnessOptions& options) {
  AnisotropicStiffness result;
  const auto n = static_cast<Eigen::Index>(tables.size());
  if (n < 2) throw Error(fmt::format("stiffness in {} directions: must be at least 2", n));
  Eigen::MatrixXd basis(n, 3);
  Eigen::VectorXd k(n);
  Eigen::VectorXd weight(n);
  double mean_sd = 0;
  for (const auto& table : tables) {
    result.laws.push_back(fit_stiffness(table.deflection, table.force, options));
    mean_sd += result.laws.back().k1.sd / static_cast<double>(n);
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    const auto& law = result.laws[static_cast<std::size_t>(i)];
    const double angle = tables[static_cast<std::size_t>(i)].angle;
    basis.row(i) << 1, std::cos(2 * angle), std::sin(2 * angle);
    k[i] = law.k1.value;
    // A table without scatter must not own the fit.
    weight[i] = 1 / std::max({law.k1.sd, 0.1 * mean_sd, 1e-12 * std::abs(law.k1.value)});
    if (law.summary.status == Status::unusable)
      result.summary.fail(fmt::format("table {}: {}", i + 1, law.summary.reason));
  }
  Eigen::Index columns = 3;
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> rank(basis);
  rank.setThreshold(1e-6);
  if (rank.rank() < 3) {
    columns = 2;
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> rank2(basis.leftCols(2));
    rank2.setThreshold(1e-6);
    if (rank2.rank() < 2) throw Error("stiffness tables must pull in at least two different directions along x and y");
    result.summary.warn("directions do not show the coupling Kxy: taken as zero");
  }
  const Eigen::MatrixXd a = weight.asDiagonal() * basis.leftCols(columns);
  const Eigen::MatrixXd covariance = inverse(a.transpose() * a);
  Eigen::VectorXd p = Eigen::VectorXd::Zero(3);
  p.head(columns) = covariance * (a.transpose() * weight.cwiseProduct(k));
  result.mean = Estimate::from_sd(p[0], std::sqrt(covariance(0, 0)));
  const double amplitude = std::hypot(p[1], p[2]);
  result.axis = 0.5 * std::atan2(p[2], p[1]);
  Eigen::VectorXd direction(columns - 1);
  direction[0] = amplitude > 0 ? p[1] / amplitude : 1;
  if (columns == 3) direction[1] = amplitude > 0 ? p[2] / amplitude : 0;
  const Eigen::MatrixXd block = covariance.bottomRightCorner(columns - 1, columns - 1);
  result.amplitude = magnitude_estimate(amplitude, std::sqrt(direction.dot(block * direction)));
  const Eigen::VectorXd anisotropy = p.segment(1, columns - 1);
  const double statistic = anisotropy.dot(block.inverse() * anisotropy);
  result.p_value = chi_squared_tail(static_cast<double>(columns - 1), statistic);
  result.summary.residual = (weight.cwiseProduct(basis * p - k)).norm() / std::sqrt(static_cast<double>(n));
  if (result.p_value < 0.05) {
    result.summary.warn(
        fmt::format("shaft is anisotropic: stiffness differs by {:.3g} % between its principal directions",
                    200 * amplitude / p[0]));
  }
  return result;
}

}  // namespace whirl::modal
