#include "whirl/shaft/fit/recognise.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::shaft {
namespace {

using Eigen::Index;

/// Straight line through the speed over time: acceleration and its standard deviation.
Estimate acceleration_of(const OrderRun& run) {
  const Index n = run.blocks(), step = static_cast<Index>(run.turns) * kGridPerTurn;
  Eigen::MatrixXd x(n, 2);
  for (Index b = 0; b < n; ++b) x.row(b) << 1, 0.5 * (run.time[b * step] + run.time[(b + 1) * step]);
  const Eigen::Vector2d line = x.colPivHouseholderQr().solve(run.speed);
  const double variance = (run.speed - x * line).squaredNorm() / static_cast<double>(n - 2);
  const Eigen::Matrix2d inverse = (x.transpose() * x).inverse();
  return Estimate::from_sd(line[1], std::sqrt(variance * inverse(1, 1)));
}

/// The tolerance is a half width; the scatter of the speed adds to it.
Estimate inertia_of(const OrderRun& run, const DriveTorque& torque) {
  const Estimate a = acceleration_of(run);
  const double value = torque.value / std::abs(a.value), half = torque.tolerance + 1.96 * a.sd / std::abs(a.value);
  return {value, half * value / 1.96, value * (1 - half), value * (1 + half)};
}

void judge(RotorRecognition& found) {
  std::string possible;
  int count = 0;
  for (const CandidateFit& c : found.candidates) {
    if (!c.possible()) continue;
    possible += (count++ > 0 ? ", " : "") + c.name;
  }
  if (count == 0)
    found.summary.fail(
        "none of these rotors explains the record: another rotor, or a machine that differs from all files");
  else if (count == 1)
    found.summary.trust = "The rotor is " + possible + ".";
  else
    found.summary.warn("the record does not tell these apart: " + possible +
                       "; a run through the next critical speed, or the torque of the drive, may");
}

}  // namespace

RotorRecognition recognise_rotor(const std::vector<RotorCandidate>& candidates, const DriveTorque& torque,
                                 const FitOptions& options) {
  if (candidates.size() < 2) throw Error("two rotor files or more are needed: which of them is it?");
  require_range("torque", torque.value, 0, 1e9, "N m");
  require_range("torque tolerance", torque.tolerance, 0, 1);
  RotorRecognition found;
  found.inertia = torque.value > 0 ? inertia_of(candidates.front().run, torque) : Estimate{};
  FitOptions judged = options;
  judged.next = false;
  for (const RotorCandidate& c : candidates) {
    CandidateFit one;
    one.name = c.name;
    one.misfit = fit_rotor(c.job.rotor, c.job.fit, {c.run}, judged).misfit;
    one.explains = one.misfit.explained;
    one.inertia = c.job.rotor.polar_inertia();
    one.inertia_fits = std::isnan(found.inertia.value) || found.inertia.covers(one.inertia);
    found.candidates.push_back(one);
  }
  judge(found);
  return found;
}

io::Json to_json(const RotorRecognition& found) {
  io::Json list = io::Json::array();
  for (const CandidateFit& c : found.candidates)
    list.push(io::Json::object()
                  .set("name", c.name)
                  .set("possible", c.possible())
                  .set("explains", c.explains)
                  .set("chi_square", c.misfit.chi_square)
                  .set("deviations", c.misfit.most())
                  .set("inertia", c.inertia)
                  .set("inertia_fits", c.inertia_fits));
  return io::start_document("whirl.rotor_which", 1)
      .set("summary", io::to_json(found.summary))
      .set("inertia", io::to_json(found.inertia, "kg m^2"))
      .set("candidates", std::move(list));
}

}  // namespace whirl::shaft
