#include "whirl/pages/margins_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/report/units.hpp"

namespace whirl::pages {
namespace {

std::string finite(double value, const char* format, const char* none) {
  return std::isfinite(value) ? fmt::format(fmt::runtime(format), value) : none;
}

/// " ± 0.03", two standard deviations; empty below the digits shown.
std::string within(double deviation) {
  return 2 * deviation < 0.005 ? std::string() : fmt::format(" ± {:.2f}", 2 * deviation);
}

std::vector<std::string> cells(std::string speed, const tuning::LoopMargins& m) {
  if (!m.stable) return {std::move(speed), "not stable", "", "", "", "", "", "D"};
  return {std::move(speed),
          finite(m.gain_up, "{:.2f}", "none") + (m.simulated ? " *" : ""),
          m.gain_down > 0 ? fmt::format("{:.2f}", m.gain_down) : "none",
          fmt::format("{:.0f}", m.phase * 360 / kTwoPi),
          finite(1e3 * m.delay, "{:.2f}", "none"),
          fmt::format("{:.3f}", m.modulus),
          fmt::format("{:.2f}{} at {:.0f} Hz", m.peak_sensitivity, within(m.peak_deviation),
                      std::round(m.peak_frequency) + 0.0),
          std::string(1, m.zone())};
}

const tuning::SpeedMargins& worst_speed(const MarginStudy& s) {
  return *std::ranges::max_element(s.speeds, {}, [](const tuning::SpeedMargins& m) {
    return m.response.loop.empty() ? 0 : m.margins.peak_sensitivity;
  });
}

io::Json margins_json(const tuning::LoopMargins& m) {
  const auto number = [](double v) { return std::isfinite(v) ? io::Json(v) : io::Json(); };
  io::Json out = io::Json::object();
  out.set("speed", m.omega).set("stable", m.stable).set("gain_up", number(m.gain_up)).set("gain_down", m.gain_down);
  out.set("gain_frequency", m.gain_frequency).set("phase", m.phase).set("phase_frequency", m.phase_frequency);
  out.set("delay", number(m.delay)).set("delay_frequency", m.delay_frequency).set("modulus", m.modulus);
  out.set("peak_sensitivity", number(m.peak_sensitivity)).set("peak_frequency", m.peak_frequency);
  out.set("peak_deviation", m.peak_deviation).set("phase_deviation", m.phase_deviation).set("simulated", m.simulated);
  out.set("peak_complementary", number(m.peak_complementary)).set("zone", std::string(1, m.zone()));
  return out;
}

}  // namespace

report::Table margins_table(const MarginStudy& study, const ControllerDesign& design) {
  report::Table t;
  t.caption = fmt::format("Margins of {} with {}{}", design.law, design.estimator,
                          study.plant.empty() ? "" : ", plant with " + study.plant);
  t.columns = {{"speed", "Hz"}, {"gain up", "times"}, {"gain down", "times"}, {"phase", "deg"},
               {"delay", "ms"}, {"modulus", "1"},     {"peak |S|", "1"},      {"zone", ""}};
  for (const tuning::SpeedMargins& s : study.speeds)
    t.add(cells(fmt::format("{:.1f}", s.margins.omega / kTwoPi), s.margins));
  t.add(cells("worst", tuning::worst_margins(study.speeds)));
  t.notes = {
      "Loop opened at the force, both axes as one complex loop: frequencies above zero whirl with the rotor, below "
      "zero "
      "against it. Gain: factor on the loop gain at which it becomes unstable. Zones of ISO 14839-3 by the peak "
      "sensitivity: A below 3, B below 4, C below 5; ±: two standard deviations of its estimate. Gain up and delay are "
      "tried in the running loop; *: there the "
      "linearised loop did not show them, and they are the factor and the delay at which the motion stopped decaying."};
  return t;
}

std::string delivered_text(const tuning::DeliveredDelay& found) {
  return fmt::format("further delay as delivered: {:.2f} ms, limited by: {}", 1e3 * found.delay, name_of(found.limit));
}

io::Json to_json(const tuning::DeliveredDelay& found) {
  io::Json out = io::Json::object();
  return out.set("delay", found.delay).set("limited_by", std::string(name_of(found.limit)));
}

io::Json to_json(const std::vector<MarginStudy>& studies) {
  io::Json document = io::start_document("whirl.margins", 1);
  io::Json::Array plants;
  for (const MarginStudy& study : studies) {
    io::Json::Array speeds;
    for (const tuning::SpeedMargins& s : study.speeds) speeds.push_back(margins_json(s.margins));
    io::Json plant = io::Json::object();
    plant.set("plant", study.plant).set("worst", margins_json(tuning::worst_margins(study.speeds)));
    plants.push_back(plant.set("speeds", std::move(speeds)));
  }
  return document.set("plants", std::move(plants));
}

report::Document margins_report(const std::vector<MarginStudy>& studies, const ControllerDesign& design,
                                const Provenance& provenance) {
  report::Document doc;
  doc.title = fmt::format("Margins of {} with {}", design.law, design.estimator);
  for (const MarginStudy& study : studies) {
    doc.table(margins_table(study, design));
    const tuning::SpeedMargins& worst = worst_speed(study);
    const auto n = static_cast<Eigen::Index>(worst.response.loop.size());
    if (n == 0) continue;
    Eigen::VectorXd f(n), re(n), im(n), s(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const std::complex<double> l = worst.response.loop[static_cast<std::size_t>(i)];
      f[i] = worst.response.frequency[static_cast<std::size_t>(i)];
      const bool shown = std::abs(l) < 3;
      re[i] = shown ? l.real() : std::nan("");
      im[i] = shown ? l.imag() : std::nan("");
      s[i] = std::min(1 / std::abs(1.0 + l), 20.0);
    }
    report::Figure figure;
    figure.title = "Nyquist diagram and sensitivity";
    figure.description = "Loop response in the complex plane near -1 and magnitude of the sensitivity over frequency.";
    report::Panel& plane =
        figure.panel(fmt::format("{:.1f} Hz", worst.margins.omega / kTwoPi), {"Re L", {}}, {"Im L", {}});
    plane.equal_aspect = true;
    plane.line("L", re, im);
    Eigen::VectorXd at(1), zero(1);
    at << -1, zero << 0;
    plane.scatter("-1", at, zero);
    report::Panel& peak = figure.panel("", {"frequency, below zero against the rotation", report::kHertz}, {"|S|", {}});
    peak.line("|S|", f, s);
    for (const auto& [limit, zone] : {std::pair(3.0, "A/B"), std::pair(4.0, "B/C"), std::pair(5.0, "C/D")}) {
      peak.horizontal(limit, zone);
    }
    doc.figure(std::move(figure), "Loop at the speed with the largest sensitivity.");
  }
  doc.section("Where it comes from").provenance(provenance);
  return doc;
}

}  // namespace whirl::pages
