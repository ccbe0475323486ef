#include "whirl/diagnosis/standards.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"

namespace whirl::diagnosis {
namespace {

struct HousingLimits {
  std::string_view word;
  MachineClass machine;
  std::array<double, 3> limits;  ///< mm/s rms: A/B, B/C, C/D
};
constexpr std::array<HousingLimits, 4> kHousing{{{"1-rigid", {1, false}, {2.3, 4.5, 7.1}},
                                                 {"1-flexible", {1, true}, {3.5, 7.1, 11.0}},
                                                 {"2-rigid", {2, false}, {1.4, 2.8, 4.5}},
                                                 {"2-flexible", {2, true}, {2.3, 4.5, 7.1}}}};

const HousingLimits& housing(const MachineClass& machine) {
  for (const HousingLimits& h : kHousing) {
    if (h.machine.group == machine.group && h.machine.flexible == machine.flexible) return h;
  }
  throw Error::in_field("group", std::to_string(machine.group), "1 or 2");
}

template <class Limit>
char zone_of(double value, Limit&& limit) {
  for (const char zone : {'A', 'B', 'C'}) {
    if (value <= limit(zone)) return zone;
  }
  return 'D';
}

}  // namespace

using Eigen::Index;

std::optional<Amplification> amplification(const signal::SynchronousCurve& curve, int turns) {
  const Eigen::VectorXd a = curve.vector.cwiseAbs();
  const Index n = a.size();
  if (n < 3 || curve.speed.size() != n) return std::nullopt;
  Index top = 0;
  const double largest = a.maxCoeff(&top), level = largest / std::numbers::sqrt2;
  const auto crossing = [&](Index step) -> std::optional<double> {
    for (Index i = top; i + step >= 0 && i + step < n; i += step) {
      if (a[i + step] > level) continue;
      const double part = (a[i] - level) / (a[i] - a[i + step]);
      return curve.speed[i] + part * (curve.speed[i + step] - curve.speed[i]);
    }
    return std::nullopt;
  };
  const auto before = crossing(-1), after = crossing(1);
  if (!before || !after || *before == *after) return std::nullopt;
  Amplification out;
  out.critical = curve.speed[top];
  out.amplitude = largest;
  out.low = std::min(*before, *after);
  out.high = std::max(*before, *after);
  out.factor = out.critical / (out.high - out.low);
  // Between two revolutions Omega^2 changes by 2 alpha times the angle turned.
  const Index from = std::max<Index>(0, top - 5), to = std::min(n - 1, top + 5);
  out.sweep_rate = (curve.speed[to] * curve.speed[to] - curve.speed[from] * curve.speed[from]) /
                   (2 * kTwoPi * turns * static_cast<double>(to - from));
  out.sweep = std::abs(out.sweep_rate) / (out.critical * out.critical);
  return out;
}

double required_margin(double factor, bool critical_below) {
  if (factor < 2.5) return 0;
  const double margin = 17 * (1 - 1 / (factor - 1.5));
  return 0.01 * (critical_below ? std::min(16.0, margin) : std::min(26.0, 10 + margin));
}

double shaft_vibration_limit(char zone, double speed) {
  if (!(speed > 0)) throw Error::in_field("speed", std::to_string(speed), "positive");
  const double factor = zone == 'A' ? 4800 : zone == 'B' ? 9000 : 13200;
  return 1e-6 * factor / std::sqrt(speed * 60 / kTwoPi);
}

char shaft_vibration_zone(double peak_to_peak, double speed) {
  return zone_of(peak_to_peak, [&](char zone) { return shaft_vibration_limit(zone, speed); });
}

std::optional<MachineClass> machine_class(std::string_view word) {
  for (const HousingLimits& h : kHousing) {
    if (h.word == word) return h.machine;
  }
  return std::nullopt;
}

std::string_view to_string(const MachineClass& machine) { return housing(machine).word; }

double housing_vibration_limit(char zone, const MachineClass& machine) {
  if (zone < 'A' || zone > 'C') throw Error::in_field("zone", std::string(1, zone), "A, B or C");
  return 1e-3 * housing(machine).limits[static_cast<std::size_t>(zone - 'A')];
}

char housing_vibration_zone(double velocity_rms, const MachineClass& machine) {
  return zone_of(velocity_rms, [&](char zone) { return housing_vibration_limit(zone, machine); });
}

double balance_grade(double eccentricity, double speed) { return eccentricity * speed; }

double balance_grade_class(double grade) {
  for (const double g : {0.4, 1.0, 2.5, 6.3, 16.0, 40.0, 100.0, 250.0, 630.0, 1600.0, 4000.0}) {
    if (1e3 * grade <= g) return g;
  }
  return std::numeric_limits<double>::infinity();
}

}  // namespace whirl::diagnosis
