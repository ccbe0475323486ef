#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>

#include "bounds/linear_bounds.hpp"
#include "evidence/model_verdict.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/partwise_score.hpp"

namespace whirl::identification {
namespace {

constexpr Eigen::Index kLeast = 1000;  // samples of a last part that speaks for the record

Eigen::Index count_rows(const NextPart& next, const IdentifyOptions& o) {
  Eigen::Index rows = 0;
  for (Recording part; next(part);) {
    rows += part.size();
    if (o.progress) o.progress(fmt::format("{:.3g} million samples counted", 1e-6 * static_cast<double>(rows)), 0);
  }
  return rows;
}

}  // namespace

Identification identify_stream(const std::function<NextPart()>& open, const std::string& source,
                               const std::function<SindyOptions(const Recording&)>& sindy_of,
                               const IdentifyOptions& o) {
  if (o.bounds.any()) throw Error("bounds between coefficients are for records that are held in memory");
  // Where the part held out begins is known when the samples have been counted.
  const bool holds_out = o.holdout != 0;
  const Eigen::Index rows = holds_out ? count_rows(open(), o) : 0;
  const Eigen::Index split = holds_out ? holdout_start(rows, o.holdout) : std::numeric_limits<Eigen::Index>::max();

  Identification id;
  HeldOut& held = id.evidence.held_out;
  held.what = holds_out ? held_out_part(split, rows, source) : "";
  std::unique_ptr<SindyStream> stream;
  std::unique_ptr<HeldOutParts> test;
  const auto begin_test = [&] {
    try {
      const IdentifiedModel model = stream->fit();
      if (model.summary.status == Status::unusable)
        throw Error("the rest alone gives no model: " + model.summary.reason);
      test = std::make_unique<HeldOutParts>(model, held.what);
    } catch (const Error& e) {
      held.reason = e.what();
    }
  };
  const NextPart next = open();
  Eigen::Index at = 0;
  Recording last;
  for (Recording part; next(part);) {
    if (o.progress) {
      o.progress(fmt::format("{:.3g} million samples", 1e-6 * static_cast<double>(at)),
                 rows > 0 ? 0.9 * static_cast<double>(at) / static_cast<double>(rows) : 0.5);
    }
    if (!stream) stream = std::make_unique<SindyStream>(sindy_of(part));
    const Eigen::Index fitted = std::clamp<Eigen::Index>(split - at, 0, part.size());
    if (fitted > 0) stream->add(part_of(part, 0, fitted));
    if (at <= split && split < at + part.size()) begin_test();
    if (fitted < part.size()) {
      const Recording rest = part_of(part, fitted, part.size() - fitted);
      stream->add(rest);
      if (test) test->add(rest);
    }
    at += part.size();
    if (part.size() >= kLeast || last.size() == 0) last = std::move(part);
  }
  if (!stream) throw Error(source + ": no samples");
  id.model = stream->fit(&id.evidence.bounds);
  if (id.model.summary.status != Status::unusable) {
    id.evidence.collinear = collinear_groups(id.model, last);
    if (test) held = test->finish();
  }
  detail::judge_evidence(id);
  return id;
}

}  // namespace whirl::identification
