#include "whirl/pages/monte_carlo_report.hpp"

#include <fmt/format.h>

#include <cmath>

#include "whirl/io/model_json.hpp"
#include "whirl/report/format.hpp"
#include "whirl/report/units.hpp"

namespace whirl::pages {
namespace {

std::string percent(const tuning::Proportion& p) {
  return fmt::format("{:.2f} % [{:.2f}, {:.2f}]", 100 * p.value, 100 * p.low, 100 * p.high);
}

io::Json to_json(const tuning::Proportion& p) {
  return io::Json::object()
      .set("count", p.count)
      .set("of", p.n)
      .set("value", p.value)
      .set("ci95", std::vector{p.low, p.high});
}

/// What no data sheet says, and by how much it widens the interval of `exceeds`.
std::string common_note(const tuning::MonteCarloResult& r) {
  std::string parts;
  for (int u = 0; u < tuning::kCommonUnknowns; ++u) {
    const double part = r.common[static_cast<std::size_t>(u)];
    if (part < 5e-4) continue;
    parts += fmt::format("{}{} {:.1f} %", parts.empty() ? "" : ", ", to_string(static_cast<tuning::CommonUnknown>(u)),
                         100 * part);
  }
  if (parts.empty()) return "What all machines may have in common (distribution, runout, ringing) makes no difference.";
  return "Of the last interval, to either side, by what no data sheet says and all machines may have in common: " +
         parts + ".";
}

}  // namespace

report::Table monte_carlo_table(const tuning::MonteCarloResult& r, const tuning::MonteCarloOptions& o) {
  report::Table t;
  t.caption =
      fmt::format("{} machines drawn from the identified covariance and the hardware's tolerances", r.samples.size());
  t.columns = {{"quantity", "", report::Align::left}, {"value", ""}};
  const auto mm = [](double v) { return fmt::format("{:.4f} mm peak", 1e3 * v); };
  t.add({"whole-run peak, median", mm(r.peak_median)});
  t.add({"95 % of the machines below", mm(r.peak_p95)});
  t.add({"99 % of the machines below", mm(r.peak_p99)});
  t.add({"largest", mm(r.peak_worst)});
  t.add({"stable", percent(r.stable)});
  if (o.limit > 0) t.add({fmt::format("above {:g} mm or not stable", 1e3 * o.limit), percent(r.exceeds)});
  t.notes = {
      "In brackets the 95 % interval of Clopper and Pearson. It covers the draws, not what the model leaves out."};
  if (o.limit > 0) t.notes.push_back(common_note(r));
  return t;
}

io::Json to_json(const tuning::MonteCarloResult& r, const tuning::MonteCarloOptions& o) {
  io::Json document = io::start_document("whirl.robustness", 1);
  document.set("amplitude", "peak").set("seed", fmt::format("{}", o.seed));
  document.set("peak_median", r.peak_median).set("peak_p95", r.peak_p95).set("peak_p99", r.peak_p99);
  document.set("peak_worst", r.peak_worst).set("stable", to_json(r.stable));
  document.set("limit", o.limit).set("exceeds", o.limit > 0 ? to_json(r.exceeds) : io::Json());
  io::Json common = io::Json::object();
  for (int u = 0; u < tuning::kCommonUnknowns; ++u) {
    common.set(to_string(static_cast<tuning::CommonUnknown>(u)), r.common[static_cast<std::size_t>(u)]);
  }
  document.set("exceeds_common", o.limit > 0 ? common : io::Json());
  std::vector<double> k1, k2, c, re, im, open, peak, still, stable;
  for (const tuning::MonteCarloSample& s : r.samples) {
    k1.push_back(s.model.k1), k2.push_back(s.model.k2), c.push_back(s.model.c);
    re.push_back(s.model.eps.real()), im.push_back(s.model.eps.imag());
    open.push_back(s.open_peak), peak.push_back(s.peak), still.push_back(s.standstill_rms), stable.push_back(s.stable);
  }
  document.set("samples", io::Json::object()
                              .set("k1", k1)
                              .set("k2", k2)
                              .set("c", c)
                              .set("eps_re", re)
                              .set("eps_im", im)
                              .set("open_peak", open)
                              .set("peak", peak)
                              .set("standstill_rms", still)
                              .set("stable", stable));
  return document;
}

report::Document monte_carlo_report(const tuning::MonteCarloResult& r, const tuning::MonteCarloOptions& o,
                                    const ControllerDesign& design, const Provenance& provenance) {
  report::Document doc;
  doc.title = fmt::format("Robustness of {} with {}", design.law, design.estimator);
  doc.table(monte_carlo_table(r, o));
  const auto n = static_cast<Eigen::Index>(r.samples.size());
  Eigen::VectorXd peak(n), frequency(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const tuning::MonteCarloSample& s = r.samples[static_cast<std::size_t>(i)];
    peak[i] = s.peak;
    frequency[i] = s.model.natural_frequency();
  }
  report::Figure histogram;
  histogram.title = "Distribution of the whole-run peak";
  histogram.description = "Machines per class of the largest displacement.";
  report::Panel& bars = histogram.panel(
      "",
      {"largest |x|, peak", report::engineering_unit(Quantity::displacement, peak.maxCoeff<Eigen::PropagateNumbers>())},
      {"machines", {}});
  bars.histogram("", peak, std::clamp(static_cast<int>(std::sqrt(static_cast<double>(n))), 5, 60));
  report::Figure cause;
  cause.title = "Peak against natural frequency";
  cause.description = "One mark per machine.";
  report::Panel& marks = cause.panel("", {"natural frequency", report::kHertzOfAngular}, {"largest |x|, peak", {}});
  marks.scatter("", frequency, peak);
  report::show_y_as(marks, Quantity::displacement);
  if (o.limit > 0) {
    bars.vertical(o.limit, "limit");
    marks.horizontal(o.limit, "limit");
  }
  doc.figure(std::move(histogram), "Largest displacement over the machines drawn.");
  doc.figure(std::move(cause), "Largest displacement against the natural frequency drawn.");
  doc.section("Where it comes from").provenance(provenance);
  return doc;
}

}  // namespace whirl::pages
