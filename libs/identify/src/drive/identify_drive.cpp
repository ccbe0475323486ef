#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "drive/drive_model.hpp"
#include "evidence/verdict.hpp"
#include "rules/rules.hpp"
#include "weak/integral_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/drive.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification {
namespace {

constexpr std::size_t kEps = 3, kMotor = 5, kSlope = 6, kCoulomb = 7, kViscous = 8, kDrag = 9, kReaction = 10;

/// A record with all channels of the fit and the states read from it.
struct DriveRecord {
  Recording record;
  Eigen::MatrixXd states;  // samples x 6
  Eigen::VectorXd drive;
  AngleSignal angle;
};

DriveRecord prepared(const Recording& in, const DriveOptions& o, const std::string& drive) {
  DriveRecord out;
  const RotorRecord rotor = rotor_record(in, o.rotor.record);
  if (rotor.summary.status == Status::unusable) throw Error(fmt::format("{}: {}", in.source, rotor.summary.reason));
  const Eigen::Index n = rotor.size();
  out.angle = rotor.angle;
  out.record.dt = rotor.dt;
  out.record.t0 = rotor.t0;
  out.record.source = in.source;
  out.record.add(o.rotor.record.x, Quantity::displacement, rotor.z.real());
  out.record.add(o.rotor.record.y, Quantity::displacement, rotor.z.imag());
  out.record.add(o.rotor.record.angle, Quantity::angle,
                 in.has(o.rotor.record.angle) ? in[o.rotor.record.angle] : Eigen::VectorXd());
  Eigen::VectorXd& beta = out.record.channels.back().samples;
  for (Eigen::Index i = 0; i < n; ++i) {  // turns of an encoder that begins anew are the angle's
    const double at = rotor.angle.beta[2 * i];
    beta[i] = at + std::remainder(beta[i] - at, 2 * std::numbers::pi);
  }
  out.drive = in.has(drive) ? in[drive] : Eigen::VectorXd::Zero(n);
  if (!drive.empty()) out.record.add(drive, Quantity::dimensionless, out.drive);
  out.states.resize(n, 6);
  for (int axis = 0; axis < 2; ++axis) {
    const Eigen::VectorXd& d = out.record.channels[static_cast<std::size_t>(axis)].samples;
    const signal::SmoothedSignal s = detail::without_noise(d, rotor.dt, signal::noise_sd(d));
    out.states.col(2 * axis) = s.value;
    out.states.col(2 * axis + 1) = s.first;
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    out.states(i, 4) = rotor.angle.beta[2 * i];
    out.states(i, 5) = rotor.angle.omega[2 * i];
  }
  return out;
}

/// Torque constants that the records tell: columns of the acceleration that are not the same.
struct Told {
  bool motor = false, slope = false, coulomb = true;
  std::string joined;  // what was joined, as a sentence
};

Told told_by(const std::vector<DriveRecord>& records) {
  bool on = false, off = false;
  double low = INFINITY, high = -INFINITY;
  for (const DriveRecord& r : records) {
    on = on || (r.drive.array() != 0).any();
    off = off || (r.drive.array() == 0).any();
    low = std::min(low, r.drive.minCoeff());
    high = std::max(high, r.drive.maxCoeff());
  }
  Told told;
  told.motor = on;
  told.slope = on && off;
  told.coulomb = !on || high - low > 1e-3 * std::max(std::abs(high), std::abs(low));
  if (on && !told.slope) told.joined = "the motor is never off: viscous is C_v + C_m2";
  if (!told.coulomb) told.joined += "; the drive has one level: motor is C_m1 - C_c / drive";
  return told;
}

/// Torque constants by least squares on the angle's acceleration.
void start_torques(const std::vector<DriveRecord>& records, const std::string& drive, const Told& told,
                   std::vector<double>& values) {
  std::vector<std::size_t> columns{kViscous, kDrag, kReaction};
  if (told.coulomb) columns.push_back(kCoulomb);
  if (told.motor) columns.push_back(kMotor);
  if (told.slope) columns.push_back(kSlope);
  Eigen::Index rows = 0;
  for (const DriveRecord& r : records) rows += r.drive.size();
  Eigen::MatrixXd a(rows, static_cast<Eigen::Index>(columns.size()));
  Eigen::VectorXd b(rows);
  const expr::Tape reaction =
      expr::compile({detail::with_values(detail::drive_rates(drive).reaction, values)}, {"X1", "X2", "X3", "X4", "X5"});
  Eigen::Index row = 0;
  for (const DriveRecord& r : records) {
    const Eigen::VectorXd bracket = reaction.evaluate(r.states.leftCols(5)).col(0);
    for (Eigen::Index i = 0; i < r.drive.size(); ++i, ++row) {
      const double n = r.states(i, 5), u = r.drive[i];
      for (std::size_t k = 0; k < columns.size(); ++k) {
        double v = bracket[i];
        if (columns[k] == kViscous) v = -n;
        if (columns[k] == kDrag) v = -n * std::abs(n);
        if (columns[k] == kCoulomb) v = n > 0 ? -1 : n < 0 ? 1 : 0;
        if (columns[k] == kMotor) v = u;
        if (columns[k] == kSlope) v = u != 0 ? -n : 0;
        a(row, static_cast<Eigen::Index>(k)) = v;
      }
      b[row] = r.angle.alpha[2 * i];
    }
  }
  const Eigen::VectorXd scale = a.colwise().norm().cwiseMax(1e-300);
  const Eigen::VectorXd found =
      scale.cwiseInverse().asDiagonal() * (a * scale.cwiseInverse().asDiagonal()).colPivHouseholderQr().solve(b);
  for (std::size_t k = 0; k < columns.size(); ++k) values[columns[k]] = found[static_cast<Eigen::Index>(k)];
  values[kReaction] = std::max(values[kReaction], 0.0);
}

std::vector<TrajectoryRun> cut(const std::vector<DriveRecord>& records, Eigen::Index length) {
  std::vector<TrajectoryRun> runs;
  for (std::size_t r = 0; r < records.size(); ++r) {
    const Eigen::Index n = records[r].drive.size(), pieces = std::max<Eigen::Index>(1, n / length);
    for (Eigen::Index p = 0; p < pieces; ++p) {
      const Eigen::Index first = p * n / pieces;
      runs.push_back({r, first, (p + 1) * n / pieces - first, records[r].states.row(first)});
    }
  }
  return runs;
}

/// Runs of `length` that begin where the present fit says.
std::vector<TrajectoryRun> longer(const std::vector<TrajectoryRun>& now, const std::vector<DriveRecord>& records,
                                  Eigen::Index length) {
  std::vector<TrajectoryRun> next = cut(records, length);
  for (TrajectoryRun& r : next) {
    const auto at = std::find_if(now.begin(), now.end(), [&](const TrajectoryRun& old) {
      return old.record == r.record && old.first == r.first;
    });
    if (at != now.end()) r.start = at->start;
  }
  return next;
}

Estimate of(const TrajectoryFit& fit, std::size_t k) {
  const auto at = static_cast<Eigen::Index>(std::count_if(fit.model.parameters.begin(),
                                                          fit.model.parameters.begin() + static_cast<std::ptrdiff_t>(k),
                                                          [](const TrajectoryParameter& p) { return p.free; }));
  const TrajectoryParameter& p = fit.model.parameters[k];
  return p.free ? Estimate::from_sd(p.value, std::sqrt(fit.covariance(at, at)))
                : Estimate{p.value, 0, p.value, p.value};
}

/// Parameters, and the rotor they make.
void set_parameters(const TrajectoryFit& fit, const DriveOptions& o, const Told& told,
                    const std::vector<double>& values, IdentifiedModel& model) {
  model.parameter_covariance.clear();
  model.rotor_covariance.clear();
  model.parameters.clear();
  const auto set = [&](const std::string& name, const Estimate& e) { model.parameters.emplace_back(name, e); };
  for (std::size_t k = 0; k < 3; ++k) set(detail::drive_parameters()[k], of(fit, k));
  const double e = std::hypot(values[kEps], values[kEps + 1]), sd = of(fit, kEps).sd;
  set("e", Estimate::from_sd(e, sd));
  set("e_phase", Estimate::from_sd(std::atan2(values[kEps + 1], values[kEps]), sd / e));
  for (std::size_t k = kMotor; k <= kReaction; ++k) {
    if ((k == kMotor && !told.motor) || (k == kSlope && !told.slope) || (k == kCoulomb && !told.coulomb)) continue;
    set(detail::drive_parameters()[k], of(fit, k));
    if (!(o.inertia > 0) || k == kReaction) continue;
    static const char* physical[] = {"C_m1", "C_m2", "C_c", "C_v", "C_a"};
    Estimate torque = of(fit, k);
    for (double* v : {&torque.value, &torque.sd, &torque.low, &torque.high}) *v *= o.inertia;
    set(physical[k - kMotor], torque);
  }
  set("offset_x", of(fit, kReaction + 1));
  set("offset_y", of(fit, kReaction + 2));
  RotorModel rotor;
  rotor.k1 = values[0];
  rotor.k2 = values[1];
  rotor.c = values[2];
  rotor.eps = {values[kEps], values[kEps + 1]};
  rotor.offset = {of(fit, kReaction + 1).value, of(fit, kReaction + 2).value};
  model.rotor = rotor;
}

void describe(const TrajectoryFit& fit, const std::string& drive, const DriveOptions& o, const Told& told,
              IdentifiedModel& model) {
  std::vector<double> values;
  for (std::size_t k = 0; k <= kReaction; ++k) values.push_back(fit.model.parameters[k].value);
  model.states = {"X1", "X2", "X3", "X4", "X5", "X6"};
  model.inputs.clear();
  if (!drive.empty()) model.inputs.push_back(drive);
  const auto sought = [&](std::size_t k, double sign) {
    Estimate e = of(fit, k);
    return sign > 0 ? e : Estimate{-e.value, e.sd, -e.high, -e.low};
  };
  const Estimate one{1, 0, 1, 1};
  const detail::DriveRates rates = detail::drive_rates(drive);
  Equation speed{"X6'", {}};
  if (told.motor) speed.terms.push_back({drive, sought(kMotor, 1), ""});
  if (told.slope) speed.terms.push_back({"abs(sgn(" + drive + "))*X6", sought(kSlope, -1), "1/s"});
  if (told.coulomb) speed.terms.push_back({"sgn(X6)", sought(kCoulomb, -1), "rad/s^2"});
  speed.terms.push_back({"X6", sought(kViscous, -1), "1/s"});
  speed.terms.push_back({"X6*abs(X6)", sought(kDrag, -1), "1/rad"});
  speed.terms.push_back({detail::with_values(rates.reaction, values).str(), sought(kReaction, 1), "1/m^2"});
  const auto lateral = [&](const char* lhs, const char* d, const char* v, const expr::Expr& force) {
    Equation e{lhs, {}};
    e.terms.push_back({d, sought(0, -1), "1/s^2"});
    e.terms.push_back({fmt::format("{}*(X1^2+X3^2)", d), sought(1, -1), "1/(m^2 s^2)"});
    e.terms.push_back({v, sought(2, -1), "1/s"});
    e.terms.push_back({force.str(), one, "1"});
    return e;
  };

  // Forces of the unbalance with the full angular acceleration put in: the rest of X2' + F_x.
  const expr::Expr fx = expr::Expr::parse("k1*X1+k2*(X1^2+X3^2)*X1+c*X2"),
                   fy = expr::Expr::parse("k1*X3+k2*(X1^2+X3^2)*X3+c*X4");
  model.equations = {{"X1'", {{"X2", one, ""}}}, lateral("X2'", "X1", "X2", detail::with_values(rates.x + fx, values)),
                     {"X3'", {{"X4", one, ""}}}, lateral("X4'", "X3", "X4", detail::with_values(rates.y + fy, values)),
                     {"X5'", {{"X6", one, ""}}}, speed};
  set_parameters(fit, o, told, values, model);
  if (!drive.empty()) model.timing = {{drive, Hold::zero, {0, 0, 0, 0}}};
}

/// Noise sd of x, y and the angle, over all records.
Eigen::VectorXd noise_of(const std::vector<Recording>& records) {
  Eigen::VectorXd sd(3);
  for (int k = 0; k < 3; ++k) {
    double sum = 0;
    for (const Recording& r : records)
      sum += std::pow(signal::noise_sd(r.channels[static_cast<std::size_t>(k)].samples), 2);
    sd[k] = std::max(std::sqrt(sum / static_cast<double>(records.size())), k == 2 ? 1e-5 : 1e-9);
  }
  return sd;
}

/// What free runs leave of x and y beyond the noise, both rms.
double unexplained_share(const TrajectoryFit& best, const std::vector<DriveRecord>& data) {
  double left = 0, motion = 0;
  for (int k = 0; k < 2; ++k) {
    for (const DriveRecord& r : data) {
      const Eigen::VectorXd& x = r.record.channels[static_cast<std::size_t>(k)].samples;
      const double noise = std::pow(signal::noise_sd(x), 2), rows = static_cast<double>(x.size());
      left += rows * std::max(0.0, std::pow(best.output_rmse[k], 2) - noise);
      motion += rows * std::max(0.0, (x.array() - x.mean()).square().mean() - noise);
    }
  }
  return std::sqrt(left / motion);
}

Summary verdict(const TrajectoryFit& best, const Told& told, double horizon, const std::vector<DriveRecord>& data,
                const IdentifiedModel& model) {
  double longest = 0, top = 0;
  for (const DriveRecord& r : data) {
    longest = std::max(longest, r.record.duration());
    top = std::max(top, r.angle.omega.cwiseAbs().maxCoeff());
  }
  Summary summary;
  summary.chi_square = best.rmse * best.rmse;
  summary.residual = best.output_rmse.head(2).norm();
  summary.condition_number = model.summary.condition_number;
  if (!told.joined.empty()) summary.warnings.push_back(told.joined);
  if (!best.converged) summary.warn("the fit on free runs did not converge");
  if (summary.chi_square > rules::kNoTrust)
    summary.warn(fmt::format("model error: chi-square {:.2f} (1 when the model fits)", summary.chi_square));
  if (horizon < 0.99 * longest)
    summary.warn(fmt::format("the model follows angle and motion for {:.2g} s only", horizon));
  detail::judge_unexplained(unexplained_share(best, data), "free runs leave",
                            "the drive or the angle is not what turned the rotor, or a torque is missing", summary);
  detail::set_trust(
      fmt::format(
          "Trust the speed under other drives up to {:.0f} rad/s, and stalls at the critical speed {:.1f} rad/s.", top,
          model.rotor->natural_frequency()),
      summary);
  detail::judge_remaining(summary);
  return summary;
}

}  // namespace

bool has_drive(const IdentifiedModel& model) {
  return std::any_of(model.equations.begin(), model.equations.end(), [](const Equation& e) { return e.lhs == "X6'"; });
}

IdentifiedModel identify_drive(const std::vector<Recording>& records, const DriveOptions& o) {
  if (records.empty()) throw Error("records: at least one is needed");
  const bool driven = std::any_of(records.begin(), records.end(), [&](const Recording& r) { return r.has(o.drive); });
  const std::string drive = driven ? o.drive : "";
  std::vector<DriveRecord> data;
  for (const Recording& r : records) data.push_back(prepared(r, o, drive));
  const Told told = told_by(data);

  IdentifiedModel model = identify_rotor(records, o.rotor);
  if (!model.rotor) return model;
  model.method = "drive";
  std::vector<double> values(kReaction + 1, 0.0);
  values[0] = model.rotor->k1;
  values[1] = model.rotor->k2;
  values[2] = model.rotor->c;
  values[kEps] = model.rotor->eps.real();
  values[kEps + 1] = model.rotor->eps.imag();
  for (DriveRecord& r : data) {
    r.states.col(0).array() -= model.rotor->offset.real();
    r.states.col(2).array() -= model.rotor->offset.imag();
  }
  start_torques(data, drive, told, values);
  if (o.inertia > 0 && o.mass > 0) values[kReaction] = o.mass / o.inertia;

  TrajectoryModel trajectory =
      detail::drive_trajectory(drive, values, {o.rotor.record.x, o.rotor.record.y, o.rotor.record.angle});
  trajectory.parameters[kMotor].free = told.motor;
  trajectory.parameters[kSlope].free = told.slope;
  trajectory.parameters[kCoulomb].free = told.coulomb;
  trajectory.parameters[kReaction].free = !(o.inertia > 0 && o.mass > 0);
  trajectory.parameters[kReaction + 1].value = model.rotor->offset.real();
  trajectory.parameters[kReaction + 2].value = model.rotor->offset.imag();
  std::vector<Recording> plain;
  for (const DriveRecord& r : data) plain.push_back(r.record);
  TrajectoryOptions t;
  t.output_sd = noise_of(plain);
  t.max_iterations = 12;
  const double dt = plain.front().dt;
  Eigen::Index longest = 0;
  for (const Recording& r : plain) longest = std::max(longest, r.size());
  TrajectoryFit best;
  best.diverged = true;
  std::vector<TrajectoryRun> runs;
  double horizon = 0;
  for (Eigen::Index length = std::max<Eigen::Index>(100, std::lround(0.25 / dt));; length *= 4) {
    runs = longer(runs, data, length);
    if (length >= longest) t.max_iterations = 25;
    TrajectoryFit fit = fit_trajectory(trajectory, plain, runs, t);
    if (fit.diverged || (!best.diverged && fit.rmse > 3 * best.rmse)) break;
    best = std::move(fit);
    trajectory = best.model;
    runs = best.runs;
    horizon = dt * static_cast<double>(std::min(length, longest));
    if (length >= longest) break;
  }
  if (best.diverged) {
    model.summary.fail("free runs of the driven rotor diverge");
    return model;
  }
  describe(best, drive, o, told, model);
  model.summary = verdict(best, told, horizon, data, model);
  if (!driven) model.summary.warnings.push_back(fmt::format("no record has a channel {}: all coast", o.drive));
  return model;
}

}  // namespace whirl::identification
