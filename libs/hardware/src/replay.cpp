#include "whirl/hardware/replay.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::hardware {
namespace {

/// Replayed and recorded side by side.
constexpr std::array<std::pair<const char*, Quantity>, 16> kColumns{{{"x", Quantity::displacement},
                                                                     {"y", Quantity::displacement},
                                                                     {"beta", Quantity::angle},
                                                                     {"omega", Quantity::angular_velocity},
                                                                     {"ux_recorded", Quantity::force},
                                                                     {"uy_recorded", Quantity::force},
                                                                     {"ux", Quantity::force},
                                                                     {"uy", Quantity::force},
                                                                     {"x_est", Quantity::displacement},
                                                                     {"y_est", Quantity::displacement},
                                                                     {"vx_est", Quantity::velocity},
                                                                     {"vy_est", Quantity::velocity},
                                                                     {"s_x", Quantity::velocity},
                                                                     {"s_y", Quantity::velocity},
                                                                     {"valid", Quantity::dimensionless},
                                                                     {"missed", Quantity::dimensionless}}};

}  // namespace

ControllerDesign recorded_design(const rt::LoopRecord& record) {
  const std::string* text = record.text("controller");
  if (!text) throw Error("the recording holds no controller: give one with --controller");
  return io::from_json<ControllerDesign>(io::parse_json(*text, "controller of the recording"),
                                         "controller of the recording");
}

ControllerDesign with_estimator(ControllerDesign design, const std::string& estimator) {
  if (estimator.empty() || estimator == design.estimator) return design;
  for (const control::ParameterInfo& p : control::estimator_info(design.estimator).parameters)
    design.parameters.erase(p.name);
  design.estimator = estimator;
  return design;
}

Replay replay(const rt::LoopRecord& record, const ControllerDesign& design, const std::string& file) {
  if (record.cycles.empty()) throw Error::in_file(file, 0, "no cycles");
  Replay out;
  out.cycles = static_cast<long>(record.cycles.size());
  out.closed = record.closed;
  control::Controller controller = control::make_controller(design);
  Eigen::MatrixXd table(static_cast<Eigen::Index>(record.cycles.size()), static_cast<Eigen::Index>(kColumns.size()));
  double square = 0;
  for (std::size_t k = 0; k < record.cycles.size(); ++k) {
    const rt::LoopSample& s = record.cycles[k];
    const Measurement m{s.t, s.x, s.y, s.beta, s.omega, s.omega_dot, (s.flags & rt::kValid) != 0};
    Command u;
    if (const auto request = controller.step(m)) u = *request;
    // What the loop really sent is what the plant answered to.
    controller.applied({s.ux, s.uy});
    const control::ControllerState& c = controller.state();
    if ((s.flags & rt::kArmed) && !(s.flags & rt::kLimited) && s.trip == 0) {
      const double d = std::hypot(u.ux - s.ux, u.uy - s.uy);
      square += d * d;
      out.force_worst = std::max(out.force_worst, d);
      ++out.compared;
    }
    table.row(static_cast<Eigen::Index>(k)) << s.x, s.y, s.beta, s.omega, s.ux, s.uy, u.ux, u.uy, c.estimate.z.real(),
        c.estimate.z.imag(), c.estimate.v.real(), c.estimate.v.imag(), c.s.real(), c.s.imag(), m.valid ? 1.0 : 0.0,
        s.missed;
  }
  if (out.compared > 0) out.force_rms = std::sqrt(square / static_cast<double>(out.compared));
  out.log.dt = record.head.sample_time;
  out.log.t0 = record.cycles.front().t;
  out.log.source = file;
  for (std::size_t c = 0; c < kColumns.size(); ++c)
    out.log.add(kColumns[c].first, kColumns[c].second, table.col(static_cast<Eigen::Index>(c)));
  return out;
}

io::Json to_json(const Replay& replay) {
  io::Json json = io::start_document("whirl.replay", 1);
  json.set("cycles", replay.cycles).set("closed", replay.closed).set("compared", replay.compared);
  return json.set("force_difference_rms", replay.force_rms).set("force_difference_max", replay.force_worst);
}

}  // namespace whirl::hardware
