#include "whirl/core/angles.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/pages/run_report.hpp"

namespace whirl::pages {

ReportOptions about_machine(const std::filesystem::path& file) {
  constexpr double kFastest = 1e6 * kRadPerSecPerRpm;
  const io::Settings s = io::read_settings(file);
  ReportOptions o;
  o.signature = {s.text("machine.name", ""), s.text("measurement.date", ""), s.text("measurement.analyst", "")};
  o.service_speed = s.number("machine.service", Quantity::angular_velocity, 0, 0, kFastest);
  o.slow_roll = s.number("machine.slow_roll", Quantity::angular_velocity, 0, 0, kFastest);
  o.machine =
      diagnosis::machine_class(s.text("machine.iso_20816", "", {"", "1-rigid", "1-flexible", "2-rigid", "2-flexible"}));
  s.finish();
  return o;
}

}  // namespace whirl::pages
