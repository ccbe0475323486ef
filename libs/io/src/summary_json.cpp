#include <fmt/format.h>

#include <initializer_list>
#include <string_view>

#include "whirl/core/names.hpp"
#include "whirl/io/json.hpp"

namespace whirl::io {
namespace {

template <class Code>
Code read_code(const JsonReader& in, std::initializer_list<Code> known, std::string_view what) {
  for (const Code code : known)
    if (in.text() == to_string(code)) return code;
  throw in.error(fmt::format("'{}' is no {} of this version", in.text(), what));
}

Finding read_finding(const JsonReader& in) {
  using enum FindingCode;
  Finding f;
  f.code = read_code(
      in.at("code"),
      {motion_unexplained,  model_error,       held_out_not_predicted, held_out_diverges,     held_out_missed,
       held_out_not_tried,  parameter_differs, parts_differ,           term_too_large,        inertia_impossible,
       model_not_trusted,   part_left_out,     readings_differ,        held_out_cannot_check, work_limit,
       freedom_spent,       option_not_taken,  not_repeatable,         run_contradicted,      runs_undecided,
       angles_reversed,     scatter_unknown,   sense_not_stated,       answer_ambiguous,      requirement_missed,
       sliding_bound_missed},
      "finding");
  f.consequence =
      read_code(in.at("consequence"),
                {Consequence::note, Consequence::warning, Consequence::no_trust, Consequence::unusable}, "consequence");
  f.where = one_line(in.at("where").text());
  for (const JsonReader& a : in.at("amounts").items())
    f.amounts.push_back({a.at("name").text(), a.at("value").number_or_nan(), a.at("unit").text()});
  return f;
}

}  // namespace

Json to_json(const Summary& s) {
  Json out;
  out.set("status", to_string(s.status)).set("residual", s.residual).set("condition_number", s.condition_number);
  Json findings = Json::array();
  for (const Finding& f : s.findings) {
    Json amounts = Json::array();
    for (const Amount& a : f.amounts)
      amounts.push(Json::object().set("name", a.name).set("value", a.value).set("unit", a.unit));
    findings.push(Json::object()
                      .set("code", to_string(f.code))
                      .set("consequence", to_string(f.consequence))
                      .set("where", f.where)
                      .set("amounts", std::move(amounts)));
  }
  out.set("chi_square", s.chi_square).set("trust", s.trust).set("warnings", s.warnings);
  if (!s.reason.empty()) out.set("reason", s.reason);
  if (!s.notes.empty()) out.set("notes", s.notes);
  return std::move(out.set("findings", std::move(findings)));
}

Summary read_summary(const JsonReader& in) {
  Summary s;
  const JsonReader status = in.at("status");
  bool known = false;
  for (const Status candidate : {Status::ok, Status::warning, Status::unusable}) {
    if (status.text() == to_string(candidate)) {
      s.status = candidate;
      known = true;
    }
  }
  if (!known) throw status.error(fmt::format("'{}' must be ok, warning or unusable", status.text()));
  s.residual = in.at("residual").number_or_nan();
  s.condition_number = in.at("condition_number").number_or_nan();
  s.chi_square = in.at("chi_square").number_or_nan();
  s.trust = one_line(in.at("trust").text());
  for (const JsonReader& w : in.at("warnings").items()) s.warnings.push_back(one_line(w.text()));
  if (in.has("reason"))
    s.reason = one_line(in.at("reason").text());
  else if (s.status == Status::unusable &&
           !s.warnings.empty())  // files of earlier versions: the last one is the reason
    s.reason = s.warnings.back();
  if (in.has("notes"))
    for (const JsonReader& n : in.at("notes").items()) s.notes.push_back(one_line(n.text()));
  if (in.has("findings"))  // files of earlier versions have none
    for (const JsonReader& f : in.at("findings").items()) s.findings.push_back(read_finding(f));
  return s;
}

}  // namespace whirl::io
