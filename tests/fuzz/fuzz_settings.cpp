// TOML settings: any text gives either settings or an Error, from parsing and from every getter.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "whirl/io/settings.hpp"

namespace {

template <class F>
void only_errors(F&& f) {
  try {
    f();
  } catch (const whirl::Error& e) {
    if (std::string_view(e.what()).empty()) std::abort();
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using whirl::Quantity;
  only_errors([&] {
    const auto s = whirl::parse_settings({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
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
  return 0;
}
