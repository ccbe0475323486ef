// CSV records and tables: any bytes give either a valid record or an Error.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/info.hpp"

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
  const std::string_view bytes(reinterpret_cast<const char*>(data), size);
  only_errors([&] {
    const whirl::Recording r = whirl::parse_csv(bytes, "fuzz.csv");
    r.check();
    if (r.size() < 2 || !(r.dt > 0)) std::abort();
    if (whirl::to_string(whirl::describe(r)).empty()) std::abort();
  });
  only_errors([&] {
    const whirl::Table t = whirl::parse_table(bytes, "fuzz.csv");
    for (const whirl::Channel& c : t.columns) {
      if (c.samples.size() != t.rows()) std::abort();
    }
  });
  only_errors([&] { whirl::parse_csv(bytes, "fuzz.csv", {.rate = 100, .columns = {"1:u_V", "V2:y_mm"}}); });
  return 0;
}
