#include "whirl/identify/record/model_run.hpp"

#include <fmt/format.h>

#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/identify/drive.hpp"
#include "whirl/identify/parts/readings.hpp"
#include "whirl/identify/simulate_model.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/identify/tilt/tilt_rotor.hpp"
#include "whirl/rotor/simulate.hpp"
#include "whirl/signal/angle.hpp"

namespace whirl::identification {
namespace {

AngleSignal angle_of(const SpeedRun& run) {
  require_range("seconds", run.seconds, 1e-6, 1e6, "s");
  require_range("dwell", run.dwell, 0, 1e6, "s");
  require_range("rate", run.rate, 1, 1e7, "Hz");
  if ((run.seconds + run.dwell) * run.rate > 5e7) {
    throw Error(fmt::format("{:g} s at {:g} Hz are more than 50 million samples: lower the rate or the time",
                            run.seconds + run.dwell, run.rate));
  }
  rotor::SpeedProfile profile;
  profile.omega_start = run.from;
  profile.omega_end = run.to;
  profile.ramp_time = run.seconds;
  profile.dwell_end = run.dwell;
  return rotor::angle_signal(profile, 1 / run.rate);
}

SpeedRunMotion run_tilting_rotor(const IdentifiedModel& model, const SpeedRun& run) {
  if (run.unbalance != 1 || run.eccentricity)
    throw Error(
        "the disc of this model tilts: what another unbalance does to its tilt is not known, run it without another "
        "unbalance or eccentricity");
  const AngleSignal angle = angle_of(run);
  SpeedRunMotion out;
  out.record = simulate_tilt_rotor(model, angle);
  const auto offset = [&](const char* name) { return model.parameter(name)->value; };
  const Eigen::ArrayXd x = out.record["x"].array() - offset("offset_x"),
                       y = out.record["y"].array() - offset("offset_y");
  Eigen::Index worst = 0;
  out.peak = (x.square() + y.square()).sqrt().maxCoeff(&worst);
  out.speed = angle.omega[2 * worst];
  return out;
}

}  // namespace

SpeedRunMotion run_over_speeds(const IdentifiedModel& identified, const SpeedRun& run) {
  if (has_tilt(identified)) return run_tilting_rotor(identified, run);
  IdentifiedModel model = identified;
  if (!model.rotor) throw Error("the model has no rotor parameters: it runs over the inputs of a record");
  RotorModel& rotor = *model.rotor;
  scale_unbalance(rotor, run.unbalance);
  if (run.eccentricity) {
    if (rotor.eps == 0.0 && !rotor.modes.empty())
      throw Error("another eccentricity: the model has no unbalance to which its further modes refer");
    if (rotor.eps != 0.0) scale_unbalance(rotor, *run.eccentricity / rotor.eps);
    rotor.eps = *run.eccentricity;
  }
  const AngleSignal angle = angle_of(run);
  const rotor::Response response = simulate_rotor(model, angle);
  SpeedRunMotion out;
  Eigen::Index worst = 0;
  if (response.z.size() > 0) out.peak = (response.z.array() - model.rotor->offset).abs().maxCoeff(&worst);
  out.speed = angle.omega[2 * worst];
  if (!std::isfinite(out.peak)) throw Error("the motion diverges: the model is not stable over this profile");
  out.record = response.recording();
  Eigen::VectorXd beta(response.z.size());
  for (Eigen::Index i = 0; i < beta.size(); ++i) beta[i] = angle.beta[2 * i];
  out.record.add("beta", Quantity::angle, std::move(beta));
  return out;
}

Recording run_over_record(const IdentifiedModel& model, const Recording& record) {
  if (has_drive(model)) return simulate_drive(model, record);
  if (has_tilt(model)) {
    return simulate_tilt_rotor(model, signal::angle_from_encoder(record["beta"], record.dt).angle, record.t0);
  }
  const ModelRun result = simulate(model, record);
  if (result.diverged)
    throw Error(fmt::format("the motion diverges after {:.4g} s", static_cast<double>(result.valid) * result.dt));
  Recording out = record;
  out.channels.clear();
  for (const std::string& input : model.inputs)
    if (record.find(input) != nullptr) out.channels.push_back(*record.find(input));
  for (std::size_t k = 0; k < result.states.size(); ++k) {
    const Channel* measured = record.find(result.states[k]);
    out.add(result.states[k], measured != nullptr ? measured->quantity : Quantity::dimensionless,
            result.values.col(static_cast<Eigen::Index>(k)));
  }
  return out;
}

}  // namespace whirl::identification
