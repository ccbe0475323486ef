#pragma once
#include <span>
#include <string>
#include <string_view>

#include "whirl/core/quantity.hpp"

namespace whirl::io {

/// A unit as it is written after the last underscores of a CSV column, flag or TOML key: `x_mm`, `speed_rpm`.
/// An underscore inside the suffix means "per": `m_s2` is m/s^2, `N_m` is N/m (`Nm` is the torque N m).
struct UnitSuffix {
  std::string_view suffix;
  Quantity quantity;
  double multiply = 1;  ///< SI value = value * multiply / divide + offset
  double divide = 1;
  double offset = 0;
  bool decibel = false;  ///< SI value = 10^(value / 20), an amplitude ratio

  double to_si(double value) const;
  double from_si(double si) const;
};

/// All units, grouped by quantity; the first one of a quantity is its SI unit.
///
/// `g` is the standard gravity 9.80665 m/s^2; grams are written `gram` (after a name that holds "mass" also
/// `g`). `hz` and `rpm` serve both as frequency and as angular velocity; without a wish they are frequency
/// (hz) and angular velocity (rpm).
std::span<const UnitSuffix> all_units();

/// The unit written `suffix`, or null. With a quantity: the one that gives this quantity, or null.
const UnitSuffix* find_unit(std::string_view suffix);
const UnitSuffix* find_unit(std::string_view suffix, Quantity quantity);
/// The SI unit of a quantity as a suffix, e.g. `m_s2`.
const UnitSuffix& si_suffix(Quantity quantity);

/// `acc_m_s2` -> name "acc", unit m/s^2. The longest known suffix counts; `unit` is null when there is none.
struct NameWithUnit {
  std::string name;
  const UnitSuffix* unit = nullptr;
};
NameWithUnit split_unit(std::string_view name_with_suffix);

/// The suffixes allowed, as text for messages: all, or those of one quantity.
std::string allowed_units();
std::string allowed_units(Quantity quantity);
/// Why `name` has no usable unit, with the nearest spelling or the allowed list: "column 'x_Mm': ...".
std::string unit_problem(std::string_view name);

/// Why a column of one quantity is none of another: "column 'force' is a mass, must be a force; allowed units: ...".
std::string quantity_problem(std::string_view column, Quantity is, Quantity wanted);

/// The candidate with the smallest edit distance to `word`; empty when none is near. For "did you mean".
std::string nearest(std::string_view word, std::span<const std::string> candidates);

}  // namespace whirl::io
