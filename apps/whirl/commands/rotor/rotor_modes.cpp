#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>

#include "rotor.hpp"
#include "rotor_drawing.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/pages/rotor_curves.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/shaft/distrust.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/response.hpp"
#include "whirl/shaft/rotor_json.hpp"

namespace whirl::app {
namespace {

struct RotorModesOptions {
  std::string rotor, figure;
  double speed_rpm = 0;
  int count = 6;
};

/// The shaft at the instant of its largest deflection, and the orbits of stations along it.
void draw_mode(report::Figure& figure, const shaft::Mode& m, const Eigen::VectorXd& z) {
  constexpr Eigen::Index kOrbits = 12, kPoints = 48;
  report::Panel& panel =
      figure.panel(fmt::format("{:.4g} Hz, {}", m.frequency() / kTwoPi, whirl_word(m.direction)),
                   {"position", report::engineering_unit(Quantity::displacement, z.cwiseAbs().maxCoeff())}, {"x", {}});
  panel.kind = report::Panel::Kind::projected;
  panel.z.label = "y, largest 1";
  report::Series& shaft = panel.line3("shaft", z, m.x.real(), m.y.real(), {.color = 0, .width = 2});
  shaft.y_later = -m.x.imag();
  shaft.z_later = -m.y.imag();
  const Eigen::Index step = std::max<Eigen::Index>(1, (z.size() - 1) / kOrbits);
  const Eigen::VectorXcd turn =
      (std::complex<double>(0, 1) * Eigen::ArrayXd::LinSpaced(kPoints + 1, 0, kTwoPi)).exp().matrix();
  for (Eigen::Index k = 0; k < z.size(); k += step)
    panel.line3(k == 0 ? "orbits" : "", Eigen::VectorXd::Constant(kPoints + 1, z[k]), (m.x[k] * turn).real(),
                (m.y[k] * turn).real(), {.color = 1, .width = 0.8});
  for (report::Axis* axis : {&panel.y, &panel.z}) axis->low = -1.1, axis->high = 1.1;
}

report::Figure mode_figure(const LoadedRotor& loaded, const std::vector<shaft::Mode>& modes, const std::string& file) {
  const shaft::System& system = loaded.system;
  report::Figure figure;
  figure.title = "The rotor and its modes";
  figure.description =
      "The rotor to scale. Of each mode the shaft at the instant of its largest deflection, and the orbits of stations "
      "along it. In a browser the shaft moves.";
  figure.columns = 2;
  draw_rotor(figure, loaded.rotor);
  const auto n = static_cast<Eigen::Index>(system.nodes.size());
  const Eigen::VectorXd z = Eigen::Map<const Eigen::VectorXd>(system.nodes.data(), n);
  for (const shaft::Mode& m : modes) draw_mode(figure, m, z);
  figure.runs = {std::filesystem::path(file).filename().string()};
  return figure;
}

void say_sag(const LoadedRotor& loaded, const shaft::Sag& sag, Session& session) {
  if (loaded.rotor.vertical) return;
  session.say(fmt::format("mass               {:.4g} kg; largest sag {:.3g} um", loaded.rotor.mass(),
                          1e6 * sag.y.cwiseAbs().maxCoeff()));
  for (std::size_t k = 0; k < sag.reactions.size(); ++k)
    session.say(fmt::format("{:<18} carries {:.4g} N", loaded.system.supports[k].name, sag.reactions[k].y()));
}

void rotor_modes(const RotorModesOptions& o, Session& session) {
  const LoadedRotor loaded = load_rotor(o.rotor);
  const double speed = o.speed_rpm * kRadPerSecPerRpm;
  const std::vector<shaft::Mode> modes = shaft::modes(loaded.system, speed, o.count);
  const shaft::MeshCheck mesh = shaft::check_mesh(loaded.rotor, speed, o.count);
  const shaft::Sag sag = shaft::static_sag(loaded.system);
  report::Table table;
  table.caption = fmt::format("modes at {:g} rpm", o.speed_rpm);
  table.columns = {{"mode", ""},     {"frequency", "Hz"}, {"frequency", "rpm"},
                   {"damping", "%"}, {"whirl", ""},       {"mesh error", "%"}};
  Summary summary;
  shaft::carry_distrust(loaded.rotor, Consequence::no_trust, summary);
  if (!shaft::returns_to_place(loaded.system, speed)) pages::warn_if_unstable(loaded.system, speed, speed, summary);
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const shaft::Mode& m = modes[k];
    table.add({std::to_string(k + 1), report::format_fixed(m.frequency() / kTwoPi, 3),
               report::format_fixed(m.frequency() / kRadPerSecPerRpm, 1), report::format_fixed(100 * m.damping(), 3),
               whirl_word(m.direction), report::format_number(k < mesh.error.size() ? 100 * mesh.error[k] : 0, 2)});
    if (m.damping() < -1e-9)
      summary.warn(fmt::format("mode {} grows at {:g} rpm: the rotor is unstable", k + 1, o.speed_rpm));
  }
  session.say(report::to_text(table));
  say_sag(loaded, sag, session);
  if (mesh.coarse)
    summary.warn(
        fmt::format("the mesh is coarse: frequencies are off by up to {:.2g} %; raise elements in the rotor file",
                    100 * mesh.worst));
  const double length = loaded.system.nodes.back() - loaded.system.nodes.front(), sagged = sag.y.cwiseAbs().maxCoeff();
  if (!loaded.rotor.vertical && sagged > length)
    summary.fail(fmt::format(
        "the shaft of {:.3g} m sags by {:.3g} m under its own weight: is a length in mm given as m?", length, sagged));
  session.result(shaft::modes_json(loaded.system, speed, modes, sag, mesh));
  if (!o.figure.empty()) report::write_figure(mode_figure(loaded, modes, o.rotor), o.figure);
  session.finish(summary);
}

}  // namespace

void add_rotor_modes(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorModesOptions>();
  CommandLine* sub =
      add_command(rotor, session, "modes", "Frequencies, damping and whirl direction at a speed; static sag",
                  "Input: a rotor file of `whirl rotor new`. The error of the mesh is estimated from one with every "
                  "element halved.\n\n"
                  "Example: whirl rotor modes rotor.toml --speed-rpm 4000 --figure modes.svg",
                  [o, &session] { rotor_modes(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--speed-rpm", o->speed_rpm, "speed of the shaft")->range(0, 1e7)->show_default();
  sub->add_option("--count", o->count, "modes listed")->range(1, 100)->show_default();
  sub->add_option("--figure", o->figure,
                  "the rotor to scale and its modes with orbits (.svg, which moves in a browser, .png, .pdf, .csv)")
      ->output();
}

}  // namespace whirl::app
