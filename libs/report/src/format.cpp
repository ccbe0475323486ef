#include "whirl/report/format.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "whirl/report/amplitude_scale.hpp"

namespace whirl::report {
namespace {

constexpr std::string_view kMinus = "\u2212";
constexpr std::array<std::string_view, 10> kSuperscript = {"⁰", "¹", "²", "³", "⁴", "⁵", "⁶", "⁷", "⁸", "⁹"};

std::string superscript(int n) {
  std::string out = n < 0 ? "⁻" : "";
  for (const char digit : std::to_string(std::abs(n))) out += kSuperscript[static_cast<std::size_t>(digit - '0')];
  return out;
}

/// Exponent of the first significant digit after rounding to `digits` digits.
int leading_exponent(double value, int digits) {
  const std::string text = fmt::format("{:.{}e}", std::abs(value), digits - 1);
  return std::stoi(text.substr(text.find('e') + 1));
}

}  // namespace

Unit si(Quantity quantity) { return {quantity == Quantity::dimensionless ? "" : pretty_unit(si_unit(quantity)), 1}; }

Unit engineering_unit(Quantity quantity, double magnitude) {
  struct Choice {
    double from;
    std::string_view symbol;
    double factor;
  };
  const auto choose = [&](std::initializer_list<Choice> choices) {
    const Choice* best = choices.begin();
    for (const Choice& choice : choices) {
      if (magnitude >= choice.from * (1 - 1e-9)) best = &choice;
    }
    return Unit{std::string(best->symbol), best->factor};
  };
  switch (quantity) {
    case Quantity::displacement:
      return choose({{0, "µm", 1e-6}, {0.1e-3, "mm", 1e-3}, {1, "m", 1}});
    case Quantity::velocity:
      return choose({{0, "mm/s", 1e-3}, {1, "m/s", 1}});
    case Quantity::frequency:
      return choose({{0, "Hz", 1}, {10e3, "kHz", 1e3}});
    case Quantity::time:
      return choose({{0, "µs", 1e-6}, {1e-3, "ms", 1e-3}, {1, "s", 1}});
    case Quantity::voltage:
      return choose({{0, "mV", 1e-3}, {1, "V", 1}});
    case Quantity::current:
      return choose({{0, "mA", 1e-3}, {1, "A", 1}});
    case Quantity::force:
      return choose({{0, "mN", 1e-3}, {0.1, "N", 1}, {10e3, "kN", 1e3}});
    case Quantity::pressure:
      return choose({{0, "Pa", 1}, {1e3, "kPa", 1e3}, {1e6, "MPa", 1e6}});
    case Quantity::mass:
      return choose({{0, "g", 1e-3}, {1, "kg", 1}});
    case Quantity::strain:
      return {"µm/m", 1e-6};
    default:
      return si(quantity);
  }
}

std::string format_fixed(double value, int decimals) {
  if (std::isnan(value)) return "–";
  if (std::isinf(value)) return value > 0 ? "∞" : std::string(kMinus) + "∞";
  std::string text = fmt::format("{:.{}f}", std::abs(value), std::max(0, decimals));
  const bool zero = text.find_first_not_of("0.") == std::string::npos;
  return (std::signbit(value) && !zero ? std::string(kMinus) : "") + text;
}

std::string format_number(double value, int digits) {
  if (!std::isfinite(value) || value == 0) return format_fixed(value, 0);
  const int exponent = leading_exponent(value, digits);
  if (exponent >= -4 && exponent < 6) return format_fixed(value, digits - 1 - exponent);
  return format_fixed(value / std::pow(10.0, exponent), digits - 1) + power_of_ten(exponent);
}

std::string_view short_name(AmplitudeKind kind) {
  return kind == AmplitudeKind::peak ? "peak" : kind == AmplitudeKind::rms ? "rms" : "p-p";
}

Unit AmplitudeScale::unit_for(Quantity quantity, double largest) const {
  return unit && unit->first == quantity ? unit->second : engineering_unit(quantity, largest);
}

std::string AmplitudeScale::text(double value, Quantity quantity, int digits) const {
  const Unit shown = unit_for(quantity, std::abs(value));
  const std::string number = format_number(value / shown.factor, digits);
  return fmt::format("{}{}{} {}", number, shown.symbol.empty() ? "" : " ", shown.symbol, short_name(kind));
}

std::string format_quantity(double value, Quantity quantity, int digits) {
  const Unit unit = engineering_unit(quantity, std::abs(value));
  const std::string number = format_number(value / unit.factor, digits);
  return unit.symbol.empty() ? number : number + " " + unit.symbol;
}

std::string format_amplitude(double value, AmplitudeKind kind, Quantity quantity, int digits) {
  return AmplitudeScale(kind).text(value, quantity, digits);
}

RoundedEstimate round_estimate(const Estimate& estimate) {
  const double value = estimate.value;
  const double sd = std::abs(estimate.sd);
  const bool known = std::isfinite(sd) && sd > 0;
  if (!std::isfinite(value)) return {format_fixed(value, 0), "", 0};
  int last = value == 0 ? 0 : leading_exponent(value, 5) - 4;  // exponent of the last digit shown
  int first = value == 0 ? 0 : leading_exponent(value, 5);
  if (known) {
    const bool two_digits = fmt::format("{:.1e}", sd).front() < '3';
    last = leading_exponent(sd, two_digits ? 2 : 1) - (two_digits ? 1 : 0);
    first = std::max(value == 0 ? last : leading_exponent(value, 5), leading_exponent(sd, 2));
  }
  // A power of ten where digits left of the point would be invented zeros or leading zeros would hide the number.
  const int exponent = (last > 0 || first > 6 || first < -3) ? first : 0;
  const double scale = std::pow(10.0, exponent);
  RoundedEstimate out;
  out.exponent = exponent;
  out.value = format_fixed(value / scale, exponent - last);
  if (known) out.deviation = format_fixed(sd / scale, exponent - last);
  return out;
}

std::string format_estimate(const Estimate& estimate, std::string_view unit) {
  const RoundedEstimate rounded = round_estimate(estimate);
  std::string text = rounded.value;
  if (!rounded.deviation.empty()) text += " ± " + rounded.deviation;
  if (rounded.exponent != 0) {
    text = (rounded.deviation.empty() ? text : "(" + text + ")") + power_of_ten(rounded.exponent);
  } else if (!rounded.deviation.empty() && !unit.empty()) {
    text = "(" + text + ")";
  }
  return unit.empty() ? text : text + " " + pretty_unit(unit);
}

std::string power_of_ten(int exponent) { return "×10" + superscript(exponent); }

std::string pretty_unit(std::string_view unit) {
  std::string out;
  for (std::size_t i = 0; i < unit.size(); ++i) {
    if (unit[i] == '^' && i + 1 < unit.size()) {
      std::size_t end = i + 1;
      if (unit[end] == '-') ++end;
      while (end < unit.size() && unit[end] >= '0' && unit[end] <= '9') ++end;
      if (end > i + 1 && unit[end - 1] != '-') {
        out += superscript(std::stoi(std::string(unit.substr(i + 1, end - i - 1))));
        i = end - 1;
        continue;
      }
    }
    out += unit[i] == '*' ? "·" : std::string(1, unit[i]);
  }
  return out;
}

std::string escape_markup(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for (const char c : text) {
    switch (c) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        if (static_cast<unsigned char>(c) >= 0x20 || c == '\n' || c == '\t') out += c;
    }
  }
  return out;
}

std::string escape_csv(std::string_view text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace whirl::report
