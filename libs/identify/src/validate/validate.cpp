#include "whirl/identify/validate.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "output_error/rotor/output_error_kernel.hpp"
#include "problem/rotor_equations.hpp"
#include "rules/rules.hpp"
#include "validate/free_run_errors.hpp"
#include "weak/weak_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/output_error_rotor.hpp"
#include "whirl/identify/weak_rotor.hpp"
#include "whirl/rotor/equations.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::identification {
namespace {

using Complex = std::complex<double>;

// Probe runout among the parameters of the model, as readings along the angle of an instant `delay` before.
Eigen::VectorXcd runout_readings(const IdentifiedModel& model, const AngleSignal& angle, double delay) {
  Eigen::VectorXcd sum = Eigen::VectorXcd::Zero(angle.samples());
  for (int order = 1;; ++order) {
    const Estimate* present = model.parameter(fmt::format("runout{}+_re", order));
    if (present == nullptr) return sum;
    for (const char* direction : {"+", "-"}) {
      const auto part = [&](const char* p) {
        return model.parameter(fmt::format("runout{}{}_{}", order, direction, p))->value;
      };
      const Complex amplitude(part("re"), part("im"));
      const double turns = *direction == '+' ? order : -order;
      for (Eigen::Index i = 0; i < sum.size(); ++i) {
        sum[i] += amplitude * std::polar(1.0, turns * (angle.beta[2 * i] - delay * angle.omega[2 * i]));
      }
    }
  }
}

/// rms of x and y by which the motion moves when each principal direction of the parameters' covariance moves by its
/// standard deviation; the initial state, which is fitted to the run, stays.
Eigen::Vector2d parameter_spread(const IdentifiedModel& model, const RotorModel& rotor, const OutputErrorRecord& run,
                                 const detail::TermForces& forces, const detail::StepGrid& grid, bool own_unbalance) {
  const Eigen::Map<const Eigen::Matrix<double, 5, 5>> covariance(model.rotor_covariance.data());
  Eigen::Matrix<double, 5, 5> c = covariance;
  if (own_unbalance) {  // fitted to this run
    c.rightCols<2>().setZero();
    c.bottomRows<2>().setZero();
  }
  const Eigen::Matrix<double, 5, 1> scale = c.diagonal().cwiseMax(0).cwiseSqrt();
  const Eigen::Matrix<double, 5, 1> by = (scale.array() > 0).select(scale.cwiseInverse(), 0.0);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(Eigen::MatrixXd(by.asDiagonal() * c * by.asDiagonal()));
  const Eigen::VectorXcd forcing = rotor::unbalance_forcing(rotor::refine(run.angle, grid.substeps));
  Eigen::Vector2d squares = Eigen::Vector2d::Zero();
  for (Eigen::Index k = 0; k < 5; ++k) {
    if (!(eigen.eigenvalues()[k] > 0)) continue;
    const Eigen::Matrix<double, 5, 1> step =
        std::sqrt(eigen.eigenvalues()[k]) * scale.cwiseProduct(eigen.eigenvectors().col(k));
    RotorModel moved = rotor;
    moved.k1 += step[0];
    moved.k2 += step[1];
    moved.c += step[2];
    const Eigen::VectorXcd shift =
        detail::main_mode(moved, run.eps + Complex(step[3], step[4]), forcing, forces, grid, run.z0, run.dz0)
            .read(grid.derivative) -
        run.as_read();
    squares +=
        Eigen::Vector2d(shift.real().squaredNorm(), shift.imag().squaredNorm()) / static_cast<double>(shift.size());
  }
  return squares.cwiseSqrt();
}

double rms(const Eigen::VectorXd& v) { return std::sqrt(v.squaredNorm() / static_cast<double>(v.size())); }
/// Of the samples that are not left out.
double rms(const Eigen::VectorXd& v, const Eigen::ArrayXd& usable) {
  return usable.size() ? std::sqrt((v.array().square() * usable).sum() / std::max(1.0, usable.sum())) : rms(v);
}

/// A run that jumps has several unbalances near which none follows better: the fit of one begins at that of the model
/// and at that of the weak equations, which have one minimum.
OutputErrorFit follow(const RotorRecord& record, const RotorModel& rotor, const OutputErrorOptions& free, Complex eps,
                      double delay) {
  OutputErrorFit fit = fit_output_error_rotor({record}, rotor, free, {eps}, delay);
  const bool weak_rows =
      record.quantity == Quantity::displacement && 4 * detail::default_half_width(record) <= record.size();
  if (!free.unbalance || !weak_rows) return fit;
  const WeakRotorFit weak = fit_weak_rotor({record});
  if (weak.summary.status == Status::unusable) return fit;
  OutputErrorFit other = fit_output_error_rotor({record}, rotor, free, {weak.eps[0]}, delay);
  const auto misfit = [](const OutputErrorFit& f) {
    return f.summary.status == Status::unusable ? INFINITY : f.summary.chi_square;
  };
  return misfit(other) < misfit(fit) ? other : fit;
}

/// Whether a change at one instant is among the terms.
bool changes(const std::vector<RotorTerm>& terms) {
  return std::ranges::any_of(terms, [](const RotorTerm& t) { return t.entry->by_reference != nullptr; });
}

/// A run that holds no change shows the machine as it is now, whenever it was recorded: of the two fits the one that
/// follows it better. True: without the change.
bool take_as_now(const RotorRecord& record, const RotorModel& rotor, Complex eps, double delay,
                 OutputErrorOptions& free, OutputErrorFit& fit) {
  if (!changes(free.terms)) return false;
  OutputErrorOptions now = free;
  std::erase_if(now.terms, [](const RotorTerm& t) { return t.entry->by_reference != nullptr; });
  OutputErrorFit after = follow(record, rotor, now, eps, delay);
  if (after.summary.status == Status::unusable ||
      !(fit.summary.status == Status::unusable || after.summary.chi_square < fit.summary.chi_square))
    return false;
  free = std::move(now);
  fit = std::move(after);
  return true;
}

void tell(Validation& v, const ValidateOptions& options, const Summary& fit) {
  for (const std::string& w : fit.warnings) v.summary.warn(w);
  v.summary.trust =
      fmt::format("Free run, unbalance {}; initial state and sensor offset fitted.", to_string(options.unbalance));
  if (v.after_change) v.summary.trust += " The machine as it is after its change: this run does not hold it.";
}

/// Whether a change of the cubic stiffness would show, and the bands within which the model's own uncertainty explains
/// the errors.
void judge_fold_and_bands(const IdentifiedModel& model, const ValidateOptions& options, const RotorRecord& record,
                          const OutputErrorFit& fit, const OutputErrorOptions& free, Validation& v) {
  const OutputErrorRecord& run = fit.records[0];
  const bool same_sensors = record.quantity == model.quantity;
  RotorModel harder = fit.model;
  harder.eps = run.eps;
  harder.k2 *= 1 + options.fold_change;
  const detail::StepGrid grid{record.dt, fit.substeps, record.derivative()};
  const AngleSignal fine = rotor::refine(run.angle, fit.substeps);
  const detail::TermForces forces{free.terms, fine, record.t0};
  const Eigen::VectorXcd moved =
      detail::main_mode(harder, run.eps, rotor::unbalance_forcing(fine), forces, grid, run.z0, run.dz0).z;
  detail::judge_fold(v, options, std::sqrt((moved - run.main).squaredNorm() / static_cast<double>(moved.size())));
  if (model.rotor_covariance.size() == 25) {
    const Eigen::Vector2d spread = parameter_spread(model, fit.model, run, forces, grid, free.unbalance);
    const double left = model.summary.residual * model.summary.residual - model.noise_sd * model.noise_sd;
    const double model_error = std::isfinite(left) && same_sensors ? std::max(0.0, left) : 0;
    const auto band = [&](double noise, double moves) {
      return rules::kBand * std::sqrt(noise * noise + moves * moves + model_error);
    };
    if (record.axes != Axes::y) v.band_x = band(record.noise_x, spread[0]);
    if (record.axes != Axes::x) v.band_y = band(record.noise_y, spread[1]);
  }
}

}  // namespace

namespace detail {

void compare_with_clean(Validation& v, const ValidateOptions& options, const Eigen::VectorXcd& simulated) {
  if (options.clean->size() != simulated.size()) {
    throw Error::in_field("clean", fmt::format("{} samples", options.clean->size()),
                          fmt::format("as long as the record, {} samples", simulated.size()));
  }
  if (options.clean->has(options.record.x)) v.clean_rmse_x = rms((*options.clean)[options.record.x] - simulated.real());
  if (options.clean->has(options.record.y)) v.clean_rmse_y = rms((*options.clean)[options.record.y] - simulated.imag());
}

void tell_offsets(const IdentifiedModel& model, Complex fitted, const Eigen::Vector2d& sd, Axes axes, Validation& v) {
  for (const bool y : {false, true}) {
    if (axes == (y ? Axes::x : Axes::y)) continue;
    const char* name = y ? "offset_y" : "offset_x";
    const Estimate* stated = model.parameter(name);
    if (stated == nullptr) continue;
    const double value = y ? fitted.imag() : fitted.real(), own = std::isfinite(stated->sd) ? stated->sd : 0,
                 deviations = std::abs(value - stated->value) / std::hypot(sd[y], own);
    if (!(deviations > rules::kRestDiffers)) continue;
    const std::string unit(si_unit(v.quantity));
    v.summary.add(
        {FindingCode::parameter_differs,
         Consequence::note,
         {{"model", stated->value, unit}, {"record", value, unit}, {"deviations", deviations}},
         name},
        ": the constant of a channel is its probe's (a gap set anew), not the rotor's, and is fitted to each run");
  }
}

void measure_errors(const RotorRecord& record, const Eigen::VectorXcd& measured, const Eigen::VectorXcd& error,
                    Validation& v) {
  v.rmse_x = rms(error.real(), record.usable_x);
  v.rmse_y = rms(error.imag(), record.usable_y);
  if (record.axes == Axes::x) v.rmse_y = v.noise_y = NAN;
  if (record.axes == Axes::y) v.rmse_x = v.noise_x = NAN;
  const double squares =
      (record.axes != Axes::y ? v.rmse_x * v.rmse_x : 0.0) + (record.axes != Axes::x ? v.rmse_y * v.rmse_y : 0.0);
  // The analytic signal that stands for an unseen axis has the size of the other.
  const double motion = (measured.array() - measured.mean()).matrix().norm() / (record.one_axis() ? std::sqrt(2.0) : 1);
  v.nrmse = std::sqrt(squares * static_cast<double>(error.size())) / motion;
  v.summary.residual = std::sqrt((record.one_axis() ? 1 : 0.5) * squares);
}

void judge_fold(Validation& v, const ValidateOptions& options, double shift) {
  v.fold_shift = shift;
  v.fold_sensitive = !(shift < options.fold_limit);
  if (!v.fold_sensitive) return;
  v.summary.warn(
      fmt::format("fold-sensitive: {:g} % of k2 moves this run by {:.3g} mm rms, so its error is decided by "
                  "whether the rotor jumps; do not average it with other runs",
                  100 * options.fold_change, 1e3 * v.fold_shift));
}

}  // namespace detail

std::string_view to_string(UnbalanceSource source) {
  switch (source) {
    case UnbalanceSource::identified:
      return "identified";
    case UnbalanceSource::added:
      return "identified plus known added";
    case UnbalanceSource::refitted:
      return "refitted to this run";
  }
  return "?";
}

Validation validate(const IdentifiedModel& model, const Recording& recording, const ValidateOptions& options) {
  require_range("fold_change", options.fold_change, 1e-6, 1);
  Validation v;
  v.unbalance = options.unbalance;
  if (!model.rotor || model.summary.status == Status::unusable) {
    v.summary.fail("the model is unusable: there is nothing to validate");
    return v;
  }
  RotorRecordOptions reading = options.record;
  reading.one_axis = true;
  reading.any_motion = true;
  RotorRecord record = rotor_record(recording, reading);
  v.quantity = record.quantity;
  const bool same_sensors = record.quantity == model.quantity;
  v.noise_x = record.noise_x;
  v.noise_y = record.noise_y;
  for (const std::string& w : record.summary.warnings) {
    record.summary.status == Status::unusable ? v.summary.fail(w) : v.summary.warn(w);
  }
  if (v.summary.status == Status::unusable) return v;
  const Estimate* found_delay = model.parameter("delay");
  const double delay = found_delay != nullptr && same_sensors ? found_delay->value : 0.0;
  const Eigen::VectorXcd runout =
      same_sensors ? runout_readings(model, record.angle, delay) : Eigen::VectorXcd::Zero(record.size());
  const Eigen::VectorXcd measured = record.z;
  record.z -= runout;

  const Complex eps = model.rotor->eps + (options.unbalance == UnbalanceSource::added ? options.added : Complex(0));
  OutputErrorOptions free;
  free.rotor = false;
  free.modes.participation = false;
  free.unbalance = options.unbalance == UnbalanceSource::refitted;
  free.terms = terms_of(model);
  free.free_terms = false;
  if (same_sensors) free.probes.start = detail::sensor_of(model);
  if (const Estimate* drift = model.parameter("clock_drift")) free.clock.start_drift = drift->value;
  OutputErrorFit fit = follow(record, *model.rotor, free, eps, delay);
  v.after_change = take_as_now(record, *model.rotor, eps, delay, free, fit);
  if (fit.summary.status == Status::unusable) {
    v.summary.fail(fit.summary.reason);
    return v;
  }
  const OutputErrorRecord& run = fit.records[0];
  v.eps = run.eps;
  const Eigen::VectorXcd simulated = fit.read_main(0) + run.beside + runout;
  const Eigen::VectorXcd error = measured - simulated;
  detail::measure_errors(record, measured, error, v);
  if (same_sensors) {
    const double excess = std::sqrt(std::max(1.0, fit.summary.chi_square));
    const auto sd_of = [&](const char* name) {
      const Eigen::Index k = fit.index(name);
      return k < 0 ? INFINITY : excess * std::sqrt(fit.covariance(k, k));
    };
    detail::tell_offsets(model, run.offset, {sd_of("offset_re"), sd_of("offset_im")}, record.axes, v);
  }
  v.peak_measured = (measured.array() - run.offset).abs().maxCoeff();
  v.peak_simulated = (simulated.array() - run.offset).abs().maxCoeff();
  if (options.clean) detail::compare_with_clean(v, options, simulated);
  v.simulated.t0 = recording.t0;
  v.simulated.dt = recording.dt;
  v.simulated.source = "simulated: " + recording.source;
  v.simulated.add("x", record.quantity, simulated.real());
  v.simulated.add("y", record.quantity, simulated.imag());

  judge_fold_and_bands(model, options, record, fit, free, v);
  v.summary.chi_square = fit.summary.chi_square;
  tell(v, options, fit.summary);
  return v;
}

}  // namespace whirl::identification
