#include "whirl/pages/text/sliding.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/report/units.hpp"

namespace whirl::pages {
namespace {

std::string yes_or_no(bool yes) { return yes ? "yes" : "NO"; }

Eigen::VectorXd column(const std::vector<double>& v) {
  return Eigen::Map<const Eigen::VectorXd>(v.data(), static_cast<Eigen::Index>(v.size()));
}

report::Unit largest_unit(const std::array<std::vector<double>, 2>& axes, Quantity quantity) {
  double largest = 0;
  for (const std::vector<double>& axis : axes)
    for (const double value : axis) largest = std::max(largest, std::abs(value));
  return report::engineering_unit(quantity, largest);
}

}  // namespace

report::Table sliding_table(const tuning::SlidingStudy& study) {
  report::Table t;
  t.caption = "Argument by V = S^2/2 along the run (paper, eqs. 28 to 42)";
  t.columns = {{"requirement", "", report::Align::left}, {"value", ""}, {"limit", ""}, {"met", ""}};
  const bool holds = !study.missed();
  const auto seconds = [](double s) { return std::isfinite(s) ? fmt::format("{:.3g} s", s) : std::string("none"); };
  t.add({fmt::format("disturbance, largest after {:.3g} s", study.skip),
         fmt::format("{:.3g} m/s^2", study.largest_disturbance),
         fmt::format("below {:.3g} m/s^2, the switching gain", study.switching_gain), yes_or_no(holds)});
  t.add({"time with the disturbance above the switching gain", fmt::format("{:.2f} %", 100 * study.share_above), "0 %",
         yes_or_no(study.share_above == 0)});
  if (holds) {
    t.add({"time outside the layer with dV/dt above its bound", fmt::format("{:.2f} %", 100 * study.share_outside),
           "0 %", yes_or_no(study.share_outside == 0)});
    t.add({"|S| stays below", fmt::format("{:.3g} m/s", study.layer), "", ""});
    t.add({"time to reach it", seconds(study.reached), "at most " + seconds(study.reach_bound),
           yes_or_no(study.reached_in_time())});
  }
  return t;
}

std::string sliding_csv(const tuning::SlidingStudy& s) {
  std::string out = "t_s,s_x_m_s,s_y_m_s,disturbance_x_m_s2,disturbance_y_m_s2,V_m2_s2,dV_dt_m2_s3,dV_dt_bound_m2_s3\n";
  for (std::size_t k = 0; k < s.time.size(); ++k) {
    fmt::format_to(std::back_inserter(out), "{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n", s.time[k],
                   s.s[0][k], s.s[1][k], s.disturbance[0][k], s.disturbance[1][k], s.v[k], s.v_rate[k], s.bound[k]);
  }
  return out;
}

report::Figure sliding_figure(const tuning::SlidingStudy& s) {
  const Eigen::VectorXd time = column(s.time);
  const double begin = s.time.front(), end = s.time.back();
  report::Figure out;
  out.title = "Reaching the sliding surface";
  out.description = fmt::format(
      "Left, the whole run: sliding variables, disturbance and V = S^2/2. Right, its start: sliding variables, V and "
      "the derivative of V. The largest disturbance after {:.3g} s is {:.3g} m/s^2, the switching gain {:.3g} m/s^2.",
      s.skip, s.largest_disturbance, s.switching_gain);
  out.width = 1000;
  out.columns = 2;
  // The surface is reached in a small part of the run, which would be one vertical line in it.
  const double reach = std::isfinite(s.reached) ? s.reached : 0;
  const double shown = std::min(begin + std::max(4 * reach, 0.1), end);
  const report::Axis whole{"time", report::kSecond, report::Scale::linear, begin, end};
  const report::Axis start{"time", report::kSecond, report::Scale::linear, begin, shown};
  const report::Axis energy{"V", {report::pretty_unit("m^2/s^2")}};
  const auto surface = [&](const char* title, const report::Axis& t) {
    report::Panel& panel = out.panel(title, t, {"S", largest_unit(s.s, Quantity::velocity)});
    panel.line("x", time, column(s.s[0]));
    panel.line("y", time, column(s.s[1]));
    if (std::isfinite(s.layer)) {
      panel.horizontal(s.layer, "layer");
      panel.horizontal(-s.layer, "");
    }
    if (std::isfinite(s.reached)) panel.vertical(begin + s.reached, "reached");
  };
  surface("whole run", whole);
  surface("start", start);
  report::Panel& pushed = out.panel("", whole, {"disturbance", largest_unit(s.disturbance, Quantity::acceleration)});
  pushed.line("x", time, column(s.disturbance[0]));
  pushed.line("y", time, column(s.disturbance[1]));
  pushed.horizontal(s.switching_gain, "switching gain, eq. 42");
  pushed.horizontal(-s.switching_gain, "");
  pushed.span(begin, std::min(begin + s.skip, end), "start, left out");
  out.panel("", start, energy).line("", time, column(s.v));
  out.panel("", whole, energy).line("", time, column(s.v));
  report::Panel& rate = out.panel("", start, {"dV/dt", {report::pretty_unit("m^2/s^3")}});
  rate.line("dV/dt", time, column(s.v_rate));
  rate.line("bound outside the layer, eq. 39", time, column(s.bound));
  return out;
}

io::Json to_json(const tuning::SlidingStudy& s) {
  io::Json out = io::Json::object()
                     .set("holds", !s.missed())
                     .set("switching_gain", s.switching_gain)
                     .set("largest_disturbance", s.largest_disturbance)
                     .set("share_above", s.share_above)
                     .set("share_outside", s.share_outside);
  const auto finite = [&](const char* name, double value) {
    if (std::isfinite(value)) out.set(name, value);
  };
  finite("layer", s.layer);
  finite("reached", s.reached);
  finite("reach_bound", s.reach_bound);
  return out;
}

}  // namespace whirl::pages
