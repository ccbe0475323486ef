// Held inputs with unknown dead time, and torque constants of a run-up, over seeds.
// Usage: bench_identify_drives [seeds = 4] [first seed = 1]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <random>

#include "whirl/identify/drive.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/testing/driven_rotor.hpp"
#include "whirl/testing/held_input.hpp"

using namespace whirl;

namespace {

/// Free runs of another record by the noise that was added to it; dead times 0 to 3 samples.
void held_inputs(const char* between, const testing::Actuator& actuator, Hold hold, int seeds, unsigned first) {
  for (const testing::HeldSystem& system : testing::held_systems()) {
    testing::Actuator own = actuator;
    own.lag *= system.dt;
    double late = 0;
    std::vector<double> ratios;
    int found = 0, warned = 0, beyond = 0;
    for (unsigned seed = first; seed < first + static_cast<unsigned>(seeds); ++seed) {
      std::mt19937_64 random(seed * 40503ULL + 7);
      const double d = std::uniform_real_distribution<double>(0, 3)(random) * system.dt;
      const Recording train = testing::held_record(system, d, 1500, 0.01, 2 * seed + 100, own);
      const Recording other = testing::held_record(system, d, 1000, 0.01, 2 * seed + 101, own);
      identification::SindyOptions o;
      o.states = system.states;
      o.inputs = {"u"};
      o.library = system.library;
      const IdentifiedModel model = identification::fit_sindy({train}, o);
      warned += model.summary.status != Status::ok;
      const bool right = model.timing.size() == 1 && model.timing[0].hold == hold &&
                         (model.states.size() > system.states.size()) == (own.lag > 0);
      found += right;
      if (right) late = std::max(late, std::abs(model.timing[0].dead_time.value - d) / system.dt);
      double ratio = 0;
      for (const identification::StateScore& s : identification::score(model, other)) {
        const Eigen::VectorXd& y = other[s.state];
        ratio = std::max(ratio, s.rmse / (0.01 * std::sqrt((y.array() - y.mean()).square().mean())));
      }
      ratios.push_back(ratio);
      beyond += ratio > 1.2;
    }
    std::sort(ratios.begin(), ratios.end());
    fmt::print(
        "{:25} {:28} found {}/{}, warned {}, dead time within {:.4f} samples, free run by noise: median {:.3f}, beyond "
        "1.2 {}, largest {:.2f}\n",
        system.name, between, found, seeds, warned, late, ratios[ratios.size() / 2], beyond, ratios.back());
    std::fflush(stdout);
  }
}

void torques(int seeds, unsigned first) {
  const testing::DrivenRotor truth;
  const std::pair<const char*, double> expected[] = {
      {"C_m1", truth.motor}, {"C_m2", truth.slope},      {"C_c", truth.coulomb},   {"C_v", truth.viscous},
      {"C_a", truth.drag},   {"k1", truth.k1 / truth.m}, {"c", truth.c / truth.m}, {"e", truth.e}};
  std::vector<double> worst(std::size(expected), 0);
  int unusable = 0;
  for (unsigned seed = first; seed < first + static_cast<unsigned>(seeds); ++seed) {
    Eigen::VectorXd u = Eigen::VectorXd::Ones(9000);
    u.tail(3600).setZero();
    identification::DriveOptions o;
    o.inertia = truth.inertia;
    const IdentifiedModel model =
        identification::identify_drive({testing::driven_record(truth, u, 1e-3, 0, std::pow(10, -1.5), 300 + seed)}, o);
    unusable += model.summary.status == Status::unusable;
    for (std::size_t k = 0; k < worst.size(); ++k) {
      const Estimate* e = model.parameter(expected[k].first);
      worst[k] = std::max(worst[k], e ? std::abs(e->value / expected[k].second - 1) : INFINITY);
    }
  }
  fmt::print("torque constants at 30 dB, {} seeds, unusable {}: largest errors", seeds, unusable);
  for (std::size_t k = 0; k < worst.size(); ++k) fmt::print(" {} {:.2f} %", expected[k].first, 100 * worst[k]);
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 4;
  const auto first = static_cast<unsigned>(argc > 2 ? std::atoi(argv[2]) : 1);
  held_inputs("steps", {}, Hold::zero, seeds, first);
  held_inputs("straight lines", {true, 0}, Hold::first, seeds, first);
  held_inputs("steps, lag of two samples", {false, 2}, Hold::zero, seeds, first);
  torques(seeds, first);
}
