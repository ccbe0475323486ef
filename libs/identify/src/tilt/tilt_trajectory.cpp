#include "tilt/tilt_trajectory.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/core/error.hpp"

namespace whirl::identification::tilting {
namespace {

constexpr const char* kNames[] = {"soft",   "k2",    "c",       "mass",    "heavy_re", "heavy_im", "give",
                                  "c_tilt", "polar", "tilt_re", "tilt_im", "offset_x", "offset_y"};
static_assert(std::size(kNames) == kParameters);

constexpr double kLeastMass = 1e-12;
double share_of(double mass) { return std::sqrt(std::max(mass, kLeastMass)); }

Values fitted(Values v) {
  const double share = std::copysign(share_of(std::pow(v[couple] / v[tilt], 2)), v[couple]);
  v[k1] -= share * v[couple];
  v[eps_re] -= share * v[tilt_re];
  v[eps_im] -= share * v[tilt_im];
  v[couple] = share * share;
  v[tilt_re] /= share;
  v[tilt_im] /= share;
  v[tilt] = 1 / v[tilt];
  return v;
}

}  // namespace

Values physical(const Values& f) {
  const double share = share_of(f[couple]);
  Values v = f;
  v[k1] += f[couple] / f[tilt];
  v[couple] = share / f[tilt];
  v[eps_re] += f[couple] * f[tilt_re];
  v[eps_im] += f[couple] * f[tilt_im];
  v[tilt] = 1 / f[tilt];
  v[tilt_re] *= share;
  v[tilt_im] *= share;
  return v;
}

Eigen::Matrix<double, kParameters, kParameters> physical_slopes(const Values& f) {
  const double share = share_of(f[couple]), give = f[tilt];
  Eigen::Matrix<double, kParameters, kParameters> slope = Eigen::Matrix<double, kParameters, kParameters>::Identity();
  slope(k1, couple) = 1 / give;
  slope(k1, tilt) = -f[couple] / (give * give);
  slope(couple, couple) = 0.5 / (share * give);
  slope(couple, tilt) = -share / (give * give);
  slope(tilt, tilt) = -1 / (give * give);
  for (const auto& [own, other] : {std::pair(eps_re, tilt_re), std::pair(eps_im, tilt_im)}) {
    slope(own, couple) = f[other];
    slope(own, other) = f[couple];
    slope(other, couple) = 0.5 * f[other] / share;
    slope(other, other) = share;
  }
  return slope;
}

Recording run_record(const RotorRecord& record, Eigen::Index every) {
  const Eigen::Index n = (record.size() + every - 1) / every;
  Eigen::VectorXd x(n), y(n), fx(n), fy(n), w(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::Index k = i * every;
    const bool sees_x = record.usable_x.size() == 0 || record.usable_x[k] > 0;
    const bool sees_y = record.usable_y.size() == 0 || record.usable_y[k] > 0;
    x[i] = sees_x ? record.z[k].real() : NAN;
    y[i] = sees_y ? record.z[k].imag() : NAN;
    w[i] = record.angle.omega[2 * k];
    const Complex force = std::polar(1.0, record.angle.beta[2 * k]) * Complex(w[i] * w[i], -record.angle.alpha[2 * k]);
    fx[i] = force.real();
    fy[i] = force.imag();
  }
  Recording out;
  out.dt = record.dt * static_cast<double>(every);
  out.t0 = record.t0;
  out.add("x", Quantity::displacement, x);
  out.add("y", Quantity::displacement, y);
  out.add("fx", Quantity::dimensionless, fx);
  out.add("fy", Quantity::dimensionless, fy);
  out.add("w", Quantity::angular_velocity, w);
  return out;
}

TrajectoryModel trajectory_at(Values values) {
  constexpr double kSlowest = 1, kFastest = 1e9;  // tilt, 1/s^2
  values = fitted(values);
  TrajectoryModel model;
  model.states = {"x1", "vx", "y1", "vy", "p", "vp", "q", "vq"};
  model.inputs = {"fx", "fy", "w"};
  const std::string re = "(heavy_re + mass*tilt_re)", im = "(heavy_im + mass*tilt_im)";
  for (const std::string& rate :
       {std::string("vx"), "-soft*x1 - mass*(x1 + p)/give - k2*(x1^2 + y1^2)*x1 - c*vx + " + re + "*fx - " + im + "*fy",
        std::string("vy"), "-soft*y1 - mass*(y1 + q)/give - k2*(x1^2 + y1^2)*y1 - c*vy + " + re + "*fy + " + im + "*fx",
        std::string("vp"), std::string("-(p + x1)/give - c_tilt*vp - polar*w*vq + tilt_re*fx - tilt_im*fy"),
        std::string("vq"), std::string("-(q + y1)/give - c_tilt*vq + polar*w*vp + tilt_re*fy + tilt_im*fx")})
    model.rates.push_back(expr::Expr::parse(rate));
  model.channels = {"x", "y"};
  model.outputs = {expr::Expr::parse("x1 + offset_x"), expr::Expr::parse("y1 + offset_y")};
  for (std::size_t j = 0; j < kParameters; ++j) {
    TrajectoryParameter p;
    p.name = kNames[j];
    p.value = values[static_cast<Eigen::Index>(j)];
    // A polar moment is at most twice the diametral one (thin disc).
    if (j == polar) p.low = -0.5, p.high = 2.5;
    if (j == tilt) p.low = 1 / kFastest, p.high = 1 / kSlowest;
    if (j == couple) p.low = kLeastMass;
    model.parameters.push_back(p);
  }
  return model;
}

std::vector<TrajectoryRun> cut(const TrajectoryModel& model, const Recording& record, Eigen::Index length) {
  const Eigen::Index n = record.size(), pieces = std::max<Eigen::Index>(1, n / length);
  const double stiffness = 1 / model.parameters[tilt].value;
  std::vector<TrajectoryRun> runs;
  for (Eigen::Index i = 0; i < pieces; ++i) {
    TrajectoryRun run{0, i * n / pieces, (i + 1) * n / pieces - i * n / pieces, Eigen::VectorXd::Zero(kStates)};
    const double w = record["w"][run.first];
    const double turn = 2 * std::numbers::pi / std::max(std::abs(w), 10.0);
    const Eigen::Index count = std::clamp<Eigen::Index>(std::lround(turn / record.dt), 6, run.count);
    Eigen::MatrixXd basis(count, 3), readings(count, 2);
    for (Eigen::Index j = 0; j < count; ++j) {
      const double at = w * record.dt * static_cast<double>(j);
      basis.row(j) << 1, std::cos(at), std::sin(at);
      readings.row(j) << record["x"][run.first + j], record["y"][run.first + j];
    }
    if (!readings.allFinite()) {
      runs.push_back(run);
      continue;
    }
    const Eigen::MatrixXd fit = basis.colPivHouseholderQr().solve(readings);
    const double margin = stiffness - w * w;
    const double follows = std::abs(margin) > 0.1 * stiffness ? -stiffness / margin : 0;
    for (Eigen::Index axis = 0; axis < 2; ++axis) {
      run.start[2 * axis] = fit(1, axis);
      run.start[2 * axis + 1] = w * fit(2, axis);
      run.start[4 + 2 * axis] = follows * run.start[2 * axis];
      run.start[5 + 2 * axis] = follows * run.start[2 * axis + 1];
    }
    runs.push_back(run);
  }
  return runs;
}

double number(const IdentifiedModel& model, const char* name) {
  const Estimate* e = model.parameter(name);
  if (e == nullptr) throw Error::in_field("parameter of a rotor that tilts", name, "present");
  return e->value;
}

Values values_of(const IdentifiedModel& model) {
  const auto of = [&](const char* name) { return number(model, name); };
  const Complex eps = std::polar(of("e"), of("e_phase")), eps_tilt = std::polar(of("e_tilt"), of("e_tilt_phase"));
  Values v;
  v << of("k1"), of("k2"), of("c"), of("k_couple"), eps.real(), eps.imag(), of("k_tilt"), of("c_tilt"),
      of("polar_ratio"), eps_tilt.real(), eps_tilt.imag(), of("offset_x"), of("offset_y");
  return v;
}

Eigen::VectorXd steady(const IdentifiedModel& model, double w, double beta) {
  const Complex i(0, 1), k(number(model, "k_couple"));
  const Complex eps = std::polar(number(model, "e"), number(model, "e_phase"));
  const Complex eps_tilt = std::polar(number(model, "e_tilt"), number(model, "e_tilt_phase"));
  Eigen::Matrix2cd stiffness;
  stiffness << number(model, "k1") - w * w + i * w * number(model, "c"), k, k,
      number(model, "k_tilt") - (1 - number(model, "polar_ratio")) * w * w + i * w * number(model, "c_tilt");
  const Eigen::Vector2cd z =
      stiffness.partialPivLu().solve(Eigen::Vector2cd(eps, eps_tilt)) * (w * w) * std::polar(1.0, beta);
  Eigen::VectorXd start(kStates);
  for (int m = 0; m < 2; ++m) {
    const Complex v = i * w * z[m];
    start.segment<4>(4 * m) << z[m].real(), v.real(), z[m].imag(), v.imag();
  }
  return start;
}

Eigen::VectorXd steady_fitted(const IdentifiedModel& model, double w, double beta) {
  Eigen::VectorXd start = steady(model, w, beta);
  const double share = number(model, "k_couple") / number(model, "k_tilt");
  start.tail<4>() /= std::copysign(share_of(share * share), share);
  return start;
}

}  // namespace whirl::identification::tilting
