// Between a universal file in its own units and the SI values of the toolkit.
#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <numbers>

#include "formats/format.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/uff.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

constexpr std::pair<int, Quantity> kQuantities[] = {{8, Quantity::displacement},
                                                    {11, Quantity::velocity},
                                                    {12, Quantity::acceleration},
                                                    {13, Quantity::force},
                                                    {15, Quantity::pressure}};

Quantity quantity_of(int type) {
  const auto* const known = std::ranges::find(kQuantities, type, &std::pair<int, Quantity>::first);
  return known == std::end(kQuantities) ? Quantity::dimensionless : known->second;
}

int type_of(Quantity quantity) {
  const auto* const known = std::ranges::find(kQuantities, quantity, &std::pair<int, Quantity>::second);
  return known == std::end(kQuantities) ? 1 : known->first;
}

bool is_blank(const std::string& unit) { return unit.empty() || unit == "NONE"; }

// Dataset 164 with code 1 states that the file is in SI.
bool states_si(const UffFile& file) { return file.units.size() == 1 && file.units[0].code == 1; }

// The unit of the one unit system that dataset 164 states, of which a value divided by its factor is SI; nothing for
// quantities that it does not say, or without a factor.
std::optional<UnitSuffix> system_unit(const UffFile& file, Quantity quantity) {
  if (file.units.size() != 1) return {};
  const bool length =
      quantity == Quantity::displacement || quantity == Quantity::velocity || quantity == Quantity::acceleration;
  if (!length && quantity != Quantity::force) return {};
  const UffUnits& units = file.units.front();
  const double factor = units.code == 1 ? 1 : length ? units.length : units.force;
  if (!(factor > 0) || !std::isfinite(factor)) return {};
  UnitSuffix unit = si_suffix(quantity);
  unit.divide = factor;
  return unit;
}

// To Hz or s; 0 where the unit is none of these. A blank unit is SI, as the format says.
double abscissa_scale(const UffAxis& axis, Quantity over) {
  if (is_blank(axis.unit)) return 1;
  const UnitSuffix* unit = unit_from_label(axis.unit);
  if (unit == nullptr) return 0;
  if (unit->quantity == over) return unit->to_si(1);
  const bool angular = over == Quantity::frequency && unit->quantity == Quantity::angular_velocity;
  return angular ? unit->to_si(1) / (2 * std::numbers::pi) : 0;
}

UnitSuffix motion_unit(const UffFile& file, const UffAxis& axis, const std::string& label, const std::string& what,
                       const UnitSuffix* meant) {
  if (const UnitSuffix* unit = unit_from_label(label)) return *unit;
  if (is_blank(label)) {
    const auto unit = system_unit(file, quantity_of(axis.type));
    if (unit && (meant == nullptr || meant->quantity == unit->quantity)) return *unit;
  }
  if (is_blank(label) && meant != nullptr) {
    const Quantity stated = quantity_of(axis.type);
    if (stated == Quantity::dimensionless || stated == meant->quantity) return *meant;
    throw Error::in_file(
        file.source, 0,
        fmt::format("{} shows {} by its axis: --kind says {}", what, to_string(stated), to_string(meant->quantity)));
  }
  if (is_blank(label) && states_si(file) && quantity_of(axis.type) != Quantity::dimensionless) {
    return si_suffix(quantity_of(axis.type));
  }
  throw Error::in_file(
      file.source, 0,
      is_blank(label) ? fmt::format("{} has no unit: state --kind if its values are in SI", what)
                      : fmt::format("{} has the unknown unit '{}' (known units: {})", what, label, allowed_units()));
}

// A point without direction is known by its name, where it has one.
std::string point_name(const UffPoint& point) {
  if (point.direction == 0 && !is_blank(point.name)) return point.name;
  static const char* const names[] = {"-RZ", "-RY", "-RX", "-Z",  "-Y",  "-X", "S",
                                      "+X",  "+Y",  "+Z",  "+RX", "+RY", "+RZ"};
  const int direction = point.direction >= -6 && point.direction <= 6 ? point.direction : 0;
  return fmt::format("{}:{}", point.node, names[direction + 6]);
}

UffPoint point_of(const std::string& name, long number) {
  static const char* const names[] = {"+X", "+Y", "+Z", "+RX", "+RY", "+RZ"};
  UffPoint point;
  point.node = number;
  const std::size_t colon = name.rfind(':');
  if (colon == std::string::npos) {
    point.name = name;
    return point;
  }
  const std::string direction = name.substr(colon + 1);
  for (int k = 0; k < 6; ++k) {
    if (direction == names[k]) point.direction = k + 1;
    if (direction == "-" + std::string(names[k]).substr(1)) point.direction = -(k + 1);
  }
  char* end = nullptr;
  const long node = std::strtol(name.c_str(), &end, 10);
  if (end == name.c_str() + colon && end != name.c_str()) {
    point.node = node;
  } else {
    point.name = name.substr(0, colon);
  }
  return point;
}

}  // namespace

SignalFile signals_from_uff(const UffFile& file) {
  static const char* const types[] = {
      "general",          "time response", "auto spectrum",   "cross spectrum",   "frequency response",
      "transmissibility", "coherence",     "autocorrelation", "crosscorrelation", "power spectral density"};
  SignalFile result;
  result.source = file.source;
  result.format = "universal file";
  result.findings = file.warnings;
  for (const auto& f : file.functions) {
    SignalTable table;
    table.name = f.type >= 0 && f.type < 10 ? types[f.type] : fmt::format("function type {}", f.type);
    const bool frequency = f.abscissa.type == 18 || (f.abscissa.type == 0 && f.type >= 2 && f.type != 7 && f.type != 8);
    const Quantity over = frequency ? Quantity::frequency : Quantity::time;
    double scale = abscissa_scale(f.abscissa, over);
    if (scale == 0) {
      result.findings.push_back(fmt::format("function {}: abscissa in '{}', which is no unit of {}: shown as it is",
                                            &f - file.functions.data() + 1, f.abscissa.unit, to_string(over)));
      scale = 1;
    }
    if (f.even) {
      table.abscissa = over;
      table.start = scale * f.x0;
      table.step = scale * f.dx;
    } else {
      set_abscissa(table, over, scale * f.x);
    }
    std::string name = f.response.node != 0 || f.response.direction != 0 ? point_name(f.response) : f.ordinate.label;
    // The field of a point's name holds ten characters; the first line of the function may hold all of it.
    if (name == f.response.name && f.id[0].starts_with(name)) name = f.id[0];
    if (f.type != 0 && f.type != 1 && (f.reference.node != 0 || f.reference.direction != 0))
      name += "/" + point_name(f.reference);
    const std::size_t number = static_cast<std::size_t>(&f - file.functions.data()) + 1;
    const auto used = [&](const SignalTable& t) {
      return t.name == table.name &&
             std::any_of(t.signals.begin(), t.signals.end(), [&](const Signal& s) { return s.name == name; });
    };
    if (name.empty() || name == "NONE" || std::any_of(result.tables.begin(), result.tables.end(), used))
      name += fmt::format("#{}", number);
    std::string label = is_blank(f.ordinate.unit) ? "" : f.ordinate.unit;
    if (!is_blank(f.denominator.unit)) label += "/" + f.denominator.unit;
    const Quantity stated = quantity_of(f.ordinate.type);
    if (label.empty() && states_si(file) && stated != Quantity::dimensionless && f.type <= 1) label = si_unit(stated);
    Signal signal{name, label, {}, f.value.real(), {}};
    if (f.complex) signal.imaginary = f.value.imag();
    const UnitSuffix* ordinate = unit_from_label(label);
    const std::optional<UnitSuffix> system = label.empty() ? system_unit(file, stated) : std::nullopt;
    if (system) {
      ordinate = &*system;
      signal.unit = label = si_unit(stated);
    }
    if (ordinate != nullptr && f.type <= 1 && !f.complex) {
      signal.quantity = ordinate->quantity;
      signal.value = signal.value.unaryExpr([&](double v) { return ordinate->to_si(v); }).eval();
    } else if (f.type <= 1) {
      result.findings.push_back(fmt::format("channel '{}' has {}", name,
                                            label.empty() ? "no unit" : fmt::format("the unknown unit '{}'", label)));
    }
    add_signal(result, table, std::move(signal));
  }
  const auto note = [&](std::size_t count, const char* what) {
    if (count > 0) result.contents.push_back(fmt::format("{} {}", count, what));
  };
  note(file.shapes.size(), "mode shapes (dataset 55)");
  note(file.nodes.size(), "nodes");
  note(file.traces.size(), "trace lines");
  note(file.elements.size(), "elements");
  note(file.systems.size(), "coordinate systems");
  note(file.units.size(), "unit systems");
  note(file.header.size(), "header lines");
  for (const int skipped : file.skipped) result.contents.push_back(fmt::format("dataset {} (passed over)", skipped));
  return result;
}

namespace {

// The lines of a frequency response in Hz.
Eigen::VectorXd lines_of(const UffFile& file, const UffFunction& f, const std::string& what) {
  const double scale = abscissa_scale(f.abscissa, Quantity::frequency);
  if (scale == 0)
    throw Error::in_file(file.source, 0,
                         fmt::format("{}: frequencies in '{}', which is no unit of frequency", what, f.abscissa.unit));
  SignalTable table;
  const Eigen::Index n = f.value.size();
  if (!f.even) {
    set_abscissa(table, Quantity::frequency, scale * f.x);
  } else {
    table.start = scale * f.x0;
    table.step = scale * f.dx;
  }
  if (!(table.step > 0) || !std::isfinite(table.start))
    throw Error::in_file(file.source, 0, what + ": must be evenly spaced");
  return table.start + table.step * Eigen::ArrayXd::LinSpaced(n, 0, static_cast<double>(n - 1));
}

}  // namespace

FrequencyResponse frf_from_uff(const UffFile& file, std::optional<FrfKind> meant) {
  FrequencyResponse frf;
  frf.averages = 0;
  for (const auto& f : file.functions) {
    if (f.type != 4) continue;
    const std::string what = fmt::format("frequency response {}", frf.channels.size() + 1);
    if (!f.complex) throw Error::in_file(file.source, 0, what + ": must be complex");
    // The unit may stand as a whole at the ordinate: (m/s2)/N, (1/N)*(m/s2), g/lbf.
    std::string motion = f.ordinate.unit, force = f.denominator.unit;
    if (is_blank(force)) {
      if (motion.starts_with("(1/N)*")) {
        motion = motion.substr(6);
        force = "N";
      } else if (const auto slash = motion.rfind('/');
                 slash != std::string::npos && unit_from_label(motion) == nullptr) {
        force = motion.substr(slash + 1);
        motion.resize(slash);
      }
    }
    const UnitSuffix numerator =
        motion_unit(file, f.ordinate, motion, what + " (response)", meant ? &si_suffix(motion_of(*meant)) : nullptr);
    const UnitSuffix denominator = motion_unit(file, f.denominator.type == 13 ? f.denominator : UffAxis{13, {}, {}},
                                               force, what + " (force)", meant ? &si_suffix(Quantity::force) : nullptr);
    if (denominator.quantity != Quantity::force) {
      throw Error::in_file(file.source, 0,
                           fmt::format("{} is per {}: must be per force", what, to_string(denominator.quantity)));
    }
    const std::optional<FrfKind> kind = kind_of_motion(numerator.quantity);
    if (!kind)
      throw Error::in_file(file.source, 0,
                           fmt::format("{} shows {}: must be displacement, velocity or acceleration", what,
                                       to_string(numerator.quantity)));
    const Eigen::VectorXd lines = lines_of(file, f, what);
    const Eigen::Index n = lines.size();
    const double step = n > 1 ? lines[1] - lines[0] : 1;
    if (frf.channels.empty()) {
      frf.kind = *kind;
      frf.frequency = lines;
    } else if (kind != frf.kind || n != frf.frequency.size() ||
               (n > 0 && std::abs(lines[0] - frf.frequency[0]) > 1e-4 * step) ||
               (n > 1 && std::abs(step - (frf.frequency[1] - frf.frequency[0])) > 1e-4 * step)) {
      throw Error::in_file(file.source, 0, what + ": must have the kind and the frequencies of the first");
    }
    frf.channels.push_back({point_name(f.response),
                            point_name(f.reference),
                            f.value * (numerator.to_si(1) / denominator.to_si(1)),
                            {},
                            {}});
  }
  if (frf.channels.empty()) throw Error::in_file(file.source, 0, "no frequency response (dataset 58, function type 4)");
  for (const auto& warning : file.warnings) frf.summary.warn(warning);
  frf.provenance.inputs = {file.source};
  return frf;
}

UffFile uff_from_frf(const FrequencyResponse& frf) {
  UffFile file;
  file.units.push_back({1, "SI: Meter (newton)", 1, 1, 1, 273.15});
  const Quantity motion = motion_of(frf.kind);
  long number = 0;
  for (const auto& channel : frf.channels) {
    UffFunction f;
    f.id[0] = fmt::format("{} {}", to_string(frf.estimator), to_string(frf.kind));
    f.type = 4;
    f.response = point_of(channel.response, ++number);
    f.reference = point_of(channel.reference, 0);
    f.complex = true;
    f.single = false;
    f.x0 = frf.frequency[0];
    f.dx = frf.frequency.size() > 1 ? (frf.frequency[frf.frequency.size() - 1] - frf.frequency[0]) /
                                          static_cast<double>(frf.frequency.size() - 1)
                                    : 0;
    f.value = channel.value;
    f.declared = channel.value.size();
    f.abscissa = {18, "Frequency", "Hz"};
    f.ordinate = {type_of(motion), std::string(to_string(frf.kind)), std::string(si_unit(motion))};
    f.denominator = {13, "Force", "N"};
    file.functions.push_back(std::move(f));
  }
  return file;
}

UffFile uff_from_recording(const Recording& recording) {
  UffFile file;
  file.units.push_back({1, "SI: Meter (newton)", 1, 1, 1, 273.15});
  long number = 0;
  for (const auto& channel : recording.channels) {
    UffFunction f;
    f.id[0] = channel.name;
    f.type = 1;
    f.response = point_of(channel.name, ++number);
    f.single = false;
    f.x0 = recording.t0;
    f.dx = recording.dt;
    f.value = channel.samples.cast<std::complex<double>>();
    f.declared = f.value.size();
    f.abscissa = {17, "Time", "s"};
    f.ordinate = {type_of(channel.quantity), channel.name, std::string(si_unit(channel.quantity))};
    file.functions.push_back(std::move(f));
  }
  return file;
}

namespace {

/// Blocks of a universal file begin with -1 alone on a line, perhaps after some text.
bool has_block(std::string_view head) {
  head = head.substr(0, 4096);
  if (head.starts_with("\xEF\xBB\xBF")) head.remove_prefix(3);
  for (std::size_t at = 0; at < head.size();) {
    const std::size_t end = std::min(head.find('\n', at), head.size());
    std::string_view line = head.substr(at, end - at);
    while (!line.empty() && std::isspace(static_cast<unsigned char>(line.back())) != 0) line.remove_suffix(1);
    while (!line.empty() && line.front() == ' ') line.remove_prefix(1);
    if (line == "-1") return true;
    at = end + 1;
  }
  return false;
}

}  // namespace

Format uff_format() {
  Format f{FileFormat::uff, "universal file", {".uff", ".unv"}, has_block};
  f.read = [](const std::filesystem::path& path, const CsvOptions&) { return signals_from_uff(read_uff(path)); };
  f.write = [](const std::filesystem::path& path, const Recording& r) { write_uff(path, uff_from_recording(r)); };
  f.read_responses = [](const std::filesystem::path& path,
                        const ResponseOptions& options) -> std::optional<FrequencyResponse> {
    const UffFile uff = read_uff(path);
    const bool any = std::any_of(uff.functions.begin(), uff.functions.end(),
                                 [](const UffFunction& function) { return function.type == 4; });
    return any ? std::optional(frf_from_uff(uff, options.kind)) : std::nullopt;
  };
  f.write_responses = [](const std::filesystem::path& path, const FrequencyResponse& r) {
    write_uff(path, uff_from_frf(r));
  };
  return f;
}

}  // namespace whirl::io
