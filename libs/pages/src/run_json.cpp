#include "whirl/pages/run_json.hpp"

#include <fmt/format.h>

#include "whirl/report/format.hpp"

namespace whirl::pages {

const std::array<const char*, 4> kSegmentNames{"1 before the critical region", "2 entering it",
                                               "3 through the natural frequency", "4 coming to rest"};

namespace {

io::Json entry(const std::string& name, double open, double closed, double suppression) {
  return io::Json::object()
      .set("name", name)
      .set("open_peak", open)
      .set("closed_peak", closed)
      .set("suppression", suppression);
}

}  // namespace

io::Json to_json(const tuning::ClosedLoopMetrics& m) {
  io::Json document = io::start_document("whirl.run", 1);
  io::Json::Array segments;
  for (std::size_t i = 0; i < 4; ++i) {
    segments.push_back(entry(kSegmentNames[i], m.open.segment[i], m.closed.segment[i], m.suppression.segment[i]));
  }
  document.set("segments", std::move(segments));
  document.set("whole", entry("whole run", m.open.all, m.closed.all, m.suppression.all));
  document.set("amplitude", "peak");
  document.set("standstill_rms", m.standstill_rms);
  document.set("force_rms", m.force_rms).set("force_peak", m.force_peak);
  document.set("force_y_rms", m.force_y_rms).set("force_y_peak", m.force_y_peak);
  document.set("total_variation", m.total_variation).set("excess_variation", m.excess_variation);
  document.set("saturated", m.saturated).set("saturated_turning", m.saturated_turning);
  document.set("standing_rms", m.standing_rms).set("reasons", m.verdict.reasons);
  document.set("supervision", static_cast<double>(m.supervision)).set("supervised", m.supervised);
  const auto& r = m.reidentification;
  io::Json found = io::Json::object().set("status", static_cast<double>(r.word));
  constexpr std::array kShares{"stiffness", "damping", "gain"};
  for (std::size_t i = 0; i < 3; ++i) {
    found.set(kShares[i],
              io::Json::object().set("estimate", r.estimate[i]).set("sd", r.sd[i]).set("corrected", r.acting[i]));
  }
  if (r.sd[0] > 0) document.set("reidentification", std::move(found));
  document.set("held", m.held).set("stable", m.stable).set("trip", std::string(to_string(m.trip)));
  return document;
}

report::Table segment_table(const tuning::ClosedLoopMetrics& m, const std::string& caption, bool with_paper) {
  report::Table table;
  table.caption = caption;
  table.columns = {{"segment", "", report::Align::left},
                   {"open loop, peak", "mm"},
                   {"closed loop, peak", "mm"},
                   {"suppression", "%"}};
  if (with_paper) {
    for (const char* name : {"paper, open", "paper, closed"}) table.columns.push_back({name, "mm"});
    table.columns.push_back({"paper, suppression", "%"});
    table.notes = {
        "Peaks of the true disk centre, x axis, zero-to-peak, without the first 0.5 s. The paper's Table 4 prints "
        "6.45 and 0.26 mm for segment 3, its text 3.25 and below 0.17 mm for the same: most likely peak-to-peak "
        "against zero-to-peak. Row 5 is not defined there; read as the whole run."};
  }
  if (m.radial_peak > 0) {
    table.notes.push_back(
        fmt::format("The first 0.5 s count in no row; with them the disk centre was {:.3f} mm off at most "
                    "(radial, zero-to-peak).",
                    1e3 * m.radial_peak));
  }
  for (std::size_t i = 0; i < 5; ++i) {
    const bool whole = i == 4;
    const double open = whole ? m.open.all : m.open.segment[i];
    const double closed = whole ? m.closed.all : m.closed.segment[i];
    std::vector<std::string> row{whole ? "5 whole run" : kSegmentNames[i], report::format_fixed(1e3 * open, 3),
                                 report::format_fixed(1e3 * closed, 3),
                                 open > 0 ? report::format_fixed(100 * (1 - closed / open), 1) : "-"};
    if (with_paper) {
      row.push_back(report::format_fixed(1e3 * kPaperOpen[i], 2));
      row.push_back(report::format_fixed(1e3 * kPaperClosed[i], 2));
      row.push_back(report::format_fixed(100 * (1 - kPaperClosed[i] / kPaperOpen[i]), 1));
    }
    table.add(std::move(row));
  }
  return table;
}

}  // namespace whirl::pages
