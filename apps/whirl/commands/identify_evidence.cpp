#include "identify_evidence.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/identify/sindy_library.hpp"
#include "whirl/identify/validate_model.hpp"

namespace whirl::app {
namespace {

identification::HeldOut hold_out(const identification::HoldoutSplit& split, bool rotor,
                                 const identification::ValidateOptions& options, const Identify& identify) {
  identification::HeldOut held;
  held.what = split.what;
  try {
    const IdentifiedModel model = identify(split.train);
    if (model.summary.status == Status::unusable) {
      held.reason = "the rest alone gives no model: " + model.summary.warnings.back();
      return held;
    }
    return predict_held_out(model, split.test, split.what, rotor, options);
  } catch (const Error& e) {
    held.reason = e.what();
    return held;
  }
}

std::string show(const std::vector<identification::StateScore>& scores) {
  std::vector<std::string> parts;
  for (const identification::StateScore& s : scores) {
    parts.push_back(std::isfinite(s.rmse)
                        ? fmt::format("{} {:.3g} ({:.2g} %, noise {:.3g})", s.state, s.rmse, 100 * s.nrmse, s.noise)
                        : fmt::format("{} diverges", s.state));
  }
  return fmt::format("{}", fmt::join(parts, ", "));
}

io::Json scores_json(const std::vector<identification::StateScore>& scores) {
  io::Json list = io::Json::array();
  for (const identification::StateScore& s : scores) {
    io::Json entry = io::Json::object();
    entry.set("state", s.state).set("rmse", s.rmse).set("nrmse", s.nrmse).set("noise", s.noise);
    list.push(std::move(entry));
  }
  return list;
}

}  // namespace

std::string show_error(double value) { return std::isfinite(value) ? fmt::format("{:.4g}", value) : "diverges"; }

identification::HeldOut predict_held_out(const IdentifiedModel& model, const Recording& record, std::string what,
                                         bool rotor, const identification::ValidateOptions& options) {
  identification::HeldOut held;
  held.what = std::move(what);
  try {
    const Recording test = rotor ? record : identification::with_derivatives(record, model.inputs);
    if (rotor) {
      const identification::Validation v = identification::validate_model(model, test, options);
      if (v.summary.status == Status::unusable && std::isfinite(v.rmse_x)) {
        held.reason = v.summary.warnings.back();
        return held;
      }
      const Eigen::VectorXd &x = test["x"], &y = test["y"];
      const auto spread = [](const Eigen::VectorXd& a) { return std::sqrt((a.array() - a.mean()).square().mean()); };
      held.scores = {{"x", v.rmse_x, v.rmse_x / spread(x), v.noise_x},
                     {"y", v.rmse_y, v.rmse_y / spread(y), v.noise_y}};
      return held;
    }
    held.scores = identification::score(model, test);
    const identification::CompiledModel compiled(model);
    std::vector<std::string> states;
    for (const identification::StateScore& s : held.scores) states.push_back(s.state);
    held.horizon = compiled.discrete() ? 10 * test.dt : identification::characteristic_period(test, states);
    held.near = identification::score(model, test, held.horizon);
  } catch (const Error& e) {
    held.reason = e.what();
  }
  return held;
}

identification::HeldOut hold_out_rotor(const std::vector<Recording>& records, double share, const Identify& identify) {
  identification::ValidateOptions options;
  if (records.size() > 1) options.unbalance = identification::UnbalanceSource::refitted;
  return hold_out(identification::split_holdout(records, share, {"x", "y"}), true, options, identify);
}

identification::HeldOut hold_out_general(const std::vector<Recording>& records, double share,
                                         const Identify& identify) {
  return hold_out(identification::split_holdout(records, share), false, {}, identify);
}

std::string describe(const Evidence& evidence, const Summary& summary) {
  std::string text;
  text += std::isfinite(summary.chi_square)
              ? fmt::format("chi^2             {:.3g} (1: the model explains the records down to their noise)\n",
                            summary.chi_square)
              : std::string(
                    "chi^2             not known (noise cannot be told from this record, or no free run was fitted)\n");
  if (std::isfinite(summary.condition_number))
    text += fmt::format("condition number  {:.3g}\n", summary.condition_number);
  for (const identification::BoundOutcome& b : evidence.bounds) {
    text += fmt::format(
        "sign bound        {}: {} {} 0 {}\n", b.equation, b.function, b.sign > 0 ? ">=" : "<=",
        b.active ? fmt::format("is active: held at 0, no interval; without the bound about {:.3g} (t {:.3g})",
                               b.unbounded, b.t)
        : b.kept ? "is not active: the term is in the model"
                 : "is not active: the term is not needed");
  }
  if (evidence.collinear.empty()) {
    text += "collinear         no group of terms (all condition indices below 30)\n";
  }
  for (const identification::CollinearGroup& g : evidence.collinear) {
    text += fmt::format("collinear         {}{}: hard to tell apart on these records (condition index {:.3g})\n",
                        g.equation.empty() ? "" : g.equation + ": ", fmt::join(g.terms, ", "), g.condition_index);
  }
  const identification::HeldOut& h = evidence.held_out;
  if (!h.reason.empty()) {
    text += fmt::format("held out          {}: no prediction, {}\n", h.what, h.reason);
  } else if (!h.scores.empty()) {
    text += fmt::format("held out          {}, predicted by a model of the rest; free-run error, rms:\n", h.what);
    if (h.horizon > 0) text += fmt::format("  restarted every {:.3g} s: {}\n", h.horizon, show(h.near));
    text += fmt::format("  one free run: {}\n", show(h.scores));
  }
  return text;
}

io::Json to_json(const Evidence& evidence) {
  io::Json groups = io::Json::array();
  for (const identification::CollinearGroup& g : evidence.collinear) {
    io::Json entry = io::Json::object();
    entry.set("equation", g.equation).set("terms", g.terms).set("condition_index", g.condition_index);
    groups.push(std::move(entry));
  }
  const identification::HeldOut& h = evidence.held_out;
  io::Json held = io::Json::object();
  held.set("what", h.what).set("free_run", scores_json(h.scores)).set("horizon_s", h.horizon);
  held.set("free_run_horizon", scores_json(h.near)).set("reason", h.reason);
  io::Json bounds = io::Json::array();
  for (const identification::BoundOutcome& b : evidence.bounds) {
    io::Json entry = io::Json::object();
    entry.set("equation", b.equation).set("function", b.function).set("sign", b.sign > 0 ? "+" : "-");
    entry.set("active", b.active).set("kept", b.kept).set("unbounded", b.unbounded).set("t", b.t);
    bounds.push(std::move(entry));
  }
  io::Json out = io::Json::object();
  out.set("held_out", std::move(held)).set("collinear", std::move(groups)).set("bounds", std::move(bounds));
  return out;
}

}  // namespace whirl::app
