// Promise: one step of every controller, estimator included, takes at most 1 us in the median.
// Prints per law and estimator the median, p99 and largest time of one step in ns over a simulated run.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <vector>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"

int main() {
  using namespace whirl;
  ControllerDesign d;
  d.model.k1 = 5700;
  d.model.k2 = 1e7;
  d.model.c = 1;
  d.model.eps = {280e-6, 40e-6};
  d.model.gain = 1 / 1.5;
  d.delay = 2.05e-3;
  d.force_limit = 40;
  std::vector<Measurement> readings(20000);
  for (std::size_t k = 0; k < readings.size(); ++k) {
    const double t = 1e-3 * static_cast<double>(k), omega = 188 - 9 * t;
    Measurement& m = readings[k];
    m.t = t;
    m.omega = omega;
    m.omega_dot = -9;
    m.beta = 188 * t - 4.5 * t * t;
    m.x = 1e-4 * std::cos(m.beta) + 1e-6 * std::sin(377 * t);
    m.y = 1e-4 * std::sin(m.beta);
  }
  double worst = 0;
  std::printf("%-14s %-13s %8s %8s %8s  ns\n", "law", "estimator", "median", "p99", "max");
  for (const auto& law : laws()) {
    for (const auto& estimator : estimators()) {
      d.law = law.name;
      d.estimator = estimator.name;
      d.parameters = {{"sensor_delay", 0.25e-3}, {"predict", 1}, {"runout_x_cos_1", 1e-5}};
      Controller controller = make_controller(d);
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
      worst = std::max(worst, median);
      std::printf("%-14s %-13s %8.0f %8.0f %8.0f%s\n", law.name.c_str(), estimator.name.c_str(), median,
                  ns[ns.size() * 99 / 100], ns.back(), std::isfinite(sum) ? "" : "  not finite");
    }
  }
  std::printf("slowest median %.0f ns, target 1000 ns\n", worst);
  return worst <= 1000 ? 0 : 1;
}
