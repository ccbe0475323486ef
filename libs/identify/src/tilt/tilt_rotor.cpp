#include "whirl/identify/tilt/tilt_rotor.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>

#include "tilt/tilt_trajectory.hpp"
#include "validate/free_run_errors.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/parallel.hpp"
#include "whirl/identify/trajectory.hpp"
#include "whirl/rotor/simulate.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::identification {
namespace {

using namespace tilting;

/// Residuals, by the noise, that a fit has to come below.
struct Limits {
  double most;    ///< of runs of two seconds with starts of their own
  double target;  ///< of the whole record
};

/// The fit of the whole record; diverged where it does not converge in some steps and at the pace of the last ones
/// would not come below `target` in all. `enough`: it is only a start, and done once below.
TrajectoryFit fit_whole(const TrajectoryModel& model, const Recording& record, std::vector<TrajectoryRun> runs,
                        TrajectoryOptions options, double target, bool enough = false) {
  constexpr int kFirst = 25, kPace = 10, kAll = 100;  // steps: the upper mode is told by little of the motion
  options.max_iterations = kFirst;
  TrajectoryFit fit = fit_trajectory(model, {record}, runs, options);
  int left = kAll - kFirst;
  for (const int steps : {kPace, kAll - kFirst - kPace}) {
    if (fit.diverged || fit.converged || !std::isfinite(fit.rmse) || (enough && fit.rmse <= target)) return fit;
    options.max_iterations = steps;
    TrajectoryFit on = fit_trajectory(fit.model, {record}, fit.runs, options);
    if (on.diverged) return fit;
    left -= steps;
    const double pace = on.rmse / fit.rmse;
    fit = std::move(on);
    fit.diverged = !fit.converged && fit.rmse * std::pow(pace, static_cast<double>(left) / steps) > target;
  }
  return fit;
}

/// Readings and forcing as often as a step of so many radians at the top speed asks.
Recording thinned(const RotorRecord& record, double step, double top) {
  return run_record(record, std::max<Eigen::Index>(1, static_cast<Eigen::Index>(step / (top * record.dt))));
}
constexpr double kStep = 0.8, kFineTilt = 0.35;

TrajectoryOptions options_of(const RotorRecord& record) {
  TrajectoryOptions options;
  options.output_sd = Eigen::Vector2d(record.noise_x, record.noise_y);
  options.substeps = 1;  // the records are thinned to what one step takes
  options.max_iterations = 25;
  return options;
}

/// Short runs, longer ones, the whole record, that at every sample; diverged where the first leave far more than is
/// asked of the next, or converge to more than the whole may leave.
TrajectoryFit fit_from(const RotorRecord& record, const Values& values, double top, const Limits& limits) {
  constexpr double kFar = 3;       // times what runs of two seconds may leave
  constexpr double kAlike = 1.03;  // residuals of a thinned record and of all of it
  // Undamped first steps went astray: the starts of many short runs hold the hidden tilt hardly at all.
  constexpr double kFromAfar = 0.1;
  const TrajectoryOptions options = options_of(record);
  TrajectoryOptions begun = options;  // what another fit goes on from
  begun.tolerance = 1e-5;
  TrajectoryOptions from_afar = begun;
  from_afar.damping = kFromAfar;
  const Recording coarse = thinned(record, kStep, top), fine = thinned(record, kFineTilt, top);
  const auto ends_above = [&](const TrajectoryFit& fit) { return fit.converged && fit.rmse > kAlike * limits.target; };
  TrajectoryModel model = trajectory_at(values);
  TrajectoryFit fit;
  for (const auto& [seconds, most] : {std::pair(0.4, kFar * limits.most), std::pair(2.0, limits.most)}) {
    const double samples = std::min(seconds / coarse.dt, static_cast<double>(coarse.size()));
    fit = fit_whole(model, coarse, cut(model, coarse, std::lround(samples)), from_afar, most, seconds < 1);
    fit.diverged = fit.diverged || !std::isfinite(fit.rmse) || fit.rmse > most;
    fit.diverged = fit.diverged || (seconds > 1 && ends_above(fit));
    if (fit.diverged) return fit;
    model = fit.model;
  }
  fit = fit_whole(model, coarse, cut(model, coarse, coarse.size()), begun, limits.target);
  fit.diverged = fit.diverged || !std::isfinite(fit.rmse) || fit.rmse > limits.most || ends_above(fit);
  if (fit.diverged) return fit;
  std::vector<TrajectoryRun> whole = fit.runs;
  whole.front().count = fine.size();
  return fit_whole(fit.model, fine, std::move(whole), options, limits.target);
}

/// The physical parameters of a fit with their covariance, and what follows from several of them.
class View {
 public:
  explicit View(const TrajectoryFit& fit) {
    constexpr auto n = static_cast<Eigen::Index>(kParameters);
    Values fitted;
    for (Eigen::Index k = 0; k < n; ++k) fitted[k] = fit.model.parameters[static_cast<std::size_t>(k)].value;
    const auto slope = physical_slopes(fitted);
    value_ = physical(fitted);
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
  Values value_;
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

/// What a fit leaves at the frequencies of the motion, by the noise there: over all frequencies it hides in the noise
/// of those that have none. What is no disc that tilts may be followed by one up to there (jitter of the angle, hum).
double misfit_in_band(const TrajectoryFit& fit, const RotorRecord& record) {
  constexpr double kBand = 1.5;  // of the highest speed: synchronous whirl, and the free one below it
  const Recording all = run_record(record, 1);
  TrajectoryRun run = fit.runs.front();
  run.count = all.size();
  const Eigen::MatrixXd readings = follow(fit.model, all, run);
  if (readings.rows() != all.size()) return INFINITY;
  const auto lines = static_cast<Eigen::Index>(kBand * record.speed_high() / kTwoPi * all.duration());
  double power = 0, of_noise = 0;
  for (const auto& [channel, column, noise] : {std::tuple("x", 0, record.noise_x), {"y", 1, record.noise_y}}) {
    const Eigen::ArrayXd left = all[channel] - readings.col(column);
    const Eigen::VectorXcd spectrum = signal::real_fft(Eigen::VectorXd(left.isFinite().select(left, 0.0)));
    const Eigen::Index count = std::min(lines, spectrum.size() - 1);
    power += spectrum.segment(1, count).squaredNorm();
    of_noise += static_cast<double>(count * left.isFinite().count()) * noise * noise;
  }
  return power / of_noise;
}

/// Nothing where the information gives no variances.
std::optional<IdentifiedModel> model_of(const TrajectoryFit& fit, const RotorRecord& record) {
  IdentifiedModel model = described(fit);
  model.summary.chi_square = std::max(model.summary.chi_square, misfit_in_band(fit, record));
  model.sample_time = record.dt;
  model.noise_sd = std::sqrt(0.5 * record.noise_variance());
  model.summary.residual = fit.rmse * model.noise_sd;
  if (!fit.converged) model.summary.warn("the fit of a disc that tilts did not converge");
  const Eigen::Index p = static_cast<Eigen::Index>(kParameters);
  if (!(fit.covariance.topLeftCorner(p, p).diagonal().array() >= 0).all()) return std::nullopt;
  return model;
}

}  // namespace

bool has_tilt(const IdentifiedModel& model) {
  return std::find(model.states.begin(), model.states.end(), "tilt_x") != model.states.end();
}

std::optional<IdentifiedModel> fit_tilt_rotor(const RotorRecord& record, const RotorModel& start, double target) {
  if (record.summary.status == Status::unusable || record.colour.size() > 0 || !record.hum.empty() || record.drift)
    return std::nullopt;
  if (!(start.k1 > 0) || !(record.noise_x > 0) || !(record.noise_y > 0)) return std::nullopt;
  // Short runs with starts of their own leave less than one run of the whole record: they must at least come near what
  // is asked of the whole.
  constexpr double kNear = 1.1;
  const Limits limits{kNear * target, target};
  constexpr double kFollows = 1.15;  // residual by noise at which no other start is tried
  const double top = record.speed_high();
  std::optional<TrajectoryFit> best;
  // Upper by lower frequency, and a thick disc (a roll) before a thin one.
  constexpr std::array<std::pair<double, double>, 4> kStarts{{{1.4, 0.1}, {1.9, 0.1}, {2.6, 0.1}, {4.5, 1.8}}};
  std::array<TrajectoryFit, kStarts.size()> fits;
  const auto run = [&](int i) {
    const auto [ratio, thin] = kStarts[static_cast<std::size_t>(i)];
    const double stiffness = ratio * ratio * start.k1, coupling = 0.3 * start.k1, damping = std::max(0.1, start.c);
    Values values;
    values << start.k1 + coupling * coupling / stiffness, start.k2, damping, coupling, start.eps.real(),
        start.eps.imag(), stiffness, damping, thin, 0, 0, start.offset.real(), start.offset.imag();
    fits[static_cast<std::size_t>(i)] = fit_from(record, values, std::max(top, ratio * std::sqrt(start.k1)), limits);
  };
  const auto take = [&](int i) {
    TrajectoryFit& fit = fits[static_cast<std::size_t>(i)];
    if (fit.diverged || !std::isfinite(fit.rmse) || !fit.covariance.allFinite()) return;
    if (!best || fit.rmse < best->rmse) best = std::move(fit);
  };
  run(0);  // the likeliest one alone
  take(0);
  parallel_trials(
      static_cast<int>(kStarts.size()) - 1, static_cast<int>(kStarts.size()),
      [&] { return best && best->rmse < kFollows; }, [&](int i) { run(i + 1); }, [&](int i) { take(i + 1); });
  return best ? model_of(*best, record) : std::nullopt;
}

std::optional<IdentifiedModel> fit_tilt_rotor(const RotorRecord& record, const IdentifiedModel& like) {
  const TrajectoryModel model = trajectory_at(values_of(like));
  const double top = std::max(record.speed_high(), number(like, "second_frequency"));
  const Recording fine = thinned(record, kFineTilt, top);
  const TrajectoryFit fit = fit_whole(model, fine, cut(model, fine, fine.size()), options_of(record), INFINITY);
  if (fit.diverged || !std::isfinite(fit.rmse) || !fit.covariance.allFinite()) return std::nullopt;
  return model_of(fit, record);
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
  const Recording run_data = run_record(record, 1);
  TrajectoryModel fixed = trajectory_at(values_of(model));
  for (TrajectoryParameter& p : fixed.parameters) p.free = false;
  fixed.parameters[offset_x].free = fixed.parameters[offset_y].free = true;  // the probes', not the rotor's
  TrajectoryRun run{0, 0, run_data.size(), steady_fitted(model, record.angle.omega[0], record.angle.beta[0])};
  TrajectoryOptions fit_options;
  fit_options.output_sd = Eigen::Vector2d(record.noise_x, record.noise_y).cwiseMax(1e-12);
  const TrajectoryFit fit = fit_trajectory(fixed, {run_data}, {run}, fit_options);
  Validation v;
  v.noise_x = record.noise_x;
  v.noise_y = record.noise_y;
  v.eps = std::polar(number(model, "e"), number(model, "e_phase"));
  v.summary = record.summary;
  Eigen::MatrixXd readings;
  if (!fit.diverged) readings = follow(fit.model, run_data, fit.runs.front());
  if (readings.size() == 0) {
    v.rmse_x = v.rmse_y = v.nrmse = INFINITY;
    v.summary.fail(fmt::format("{}: the free run of the model diverges", recording.source));
    return v;
  }
  const Eigen::VectorXcd simulated = readings.col(0) + Complex(0, 1) * readings.col(1);
  const Complex offset(fit.model.parameters[offset_x].value, fit.model.parameters[offset_y].value);
  v.peak_measured = (record.z.array() - offset).abs().maxCoeff();
  detail::tell_offsets(model, offset, fit.covariance.diagonal().head<2>().cwiseSqrt(), record.axes, v);
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
  const Eigen::ArrayXcd about = simulated.array() - offset;
  v.peak_simulated = about.abs().maxCoeff();
  // Twice what the noise and the model's own residual account for, or 3 % of the motion, as for any system.
  const double excess = std::sqrt(std::max(1.0, model.summary.chi_square)),
               motion = std::sqrt(0.5 * about.abs2().mean());
  v.band_x = std::max(2 * excess * record.noise_x, std::hypot(excess * record.noise_x, 0.03 * motion));
  v.band_y = std::max(2 * excess * record.noise_y, std::hypot(excess * record.noise_y, 0.03 * motion));
  return v;
}

}  // namespace whirl::identification
