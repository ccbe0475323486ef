#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "rotor.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/table.hpp"
#include "whirl/report/units.hpp"
#include "whirl/report/write_figure.hpp"
#include "whirl/shaft/distrust.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"
#include "whirl/shaft/rotor_json.hpp"

namespace whirl::app {
namespace {

struct RotorCriticalsOptions {
  std::string rotor, figure;
  double to_rpm = 0, order = 1;
};

/// Critical speeds over the stiffness of what carries the shaft, as a multiple of the file's (critical speed map of
/// API 684).
report::Figure critical_map(const shaft::Rotor& rotor, double highest, double spin_per_whirl, const std::string& file) {
  constexpr int kPoints = 41;
  const Eigen::VectorXd factor =
      Eigen::VectorXd::LinSpaced(kPoints, -2, 2).unaryExpr([](double e) { return std::pow(10, e); });
  shaft::ReductionOptions reduction;
  reduction.speeds = 0;
  std::vector<Eigen::VectorXd> lines;
  for (Eigen::Index k = 0; k < kPoints; ++k) {
    shaft::Rotor changed = rotor;
    for (shaft::Support& s : changed.supports)
      if (s.a.part == "shaft" || s.b.part == "shaft")
        for (Eigen::Matrix2d& m : s.law.stiffness) m *= factor[k];
    const auto found =
        shaft::criticals(shaft::reduce(shaft::assemble(changed), reduction).system, highest, spin_per_whirl);
    while (lines.size() < found.size()) lines.emplace_back(Eigen::VectorXd::Constant(kPoints, report::kAutomatic));
    for (std::size_t c = 0; c < found.size(); ++c) lines[c][k] = found[c].speed;
  }
  report::Figure figure;
  figure.title = "Critical speed map";
  figure.description =
      "Critical speeds of the rotor over the stiffness of its bearings; the dashed line is the file's.";
  report::Panel& panel =
      figure.panel("", {"stiffness of the bearings, times the file's", {}, report::Scale::logarithmic},
                   {"critical speed", report::kRpm, report::Scale::logarithmic});
  for (const Eigen::VectorXd& line : lines) panel.line("", factor, line, {.color = 0});
  panel.vertical(1, "file");
  panel.height = 320;
  figure.runs = {std::filesystem::path(file).filename().string()};
  return figure;
}

void rotor_criticals(const RotorCriticalsOptions& o, Session& session) {
  const LoadedRotor loaded = load_rotor(o.rotor);
  const double highest = o.to_rpm * kRadPerSecPerRpm;
  const std::vector<shaft::Critical> found = shaft::criticals(loaded.system, highest, 1 / o.order);
  const auto threshold = shaft::stability_threshold(loaded.system, highest / 1000, highest);
  report::Table table;
  table.caption = fmt::format("critical speeds of an excitation {:g} times a turn", o.order);
  table.columns = {{"critical", ""}, {"speed", "rpm"}, {"frequency", "Hz"}, {"whirl", ""}};
  for (std::size_t k = 0; k < found.size(); ++k)
    table.add({std::to_string(k + 1), report::format_fixed(found[k].speed / kRadPerSecPerRpm, 1),
               report::format_fixed(found[k].frequency / kTwoPi, 3), whirl_word(found[k].direction)});
  session.say(found.empty() ? fmt::format("no critical speed up to {:g} rpm", o.to_rpm) : report::to_text(table));
  session.say(threshold ? fmt::format("unstable           from {:.5g} rpm: {} whirl at {:.4g} Hz grows",
                                      threshold->speed / kRadPerSecPerRpm, whirl_word(threshold->direction),
                                      threshold->frequency / kTwoPi)
                        : fmt::format("stable             up to {:g} rpm", o.to_rpm));
  Summary summary;
  shaft::carry_distrust(loaded.rotor, Consequence::no_trust, summary);
  session.result(shaft::criticals_json(found, 1 / o.order, threshold, highest));
  if (!o.figure.empty()) report::write_figure(critical_map(loaded.rotor, highest, 1 / o.order, o.rotor), o.figure);
  session.finish(summary);
}

}  // namespace

void add_rotor_criticals(CommandLine& rotor, Session& session) {
  auto o = std::make_shared<RotorCriticalsOptions>();
  CommandLine* sub =
      add_command(rotor, session, "criticals", "Critical speeds, and the speed above which the rotor is unstable",
                  "Input: a rotor file. Critical speeds are those of the undamped rotor, found directly and not from a "
                  "diagram. Unbalance\n"
                  "excites those of forward whirl, and of backward whirl where the bearings differ between x and y.\n\n"
                  "Example: whirl rotor criticals rotor.toml --to-rpm 20000 --figure map.svg",
                  [o, &session] { rotor_criticals(*o, session); });
  sub->add_option("ROTOR", o->rotor, "rotor file")->input()->required();
  sub->add_option("--to-rpm", o->to_rpm, "highest speed")->range(1e-3, 1e7)->required();
  sub->add_option("--order", o->order, "excitation a turn: 1 unbalance, 2 e.g. a coupling")
      ->range(1e-3, 1000)
      ->show_default();
  sub->add_option("--figure", o->figure, "critical speeds over the stiffness of the bearings (.svg, .png, .pdf, .csv)")
      ->output();
}

}  // namespace whirl::app
