#pragma once
#include <optional>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/io/json.hpp"
#include "whirl/report/figure.hpp"
#include "whirl/response/runup.hpp"

namespace whirl::pages {

/// A drive as the user states it.
struct Drive {
  double mass = 0;     ///< kg
  double inertia = 0;  ///< of the rotor about its centre of mass, kg m^2
  rotor::TorqueModel torque;
};
/// What a drive makes of the plan.
struct DriveVerdict {
  response::StallLimit limit;
  response::DrivenRunUp run;
  double needed = 0;  ///< torque for the suggested rate: inertia * rate + friction + reaction of the whirl, N m
};

/// Run-up and run-down of one rotor: what was asked, found and suggested.
struct RunUpSheet {
  RotorModel rotor;
  response::RunUpOptions options;
  response::RunUpPlan plan;
  std::optional<double> up_rate, down_rate;  ///< suggested, rad/s^2: the limit holds with 97.5 % of the covariance
  std::optional<response::PeakBand> up_band, down_band;  ///< of the peak at the suggested rate
  std::optional<DriveVerdict> drive;
  Summary summary;
};

/// Plans, and suggests for each direction the slowest rate that keeps the limit (over the covariance, where there is
/// one) or, without a limit, the fastest useful one. Fails where no rate keeps the limit or the drive stalls; warns of
/// a rate that decides between two branches and of a drive that is too weak for the suggestion. `covariance`: 25
/// numbers or empty; `parts`: what was said of the model before.
RunUpSheet run_up_sheet(const RotorModel& rotor, const std::vector<double>& covariance,
                        const response::RunUpOptions& options, const std::optional<Drive>& drive, Summary parts = {});
/// Makes the intervals of the peaks hold those of the readings of the model's records that its covariance does not
/// cover: one run of each at the suggested rates with all its forces. Fails where one exceeds the limit. `unbalance`:
/// times the identified one.
void cover_readings(const IdentifiedModel& model, double unbalance, RunUpSheet& sheet);

/// Peak over rate with the limit; below it the suggested run with the slow run behind it.
report::Figure run_up_figure(const RunUpSheet& sheet);
/// `whirl.run_up/1`.
io::Json to_json(const RunUpSheet& sheet);

}  // namespace whirl::pages
