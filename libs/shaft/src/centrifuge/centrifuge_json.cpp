#include "whirl/shaft/centrifuge/centrifuge_json.hpp"

namespace whirl::shaft {

using io::Json;

Json load_check_json(const LoadCheck& c) {
  Json named = Json::array(), changes = Json::array();
  for (const int bucket : c.named) named.push(bucket);
  for (const BucketChange& b : c.changes)
    changes.push(Json::object().set("bucket", b.bucket).set("mass", io::to_json(b.mass, "kg")));
  return io::start_document("whirl.centrifuge_check", 1)
      .set("summary", io::to_json(c.summary))
      .set("verdict", to_string(c.verdict))
      .set("wrong_probability", c.wrong_probability)
      .set("imbalance", io::to_json(c.imbalance, "kg"))
      .set("angle", io::to_json(c.angle, "rad"))
      .set("named", std::move(named))
      .set("changes", std::move(changes))
      .set("first_critical", c.first_critical)
      .set("decided_at", c.decided_at)
      .set("seconds", c.seconds)
      .set("smallest_found", c.smallest_found)
      .set("miss_rate", c.miss_rate)
      .set("seconds_more", c.seconds_more)
      .set("chi_square", c.chi_square)
      .set("misfit_deviations", c.misfit_deviations);
}

Json speed_limits_json(const SpeedLimits& l) {
  Json sensors = Json::array();
  for (std::size_t k = 0; k < l.sensors.size(); ++k) {
    const auto row = static_cast<Eigen::Index>(k);
    sensors.push(Json::object()
                     .set("name", l.sensors[k].name)
                     .set("unit", l.sensors[k].accelerometer ? "m/s^2" : "m")
                     .set("expected", Json(Eigen::VectorXd(l.expected.row(row).transpose())))
                     .set("trip", Json(Eigen::VectorXd(l.trip.row(row).transpose()))));
  }
  return io::start_document("whirl.centrifuge_limits", 1)
      .set("speed", l.speeds)
      .set("sensors", std::move(sensors))
      .set("caught", Json(l.caught))
      .set("criticals", l.criticals);
}

}  // namespace whirl::shaft
