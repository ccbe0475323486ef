// Promise: one step of every controller, estimator included, takes at most 1 us in the median, both axes, with
// supervision too; of the predictive law also when it stands at its limit, up to a horizon of 16. Prints per law and
// estimator the median, p99 and largest time of one step in ns over a simulated run-down, and for model predictive
// control the same with readings and a force limit that keep it at its limits.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/testing/designs.hpp"

namespace {

using namespace whirl;

/// The median, ns; prints the row.
double row(const ControllerDesign& d, const std::vector<Measurement>& readings, const std::string& label) {
  control::Controller controller = control::make_controller(d);
  std::vector<double> ns;
  ns.reserve(readings.size());
  double sum = 0;
  for (const Measurement& m : readings) {
    const auto start = std::chrono::steady_clock::now();
    const auto out = controller.step(m);
    const auto stop = std::chrono::steady_clock::now();
    sum += out->ux;
    ns.push_back(std::chrono::duration<double, std::nano>(stop - start).count());
  }
  std::ranges::sort(ns);
  const double median = ns[ns.size() / 2];
  std::printf("%-22s %-13s %8.0f %8.0f %8.0f%s\n", label.c_str(), d.estimator.c_str(), median, ns[ns.size() * 99 / 100],
              ns.back(), std::isfinite(sum) ? "" : "  not finite");
  return median;
}

}  // namespace

int main() {
  const std::vector<Measurement> readings = testing::run_down_readings();
  double worst = 0;
  std::printf("%-22s %-13s %8s %8s %8s  ns\n", "law", "estimator", "median", "p99", "max");
  for (const auto& law : control::laws()) {
    for (const auto& estimator : control::estimators()) {
      ControllerDesign d = testing::design_of(law.name, estimator.name);
      d.parameters["predict"] = 1;
      d.parameters["runout_x_cos_1"] = 1e-5;
      worst = std::max(worst, row(d, readings, law.name));
    }
  }
  for (const auto& law : control::laws()) {
    for (const char* estimator : {"lpf", "kfo"}) {
      ControllerDesign d = testing::design_of(law.name, estimator);
      d.parameters["predict"] = 1;
      d.parameters["supervise"] = 1;
      d.parameters["watch_level"] = 1;  // nothing is found in these readings, every step is whole
      worst = std::max(worst, row(d, readings, law.name + ", supervised"));
    }
  }
  for (const double horizon : {8.0, 12.0, 16.0, 32.0}) {
    ControllerDesign d = testing::design_of("mpc", "kfe");
    d.parameters["predict"] = 1;
    d.parameters["horizon"] = horizon;
    d.force_limit = 5;
    const double median =
        row(d, testing::run_down_readings(2e-3), "mpc at its limit, " + std::to_string(static_cast<int>(horizon)));
    if (horizon <= 16) worst = std::max(worst, median);
  }
  std::printf("slowest median %.0f ns, target 1000 ns\n", worst);
  return worst <= 1000 ? 0 : 1;
}
