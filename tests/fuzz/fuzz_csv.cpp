// CSV records and tables.
#include "harness.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/info.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const Recording r = parse_csv(bytes, "fuzz.csv");
    r.check();
    require(r.size() >= 2 && r.dt > 0);
    require(!to_string(describe(r)).empty());
  });
  only_errors([&] {
    const Table t = parse_table(bytes, "fuzz.csv");
    for (const Channel& c : t.columns) require(c.samples.size() == t.rows());
  });
  only_errors([&] { parse_csv(bytes, "fuzz.csv", {.rate = 100, .columns = {"1:u_V", "V2:y_mm"}}); });
}
