#include "whirl/pages/text/modes.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

#include "whirl/io/model_json.hpp"
#include "whirl/modal/checks.hpp"

namespace whirl::pages {
namespace {

io::Json shape_json(const Eigen::VectorXcd& shape) {
  io::Json json = io::Json::object();
  json.set("re", io::Json(shape.real())).set("im", io::Json(shape.imag()));
  return json;
}

}  // namespace

report::Table modes_table(const ModalModel& modes) {
  report::Table table;
  table.caption = "Modes";
  table.columns = {{"mode", ""}, {"frequency", "Hz"}, {"± sd", "Hz"}, {"damping", "%"}, {"± sd", "%"}, {"MPC", "1"}};
  const modal::ModeShapes shapes = modal::mode_shapes(modes);
  const auto deviation = [](double sd) { return std::isfinite(sd) ? fmt::format("{:.2g}", sd) : "-"; };
  for (std::size_t i = 0; i < modes.modes.size(); ++i) {
    const Mode& m = modes.modes[i];
    const bool outside = m.frequency.value < modes.band_low || m.frequency.value > modes.band_high;
    table.add(
        {outside ? "outside" : fmt::format("{}", i + 1), fmt::format("{:.4f}", m.frequency.value),
         deviation(m.frequency.sd), fmt::format("{:.4f}", 100 * m.damping.value), deviation(100 * m.damping.sd),
         shapes.points.size() < 2
             ? "-"
             : fmt::format("{:.3f}", modal::mode_complexity(shapes.value.col(static_cast<Eigen::Index>(i))).mpc)});
  }
  return table;
}

report::Table modes_table(const modal::OperationalModes& found) {
  report::Table table;
  table.caption = "Modes under operational excitation";
  table.columns = {{"mode", ""}, {"frequency", "Hz"}, {"± sd", "Hz"}, {"damping", "%"}, {"± sd", "%"}, {"MPC", "1"}};
  for (const modal::OperationalMode& mode : found.modes) {
    table.add({fmt::format("{}", table.rows.size() + 1), fmt::format("{:.4f}", mode.frequency.value),
               fmt::format("{:.2g}", mode.frequency.sd), fmt::format("{:.3f}", 100 * mode.damping.value),
               fmt::format("{:.2g}", 100 * mode.damping.sd),
               fmt::format("{:.3f}", modal::mode_complexity(mode.shape).mpc)});
  }
  for (const modal::Tone& tone : found.tones)
    table.add({"harmonic", fmt::format("{:.4f}", tone.frequency), "-", "-", "-", "-"});
  return table;
}

report::Table modes_table(const modal::AmbientModes& found) {
  report::Table table;
  table.caption = "Modes under ambient excitation";
  table.columns = {{"mode", ""}, {"frequency", "Hz"}, {"damping", "%"}, {"MPC", "1"}};
  for (const modal::AmbientMode& mode : found.modes) {
    table.add({fmt::format("{}", table.rows.size() + 1), fmt::format("{:.4f}", mode.frequency),
               std::isnan(mode.damping) ? "-" : fmt::format("{:.3f}", 100 * mode.damping),
               fmt::format("{:.3f}", modal::mode_complexity(mode.shape).mpc)});
  }
  return table;
}

report::Table change_table(const ModalModel& modes, const ModalModel& before) {
  report::Table table;
  table.columns = {{"mode", ""}, {"frequency", "Hz"}, {"there", "Hz"}, {"change", "%"}, {"MAC", ""}};
  for (const modal::ModeMatch& m : modal::match_modes(before, modes)) {
    table.add({fmt::format("{}", m.second + 1), fmt::format("{:.4f}", modes.modes[m.second].frequency.value),
               fmt::format("{:.4f}", before.modes[m.first].frequency.value),
               fmt::format("{:.3f}", 100 * m.frequency_change), fmt::format("{:.3f}", m.mac)});
  }
  return table;
}

std::vector<std::string> amplitude_lines(const ModalModel& modes) {
  std::vector<std::string> lines;
  for (std::size_t i = 0; i < modes.modes.size(); ++i) {
    const Mode& mode = modes.modes[i];
    if (mode.amplitude_offset == 0.0) continue;
    std::string harmonics;
    for (const AmplitudeTerm& term : modes.amplitude) {
      if (term.mode == i && term.turn != 1)
        harmonics += fmt::format("; the line at {:.4g} Hz is its distortion, not a mode",
                                 std::abs(term.pole) / (2 * std::numbers::pi));
    }
    const std::complex<double> after = mode.pole + mode.amplitude_offset;
    lines.push_back(fmt::format(
        "mode {} depends on the amplitude: just after an impact {:+.2g} % in frequency and a damping of {:.3g} %; "
        "listed "
        "is that of small motion{}",
        i + 1, 100 * (std::abs(after) / std::abs(mode.pole) - 1), -100 * after.real() / std::abs(after), harmonics));
  }
  return lines;
}

report::Table blows_table(const std::vector<modal::BlowReport>& blows) {
  report::Table table;
  table.caption = "Impacts";
  table.columns = {{"impact", ""}, {"force peak", "N"}, {"pulse", "ms"}, {"finding", "", report::Align::left}};
  for (std::size_t i = 0; i < blows.size(); ++i) {
    std::string finding = blows[i].used ? "used" : "left out";
    if (blows[i].force_overload) finding += ", force overloaded";
    for (const std::string& r : blows[i].overloaded_responses) finding += ", " + r + " overloaded";
    for (const std::string& damage : blows[i].damage) finding += ", " + damage;
    for (const modal::SecondHit& hit : blows[i].second_hits) {
      finding += fmt::format(", second hit of {:.0f} % after {:.1f} ms", 100 * hit.ratio, 1e3 * hit.time);
    }
    for (const std::string& d : blows[i].disagreements) finding += ", " + d;
    table.add({fmt::format("{}", i + 1), fmt::format("{:.1f}", blows[i].peak),
               fmt::format("{:.2f}", 1e3 * blows[i].pulse_width), finding});
  }
  return table;
}

io::Json to_json(const modal::OperationalModes& found) {
  io::Json json = io::start_document("whirl.operational_modes", 1);
  io::Json modes = io::Json::array(), tones = io::Json::array();
  for (const modal::OperationalMode& mode : found.modes) {
    io::Json entry = io::Json::object();
    entry.set("frequency", io::to_json(mode.frequency, "Hz")).set("damping", io::to_json(mode.damping, "1"));
    entry.set("mpc", modal::mode_complexity(mode.shape).mpc).set("orders", mode.orders);
    entry.set("shape", shape_json(mode.shape));
    modes.push(std::move(entry));
  }
  for (const modal::Tone& tone : found.tones) {
    io::Json entry = io::Json::object();
    entry.set("frequency_hz", tone.frequency).set("kurtosis", tone.kurtosis).set("evidence", tone.evidence);
    if (tone.amplitude.size() > 0) entry.set("amplitude_peak", io::Json(tone.amplitude));
    tones.push(std::move(entry));
  }
  json.set("channels", found.channels).set("modes", std::move(modes)).set("harmonics", std::move(tones));
  json.set("summary", io::to_json(found.summary));
  return json;
}

io::Json to_json(const modal::AmbientModes& found) {
  io::Json json = io::start_document("whirl.ambient_modes", 1);
  io::Json::Array modes;
  for (const modal::AmbientMode& mode : found.modes) {
    io::Json entry = io::Json::object();
    entry.set("frequency", mode.frequency).set("damping", mode.damping).set("shape", shape_json(mode.shape));
    modes.push_back(std::move(entry));
  }
  json.set("channels", found.channels).set("modes", std::move(modes));
  return json;
}

}  // namespace whirl::pages
