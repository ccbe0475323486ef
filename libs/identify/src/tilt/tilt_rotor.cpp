#include "whirl/identify/tilt/tilt_rotor.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "validate/free_run_errors.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/trajectory.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::identification {
namespace {

using Complex = std::complex<double>;
constexpr Eigen::Index kStates = 8;

/// Parameters, in this order. The fit has `soft` = k1 - couple^2 / tilt, the stiffness with the tilt left free, and the
/// unbalance `heavy` = eps - couple / tilt eps_tilt that acts there, in the place of k1 and eps: the main mode fixes
/// them, while k1, couple and tilt slide along a valley.
enum Parameter { k1, k2, c, couple, eps_re, eps_im, tilt, c_tilt, polar, tilt_re, tilt_im, offset_x, offset_y };
constexpr const char* kNames[] = {"soft",   "k2",    "c",       "couple",  "heavy_re", "heavy_im", "tilt",
                                  "c_tilt", "polar", "tilt_re", "tilt_im", "offset_x", "offset_y"};
constexpr std::size_t kParameters = std::size(kNames);

/// Readings and forcing, every `every`-th sample; what is left out is no number.
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

TrajectoryModel trajectory_at(std::vector<double> values) {
  const double share = values[couple] / values[tilt];
  values[k1] -= share * values[couple];
  values[eps_re] -= share * values[tilt_re];
  values[eps_im] -= share * values[tilt_im];
  TrajectoryModel model;
  model.states = {"x1", "vx", "y1", "vy", "p", "vp", "q", "vq"};
  model.inputs = {"fx", "fy", "w"};
  const std::string k = "(soft + couple^2/tilt)", re = "(heavy_re + couple/tilt*tilt_re)",
                    im = "(heavy_im + couple/tilt*tilt_im)";
  for (const std::string& rate :
       {std::string("vx"), "-" + k + "*x1 - k2*(x1^2 + y1^2)*x1 - c*vx - couple*p + " + re + "*fx - " + im + "*fy",
        std::string("vy"), "-" + k + "*y1 - k2*(x1^2 + y1^2)*y1 - c*vy - couple*q + " + re + "*fy + " + im + "*fx",
        std::string("vp"), std::string("-tilt*p - couple*x1 - c_tilt*vp - polar*w*vq + tilt_re*fx - tilt_im*fy"),
        std::string("vq"), std::string("-tilt*q - couple*y1 - c_tilt*vq + polar*w*vp + tilt_re*fy + tilt_im*fx")})
    model.rates.push_back(expr::Expr::parse(rate));
  model.channels = {"x", "y"};
  model.outputs = {expr::Expr::parse("x1 + offset_x"), expr::Expr::parse("y1 + offset_y")};
  for (std::size_t j = 0; j < kParameters; ++j) {
    TrajectoryParameter p;
    p.name = kNames[j];
    p.value = values[j];
    // A polar moment is at most twice the diametral one (thin disc).
    if (j == polar) p.low = -0.5, p.high = 2.5;
    if (j == tilt) p.low = 1;
    model.parameters.push_back(p);
  }
  return model;
}

/// Runs of about `length` samples, started from a sine through their first turn, the hidden tilt from its linear whirl.
std::vector<TrajectoryRun> cut(const TrajectoryModel& model, const Recording& record, Eigen::Index length) {
  const Eigen::Index n = record.size(), pieces = std::max<Eigen::Index>(1, n / length);
  const double stiffness = model.parameters[tilt].value, k = model.parameters[couple].value;
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
    const double follows = std::abs(margin) > 0.1 * stiffness ? -k / margin : 0;
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

/// Short runs, longer ones, the whole record at every sample; diverged where runs of two seconds with starts of their
/// own already leave more than `most`.
TrajectoryFit fit_from(const RotorRecord& record, const std::vector<double>& values, double top, double most) {
  constexpr double kStep = 0.8, kFine = 0.35;  // of a radian at the top speed
  const auto every = [&](double step) {
    return std::max<Eigen::Index>(1, static_cast<Eigen::Index>(step / (top * record.dt)));
  };
  TrajectoryOptions options;
  options.output_sd = Eigen::Vector2d(record.noise_x, record.noise_y);
  options.substeps = 1;  // the records are thinned to what one step takes
  options.max_iterations = 25;
  const Recording coarse = run_record(record, every(kStep)), fine = run_record(record, every(kFine));
  TrajectoryModel model = trajectory_at(values);
  TrajectoryFit fit;
  for (const double seconds : {0.4, 2.0, 1e9}) {
    const double samples = std::min(seconds / coarse.dt, static_cast<double>(coarse.size()));
    // The upper mode is told by little of the motion.
    options.max_iterations = seconds < 1e3 ? 25 : 100;
    fit = fit_trajectory(model, {coarse}, cut(model, coarse, std::lround(samples)), options);
    fit.diverged = fit.diverged || !std::isfinite(fit.rmse) || (seconds > 1 && fit.rmse > most);
    if (fit.diverged) return fit;
    model = fit.model;
  }
  std::vector<TrajectoryRun> whole = fit.runs;
  whole.front().count = fine.size();
  return fit_trajectory(model, {fine}, whole, options);
}

/// The physical parameters of a fit with their covariance, and what follows from several of them.
class View {
 public:
  explicit View(const TrajectoryFit& fit) {
    constexpr Eigen::Index n = kParameters;
    for (std::size_t k = 0; k < kParameters; ++k) value_[k] = fit.model.parameters[k].value;
    const double share = value_[couple] / value_[tilt];
    Eigen::MatrixXd slope = Eigen::MatrixXd::Identity(n, n);
    slope(k1, couple) = 2 * share;
    slope(k1, tilt) = -share * share;
    for (const auto& [own, other] : {std::pair(eps_re, tilt_re), std::pair(eps_im, tilt_im)}) {
      slope(own, other) = share;
      slope(own, couple) = value_[other] / value_[tilt];
      slope(own, tilt) = -share * value_[other] / value_[tilt];
    }
    value_[k1] += share * value_[couple];
    value_[eps_re] += share * value_[tilt_re];
    value_[eps_im] += share * value_[tilt_im];
    covariance_ = slope * fit.covariance.topLeftCorner(n, n) * slope.transpose();
  }
  double value(Parameter p) const { return value_[p]; }
  Estimate of(Parameter p, double factor = 1) const {
    return Estimate::from_sd(factor * value(p), std::sqrt(covariance_(p, p)));
  }
  std::pair<Estimate, Estimate> polar_of(Parameter re, Parameter im) const {
    const double a = value(re), b = value(im), size = std::hypot(a, b);
    const auto sd = [&](double fa, double fb) {
      return std::sqrt(std::max(
          0.0, fa * fa * covariance_(re, re) + fb * fb * covariance_(im, im) + 2 * fa * fb * covariance_(re, im)));
    };
    return {Estimate::from_sd(size, sd(a / size, b / size)),
            Estimate::from_sd(std::atan2(b, a), sd(b / (size * size), -a / (size * size)))};
  }
  /// Frequency of the lower or upper mode at standstill, rad/s.
  Estimate frequency(bool upper) const {
    const auto at = [&](double a, double t, double k) {
      const double mean = 0.5 * (a + t), apart = std::hypot(0.5 * (a - t), k);
      return std::sqrt(std::max(0.0, upper ? mean + apart : mean - apart));
    };
    const Parameter own[] = {k1, tilt, couple};
    const Eigen::Vector3d x(value(k1), value(tilt), value(couple));
    Eigen::Vector3d slope;
    Eigen::Matrix3d covariance;
    for (int i = 0; i < 3; ++i) {
      const double h = 1e-5 * std::max(1.0, std::abs(x[i]));
      Eigen::Vector3d up = x, down = x;
      up[i] += h, down[i] -= h;
      slope[i] = (at(up[0], up[1], up[2]) - at(down[0], down[1], down[2])) / (2 * h);
      for (int j = 0; j < 3; ++j) covariance(i, j) = covariance_(own[i], own[j]);
    }
    return Estimate::from_sd(at(x[0], x[1], x[2]), std::sqrt(std::max(0.0, slope.dot(covariance * slope))));
  }

 private:
  std::array<double, kParameters> value_{};
  Eigen::MatrixXd covariance_;  // from the residual variance
};

/// Equations of one axis of the disc and of its tilt.
void add_axis(const View& view, bool x, IdentifiedModel& model) {
  const std::string own = x ? "X1" : "X3", v = x ? "X2" : "X4", q = x ? "tilt_x" : "tilt_y",
                    vq = x ? "tilt_vx" : "tilt_vy", other = x ? "tilt_vy" : "tilt_vx";
  const char* in_phase = x ? "X6^2*cos(X5) + X7*sin(X5)" : "X6^2*sin(X5) - X7*cos(X5)";
  const char* quadrature = x ? "X7*cos(X5) - X6^2*sin(X5)" : "X6^2*cos(X5) + X7*sin(X5)";
  const Estimate one = Estimate::from_sd(1, 0);
  model.equations.push_back({own + "'", {{v, one, "1"}}});
  model.equations.push_back({v + "'",
                             {{own, view.of(k1, -1), "1/s^2"},
                              {own + "*(X1^2 + X3^2)", view.of(k2, -1), "1/(m^2 s^2)"},
                              {v, view.of(c, -1), "1/s"},
                              {q, view.of(couple, -1), "1/s^2"},
                              {in_phase, view.of(eps_re), "m"},
                              {quadrature, view.of(eps_im), "m"}}});
  model.equations.push_back({q + "'", {{vq, one, "1"}}});
  model.equations.push_back({vq + "'",
                             {{q, view.of(tilt, -1), "1/s^2"},
                              {own, view.of(couple, -1), "1/s^2"},
                              {vq, view.of(c_tilt, -1), "1/s"},
                              {"X6*" + other, view.of(polar, x ? -1 : 1), ""},
                              {in_phase, view.of(tilt_re), "m"},
                              {quadrature, view.of(tilt_im), "m"}}});
}

IdentifiedModel described(const TrajectoryFit& fit) {
  const double chi_square = fit.rmse * fit.rmse;
  const View view(fit);
  IdentifiedModel model;
  model.method = "tilt";
  model.states = {"X1", "X2", "X3", "X4", "tilt_x", "tilt_vx", "tilt_y", "tilt_vy"};
  model.inputs = {"X5", "X6", "X7"};
  add_axis(view, true, model);
  add_axis(view, false, model);
  const auto [e, phase] = view.polar_of(eps_re, eps_im);
  const auto [et, tilt_phase] = view.polar_of(tilt_re, tilt_im);
  model.parameters = {{"k1", view.of(k1)},
                      {"k2", view.of(k2)},
                      {"c", view.of(c)},
                      {"e", e},
                      {"e_phase", phase},
                      {"k_tilt", view.of(tilt)},
                      {"k_couple", view.of(couple)},
                      {"c_tilt", view.of(c_tilt)},
                      {"polar_ratio", view.of(polar)},
                      {"e_tilt", et},
                      {"e_tilt_phase", tilt_phase},
                      {"natural_frequency", view.frequency(false)},
                      {"second_frequency", view.frequency(true)},
                      {"offset_x", view.of(offset_x)},
                      {"offset_y", view.of(offset_y)}};
  model.summary.chi_square = chi_square;
  return model;
}

/// Value of a parameter of a model that has it.
double number(const IdentifiedModel& model, const char* name) {
  const Estimate* e = model.parameter(name);
  if (e == nullptr) throw Error::in_field("parameter of a rotor that tilts", name, "present");
  return e->value;
}

/// States in the steady whirl of the linear model at a speed and angle.
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

}  // namespace

bool has_tilt(const IdentifiedModel& model) {
  return std::find(model.states.begin(), model.states.end(), "tilt_x") != model.states.end();
}

std::optional<IdentifiedModel> fit_tilt_rotor(const RotorRecord& record, const RotorModel& start, double most) {
  if (record.summary.status == Status::unusable || record.colour.size() > 0 || !record.hum.empty() || record.drift)
    return std::nullopt;
  if (!(start.k1 > 0) || !(record.noise_x > 0) || !(record.noise_y > 0)) return std::nullopt;
  constexpr double kFollows = 1.15;  // residual by noise at which no other start is tried
  const double top = record.speed_high();
  std::optional<TrajectoryFit> best;
  // Upper by lower frequency, and a thick disc (a roll) before a thin one.
  for (const auto& [ratio, thin] : {std::pair(1.4, 0.1), {1.9, 0.1}, {2.6, 0.1}, {4.5, 1.8}}) {
    const double stiffness = ratio * ratio * start.k1, coupling = 0.3 * start.k1, damping = std::max(0.1, start.c);
    TrajectoryFit fit =
        fit_from(record,
                 {start.k1 + coupling * coupling / stiffness, start.k2, damping, coupling, start.eps.real(),
                  start.eps.imag(), stiffness, damping, thin, 0, 0, start.offset.real(), start.offset.imag()},
                 std::max(top, ratio * std::sqrt(start.k1)), most);
    if (fit.diverged || !std::isfinite(fit.rmse) || !fit.covariance.allFinite()) continue;
    if (!best || fit.rmse < best->rmse) best = std::move(fit);
    if (best->rmse < kFollows) break;
  }
  if (!best) return std::nullopt;
  IdentifiedModel model = described(*best);
  model.sample_time = record.dt;
  model.noise_sd = std::sqrt(0.5 * record.noise_variance());
  model.summary.residual = best->rmse * model.noise_sd;
  if (!best->converged) model.summary.warn("the fit of a disc that tilts did not converge");
  const Eigen::Index p = static_cast<Eigen::Index>(kParameters);
  if (!(best->covariance.topLeftCorner(p, p).diagonal().array() >= 0).all()) return std::nullopt;
  return model;
}

Recording simulate_tilt_rotor(const IdentifiedModel& model, const AngleSignal& angle, double t0) {
  const CompiledModel compiled(model);
  const Eigen::VectorXd by_axis = steady(model, angle.omega[0], angle.beta[0]);
  Eigen::VectorXd start(kStates);
  const std::vector<std::string> order{"X1", "X2", "X3", "X4", "tilt_x", "tilt_vx", "tilt_y", "tilt_vy"};
  for (std::size_t k = 0; k < compiled.states().size(); ++k) {
    const auto at = std::find(order.begin(), order.end(), compiled.states()[k]) - order.begin();
    start[static_cast<Eigen::Index>(k)] = by_axis[at];
  }
  const double upper = number(model, "second_frequency");
  const int substeps = rotor::steps_per_sample(angle.dt, upper, angle.omega.cwiseAbs().maxCoeff());
  const AngleSignal fine = rotor::refine(angle, substeps);
  const ModelRun run = simulate(compiled, half_grid_inputs(compiled, fine, t0), start, fine.dt, fine.samples());
  if (run.diverged)
    throw Error(fmt::format("the motion diverges after {:.4g} s", static_cast<double>(run.valid) * run.dt));
  const auto each = Eigen::seq(0, Eigen::last, substeps);
  Recording out;
  out.dt = angle.dt;
  out.t0 = t0;
  out.source = model.method;
  out.add("x", Quantity::displacement, run.state("X1")(each).array() + number(model, "offset_x"));
  out.add("y", Quantity::displacement, run.state("X3")(each).array() + number(model, "offset_y"));
  out.add("beta", Quantity::angle, angle.beta(Eigen::seq(0, Eigen::last, Eigen::fix<2>)));
  return out;
}

Validation validate_tilt_rotor(const IdentifiedModel& model, const Recording& recording,
                               const ValidateOptions& options) {
  if (options.unbalance != UnbalanceSource::identified)
    throw Error(
        "a rotor that tilts is validated with its identified unbalance only: the share of an added mass that "
        "tilts the disc is not known");
  const RotorRecord record = rotor_record(recording, options.record);
  const double ox = number(model, "offset_x"), oy = number(model, "offset_y");
  const Recording run_data = run_record(record, 1);
  const Complex eps = std::polar(number(model, "e"), number(model, "e_phase"));
  const Complex eps_tilt = std::polar(number(model, "e_tilt"), number(model, "e_tilt_phase"));
  TrajectoryModel fixed =
      trajectory_at({number(model, "k1"), number(model, "k2"), number(model, "c"), number(model, "k_couple"),
                     eps.real(), eps.imag(), number(model, "k_tilt"), number(model, "c_tilt"),
                     number(model, "polar_ratio"), eps_tilt.real(), eps_tilt.imag(), ox, oy});
  for (TrajectoryParameter& p : fixed.parameters) p.free = false;
  TrajectoryRun run{0, 0, run_data.size(), steady(model, record.angle.omega[0], record.angle.beta[0])};
  TrajectoryOptions fit_options;
  fit_options.output_sd = Eigen::Vector2d(record.noise_x, record.noise_y).cwiseMax(1e-12);
  const TrajectoryFit fit = fit_trajectory(fixed, {run_data}, {run}, fit_options);
  Validation v;
  v.noise_x = record.noise_x;
  v.noise_y = record.noise_y;
  v.eps = eps;
  v.summary = record.summary;
  v.peak_measured = (record.z.array() - Complex(ox, oy)).abs().maxCoeff();
  Eigen::MatrixXd readings;
  if (!fit.diverged) readings = follow(fit.model, run_data, fit.runs.front());
  if (readings.size() == 0) {
    v.rmse_x = v.rmse_y = v.nrmse = INFINITY;
    v.summary.fail(fmt::format("{}: the free run of the model diverges", recording.source));
    return v;
  }
  const Eigen::VectorXcd simulated = readings.col(0) + Complex(0, 1) * readings.col(1);
  // As for a plain rotor: another k2 within reason and the run jumps elsewhere.
  TrajectoryModel harder = fit.model;
  harder.parameters[k2].value *= 1 + options.fold_change;
  const Eigen::MatrixXd moved = follow(harder, run_data, fit.runs.front());
  detail::judge_fold(
      v, options,
      moved.size() == 0 ? INFINITY : std::sqrt((moved - readings).squaredNorm() / static_cast<double>(moved.rows())));
  v.simulated.dt = record.dt;
  v.simulated.t0 = recording.t0;
  v.simulated.source = model.method;
  v.simulated.add("x", Quantity::displacement, readings.col(0));
  v.simulated.add("y", Quantity::displacement, readings.col(1));
  detail::measure_errors(record, record.z, record.z - simulated, v);
  if (options.clean) detail::compare_with_clean(v, options, simulated);
  const Eigen::ArrayXcd about = simulated.array() - Complex(ox, oy);
  v.peak_simulated = about.abs().maxCoeff();
  // Twice what the noise and the model's own residual account for, or 3 % of the motion, as for any system.
  const double excess = std::sqrt(std::max(1.0, model.summary.chi_square)),
               motion = std::sqrt(0.5 * about.abs2().mean());
  v.band_x = std::max(2 * excess * record.noise_x, std::hypot(excess * record.noise_x, 0.03 * motion));
  v.band_y = std::max(2 * excess * record.noise_y, std::hypot(excess * record.noise_y, 0.03 * motion));
  return v;
}

}  // namespace whirl::identification
