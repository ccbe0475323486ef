// Drawing a long record, and a report of the size of the paper (28 figures).
#include <benchmark/benchmark.h>

#include <cmath>

#include "whirl/report/document.hpp"
#include "whirl/report/rotor_figures.hpp"

namespace {

using namespace whirl;

Recording run_down(Eigen::Index samples) {
  Recording r;
  r.dt = 1e-3;
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(samples, 0, 15);
  const Eigen::ArrayXd size = 3.25e-3 / (1 + (t - 8).square());
  r.add("x", Quantity::displacement, size * (300 * t - 10 * t.square()).cos());
  r.add("y", Quantity::displacement, size * (300 * t - 10 * t.square()).sin());
  return r;
}

void draw_time_traces(benchmark::State& state) {
  const Recording open = run_down(state.range(0)), closed = run_down(state.range(0));
  const report::Figure figure = report::time_traces({{"open loop", open}, {"closed loop", closed}}, {"x", "y"});
  std::size_t bytes = 0;
  for (auto _ : state) bytes = report::to_svg(figure).size();
  state.counters["svg_bytes"] = static_cast<double>(bytes);
}
BENCHMARK(draw_time_traces)->Arg(15'000)->Arg(1'000'000)->Unit(benchmark::kMillisecond);

void report_of_28_figures(benchmark::State& state) {
  const Recording open = run_down(15'000), closed = run_down(15'000);
  const std::vector<report::NamedRun> runs = {{"open loop", open}, {"closed loop", closed}};
  std::size_t bytes = 0;
  for (auto _ : state) {
    report::Document document;
    for (int i = 0; i < 24; ++i) document.figure(report::time_traces(runs, {"x", "y"}), "Displacement.");
    for (int i = 0; i < 3; ++i)
      document.figure(report::phase_plane(runs, "x", {{"a", 0, 7}, {"b", 7, 15}}), "Phase plane.");
    document.figure(report::funnel(runs), "Path.");
    bytes = report::to_html(document).size();
  }
  state.counters["html_bytes"] = static_cast<double>(bytes);
}
BENCHMARK(report_of_28_figures)->Unit(benchmark::kMillisecond);

}  // namespace

BENCHMARK_MAIN();
