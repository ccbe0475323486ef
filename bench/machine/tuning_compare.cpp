// Every control method on the default rig with 5 g: the same tuning budget, scenarios and seeds, then the
// robustness matrix. Usage: bench_tuning_compare [evaluations = 160] [matrix = 1]. The model is what an
// identification of this rig gives: stiffness +1 %, cubic -10 %, damping +30 %, unbalance -4 % and +4
// degrees, anisotropy not seen.
#include <fmt/format.h>

#include <complex>
#include <cstdlib>
#include <numbers>

#include "whirl/tuning/compare.hpp"

int main(int argc, char** argv) {
  using namespace whirl;
  const rig::RigParameters rig;
  rig::RigParameters balanced = rig;
  balanced.rotor.added_mass = 0;
  const std::complex<double> error = std::polar(0.96, 4 * std::numbers::pi / 180);
  IdentifiedModel model;
  model.method = "stand-in";
  model.rotor = rig.true_model();
  model.rotor->k1_conj = model.rotor->c_conj = 0;
  model.rotor->k1 *= 1.01;
  model.rotor->k2 *= 0.9;
  model.rotor->c *= 1.3;
  model.rotor->eps *= error;

  tuning::CompareOptions options;
  options.design.hardware = tuning::data_sheet(rig);
  options.design.hardware.modes = {{46, 0.008, 0.02, 1, 0}, {128, 0.006, 0.02, -1, 0}, {310, 0.010, 0.02, 1, 0}};
  options.design.evaluations = argc > 1 ? std::atoi(argv[1]) : 160;
  options.matrix = argc <= 2 || std::atoi(argv[2]) != 0;
  options.balanced_eps = balanced.eccentricity() * error;

  fmt::print(
      "peak |x| of the true disk, um (suppression %), segments 1-4; whole run mean / worst of 5 seeds; u rms "
      "/ peak N; "
      "TV N/s; balanced\n");
  const auto methods = options.methods;
  for (const auto& method : methods) {
    options.methods = {method};
    const tuning::ComparedResult r = compare(model, rig, options).front();
    const tuning::ClosedLoopMetrics& m = r.nominal;
    fmt::print("{:32}", r.label);
    for (std::size_t i = 0; i < 4; ++i) {
      fmt::print(" {:5.0f} ({:4.1f})", 1e6 * m.closed.segment[i], 100 * m.suppression.segment[i]);
    }
    fmt::print(
        " | {:5.1f} / {:5.1f} | {:4.1f} / {:4.1f} | {:5.0f} | {:5.1f} | certified {:.0f}, delay margin "
        "{:.0f} ms\n",
        1e6 * r.peak_mean, 1e6 * r.peak_worst, m.force_rms, m.force_peak, m.total_variation,
        1e6 * r.balanced->closed.all, r.design.margins.at("certified"), 1e3 * r.design.margins.at("delay_margin_s"));
    if (!r.matrix.empty()) fmt::print("   ");
    for (const auto& c : r.matrix) {
      fmt::print(" {}: {:.0f}{};", c.name, 1e6 * c.metrics.closed.all, c.metrics.stable ? "" : " UNSTABLE");
    }
    fmt::print("\n");
    std::fflush(stdout);
  }
  return 0;
}
