#include "whirl/io/units.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "formats/usual_unit.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/names.hpp"

namespace whirl::io {
namespace {

using Q = Quantity;
constexpr double kGravity = 9.80665;        // m/s^2, standard (CGPM 1901)
constexpr double kPound = 4.4482216152605;  // N per lbf: 0.45359237 kg times standard gravity
constexpr double kInch = 0.0254;            // m

// Submultiples divide by a power of ten, which rounds as the literal in SI does; a factor such as 1e-3 would
// not.
constexpr std::array kUnits{
    UnitSuffix{"s", Q::time},
    UnitSuffix{"ms", Q::time, 1, 1e3},
    UnitSuffix{"us", Q::time, 1, 1e6},
    UnitSuffix{"min", Q::time, 60},
    UnitSuffix{"m", Q::displacement},
    UnitSuffix{"cm", Q::displacement, 1, 1e2},
    UnitSuffix{"mm", Q::displacement, 1, 1e3},
    UnitSuffix{"um", Q::displacement, 1, 1e6},
    UnitSuffix{"nm", Q::displacement, 1, 1e9},
    UnitSuffix{"in", Q::displacement, kInch},
    UnitSuffix{"mil", Q::displacement, kInch, 1e3},
    UnitSuffix{"m_s", Q::velocity},
    UnitSuffix{"mm_s", Q::velocity, 1, 1e3},
    UnitSuffix{"in_s", Q::velocity, kInch},
    UnitSuffix{"m_s2", Q::acceleration},
    UnitSuffix{"mm_s2", Q::acceleration, 1, 1e3},
    UnitSuffix{"g", Q::acceleration, kGravity},
    UnitSuffix{"N", Q::force},
    UnitSuffix{"mN", Q::force, 1, 1e3},
    UnitSuffix{"kN", Q::force, 1e3},
    UnitSuffix{"lbf", Q::force, kPound},
    UnitSuffix{"kgf", Q::force, kGravity},
    UnitSuffix{"rad", Q::angle},
    UnitSuffix{"deg", Q::angle, std::numbers::pi, 180},
    UnitSuffix{"rev", Q::angle, kTwoPi},
    UnitSuffix{"rad_s", Q::angular_velocity},
    UnitSuffix{"rpm", Q::angular_velocity, kTwoPi, 60},
    UnitSuffix{"deg_s", Q::angular_velocity, std::numbers::pi, 180},
    UnitSuffix{"rad_s2", Q::angular_acceleration},
    UnitSuffix{"rpm_s", Q::angular_acceleration, kTwoPi, 60},
    UnitSuffix{"hz", Q::frequency},
    UnitSuffix{"Hz", Q::frequency},
    UnitSuffix{"kHz", Q::frequency, 1e3},
    UnitSuffix{"V", Q::voltage},
    UnitSuffix{"mV", Q::voltage, 1, 1e3},
    UnitSuffix{"A", Q::current},
    UnitSuffix{"mA", Q::current, 1, 1e3},
    UnitSuffix{"Pa", Q::pressure},
    UnitSuffix{"kPa", Q::pressure, 1e3},
    UnitSuffix{"MPa", Q::pressure, 1e6},
    UnitSuffix{"bar", Q::pressure, 1e5},
    UnitSuffix{"kg", Q::mass},
    UnitSuffix{"gram", Q::mass, 1, 1e3},
    UnitSuffix{"K", Q::temperature},
    UnitSuffix{"degC", Q::temperature, 1, 1, 273.15},
    UnitSuffix{"strain", Q::strain},
    UnitSuffix{"ustrain", Q::strain, 1, 1e6},
    UnitSuffix{"1", Q::dimensionless},
    UnitSuffix{"percent", Q::dimensionless, 1, 1e2},
    UnitSuffix{"dB", Q::dimensionless, 1, 1, 0, true},
    UnitSuffix{"Nm", Q::torque},
    UnitSuffix{"mNm", Q::torque, 1, 1e3},
    UnitSuffix{"N_m", Q::stiffness},
    UnitSuffix{"N_mm", Q::stiffness, 1e3},
    UnitSuffix{"kN_m", Q::stiffness, 1e3},
    UnitSuffix{"N_m3", Q::cubic_stiffness},
    UnitSuffix{"N_mm3", Q::cubic_stiffness, 1e9},
    UnitSuffix{"Ns_m", Q::damping},
    UnitSuffix{"kgm2", Q::moment_of_inertia},
    UnitSuffix{"1_s", Q::rate},
    UnitSuffix{"1_s2", Q::rate_squared},
    UnitSuffix{"N_V", Q::force_constant},
    UnitSuffix{"m2_s2", Q::specific_energy},
    UnitSuffix{"m2_s3", Q::specific_power},
    // Second readings, found only when the quantity is asked for.
    UnitSuffix{"hz", Q::angular_velocity, kTwoPi},
    UnitSuffix{"Hz", Q::angular_velocity, kTwoPi},
    UnitSuffix{"rpm", Q::frequency, 1, 60},
};

}  // namespace

double UnitSuffix::to_si(double value) const {
  if (decibel) return std::pow(10.0, value / 20);
  return value * multiply / divide + offset;
}

double UnitSuffix::from_si(double si) const {
  if (decibel) return 20 * std::log10(si);
  return (si - offset) * divide / multiply;
}

std::span<const UnitSuffix> all_units() { return kUnits; }

const UnitSuffix* find_unit(std::string_view suffix) {
  const auto it = std::find_if(kUnits.begin(), kUnits.end(), [&](const UnitSuffix& u) { return u.suffix == suffix; });
  return it == kUnits.end() ? nullptr : &*it;
}

const UnitSuffix* find_unit(std::string_view suffix, Quantity quantity) {
  const auto it = std::find_if(kUnits.begin(), kUnits.end(),
                               [&](const UnitSuffix& u) { return u.suffix == suffix && u.quantity == quantity; });
  return it == kUnits.end() ? nullptr : &*it;
}

const UnitSuffix& si_suffix(Quantity quantity) {
  return *std::find_if(kUnits.begin(), kUnits.end(), [&](const UnitSuffix& u) { return u.quantity == quantity; });
}

NameWithUnit split_unit(std::string_view name) {
  for (std::size_t at = name.find('_', 1); at != std::string_view::npos; at = name.find('_', at + 1)) {
    const std::string_view base = name.substr(0, at);
    const std::string_view suffix = name.substr(at + 1);
    const bool gram = suffix == "g" && base.find("mass") != std::string_view::npos;
    if (const UnitSuffix* unit = find_unit(gram ? "gram" : suffix)) return {std::string(base), unit};
  }
  return {std::string(name), nullptr};
}

std::string allowed_units() {
  std::string out;
  for (const UnitSuffix& u : kUnits) {
    if (&u == find_unit(u.suffix)) out.append(out.empty() ? "" : " ").append(u.suffix);
  }
  return out;
}

std::string allowed_units(Quantity quantity) {
  std::string out;
  for (const UnitSuffix& u : kUnits) {
    if (u.quantity == quantity) out.append(out.empty() ? "" : " ").append(u.suffix);
  }
  return out;
}

std::string_view usual_unit(std::string_view name) {
  const std::string word = small_letters(name);
  const auto is = [&](std::initializer_list<std::string_view> words) {
    return std::find(words.begin(), words.end(), word) != words.end();
  };
  if (is({"t", "time", "dt"})) return "s";
  if (is({"beta", "angle", "phi", "phase", "theta", "rotation"})) return "rad";
  if (is({"speed", "rpm", "omega", "n"})) return "rpm";
  if (is({"force", "f", "u", "ux", "uy", "hammer", "load"})) return "N";
  if (word.starts_with("acc")) return "m_s2";
  if (is({"v", "vx", "vy", "velocity"})) return "m_s";
  return "mm";
}

std::string quantity_problem(std::string_view column, Quantity is, Quantity wanted) {
  const auto named = [](Quantity q) {
    const std::string_view name = to_string(q);
    return q == Quantity::dimensionless ? std::string("number without a unit")
                                        : fmt::format("{} {}", name.front() == 'a' ? "an" : "a", name);
  };
  return fmt::format("column '{}' is {}, must be {}; allowed units: {}", column, named(is), named(wanted),
                     allowed_units(wanted));
}

std::string unit_problem(std::string_view name) {
  const std::size_t at = name.find('_', 1);
  if (at == std::string_view::npos) {
    return fmt::format(
        "'{}' has no unit; write name_unit, e.g. '{}_{}', or '{}_1' for a number without unit; allowed units: {}", name,
        name, usual_unit(name), name, allowed_units());
  }
  const std::string_view suffix = name.substr(name.rfind('_') + 1);
  std::string hint;
  for (const UnitSuffix& u : kUnits) {
    if (small_letters(u.suffix) == small_letters(suffix)) hint = fmt::format(" (did you mean '{}'?)", u.suffix);
  }
  return fmt::format("'{}' has the unknown unit '{}'{}; allowed units: {}", name, suffix, hint, allowed_units());
}

std::string nearest(std::string_view word, std::span<const std::string> candidates) {
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, word.size() / 2);
  const std::string w = small_letters(word);
  for (const std::string& candidate : candidates) {
    const std::string c = small_letters(candidate);
    // Edit distance in which two neighbours that changed places count once; three rows at a time.
    std::vector<std::size_t> before(c.size() + 1), last(c.size() + 1), row(c.size() + 1);
    std::iota(row.begin(), row.end(), std::size_t{0});
    for (std::size_t i = 0; i < w.size(); ++i) {
      std::swap(before, last);
      std::swap(last, row);
      row[0] = i + 1;
      for (std::size_t j = 0; j < c.size(); ++j) {
        row[j + 1] = std::min({last[j] + (w[i] == c[j] ? 0 : 1), row[j] + 1, last[j + 1] + 1});
        if (i > 0 && j > 0 && w[i] == c[j - 1] && w[i - 1] == c[j])
          row[j + 1] = std::min(row[j + 1], before[j - 1] + 1);
      }
    }
    if (row.back() < best_distance) {
      best_distance = row.back();
      best = candidate;
    }
  }
  return best;
}

}  // namespace whirl::io
