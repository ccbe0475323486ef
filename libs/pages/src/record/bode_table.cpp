#include "whirl/pages/bode_table.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <complex>
#include <cstdlib>
#include <optional>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/remarks.hpp"
#include "whirl/signal/motion_quantity.hpp"
#include "whirl/signal/spectrum.hpp"

namespace whirl::pages {
namespace {

using signal::SynchronousCurve;

/// What the name of an amplitude or a phase says beside its unit.
struct Heading {
  AmplitudeKind kind = AmplitudeKind::peak;
  bool kind_stated = false;
  std::string phase;  ///< "lag" or "lead" where it says so
  std::string probe;
};

Heading heading_of(const std::string& name) {
  Heading out;
  for (std::size_t from = 0; from < name.size();) {
    const std::size_t end = std::min(name.find('_', from), name.size());
    const std::string word = name.substr(from, end - from);
    const bool first = from == 0;
    from = end + 1;
    const bool peak = word == "peak" || word == "0p";
    out.kind_stated = out.kind_stated || peak || word == "pp" || word == "rms";
    if (word == "pp") {
      out.kind = AmplitudeKind::peak_to_peak;
    } else if (word == "rms") {
      out.kind = AmplitudeKind::rms;
    } else if (word == "lag" || word == "lead") {
      out.phase = word;
    } else if (word != "1x" && !peak && !first) {
      out.probe += (out.probe.empty() ? "" : "_") + word;
    }
  }
  return out;
}

void say_kind(const io::Table& table, const std::string& amplitude, const Heading& heading) {
  if (!heading.kind_stated)
    io::remark(table.source, amplitude +
                                 ": its name states no kind of amplitude, peak is taken; amp_peak, amp_pp or amp_rms "
                                 "state it");
}

/// The vectors of an amplitude and a phase; `sign` of the phase.
SynchronousCurve vectors_of(const io::Table& table, const std::string& speed, const Channel& amplitude,
                            const Channel& phase, AmplitudeKind kind, double sign) {
  SynchronousCurve curve{"1X", table.in(speed, Quantity::angular_velocity), {}};
  const bool motion = signal::integrations(amplitude.quantity, amplitude.quantity).has_value();
  if (!motion) table.in(amplitude.name, Quantity::displacement);
  table.in(phase.name, Quantity::angle);
  curve.quantity = amplitude.quantity;
  curve.vector.resize(curve.speed.size());
  for (Eigen::Index i = 0; i < curve.vector.size(); ++i)
    curve.vector[i] = std::polar(amplitude.samples[i] / signal::factor_from_peak(kind), sign * phase.samples[i]);
  return curve;
}

std::vector<SynchronousCurve> curves_of(const io::Table& table, const std::string& name,
                                        const std::string& stated = {}) {
  const Channel* speed = table.find("speed");
  std::vector<std::pair<Heading, const Channel*>> amplitudes, phases;
  for (const Channel& c : table.columns) {
    if (c.name.starts_with("amp")) amplitudes.emplace_back(heading_of(c.name), &c);
    if (c.name.starts_with("phase")) phases.emplace_back(heading_of(c.name), &c);
  }
  std::vector<SynchronousCurve> out;
  if (speed == nullptr) return out;
  for (const auto& [heading, amplitude] : amplitudes) {
    const auto phase = std::ranges::find_if(phases, [&](const auto& p) { return p.first.probe == heading.probe; });
    if (phase == phases.end()) continue;
    const bool of_response = table.find("extrapolated") != nullptr;  // `whirl response` writes peaks
    if (!of_response) say_kind(table, amplitude->name, heading);
    SynchronousCurve curve =
        vectors_of(table, "speed", *amplitude, *phase->second, heading.kind, phase_sign(phase->second->name, stated));
    curve.name = heading.probe.empty() ? name : heading.probe;
    out.push_back(std::move(curve));
  }
  return out;
}

/// Cells of a line; a comma inside quotes divides none.
std::vector<std::string> cells_of(std::string_view line) {
  std::vector<std::string> out(1);
  bool quoted = false;
  for (const char c : line) {
    if (c == '"') {
      quoted = !quoted;
    } else if (c == ',' && !quoted) {
      out.emplace_back();
    } else if (c != '\r') {
      out.back() += c;
    }
  }
  return out;
}

/// The columns of a Bode figure: speed and amplitude of each curve, then speed and phase. A speed stands once where all
/// curves share it.
struct FigureColumns {
  struct Curve {
    std::string name, unit;
    std::size_t speed = 0, amplitude = 0, phase = 0;
    double order = 1;
    AmplitudeKind kind = AmplitudeKind::peak;
  };
  std::vector<Curve> curves;
  bool lag = true;
};

std::optional<FigureColumns> figure_columns(const std::vector<std::string>& headers) {
  constexpr std::string_view kAmplitude = "X amplitude, ", kSpeed = "rotor speed";
  FigureColumns out;
  std::size_t phases = 0, speed = headers.size();
  for (std::size_t c = 0; c < headers.size(); ++c) {
    const std::string& header = headers[c];
    if (header.starts_with("passage ")) continue;
    if (header.find(kSpeed) != std::string::npos && header.ends_with("[rpm]")) {
      speed = c;
      continue;
    }
    if (speed == headers.size()) continue;
    const std::size_t at = header.find(kAmplitude), open = header.rfind('[');
    if (at != std::string::npos && open != std::string::npos && phases == 0) {
      const std::size_t word = header.rfind(' ', at);
      FigureColumns::Curve curve;
      curve.speed = speed;
      curve.amplitude = c;
      const std::size_t from = word == std::string::npos ? 0 : word + 1;
      curve.order = std::strtod(header.substr(from, at - from).c_str(), nullptr);
      if (from > 2) curve.name = header.substr(0, from - 2);  // "x: 1X amplitude"
      const std::string kind = header.substr(at + kAmplitude.size(), open - 1 - at - kAmplitude.size());
      curve.kind = kind == "p-p"   ? AmplitudeKind::peak_to_peak
                   : kind == "rms" ? AmplitudeKind::rms
                                   : AmplitudeKind::peak;
      curve.unit = header.substr(open);
      out.curves.push_back(std::move(curve));
    } else if (header.starts_with("phase l") && phases < out.curves.size()) {
      out.lag = header.starts_with("phase lag");
      out.curves[phases++].phase = c;
    }
  }
  if (out.curves.empty() || phases != out.curves.size()) return std::nullopt;
  return out;
}

/// Curves of the CSV of a Bode plot. A gap where the phase wraps leaves a vector out.
std::vector<SynchronousCurve> curves_of_figure(const std::string& text, const std::string& name) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    rows.push_back(cells_of(std::string_view(text).substr(from, end - from)));
    from = end + 1;
  }
  const FigureColumns columns = *figure_columns(rows.front());
  std::vector<SynchronousCurve> out;
  for (const FigureColumns::Curve& curve : columns.curves) {
    const char* kind = curve.kind == AmplitudeKind::peak ? "" : curve.kind == AmplitudeKind::rms ? "_rms" : "_pp";
    std::string table = fmt::format("rpm,amp{} {},phase_{}_deg\n", kind, curve.unit, columns.lag ? "lag" : "lead");
    for (std::size_t r = 1; r < rows.size(); ++r) {
      if (rows[r].size() != rows.front().size()) continue;
      const std::string &speed = rows[r][curve.speed], &amplitude = rows[r][curve.amplitude],
                        &phase = rows[r][curve.phase];
      if (!speed.empty() && !amplitude.empty() && !phase.empty())
        table += fmt::format("{},{},{}\n", speed, amplitude, phase);
    }
    std::vector<SynchronousCurve> one = curves_of(io::parse_table(table, name), curve.name.empty() ? name : curve.name);
    if (one.empty()) return {};
    one.front().order = curve.order;
    out.push_back(std::move(one.front()));
  }
  return out;
}

std::string first_line(const std::filesystem::path& file) {
  constexpr std::size_t kLongest = 65536;  // a record with a longer line of names is no figure
  std::string text(kLongest, '\0');
  text.resize(io::ByteSource(file).read(text.data(), text.size()));
  return text.substr(0, text.find('\n'));
}

}  // namespace

double phase_sign(const std::string& column, const std::string& stated) {
  const std::string named = heading_of(column).phase;
  if (!named.empty() && !stated.empty() && named != stated)
    throw Error::in_field("--phase", stated, fmt::format("{}, as the column '{}' says, or left out", named, column));
  return (named.empty() ? stated : named) == "lag" ? -1 : 1;
}

SynchronousCurve curve_of_columns(const io::Table& table, const std::string& speed, const std::string& amplitude,
                                  const std::string& phase_column, const std::string& phase) {
  const Channel &size = table.at(amplitude), &angle = table.at(phase_column);
  const Heading heading = heading_of(amplitude);
  say_kind(table, amplitude, heading);
  return vectors_of(table, speed, size, angle, heading.kind, phase_sign(phase_column, phase));
}

std::vector<SynchronousCurve> read_bode_table(const std::filesystem::path& file, const std::string& phase) {
  if (!std::filesystem::exists(file)) return {};
  const std::string name = file.stem().string();
  io::Table table;
  try {
    if (figure_columns(cells_of(first_line(file)))) {
      std::vector<SynchronousCurve> drawn = curves_of_figure(io::read_text(file), name);
      if (!drawn.empty()) return drawn;
    }
    table = io::read_table(file);
  } catch (const Error&) {
    return {};  // a record: its reader says what is wrong with it
  }
  return curves_of(table, name, phase);
}

}  // namespace whirl::pages
