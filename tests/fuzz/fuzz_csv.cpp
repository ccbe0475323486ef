// CSV records and tables.
#include "harness.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/info.hpp"

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const Recording r = io::parse_csv(bytes, "fuzz.csv");
    r.check();
    require(r.size() >= 2 && r.dt > 0);
    io::SignalTable table{.abscissa = Quantity::time, .start = r.t0, .step = r.dt};
    for (const Channel& c : r.channels) table.signals.push_back({c.name, "", c.quantity, c.samples, {}});
    require(!to_string(io::describe({.source = r.source, .tables = {std::move(table)}})).empty());
  });
  only_errors([&] {
    const io::Table t = io::parse_table(bytes, "fuzz.csv");
    for (const Channel& c : t.columns) require(c.samples.size() == t.rows());
  });
  only_errors([&] { io::parse_csv(bytes, "fuzz.csv", {.rate = 100, .columns = {"1:u_V", "V2:y_mm"}}); });
}
