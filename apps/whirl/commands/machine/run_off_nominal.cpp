#include "run_off_nominal.hpp"

#include <fmt/format.h>

#include "command.hpp"
#include "whirl/control/supervisor.hpp"
#include "whirl/report/table.hpp"
#include "whirl/tuning/off_nominal.hpp"

namespace whirl::app {

void run_off_nominal(Session& session, const ControllerDesign& design, const rig::RigParameters& rig,
                     std::uint64_t seed, Summary summary) {
  constexpr double kMost = 1.05;  // of the open loop
  const std::vector<tuning::OffNominalCase> cases = tuning::off_nominal(design, rig, seed);
  report::Table table;
  table.caption = fmt::format("{} with {} on machines it was not made for", design.law, design.estimator);
  table.columns = {{"condition", "", report::Align::left},
                   {"without", ""},
                   {"with", ""},
                   {"found after", "ms"},
                   {"supervision", "", report::Align::left}};
  table.notes = {
      "without, with supervision: largest closed / open peak of a segment, of the true disk centre, x axis, the first "
      "0.3 s left out, segments with an open peak above 50 um."};
  io::Json::Array rows;
  for (const tuning::OffNominalCase& c : cases) {
    const std::string text = control::supervision_text(c.word);
    table.add({c.name, fmt::format("{:.2f}", c.worst_without), fmt::format("{:.2f}", c.worst_with),
               c.detected >= 0 ? fmt::format("{:.0f}", 1e3 * c.detected) : "", text});
    rows.push_back(io::Json::object()
                       .set("condition", c.name)
                       .set("without", c.worst_without)
                       .set("with", c.worst_with)
                       .set("detected", c.detected)
                       .set("supervision", text));
    if (c.worst_with > kMost) {
      summary.fail(fmt::format("{}: {:.2f} times the motion without control", c.name, c.worst_with));
    }
  }
  session.say(report::to_text(table));
  session.result(io::start_document("whirl.off_nominal", 1).set("conditions", std::move(rows)));
  session.finish(summary);
}

}  // namespace whirl::app
