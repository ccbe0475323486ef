#include "whirl/shaft/centrifuge/accelerometers.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::RowVectorXd;

Support observer(const std::string& name, const Point& point) {
  const Eigen::Matrix2d none = Eigen::Matrix2d::Zero();
  return {name, point, {"ground", point.position}, {{}, {none}, {none}, {none}}};
}

System assemble_with(const Rotor& rotor, const std::vector<Accelerometer>& accelerometers) {
  Rotor observed = rotor;
  for (const Accelerometer& a : accelerometers) {
    observed.supports.push_back(observer(a.name, {a.body, a.position}));
    observed.supports.push_back(observer(a.name + " tilt", {a.body, a.position + kTiltArm}));
  }
  System s = assemble(observed);
  Index row = s.bodies.rows();
  const auto own = static_cast<std::ptrdiff_t>(rotor.supports.size());
  s.bodies.conservativeResize(row + 2 * static_cast<Index>(accelerometers.size()), Eigen::NoChange);
  const auto first = s.supports.begin() + own, end = first + 2 * static_cast<std::ptrdiff_t>(accelerometers.size());
  for (auto at = first; at != end; ++at) s.bodies.row(row++) = at->row.transpose();
  s.supports.erase(first, end);
  return s;
}

Eigen::MatrixXd accelerometer_readings(const RotorRun& run, const std::vector<Accelerometer>& accelerometers) {
  const Index count = static_cast<Index>(accelerometers.size()), n = run.time.size();
  if (n < 5) throw Error("a run of at least five samples is needed for its accelerometers");
  const double dt = run.time[1] - run.time[0];
  Eigen::MatrixXd out(count, n);
  for (Index k = 0; k < count; ++k) {
    const double angle = accelerometers[static_cast<std::size_t>(k)].angle;
    const auto along = [&](Index row) -> RowVectorXd {
      return std::cos(angle) * run.body_x.row(row) + std::sin(angle) * run.body_y.row(row);
    };
    const Index row = run.body_x.rows() - 2 * (count - k);
    const RowVectorXd motion = along(row), tilt = (along(row + 1) - motion) / kTiltArm;
    for (Index i = 0; i < n; ++i) {
      const Index c = std::clamp<Index>(i, 2, n - 3);
      const double bent = -motion[c - 2] + 16 * motion[c - 1] - 30 * motion[c] + 16 * motion[c + 1] - motion[c + 2];
      out(k, i) = bent / (12 * dt * dt) - kGravity * tilt[i];
    }
  }
  return out;
}

}  // namespace whirl::shaft
