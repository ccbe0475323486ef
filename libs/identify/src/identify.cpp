#include "whirl/identify/identify.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "bounds/linear_bounds.hpp"
#include "evidence/compare_all.hpp"
#include "evidence/model_verdict.hpp"
#include "evidence/part_agreement.hpp"
#include "evidence/verdict.hpp"
#include "face/rotor_like.hpp"
#include "record/bridge_gaps.hpp"
#include "record/damaged_records.hpp"
#include "rules/magnitudes.hpp"
#include "rules/rules.hpp"
#include "tilt/adopt_tilt.hpp"
#include "whirl/core/error.hpp"
#include "whirl/expr/library.hpp"
#include "whirl/identify/record/channel_instants.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/identify/sindy_library.hpp"

namespace whirl::identification {
namespace {

bool rotor(Method method) { return method == Method::weak || method == Method::paper || method == Method::consistent; }

std::vector<std::string> states_of(const Recording& like, const std::vector<std::string>& inputs) {
  std::vector<std::string> states;
  for (const Channel& c : like.channels) {
    if (std::find(inputs.begin(), inputs.end(), c.name) == inputs.end()) states.push_back(c.name);
  }
  return states;
}

std::size_t index_of(const Recording& r, const std::string& name) {
  const auto at = std::find_if(r.channels.begin(), r.channels.end(), [&](const Channel& c) { return c.name == name; });
  return static_cast<std::size_t>(at - r.channels.begin());
}

/// The records with what is read off beside gaps before any method begins; `said`: what was.
std::vector<Recording> bridged(std::vector<Recording> records, const IdentifyOptions& o, Summary& said) {
  for (Recording& r : records) {
    if (!rotor(o.method) && o.method != Method::drive) {
      r = detail::with_single_gaps_bridged(r, said);
      if (o.method == Method::sindy && !o.sindy.discrete)
        r = detail::without_empty_ends(r, o.sindy.states, o.sindy.inputs);
      if (o.method != Method::second_order) continue;
      // It follows one run from end to end.
      const Recording whole = detail::longest_whole_stretch(r);
      if (whole.size() == r.size()) continue;
      said.warn(fmt::format("{:.4g} s of {:.4g} s are used, from {:.4g} s on: the longest stretch without a gap",
                            whole.dt * static_cast<double>(whole.size()), r.dt * static_cast<double>(r.size()),
                            whole.t0));
      r = whole;
    } else if (const std::size_t at = index_of(r, o.rotor.record.angle); at < r.channels.size()) {
      // A rotor's likelihood leaves missing displacements out.
      const Channel angle = r.channels[at];
      detail::bridge_angle(angle, r, said);
    }
  }
  return records;
}

double finite_spread(const Eigen::VectorXd& a) {
  const Eigen::ArrayXd whole = a.array().isFinite().cast<double>();
  const Eigen::ArrayXd x = a.array().isFinite().select(a.array(), 0.0);
  const double mean = x.sum() / whole.sum();
  return std::sqrt(((x - mean).square() * whole).sum() / whole.sum());
}

/// The options with what they leave open taken from the records.
IdentifyOptions completed(IdentifyOptions o, const Recording& like) {
  o.method = o.chosen(like);
  if (o.sindy.states.empty()) o.sindy.states = states_of(like, o.sindy.inputs);
  if (o.bounds.trapping && !o.library && o.sindy.library.empty()) {
    for (const expr::Expr& term : expr::polynomial_library(o.sindy.states, 2)) o.sindy.library.push_back(term.str());
  }
  return o;
}

/// One fit of the records by the chosen method.
IdentifiedModel fit(const IdentifyOptions& o, const std::vector<Recording>& records, Evidence* evidence = nullptr) {
  switch (o.method) {
    case Method::weak:
      return detail::rotor_or_tilt(records, o.rotor).model;
    case Method::sindy: {
      IdentifiedModel model = o.library ? fit_library(records, *o.library, o.sindy)
                                        : fit_sindy(records, o.sindy, evidence ? &evidence->bounds : nullptr);
      const std::optional<Trapping> trapping = detail::hold_bounds(o, records.front(), model);
      if (evidence) evidence->trapping = trapping;
      return model;
    }
    case Method::drive:
      return identify_drive(records, o.drive);
    default:
      break;
  }
  if (records.size() != 1) throw Error(fmt::format("--method {} takes one record", to_string(o.method)));
  if (o.method == Method::paper) return identify_paper(records.front(), o.paper);
  if (o.method == Method::consistent) return identify_consistent(records.front(), o.consistent);
  return identify_second_order(records.front(), o.second_order);
}

HoldoutSplit split_of(const IdentifyOptions& o, const std::vector<Recording>& records) {
  if (!rotor(o.method)) return split_holdout(records, o.holdout);
  std::vector<std::string> motion;
  for (const std::string& name : {o.rotor.record.x, o.rotor.record.y}) {
    const Channel* c = records.front().find(name);
    if (c != nullptr && c->samples.array().isFinite().any()) motion.push_back(name);
  }
  return split_holdout(records, o.holdout, motion, o.rotor.record.angle);
}

/// A model of what is not held out, of the same kind: what did not explain the whole is not sought again.
RotorIdentification rotor_of_rest(const IdentifyOptions& o, const std::vector<Recording>& records,
                                  const RotorIdentification& whole) {
  if (whole.model.summary.chi_square > rules::kModelError) return detail::rotor_like(records, whole, o.rotor);
  return detail::rotor_or_tilt(records, o.rotor);
}

/// Whether a model of the rest and its prediction speak against the whole.
bool contradicts(const IdentifiedModel& rest, const HeldOut& held, IdentifiedModel whole) {
  whole.summary = {};
  detail::compare_with_rest(rest, whole);
  detail::judge_held_out(held, whole.summary);
  return whole.summary.distrust() != nullptr;
}

/// The rest with the parts of the whole, where it had others, or took another resonance for the rotor's, and does not
/// tell the two apart.
std::optional<IdentifiedModel> rest_like_whole(const IdentifyOptions& o, const std::vector<Recording>& records,
                                               const RotorIdentification& whole, const RotorIdentification& rest) {
  if (detail::same_parts(rest.model, whole.model) || has_tilt(rest.model)) return {};
  RotorIdentification like = detail::rotor_like(records, whole, o.rotor);
  double values = 0;
  for (const Recording& r : records) values += 2 * static_cast<double>(r.size());
  const double least = rest.fit.summary.chi_square, more = like.fit.summary.chi_square - least;
  if (like.model.summary.status == Status::unusable || values * more > rules::kToldApart * std::max(1.0, least))
    return {};
  return std::move(like.model);
}

/// `rest`: the model of what is not held out, where there is one.
HeldOut hold_out(const IdentifyOptions& o, const std::vector<Recording>& records, const IdentifiedModel& whole,
                 const std::optional<RotorIdentification>& rotor_of_whole, std::optional<IdentifiedModel>& rest) {
  const bool is_rotor = rotor(o.method);
  HeldOut held;
  try {
    const HoldoutSplit split = split_of(o, records);
    held.what = split.what;
    std::optional<RotorIdentification> found;
    if (rotor_of_whole && !has_tilt(whole)) found = rotor_of_rest(o, split.train, *rotor_of_whole);
    IdentifiedModel model = found             ? found->model
                            : has_tilt(whole) ? detail::tilt_of(split.train.front(), whole, o.rotor)
                                              : fit(o, split.train);
    if (model.summary.status == Status::unusable) {
      held.reason = "the rest alone gives no model: " + model.summary.reason;
      return held;
    }
    ValidateOptions validation;
    validation.record = o.rotor.record;
    if (is_rotor && records.size() > 1) validation.unbalance = UnbalanceSource::refitted;
    const auto predicted = [&](const IdentifiedModel& by) {
      return predict_held_out(by, split.test, split.what, is_rotor, validation);
    };
    held = predicted(model);
    // What the rest reads in two ways speaks against the whole only where both do.
    if (found && contradicts(model, held, whole)) {
      if (std::optional<IdentifiedModel> like = rest_like_whole(o, split.train, *rotor_of_whole, *found)) {
        HeldOut other = predicted(*like);
        if (!contradicts(*like, other, whole)) model = *std::move(like), held = std::move(other);
      }
    }
    rest = std::move(model);
    return held;
  } catch (const Error& e) {
    held.reason = e.what();
    return held;
  }
}

bool both_probes(const Recording& r) { return r.has("x") && r.has("y") && r.has("beta"); }

/// Whether one of the records holds both sides of an instant.
bool holds(const std::vector<Recording>& records, double instant) {
  return std::ranges::any_of(records,
                             [&](const Recording& r) { return r.t0 < instant && instant < r.t0 + r.duration(); });
}

/// Resonances and changes of the machine that the records show only in the part held out.
std::vector<Finding> not_shown(const IdentifyOptions& o, const std::vector<Recording>& records,
                               const IdentifiedModel& model, const std::string& held) {
  if (held.empty() || !std::ranges::all_of(records, both_probes)) return {};
  const DataRange all = data_range(records);
  const std::vector<Recording> train = split_of(o, records).train;
  DataRange rest = data_range(train);
  if (records.size() > 1) rest.amplitude = std::numeric_limits<double>::infinity();  // each has its own unbalance
  const auto rate = [&](double omega) { return detail::passing_rate(records, omega); };
  std::vector<Finding> out = detail::not_shown_by_rest(model, all, rest, rate, held);
  for (const RotorTerm& t : terms_of(model)) {
    if (t.entry->by_reference != nullptr && t.part == 0 && !holds(train, t.reference))
      out.push_back({FindingCode::held_out_cannot_check, Consequence::warning, {{"instant", t.reference, "s"}}, held});
  }
  return out;
}

}  // namespace

HeldOut predict_held_out(const IdentifiedModel& model, const Recording& record, std::string what, bool rotor,
                         const ValidateOptions& options) {
  HeldOut held;
  held.what = std::move(what);
  try {
    if (rotor) {
      const Validation v = validate_model(model, record, options);
      if (v.quantity != Quantity::displacement) held.unit = si_unit(v.quantity);
      if (v.summary.status == Status::unusable && (std::isfinite(v.rmse_x) || std::isfinite(v.rmse_y))) {
        held.reason = v.summary.reason;
        return held;
      }
      // Of an axis that is not measured there is no error.
      if (record.has(options.record.x) && !std::isnan(v.rmse_x))
        held.scores.push_back(
            {options.record.x, v.rmse_x, v.rmse_x / finite_spread(record[options.record.x]), v.noise_x, v.band_x});
      if (record.has(options.record.y) && !std::isnan(v.rmse_y))
        held.scores.push_back(
            {options.record.y, v.rmse_y, v.rmse_y / finite_spread(record[options.record.y]), v.noise_y, v.band_y});
      return held;
    }
    const Recording whole = detail::longest_whole_stretch(record);
    if (whole.size() < record.size())
      held.what += fmt::format(", {:.3g} s without a gap", whole.dt * static_cast<double>(whole.size()));
    const Recording test = with_derivatives(whole, model.inputs);
    held.scores = score(model, test);
    const CompiledModel compiled(model);
    std::vector<std::string> states;
    for (const StateScore& s : held.scores) states.push_back(s.state);
    held.horizon = compiled.discrete() ? 10 * test.dt : characteristic_period(test, states);
    held.near = score(model, test, held.horizon);
  } catch (const Error& e) {
    held.reason = e.what();
  }
  return held;
}

namespace {

/// Records with the angle that the fit found. What is held out is predicted along it: it has the few coefficients of a
/// polynomial, but the part held out had its say in them.
void take_angle(const OutputErrorFit& fit, const IdentifyOptions& o, std::vector<Recording>& records) {
  for (std::size_t r = 0; r < fit.records.size() && r < records.size(); ++r) {
    std::erase_if(records[r].channels, [&](const Channel& c) { return c.name == o.rotor.record.angle; });
    const Eigen::VectorXd& beta = fit.records[r].angle.beta;
    records[r].add(o.rotor.record.angle, Quantity::angle,
                   beta(Eigen::seqN(Eigen::Index{0}, records[r].size(), Eigen::Index{2})));
  }
}

/// Fit, part held out and verdict of records as they are.
Identification identify_once(const std::vector<Recording>& as_read, const IdentifyOptions& o) {
  Summary read;
  std::vector<Recording> records = bridged(as_read, o, read);
  IdentifyOptions evidence_options = o;
  const auto progress = [&](double share) {
    if (o.progress) o.progress("identify", share);
  };
  progress(0);
  Identification id;
  std::optional<IdentifiedModel> rest;
  std::optional<RotorIdentification> rotor;
  if (o.method == Method::weak) {
    RotorIdentification& found = rotor.emplace(detail::rotor_or_tilt(records, o.rotor));
    if (o.rotor.angle_source == AngleSource::vibration) {
      take_angle(found.fit, o, records);
      evidence_options.rotor.angle_source = AngleSource::measured;
    }
    id.model = found.model;
    id.evidence.assumptions = found.assumptions;
    if (id.model.quantity != Quantity::displacement) {  // radii are those of the free runs
      id.evidence.range = DataRange{0};
      for (const OutputErrorRecord& r : found.fit.records)
        id.evidence.range->amplitude = std::max(id.evidence.range->amplitude, r.main.cwiseAbs().maxCoeff());
    }
  } else {
    id.model = fit(o, records, &id.evidence);
    const bool bounded = o.bounds.any();
    if (o.method == Method::sindy && !bounded) detail::judge_parts(records, o.sindy, id.model);
  }
  progress(0.6);
  if (id.model.summary.status != Status::unusable && o.method != Method::drive) {
    if (!has_tilt(id.model))
      id.evidence.collinear =
          collinear_groups(id.model, with_derivatives(detail::longest_whole_stretch(records.front()), id.model.inputs));
    if (o.holdout != 0) id.evidence.held_out = hold_out(evidence_options, records, id.model, rotor, rest);
  }
  progress(1);
  if (o.method == Method::weak && o.holdout != 0 && id.model.summary.status != Status::unusable)
    id.evidence.not_shown = not_shown(evidence_options, records, id.model, id.evidence.held_out.what);
  if (!id.evidence.not_shown.empty()) {
    id.evidence.held_out.scores.clear();
    id.evidence.held_out.reason = text(id.evidence.not_shown.front());
    rest.reset();
  }
  if (rest && o.method == Method::weak) detail::compare_with_rest(*rest, id.model);
  for (const std::string& w : read.warnings) id.model.summary.warn(w);
  detail::judge_evidence(id);
  return id;
}

/// Whether the model leaves more than twice the noise, or is none.
bool explains(const Identification& id) { return id.usable() && !(id.summary.chi_square > rules::kNoTrust); }

/// A general system whose equations do not explain the records: the records may be to blame. The fit is made again of
/// the records without what is found; it is kept where it explains them. Records that are explained are not looked at:
/// what looks like damage may be the motion.
Identification without_damage(Identification id, const std::vector<Recording>& records, const IdentifyOptions& o) {
  if (o.method != Method::sindy || o.sindy.discrete || explains(id)) return id;
  std::vector<std::string> channels = o.sindy.states;
  channels.insert(channels.end(), o.sindy.inputs.begin(), o.sindy.inputs.end());
  const detail::DamagedRecords damage = detail::look_for_damage(records, channels);
  if (damage.findings.empty()) return id;
  bool cured = false;
  if (damage.cleaned) {
    try {
      Identification again = identify_once(damage.records, o);
      cured = explains(again);
      if (cured) id = std::move(again);
    } catch (const Error&) {  // too little is left
    }
  }
  const std::vector<std::string> said = std::move(id.model.summary.warnings);
  id.model.summary.warnings.clear();
  for (const std::string& finding : damage.findings)
    id.model.summary.warn(cured ? finding : "this may be the cause: " + finding);
  for (const std::string& warning : said) id.model.summary.warnings.push_back(warning);
  id.summary = id.model.summary;
  return id;
}

double term_count(const IdentifiedModel& model) {
  std::size_t terms = 0;
  for (const Equation& e : model.equations) terms += e.terms.size();
  return static_cast<double>(terms);
}

/// A general system some of whose channels may be read later than others: the fit is made again with them brought to
/// common instants, and kept where a simpler model then explains the records as well, or the same one better.
Identification at_their_instants(Identification id, const std::vector<Recording>& records, const IdentifyOptions& o) {
  const bool sought = o.method == Method::sindy && o.sindy.refine && o.sindy.hidden == 0 && !o.library &&
                      o.sindy.equations.denominators.empty() && !o.sindy.discrete &&
                      std::isfinite(id.summary.chi_square);
  if (!sought) return id;
  const std::vector<LateChannel> late = late_channels(records, o.sindy);
  if (late.empty()) return id;
  std::vector<Recording> moved = records;
  for (Recording& r : moved) {
    for (const LateChannel& l : late) r = at_common_instants(std::move(r), l);
  }
  double rows = 0;
  for (const Recording& r : records) rows += static_cast<double>(r.size()) * static_cast<double>(o.sindy.states.size());
  Identification again;
  try {
    again = identify_once(moved, o);
  } catch (const Error&) {
    return id;  // the records as they are could be fitted
  }
  // Two log likelihoods, and the price of a term.
  const double gain =
      rows * std::log(id.summary.chi_square / again.summary.chi_square) +
      (term_count(id.model) - term_count(again.model) - static_cast<double>(late.size())) * std::log(rows);
  if (!again.usable() || !(gain > rules::kOdds20)) return id;
  for (const LateChannel& l : late) {
    again.model.summary.warn(
        fmt::format("channel {0} is read {1:.3g} s ({2:.2f} samples) {3} the others and was brought to their instants; "
                    "records to validate on need --late {0}={4:.4g}",
                    l.channel, std::abs(l.seconds), std::abs(l.seconds) / records.front().dt,
                    l.seconds > 0 ? "after" : "before", l.seconds));
  }
  again.summary = again.model.summary;
  return again;
}

}  // namespace

Identification identify(const std::vector<Recording>& records, const IdentifyOptions& options) {
  if (records.empty()) throw Error("records: at least one is needed");
  const IdentifyOptions o = completed(options, records.front());
  if (o.holdout != 0) require_range("holdout", o.holdout, 0.05, 0.8);
  detail::check_bounds(o);
  Identification found = at_their_instants(without_damage(identify_once(records, o), records, o), records, o);
  if (rotor(o.method) && std::all_of(records.begin(), records.end(), both_probes)) {
    const double simulated = found.evidence.range ? found.evidence.range->amplitude : 0;
    found.evidence.range = data_range(records);
    if (simulated > 0) found.evidence.range->amplitude = simulated;
  } else {
    found.evidence.range.reset();
  }
  detail::keep_magnitudes(found.model);
  return found;
}

MethodComparison compare_methods(const std::vector<Recording>& as_read, const IdentifyOptions& options) {
  if (as_read.empty()) throw Error("records: at least one is needed");
  const IdentifyOptions o = completed(options, as_read.front());
  MethodComparison comparison;
  const std::vector<Recording> records = bridged(as_read, o, comparison.summary);
  const bool is_rotor = rotor(o.method);
  if (o.method == Method::second_order || o.method == Method::drive)
    throw Error("--compare is for rotors and for --method sindy");
  if (is_rotor && records.size() != 1) throw Error("--compare takes one rotor record");
  const HoldoutSplit split = split_of(o, records);
  std::vector<ComparedFit> fits;
  const auto whole = [&](const char* name, Method method) {
    IdentifyOptions one = o;
    one.method = method;
    fits.push_back(detail::timed_fit(name, [&] { return fit(one, split.train); }));
    fits.back().model.summary.residual = NAN;  // of the free run here: not comparable
  };
  if (is_rotor) {
    fits = compare_regressors(rotor_record(split.train.front()), o.paper);
    whole("consistent (tied)", Method::consistent);
    whole("weak (default)", Method::weak);
  } else {
    fits = o.library ? compare_regressors(split.train, *o.library, o.sindy) : compare_regressors(split.train, o.sindy);
    whole("sindy (default)", Method::sindy);
  }
  comparison.what = split.what;
  bool any = false;
  for (std::size_t i = 0; i < fits.size(); ++i) {
    if (o.progress) o.progress("compare", static_cast<double>(i) / static_cast<double>(fits.size()));
    HeldOut held;
    held.what = split.what;
    if (!fits[i].model.equations.empty()) held = predict_held_out(fits[i].model, split.test, split.what, is_rotor);
    any = any || (!held.scores.empty() && worst_nrmse(held.scores) < 1);
    comparison.rows.push_back({std::move(fits[i]), std::move(held)});
  }
  if (o.progress) o.progress("compare", 1);
  if (!any) comparison.summary.fail("no method predicts the part held out better than its mean does");
  return comparison;
}

}  // namespace whirl::identification
