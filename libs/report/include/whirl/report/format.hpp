#pragma once
#include <string>
#include <string_view>

#include "whirl/core/estimate.hpp"
#include "whirl/core/quantity.hpp"

namespace whirl::report {

/// A unit in which SI values are shown: shown value = SI value / factor.
struct Unit {
  std::string symbol;  ///< e.g. "mm"; "" for a dimensionless number
  double factor = 1;   ///< SI value of one such unit, e.g. 1e-3
};

/// SI unit of the quantity itself, "" for dimensionless.
Unit si(Quantity quantity);
/// The engineering unit that shows `magnitude` (SI, absolute value) with one to three digits before the point:
/// um, mm, m for displacement; Hz, kHz for frequency. Quantities without prefixes in use (rad, ...) keep their SI unit.
Unit engineering_unit(Quantity quantity, double magnitude);

/// `value` with `digits` significant digits; powers of ten only outside 1e-4 .. 1e6. "–" for NaN, so that a missing
/// number shows as missing.
std::string format_number(double value, int digits = 4);
/// `value` with `decimals` digits after the point and a true minus sign.
std::string format_fixed(double value, int decimals);

/// "12.3 µm", "2.10 kHz": a value in SI in its engineering unit.
std::string format_quantity(double value, Quantity quantity, int digits = 3);
/// "3.25 mm peak", "6.45 mm p-p", "1.20 mm rms": an amplitude always names which it is.
std::string format_amplitude(double value, AmplitudeKind kind, Quantity quantity = Quantity::displacement,
                             int digits = 3);

/// Value and standard deviation rounded together: the deviation keeps two significant digits when it starts with 1 or 2
/// and one otherwise, the value stops at the same decimal. With a power of ten where plain digits would be long:
/// mantissa "1.8492", deviation "0.0004", exponent 5. Without a known deviation the value has five significant digits.
struct RoundedEstimate {
  std::string value, deviation;  ///< deviation is empty when unknown
  int exponent = 0;
};
RoundedEstimate round_estimate(const Estimate& estimate);
/// "5667.3 ± 0.4 1/s²" or "(1.8492 ± 0.0004)×10⁵ 1/s²".
std::string format_estimate(const Estimate& estimate, std::string_view unit = "");

/// "×10⁵" written with superscript characters.
std::string power_of_ten(int exponent);
/// Plain-text unit with superscripts, "1/(m^2 s^2)" -> "1/(m² s²)".
std::string pretty_unit(std::string_view unit);

/// Text safe inside XML and HTML content and quoted attributes: & < > " ' are replaced, and characters that XML 1.0
/// does not allow are dropped.
std::string escape_markup(std::string_view text);

/// One CSV cell: quoted when it has to be.
std::string escape_csv(std::string_view text);

}  // namespace whirl::report
