#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <random>
#include <string_view>
#include <vector>

#include "whirl/testing/machines.hpp"

namespace whirl::testing {

struct ManyEffects {
  DrawnMachine drawn;
  /// Labels of the terms that it takes, "a|b": either, because a steady run-down cannot tell them.
  std::vector<std::string_view> causes;
};

/// A rotor with all at once that good probes see of a real one: leaning probes of different gain, a gyroscopic force, a
/// spring of fifth order, one that is stiffer to one side, and `more` of: stiffness that differs along two axes, force
/// along i z, damping that grows with |v|, stiffness that follows the speed. Sizes are half to all of those of
/// draw_machine.
inline ManyEffects many_effects(unsigned long long seed, std::size_t more) {
  ManyEffects all{
      draw_machine(Oddity::none, seed),
      {"sensor gain", "sensor angle", "gyroscopic term", "quintic stiffness", "springs stiffer to one side"}};
  std::mt19937_64 random(seed * 6367 + 29);
  const auto size = [&] { return std::uniform_real_distribution<double>(0.5, 1)(random); };
  const auto signed_size = [&] { return random() % 2 == 0 ? size() : -size(); };
  const auto angle = [&] { return 2 * std::numbers::pi * size(); };
  Machine& m = all.drawn.machine;
  const double w = std::sqrt(m.k);
  m.gain_y = 1 + 0.03 * signed_size();
  m.sensor_angle += std::numbers::pi / 90 * signed_size();
  m.gyroscopic = 0.02 * signed_size();
  m.quintic = 0.1 * size() * m.k / 8.1e-11;
  const double lean = 0.04 * size() * m.k / 1e-3, towards = angle();
  m.lean_x = lean * std::cos(towards), m.lean_y = lean * std::sin(towards);
  std::array<int, 4> order{0, 1, 2, 3};
  std::ranges::shuffle(order, random);
  for (std::size_t i = 0; i < std::min(more, order.size()); ++i) {
    switch (order[i]) {
      case 0:
        m.split = 0.01 * size(), m.split_angle = angle();
        all.causes.emplace_back("anisotropic stiffness");
        break;
      case 1:
        m.cross = 0.2 * size() * m.c * w;
        all.causes.emplace_back("cross-coupled stiffness");
        break;
      case 2:
        m.quadratic = size() * m.c / (w * 1e-3);
        all.causes.emplace_back("quadratic damping");
        break;
      default:
        m.k_with_speed = 0.02 * signed_size();
        all.causes.emplace_back("stiffness changing with speed|stiffness drifting in time");
    }
  }
  return all;
}

}  // namespace whirl::testing
