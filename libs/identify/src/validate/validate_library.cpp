#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/identify/tilt/tilt_rotor.hpp"
#include "whirl/identify/validate.hpp"

namespace whirl::identification {
namespace {

double root_mean_square(const Eigen::VectorXd& v) {
  return v.size() ? std::sqrt(v.squaredNorm() / static_cast<double>(v.size())) : 0;
}

// x, x', y, y' at the first sample from a synchronous orbit fitted to the first tenth of a second.
Eigen::Vector4d initial_state(const RotorRecord& record) {
  const Eigen::Index n = std::min<Eigen::Index>(record.size(), std::lround(0.1 / record.dt));
  Eigen::MatrixXd basis(n, 3);
  Eigen::MatrixXd xy(n, 2);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double beta = record.angle.beta[2 * i];
    basis.row(i) << 1, std::cos(beta), std::sin(beta);
    xy.row(i) << record.z[i].real(), record.z[i].imag();
  }
  if (std::abs(record.angle.omega[0]) * record.dt * static_cast<double>(n) < 1)
    return {0, 0, 0, 0};  // run-up from rest
  const Eigen::MatrixXd c = basis.colPivHouseholderQr().solve(xy);
  const double beta = record.angle.beta[0], omega = record.angle.omega[0];
  Eigen::Vector4d state;
  for (int axis = 0; axis < 2; ++axis) {
    state[2 * axis] = c(0, axis) + c(1, axis) * std::cos(beta) + c(2, axis) * std::sin(beta);
    state[2 * axis + 1] = omega * (-c(1, axis) * std::sin(beta) + c(2, axis) * std::cos(beta));
  }
  return state;
}

Validation validate_library(const IdentifiedModel& model, const Recording& recording, const ValidateOptions& options) {
  const RotorRecord record = rotor_record(recording, options.record);
  const CompiledModel compiled(model);
  if (compiled.states().size() != 4) throw Error("the model has no equations of the lateral motion X1 to X4");
  const double amplitude = record.z.cwiseAbs().maxCoeff();
  const ModelRun run = simulate(compiled, half_grid_inputs(compiled, record.angle, recording.t0), initial_state(record),
                                record.dt, record.size(), 1e3 * amplitude * std::max(1.0, record.speed_high()));
  Validation v;
  v.unbalance = UnbalanceSource::identified;
  v.noise_x = record.noise_x;
  v.noise_y = record.noise_y;
  v.peak_measured = amplitude;
  const Eigen::VectorXd x = run.state("X1"), y = run.state("X3");
  v.simulated.dt = record.dt;
  v.simulated.t0 = recording.t0;
  v.simulated.source = model.method;
  v.simulated.add("x", Quantity::displacement, x);
  v.simulated.add("y", Quantity::displacement, y);
  if (run.diverged) {
    v.rmse_x = v.rmse_y = v.nrmse = INFINITY;
    v.summary.fail(fmt::format("{}: the free run of the model diverges after {:.3g} s", recording.source,
                               static_cast<double>(run.valid) * record.dt));
    return v;
  }
  const Eigen::VectorXd mx = record.z.real(), my = record.z.imag();
  v.rmse_x = root_mean_square(mx - x);
  v.rmse_y = root_mean_square(my - y);
  if (options.clean) {
    v.clean_rmse_x = root_mean_square((*options.clean)["x"] - x);
    v.clean_rmse_y = root_mean_square((*options.clean)["y"] - y);
  }
  const double spread = std::hypot(root_mean_square((mx.array() - mx.mean()).matrix()),
                                   root_mean_square((my.array() - my.mean()).matrix()));
  v.nrmse = std::hypot(v.rmse_x, v.rmse_y) / spread;
  v.peak_simulated = (x.array().square() + y.array().square()).sqrt().maxCoeff();
  v.summary.residual = std::sqrt((v.rmse_x * v.rmse_x + v.rmse_y * v.rmse_y) / 2);
  return v;
}

}  // namespace

Validation validate_model(const IdentifiedModel& model, const Recording& recording, const ValidateOptions& options) {
  if (model.rotor) return validate(model, recording, options);
  return has_tilt(model) ? validate_tilt_rotor(model, recording, options) : validate_library(model, recording, options);
}

}  // namespace whirl::identification
