// TOML settings, from parsing and from every getter.
#include <string>

#include "harness.hpp"
#include "whirl/io/settings.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const auto s = io::parse_settings(bytes, "fuzz.toml");
    only_errors([&] { s.number("rotor.mass", Quantity::mass, 1, 0, 10); });
    only_errors([&] { s.number("rotor.ratio", Quantity::dimensionless, 1); });
    only_errors([&] { s.integer("laser.bits", 16, 1, 32); });
    only_errors([&] { s.flag("laser.on", true); });
    only_errors([&] { s.text("title", "", {"a rig", "x"}); });
    only_errors([&] { s.numbers("laser.range", Quantity::displacement, {}); });
    only_errors([&] { s.texts("axes", {}); });
    for (std::size_t i = 0; i < s.count("fault"); ++i) {
      only_errors([&] { s.require_number("fault[" + std::to_string(i) + "].start", Quantity::time); });
    }
    double field = 0;
    only_errors([&] { s.assign("rotor", "speed_rpm", field, 1); });
    only_errors([&] { s.finish(); });
  });
}
