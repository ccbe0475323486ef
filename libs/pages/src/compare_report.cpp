#include "whirl/pages/compare_report.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "whirl/io/model_json.hpp"
#include "whirl/pages/run_json.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/rotor_figures.hpp"
#include "whirl/report/units.hpp"

namespace whirl::pages {
namespace {

using report::format_fixed;

// The paper's balanced case (section VII-B, Fig. 18), m.
constexpr double kPaperBalancedOpen = 1.242e-3, kPaperBalancedPd = 0.558e-3, kPaperBalancedTsmc = 0.212e-3;

std::string peak_cell(double open, double closed) {
  return fmt::format("{:.4f} ({:.1f} %)", 1e3 * closed, 100 * (1 - closed / open));
}

bool has_balanced(const Comparison& c) {
  return std::ranges::all_of(c.results, [](const tuning::ComparedResult& r) { return r.balanced.has_value(); });
}

Eigen::VectorXd category_axis(Eigen::Index n) { return Eigen::VectorXd::LinSpaced(n, 0, static_cast<double>(n - 1)); }

Eigen::VectorXd segment_values(const rig::SegmentPeaks& peaks) {
  Eigen::VectorXd v(5);
  for (Eigen::Index i = 0; i < 4; ++i) v[i] = peaks.segment[static_cast<std::size_t>(i)];
  v[4] = peaks.all;
  return v;
}

const tuning::ComparedResult* find_label(const Comparison& c, const std::string& start) {
  for (const tuning::ComparedResult& r : c.results) {
    if (r.label.starts_with(start)) return &r;
  }
  return nullptr;
}

// The best method, eq. 43 and PD as the paper has them; without what was not compared, none twice.
std::vector<const tuning::ComparedResult*> shown(const Comparison& c) {
  std::vector<const tuning::ComparedResult*> out;
  for (const tuning::ComparedResult* r :
       {find_label(c, "pd, lpf, no"), find_label(c, "tsmc_paper, lpf"), &tuning::best_result(c.results)}) {
    if (r != nullptr && std::ranges::find(out, r) == out.end()) out.push_back(r);
  }
  return out;
}

// Runout that stays when nothing removes it as a line; what runout (removed), noise and delay each leave as a band.
void draw_floor(report::Panel& panel, const Comparison& c) {
  double low = INFINITY, high = 0;
  std::string names;
  for (const tuning::FloorCase& f : c.floor) {
    const std::string& n = f.name;
    if (n.starts_with("runout, not")) panel.horizontal(f.peak, n);
    for (const char* source : {"runout, as", "sensor noise", "delay"}) {
      if (!n.starts_with(source)) continue;
      low = std::min(low, f.peak), high = std::max(high, f.peak);
      names += fmt::format("{} {} {:.1f}", names.empty() ? "" : ",", n.substr(0, n.find_first_of(", ")), 1e6 * f.peak);
    }
  }
  if (high > 0) panel.spans.push_back({report::Direction::horizontal, low, high, "floor:" + names + " um", 7});
}

report::Figure effort_figure(const Comparison& c) {
  report::Figure figure;
  figure.title = "Whole-run peak against effort";
  figure.description = "One mark per method: rms force against the largest displacement; lower left is better.";
  report::Panel& panel = figure.panel("", {"force in x, rms", report::si(Quantity::force), report::Scale::linear},
                                      {"largest |x|, peak", {}, report::Scale::logarithmic});
  panel.height = 380;
  const auto add = [&](bool everywhere, const char* name, report::Mark mark, int color) {
    std::vector<double> x, y;
    for (const tuning::ComparedResult& r : c.results) {
      if (r.stable_everywhere() != everywhere) continue;
      x.push_back(r.nominal.force_rms), y.push_back(r.peak_mean);
    }
    if (x.empty()) return;
    const auto n = static_cast<Eigen::Index>(x.size());
    panel.scatter(name, Eigen::Map<Eigen::VectorXd>(x.data(), n), Eigen::Map<Eigen::VectorXd>(y.data(), n),
                  {.color = color, .mark = mark});
  };
  add(true, "stable in every condition", report::Mark::circle, 0);
  add(false, "fails in some condition", report::Mark::cross, 1);
  panel.horizontal(kPaperClosed[4], "paper, TSMC");
  report::show_y_as(panel, Quantity::displacement);
  draw_floor(panel, c);
  return figure;
}

report::Figure segment_figure(const Comparison& c) {
  report::Figure figure;
  figure.title = "Segments of Table 4";
  figure.description = "Open- and closed-loop peaks per segment on a logarithmic axis, with the paper's.";
  report::Panel& panel =
      figure.panel("", {"segment", {}, report::Scale::linear}, {"largest |x|, peak", {}, report::Scale::logarithmic});
  panel.categories = {"1 before", "2 entering", "3 through", "4 to rest", "whole run"};
  panel.x.low = -0.4, panel.x.high = 4.4;
  panel.height = 300;
  const Eigen::VectorXd x = category_axis(5);
  const auto paper = [](const std::array<double, 5>& peaks) {
    return Eigen::Map<const Eigen::VectorXd>(peaks.data(), 5).eval();
  };
  panel.line("open loop", x, segment_values(c.results.front().nominal.open),
             {.color = 7, .mark = report::Mark::circle});
  panel.line("paper, open loop", x, paper(kPaperOpen),
             {.color = 7, .dash = report::Dash::dotted, .mark = report::Mark::cross});
  panel.line("paper, TSMC", x, paper(kPaperClosed),
             {.color = 1, .dash = report::Dash::dotted, .mark = report::Mark::cross});
  int color = 2;
  for (const tuning::ComparedResult* r : shown(c)) {
    panel.line(r->label, x, segment_values(r->nominal.closed), {.color = color++, .mark = report::Mark::square});
  }
  report::show_y_as(panel, Quantity::displacement);
  draw_floor(panel, c);
  return figure;
}

// Runs the shown methods again with their logs and draws x, open loop behind.
report::Figure trace_figure(const Comparison& c, bool balanced) {
  rig::RigParameters rig = c.rig;
  if (balanced) rig.rotor.added_mass = 0;
  tuning::ClosedLoopOptions options;
  options.run.seed = 101;
  std::vector<Recording> logs;
  std::vector<std::string> names;
  const auto add = [&](const Recording& log, const char* channel, const std::string& name) {
    Recording r;
    r.dt = log.dt;
    r.add("x", Quantity::displacement, log[channel]);
    logs.push_back(std::move(r));
    names.push_back(name);
  };
  for (const tuning::ComparedResult* r : shown(c)) {
    ControllerDesign d = r->design;
    if (balanced) d.model.eps = r->balanced_eps;
    const Recording log = tuning::run_closed_loop(d, rig, options).log;
    if (logs.empty()) add(log, "x_open", "open loop");
    add(log, "x_true", r->label);
  }
  std::vector<report::NamedRun> runs;
  for (std::size_t i = 0; i < logs.size(); ++i) runs.push_back({names[i], logs[i]});
  report::Figure figure = report::time_traces(runs, {"x"});
  const report::Figure closed = report::time_traces({runs.begin() + 1, runs.end()}, {"x"});
  figure.panels.push_back(closed.panels.front());
  figure.panels.back().title = "closed loop alone";
  figure.description = "Displacement of the disk centre over the run without control and with the methods named.";
  return figure;
}

}  // namespace

report::Table comparison_table(const Comparison& c) {
  report::Table t;
  const bool balanced = has_balanced(c);
  t.caption = "Closed loop on one rig, the same tuning budget, scenarios and seeds for every method";
  t.columns = {{"method", "", report::Align::left}};
  for (int i = 1; i <= 4; ++i) t.columns.push_back({fmt::format("seg. {}", i), "%"});
  for (const char* name : {"whole run", "worst seed"}) t.columns.push_back({name, "mm peak"});
  if (balanced) t.columns.push_back({"balanced", "mm peak"});
  t.columns.push_back({"standstill", "um rms"});
  for (const char* kind : {"N rms", "N peak"}) t.columns.push_back({"force in x", kind});
  t.columns.push_back({"excess TV", "N/s"});
  t.columns.push_back({"saturated", "%"});
  t.columns.push_back({"gain margin", ""});
  t.columns.push_back({"delay margin", "ms"});
  t.columns.push_back({"fails", ""});
  t.columns.push_back({"verdict", "", report::Align::left});
  const auto suppression_cell = [](double open, double closed) { return format_fixed(100 * (1 - closed / open), 1); };

  std::vector<std::string> paper{"paper, TSMC"};
  for (std::size_t i = 0; i < 4; ++i) paper.push_back(suppression_cell(kPaperOpen[i], kPaperClosed[i]));
  paper.push_back(peak_cell(kPaperOpen[4], kPaperClosed[4]));
  paper.emplace_back();
  std::vector<std::string> paper_pd(t.columns.size());
  if (balanced) {
    paper.push_back(peak_cell(kPaperBalancedOpen, kPaperBalancedTsmc));
    paper_pd[0] = "paper, PD";
    paper_pd[7] = peak_cell(kPaperBalancedOpen, kPaperBalancedPd);
  }
  paper.resize(t.columns.size());
  t.add(paper);
  if (balanced) t.add(paper_pd);
  for (const tuning::ComparedResult& r : c.results) {
    const tuning::ClosedLoopMetrics& m = r.nominal;
    std::vector<std::string> row{r.label};
    for (std::size_t i = 0; i < 4; ++i) row.push_back(suppression_cell(m.open.segment[i], m.closed.segment[i]));
    row.push_back(peak_cell(m.open.all, r.peak_mean));
    row.push_back(format_fixed(1e3 * r.peak_worst, 4));
    if (balanced) row.push_back(peak_cell(r.balanced->open.all, r.balanced->closed.all));
    row.push_back(format_fixed(1e6 * m.standstill_rms, 2));
    row.push_back(format_fixed(m.force_rms, 2));
    row.push_back(format_fixed(m.force_peak, 1));
    row.push_back(format_fixed(m.excess_variation, 0));
    row.push_back(format_fixed(100 * m.saturated, 1));
    const auto fails =
        std::ranges::count_if(r.matrix, [](const tuning::RobustnessCase& k) { return !k.metrics.stable; });
    const auto margin = [&](const char* name, double scale) {
      const auto found = r.design.margins.find(name);
      return found == r.design.margins.end() ? std::string() : format_fixed(scale * found->second, 2);
    };
    row.push_back(margin("gain_margin", 1));
    row.push_back(margin("delay_margin_s", 1e3));
    row.push_back(r.matrix.empty() ? "" : fmt::format("{} of {}", fails, r.matrix.size()));
    const bool certified = r.design.margins.contains("certified") && r.design.margins.at("certified") > 0;
    row.emplace_back(!m.stable ? "fails" : certified ? "passes" : "not certified");
    t.add(std::move(row));
  }
  t.notes = {
      "Peaks of the true disk centre, x axis, zero-to-peak, the first 0.5 s left out; per segment and in brackets the "
      "suppression against the same rig without control. The paper does not name the kind of its amplitudes; its "
      "percentages "
      "do not depend on it. Whole run: mean over the seeds.",
      "Excess TV: total variation of the force above that of the smooth force that cancels the unbalance. Fails: "
      "conditions "
      "of the robustness matrix. Margins: the worst of five speeds on the tuning plant; a gain margin below 1.1 or a "
      "delay margin below half a sample fails. Not certified: passes on this rig, but not on all that the tuning plant "
      "may be. Differences below about 10 % are within the scatter of the tuning."};
  for (const tuning::ComparedResult& r : c.results) {
    const auto& m = r.design.margins;
    if (!m.contains("training_runs")) continue;
    t.notes.push_back(
        fmt::format("{}: beside the tuning its weights were trained in {:.0f} runs on random machines (objective on "
                    "machines not trained on: {:.4f} before, {:.4f} after).",
                    r.label, m.at("training_runs"), m.at("training_start"), m.at("training_cost")));
  }
  return t;
}

report::Table matrix_table(const Comparison& c) {
  report::Table t;
  t.caption = "Robustness: whole-run peak in micrometres, the design unchanged";
  t.columns = {{"method", "", report::Align::left}};
  for (const tuning::RobustnessCase& k : c.results.front().matrix) t.columns.push_back({k.name, ""});
  for (const tuning::ComparedResult& r : c.results) {
    std::vector<std::string> row{r.label};
    for (const tuning::RobustnessCase& k : r.matrix) {
      row.push_back(fmt::format("{}{:.0f}", k.metrics.stable ? "" : "FAILS ", 1e6 * k.metrics.closed.all));
    }
    t.add(std::move(row));
  }
  t.notes = {
      "FAILS: divergence, trip, limit cycle (at standstill, or motion above 30 um rms beside the synchronous one while "
      "turning), a segment worse than without control, total variation above 1.5 times the nominal, or at the "
      "force "
      "limit more than 1 % of the time while turning. Delay in samples; known: the controller is given it."};
  return t;
}

report::Table failures_table(const Comparison& c) {
  report::Table t;
  t.caption = "Conditions in which a method fails, and its largest peak where it does not";
  t.columns = {{"method", "", report::Align::left},
               {"peak", "um"},
               {"in", "", report::Align::left},
               {"fails with", "", report::Align::left}};
  for (const tuning::ComparedResult& r : c.results) {
    const tuning::RobustnessCase* worst = nullptr;
    std::string fails;
    for (const tuning::RobustnessCase& k : r.matrix) {
      if (!k.metrics.stable) {
        fails += (fails.empty() ? "" : "; ") + k.name;
      } else if (worst == nullptr || k.metrics.closed.all > worst->metrics.closed.all) {
        worst = &k;
      }
    }
    t.add({r.label, worst ? format_fixed(1e6 * worst->metrics.closed.all, 0) : "", worst ? worst->name : "",
           fails.empty() ? "none" : fails});
  }
  return t;
}

report::Table floor_table(const Comparison& c) {
  report::Table t;
  const bool balanced = has_balanced(c);
  t.caption = fmt::format("Physical floor: {} with one imperfection of the machine at a time",
                          tuning::best_result(c.results).label);
  t.columns = {{"what is not perfect", "", report::Align::left}, {"whole run", "um peak"}};
  if (balanced) t.columns.push_back({"balanced", "um peak"});
  for (const tuning::FloorCase& f : c.floor) {
    std::vector<std::string> row{f.name, format_fixed(1e6 * f.peak, 1)};
    if (balanced) row.push_back(format_fixed(1e6 * f.balanced, 1));
    t.add(std::move(row));
  }
  return t;
}

io::Json to_json(const Comparison& c) {
  io::Json document = io::start_document("whirl.comparison", 1);
  document.set("best", tuning::best_result(c.results).label);
  io::Json::Array methods, floor;
  for (const tuning::ComparedResult& r : c.results) {
    io::Json m =
        io::Json::object().set("method", r.label).set("peak_mean", r.peak_mean).set("peak_worst", r.peak_worst);
    m.set("stable_everywhere", r.stable_everywhere()).set("run", to_json(r.nominal));
    m.set("balanced", r.balanced ? to_json(*r.balanced) : io::Json());
    io::Json::Array matrix;
    for (const tuning::RobustnessCase& k : r.matrix) {
      matrix.push_back(io::Json::object()
                           .set("condition", k.name)
                           .set("peak", k.metrics.closed.all)
                           .set("stable", k.metrics.stable)
                           .set("reasons", k.metrics.verdict.reasons)
                           .set("standstill_rms", k.metrics.standstill_rms)
                           .set("force_rms", k.metrics.force_rms)
                           .set("saturated", k.metrics.saturated));
    }
    m.set("matrix", std::move(matrix)).set("controller", to_json(r.design));
    methods.push_back(std::move(m));
  }
  for (const tuning::FloorCase& f : c.floor) {
    floor.push_back(io::Json::object().set("source", f.name).set("peak", f.peak).set("balanced", f.balanced));
  }
  document.set("methods", std::move(methods)).set("floor", std::move(floor));
  document.set("provenance", to_json(c.provenance));
  return document;
}

report::Document comparison_report(const Comparison& c) {
  const tuning::ComparedResult& best = tuning::best_result(c.results);
  report::Document doc;
  doc.title = "Control laws compared on one rig";
  doc.subtitle = "same identified model, tuning budget, scenarios, runs and seeds";
  doc.paragraph(
      "Every method is tuned on a plant made of the identified model and the data sheets alone and then run, "
      "unchanged, on "
      "the simulated rig with seeds the tuning has not seen. Only methods with the same knowledge are alike: those "
      "with "
      "feedforward cancel the identified unbalance, those of kfe and kfo estimate it while running.");
  doc.callout(best.stable_everywhere() ? report::Callout::Kind::agrees : report::Callout::Kind::warning,
              fmt::format("Best: {}", best.label),
              fmt::format("{:.4f} mm peak over the run ({:.2f} % less than without control), {}.", 1e3 * best.peak_mean,
                          100 * (1 - best.peak_mean / best.nominal.open.all),
                          best.stable_everywhere() ? "stable in every condition of the matrix"
                                                   : "but not stable in every condition of the matrix"));
  doc.section("The run").table(comparison_table(c));
  doc.figure(effort_figure(c), "Largest displacement against effort, with the physical floor of the best method.");
  doc.figure(segment_figure(c), "Table 4 of the paper: segments, with the paper's numbers and the physical floor.");
  doc.figure(trace_figure(c, false), "The run of Table 4 (paper Fig. 24).");
  if (has_balanced(c)) doc.figure(trace_figure(c, true), "The balanced rotor (paper Fig. 18).");
  if (!c.results.front().matrix.empty()) doc.section("Robustness").table(matrix_table(c));
  doc.section("What physics allows");
  doc.paragraph(
      "The controller sees the disk through its sensors and acts late. Each row gives the best method one imperfection "
      "and "
      "takes all others away.");
  doc.table(floor_table(c));
  doc.section("Where it comes from").code(c.command_line).provenance(c.provenance);
  return doc;
}

}  // namespace whirl::pages
