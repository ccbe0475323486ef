#include "centrifuge/centrifuge_file.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace whirl::shaft {

CentrifugeSetup read_centrifuge(const io::Settings& s, const Rotor& rotor) {
  using Q = Quantity;
  CentrifugeSetup c;
  for (std::size_t k = 0; k < s.count("accelerometer"); ++k) {
    const std::string at = fmt::format("accelerometer[{}].", k);
    Accelerometer a{s.text(at + "name", fmt::format("accelerometer {}", k + 1)), s.text(at + "on", ""),
                    s.require_number(at + "position", Q::displacement), s.number(at + "angle", Q::angle, 0)};
    if (std::ranges::find(rotor.bodies, a.body, &Body::name) == rotor.bodies.end())
      throw s.error(at + "on", "must be the name of a [[body]]");
    c.accelerometers.push_back(std::move(a));
  }
  if (s.keys("centrifuge").empty()) return c;
  c.plane = s.require_number("centrifuge.plane", Q::displacement, 0, rotor.length() * (1 + 1e-9));
  c.radius = s.require_number("centrifuge.radius", Q::displacement, 1e-6);
  c.buckets = static_cast<int>(s.integer("centrifuge.buckets", c.buckets, 2, 1000));
  c.first_bucket = s.number("centrifuge.first_bucket", Q::angle, 0);
  c.allowed = s.require_number("centrifuge.allowed", Q::mass, 1e-12);
  c.load = s.number("centrifuge.load", Q::mass, 0, 0);
  const auto percent = [&](const char* key) { return 0.01 * s.number(key, Q::dimensionless, 0, 0, 99); };
  c.tolerance.mount_stiffness = percent("centrifuge.mount_stiffness_percent");
  c.tolerance.mount_damping = percent("centrifuge.mount_damping_percent");
  c.tolerance.sensor_gain = percent("centrifuge.sensor_gain_percent");
  c.tolerance.sensor_angle = s.number("centrifuge.sensor_angle", Q::angle, 0, 0, 1);
  return c;
}

}  // namespace whirl::shaft
