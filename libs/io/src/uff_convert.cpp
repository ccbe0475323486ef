// Between a universal file in its own units and the SI values of the toolkit.
#include <fmt/format.h>

#include <cmath>
#include <cstdlib>

#include "whirl/core/error.hpp"
#include "whirl/io/uff.hpp"
#include "whirl/io/units.hpp"

namespace whirl {
namespace {

std::string replaced(std::string text, std::string_view from, std::string_view to) {
  for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size())) {
    text.replace(at, from.size(), to);
  }
  return text;
}

// "m/s^2", "m/s²", "(m/s2)", "m/s**2" as the suffix m_s2; null when the label is no known unit.
const UnitSuffix* unit_of(std::string label) {
  for (const auto& [from, to] : {std::pair<std::string_view, std::string_view>{"\xC2\xB2", "2"}, {"\xC2\xB5", "u"}, {"**", ""},
                                 {"^", ""}, {"(", ""}, {")", ""}, {" ", ""}, {"/", "_"}}) {
    label = replaced(label, from, to);
  }
  if (label == "sec") label = "s";
  if (label == "G") label = "g";
  return label.empty() ? nullptr : find_unit(label);
}

Quantity quantity_of(int type) {
  switch (type) {
    case 8: return Quantity::displacement;
    case 11: return Quantity::velocity;
    case 12: return Quantity::acceleration;
    case 13: return Quantity::force;
    case 15: return Quantity::pressure;
    default: return Quantity::dimensionless;
  }
}

bool is_blank(const std::string& unit) { return unit.empty() || unit == "NONE"; }

// Dataset 164 with code 1 states that the file is in SI.
bool states_si(const UffFile& file) { return file.units.size() == 1 && file.units[0].code == 1; }

const UnitSuffix& motion_unit(const UffFile& file, const UffAxis& axis, const std::string& label, const std::string& what) {
  if (const UnitSuffix* unit = unit_of(label)) return *unit;
  if (is_blank(label) && states_si(file) && quantity_of(axis.type) != Quantity::dimensionless) {
    return si_suffix(quantity_of(axis.type));
  }
  throw Error::in_file(file.source, 0,
                       fmt::format("{} has {}: state it (allowed units: {})", what,
                                   is_blank(label) ? "no unit" : fmt::format("the unknown unit '{}'", label), allowed_units()));
}

std::string point_name(const UffPoint& point) {
  static const char* const names[] = {"-RZ", "-RY", "-RX", "-Z", "-Y", "-X", "S", "+X", "+Y", "+Z", "+RX", "+RY", "+RZ"};
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

Recording recording_from_uff(const UffFile& file, const std::string& unit) {
  Recording recording;
  recording.source = file.source;
  for (const auto& f : file.functions) {
    if (f.type != 1 && f.type != 0) continue;
    if (f.complex || !f.even) {
      throw Error::in_file(file.source, 0, fmt::format("time response '{}': must be real and evenly spaced", f.id[0]));
    }
    const std::string what = fmt::format("time response {} '{}'", recording.channels.size() + 1, f.ordinate.label);
    const UnitSuffix* given = unit.empty() ? nullptr : find_unit(unit);
    if (!unit.empty() && given == nullptr) throw Error::in_field("unit", unit, "one of " + allowed_units());
    const UnitSuffix& from =
        is_blank(f.ordinate.unit) && given != nullptr ? *given : motion_unit(file, f.ordinate, f.ordinate.unit, what);
    if (recording.channels.empty()) {
      recording.dt = f.dx;
      recording.t0 = f.x0;
    } else if (std::abs(f.dx - recording.dt) > 1e-6 * recording.dt || f.value.size() != recording.size()) {
      throw Error::in_file(file.source, 0, fmt::format("{}: must have the time step and length of the first", what));
    }
    Eigen::VectorXd samples(f.value.size());
    for (Eigen::Index i = 0; i < samples.size(); ++i) samples[i] = from.to_si(f.value[i].real());
    std::string name = f.response.node != 0 || f.response.direction != 0 ? point_name(f.response) : f.ordinate.label;
    if (name.empty() || name == "NONE" || recording.has(name)) name += fmt::format("#{}", recording.channels.size() + 1);
    recording.add(name, from.quantity, std::move(samples));
  }
  if (recording.channels.empty()) throw Error::in_file(file.source, 0, "no time response (dataset 58, function type 1)");
  recording.check();
  return recording;
}

FrequencyResponse frf_from_uff(const UffFile& file) {
  FrequencyResponse frf;
  frf.averages = 0;
  for (const auto& f : file.functions) {
    if (f.type != 4) continue;
    const std::string what = fmt::format("frequency response {}", frf.channels.size() + 1);
    if (!f.complex || !f.even) throw Error::in_file(file.source, 0, what + ": must be complex and evenly spaced");
    // The unit may stand as a whole at the ordinate: (m/s2)/N, (1/N)*(m/s2), g/lbf.
    std::string motion = f.ordinate.unit, force = f.denominator.unit;
    if (is_blank(force)) {
      if (motion.starts_with("(1/N)*")) {
        motion = motion.substr(6);
        force = "N";
      } else if (const auto slash = motion.rfind('/'); slash != std::string::npos && unit_of(motion) == nullptr) {
        force = motion.substr(slash + 1);
        motion.resize(slash);
      }
    }
    const UnitSuffix& numerator = motion_unit(file, f.ordinate, motion, what + " (response)");
    const UnitSuffix& denominator = motion_unit(file, f.denominator.type == 13 ? f.denominator : UffAxis{13, {}, {}}, force,
                                                what + " (force)");
    if (denominator.quantity != Quantity::force) {
      throw Error::in_file(file.source, 0, fmt::format("{} is per {}: must be per force", what, to_string(denominator.quantity)));
    }
    FrfKind kind = FrfKind::accelerance;
    switch (numerator.quantity) {
      case Quantity::displacement: kind = FrfKind::receptance; break;
      case Quantity::velocity: kind = FrfKind::mobility; break;
      case Quantity::acceleration: break;
      default:
        throw Error::in_file(file.source, 0, fmt::format("{} shows {}: must be displacement, velocity or acceleration", what,
                                                         to_string(numerator.quantity)));
    }
    const Eigen::Index n = f.value.size();
    if (frf.channels.empty()) {
      frf.kind = kind;
      frf.frequency = Eigen::VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1)) * f.dx;
      frf.frequency.array() += f.x0;
    } else if (kind != frf.kind || n != frf.frequency.size() || std::abs(f.x0 - frf.frequency[0]) > 1e-4 * f.dx ||
               (n > 1 && std::abs(f.dx - (frf.frequency[1] - frf.frequency[0])) > 1e-4 * f.dx)) {
      throw Error::in_file(file.source, 0, what + ": must have the kind and the frequencies of the first");
    }
    frf.channels.push_back({point_name(f.response), point_name(f.reference),
                            f.value * (numerator.to_si(1) / denominator.to_si(1)), {}, {}});
  }
  if (frf.channels.empty()) throw Error::in_file(file.source, 0, "no frequency response (dataset 58, function type 4)");
  for (const auto& warning : file.warnings) frf.summary.warn(warning);
  frf.provenance.inputs = {file.source};
  return frf;
}

UffFile uff_from_frf(const FrequencyResponse& frf) {
  UffFile file;
  file.units.push_back({1, "SI: Meter (newton)", 1, 1, 1, 273.15});
  const int type = frf.kind == FrfKind::receptance ? 8 : frf.kind == FrfKind::mobility ? 11 : 12;
  const char* unit = frf.kind == FrfKind::receptance ? "m" : frf.kind == FrfKind::mobility ? "m/s" : "m/s^2";
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
    f.ordinate = {type, std::string(to_string(frf.kind)), unit};
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
    int type = 1;
    for (int t : {8, 11, 12, 13, 15}) {
      if (quantity_of(t) == channel.quantity) type = t;
    }
    f.ordinate = {type, channel.name, std::string(si_unit(channel.quantity))};
    file.functions.push_back(std::move(f));
  }
  return file;
}

}  // namespace whirl
