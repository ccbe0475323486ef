#include <algorithm>
#include <cmath>

#include "trajectory/trajectory_score.hpp"
#include "weak/integral_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/drive.hpp"
#include "whirl/identify/trajectory.hpp"
#include "whirl/rotor/simulate.hpp"
#include "whirl/signal/angle.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::identification {
namespace {

void require_drive(const IdentifiedModel& model) {
  if (!has_drive(model)) throw Error("the model has no equation of the speed: identify it with --drive");
}

double value_of(const IdentifiedModel& model, const char* name) {
  const Estimate* e = model.parameter(name);
  return e != nullptr ? e->value : 0;
}

/// Channels x, y, beta as outputs of the six states.
TrajectoryModel six_states(const IdentifiedModel& model) {
  TrajectoryModel out = trajectory_model(model, {});
  out.channels = {"x", "y", "beta"};
  out.outputs = {expr::Expr::symbol("X1") + expr::Expr(value_of(model, "offset_x")),
                 expr::Expr::symbol("X3") + expr::Expr(value_of(model, "offset_y")), expr::Expr::symbol("X5")};
  return out;
}

}  // namespace

Recording simulate_drive(const IdentifiedModel& model, const Recording& record) {
  require_drive(model);
  const TrajectoryModel six = six_states(model);
  Recording in = record;
  for (Channel& c : in.channels)
    if (c.name == "beta") c.samples = signal::unwrapped(c.samples);  // it may come back to 0 every turn
  for (const std::string& input : model.inputs) {
    if (!in.has(input)) in.add(input, Quantity::dimensionless, Eigen::VectorXd::Zero(record.size()));
  }
  TrajectoryRun run{0, 0, in.size(), Eigen::VectorXd::Zero(6)};
  if (in.has("x") && in.has("y") && in.has("beta")) {
    for (int axis = 0; axis < 3; ++axis) {
      const Eigen::VectorXd& d = in[six.channels[static_cast<std::size_t>(axis)]];
      const signal::SmoothedSignal s = detail::without_noise(d, in.dt, signal::noise_sd(d));
      run.start[2 * axis] = s.value[0] - (axis == 0   ? value_of(model, "offset_x")
                                          : axis == 1 ? value_of(model, "offset_y")
                                                      : 0.0);
      run.start[2 * axis + 1] = s.first[0];
    }
    const double speed = std::max(std::abs(run.start[5]), 1.0);
    detail::fit_start(six, in, std::max<Eigen::Index>(50, std::lround(20 / speed / in.dt)), run);
  }
  const Eigen::MatrixXd y = follow(six, in, run);
  if (y.size() == 0) throw Error("the motion diverges");
  Recording out;
  out.dt = in.dt;
  out.t0 = in.t0;
  out.source = in.source;
  for (int k = 0; k < 3; ++k)
    out.add(six.channels[static_cast<std::size_t>(k)], k < 2 ? Quantity::displacement : Quantity::angle, y.col(k));
  for (const std::string& input : model.inputs) out.channels.push_back(in.at(input));
  return out;
}

RunUp run_up(const IdentifiedModel& model, double drive, double seconds, double rate) {
  require_drive(model);
  require_range("seconds", seconds, 1e-6, 1e6, "s");
  require_range("rate", rate, 1, 1e7, "Hz");
  if (seconds * rate > 5e7) throw Error("more than 50 million samples: fewer seconds or a lower rate");
  if (model.inputs.empty()) throw Error("the model was identified from coast-downs alone: it has no motor");
  const CompiledModel compiled(model);
  const auto n = static_cast<Eigen::Index>(std::max(2.0, std::floor(seconds * rate)));
  Eigen::VectorXd x = Eigen::VectorXd::Zero(6), stage(7), k1(6), k2(6), k3(6), k4(6);
  stage[6] = drive;
  // The six states have no name of their critical speed where the motion tells none.
  const double free = model.rotor ? 1.5 * model.rotor->natural_frequency() : 0;
  const auto slope = [&](const Eigen::VectorXd& at, Eigen::VectorXd& out) {
    stage.head(6) = at;
    compiled.rate(stage.data(), out.data());
  };
  RunUp run{Eigen::VectorXd(n), Eigen::VectorXd(n), Eigen::VectorXd(n), 0};
  for (Eigen::Index i = 0; i < n; ++i) {
    if (!x.allFinite()) throw Error("the motion diverges: a higher rate is needed");
    run.time[i] = static_cast<double>(i) / rate;
    run.speed[i] = x[5];
    run.radius[i] = std::hypot(x[0], x[2]);
    const int substeps = rotor::steps_per_sample(1 / rate, free, std::abs(x[5]));
    const double h = 1 / (rate * substeps);
    for (int s = 0; s < substeps; ++s) {
      slope(x, k1);
      slope(x + 0.5 * h * k1, k2);
      slope(x + 0.5 * h * k2, k3);
      slope(x + h * k3, k4);
      x += h / 6 * (k1 + 2 * (k2 + k3) + k4);
    }
  }
  run.reached = run.speed.tail(std::max<Eigen::Index>(1, n / 10)).mean();
  return run;
}

double limiting_drive(const IdentifiedModel& model, double speed, double seconds, double rate, double most) {
  const auto passes = [&](double drive) { return run_up(model, drive, seconds, rate).speed.maxCoeff() >= speed; };
  if (!passes(most)) return std::numeric_limits<double>::quiet_NaN();
  double low = 0, high = most;
  while (high - low > 1e-4 * high) {
    const double middle = 0.5 * (low + high);
    (passes(middle) ? high : low) = middle;
  }
  return 0.5 * (low + high);
}

}  // namespace whirl::identification
