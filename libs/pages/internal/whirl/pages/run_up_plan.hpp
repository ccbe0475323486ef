#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <vector>

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

/// A run at a suggested rate with the forces that the plan leaves out.
struct FurtherRun {
  double rate = 0;  ///< rad/s^2
  double peak = 0;  ///< m
  bool up = true;
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
  std::string further;                   ///< names of the model's forces beside RotorModel; empty: none
  std::vector<FurtherRun> further_runs;  ///< at the suggested rates
};

/// Plans, and suggests for each direction the slowest rate that keeps the limit (over the covariance, where there is
/// one) or, without a limit, the fastest useful one. Fails where no rate keeps the limit or the drive stalls; warns of
/// a rate that decides between two branches and of a drive that is too weak for the suggestion. `covariance`: 25
/// numbers or empty; `parts`: what was said of the model before.
RunUpSheet run_up_sheet(const RotorModel& rotor, const std::vector<double>& covariance,
                        const response::RunUpOptions& options, const std::optional<Drive>& drive, Summary parts = {});

/// The same of an identified rotor with `unbalance` times its eccentricity and with its covariance. What the model has
/// beside RotorModel is run once at the suggested rates, and so is each reading of its records that the covariance does
/// not cover: the intervals of the peaks hold them. Fails where the rotor whirls by itself or exceeds the limit. Parts
/// of the model that a plan leaves out are findings. Throws Error for a model without rotor parameters or with a part
/// that no plan can take; `file` names the model there.
RunUpSheet run_up_sheet(const IdentifiedModel& model, double unbalance, const response::RunUpOptions& options,
                        const std::optional<Drive>& drive, std::string_view file = "model");

/// Peak over rate with the limit; below it the suggested run with the slow run behind it.
report::Figure run_up_figure(const RunUpSheet& sheet);
/// `whirl.run_up/1`.
io::Json to_json(const RunUpSheet& sheet);

}  // namespace whirl::pages
