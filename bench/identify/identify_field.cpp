// Rotors as they stand in plants (testing/systems/field_rotors.hpp): what identify claims of them. Confidently wrong:
// status ok, and a parameter more than 3 stated standard deviations and 1 % from the truth, or another run of the
// machine farther from its prediction than the band that validate prints. Named: the cause is among the terms taken up
// or the alternatives stated.
// Usage: bench_identify_field [seeds = 8] [first seed = 1] [SNR dB = 40] [kind] [v: each result]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <string_view>
#include <tuple>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/rotor_terms.hpp"
#include "whirl/testing/systems/field_rotors.hpp"

using namespace whirl;

namespace {

std::vector<std::string_view> parts_of(std::string_view text, char by) {
  std::vector<std::string_view> out;
  for (std::size_t at = text.find(by); at != std::string_view::npos; at = text.find(by)) {
    out.push_back(text.substr(0, at));
    text.remove_prefix(at + 1);
  }
  out.push_back(text);
  return out;
}

/// Labels of the model, and those of the alternatives stated.
std::string said_of(const IdentifiedModel& model) {
  std::string said;
  for (const identification::TermEntry* entry : identification::term_catalogue()) {
    for (const identification::TermParameter& q : entry->parameters)
      if (model.parameter(std::string(q.name)) != nullptr) said += fmt::format("[{}] ", entry->label);
  }
  if (model.parameter("runout1+_re") != nullptr) said += "[runout] ";
  if (model.parameter("k1_conj_re") != nullptr) said += "[anisotropic stiffness] ";
  for (const Ambiguity& a : model.ambiguities) said += fmt::format("({}) ", a.readings);
  return said;
}

bool named(const testing::FieldName& kind, const std::string& said) {
  return std::ranges::any_of(kind.causes, [&](std::string_view cause) {
    return std::ranges::all_of(parts_of(cause, '+'), [&](std::string_view needed) {
      return std::ranges::any_of(parts_of(needed, '|'),
                                 [&](std::string_view label) { return said.find(label) != std::string::npos; });
    });
  });
}

struct Row {
  int named = 0, ok = 0, warning = 0, unusable = 0, wrong = 0, covered = 0, intervals = 0;
  double slowest = 0;
  std::string how;
};

/// What is wrong although it is stated without a warning; empty: nothing. Counts the intervals.
std::string wrong_parts(const testing::FieldRecord& truth, const IdentifiedModel& model, Row& row,
                        std::string& errors) {
  std::string how;
  for (const auto& [name, value, last] : {std::tuple("k1", truth.k1, truth.k1_last),
                                          {"k2", truth.k2, truth.k2},
                                          {"c", truth.c, truth.c_last},
                                          {"e", truth.e, truth.e}}) {
    const Estimate* p = model.parameter(name);
    if (p == nullptr || !std::isfinite(value)) continue;
    // What changes over the record is right anywhere between its first and its last value.
    const double error = p->value - std::clamp(p->value, std::min(value, last), std::max(value, last)),
                 share = std::abs(error / value), sds = std::abs(error) / p->sd;
    ++row.intervals;
    row.covered += sds <= 2;
    errors += fmt::format(" {} {:+.3f} % ({:.1f} sd)", name, 100 * error / value, sds);
    if (share > 0.01 && sds > 3) how += fmt::format(" {} {:+.1f} % {:.0f} sd", name, 100 * error / value, sds);
  }
  const identification::Validation v = identification::validate_model(model, truth.other);
  errors += fmt::format(" other {:.3g}, {:.3g} of {:.3g}, {:.3g} um{}", 1e6 * v.rmse_x, 1e6 * v.rmse_y, 1e6 * v.band_x,
                        1e6 * v.band_y, v.fold_sensitive ? " fold" : "");
  if (!v.fold_sensitive && (v.rmse_x > v.band_x || v.rmse_y > v.band_y))
    how += fmt::format(" other run {:.1f} bands off", std::max(v.rmse_x / v.band_x, v.rmse_y / v.band_y));
  return how;
}

void count(const testing::FieldName& kind, double snr, unsigned long long seed, bool each, Row& row) {
  const testing::FieldRecord truth = testing::field_record(kind.kind, snr, seed);
  identification::IdentifyOptions options;
  options.method = identification::Method::weak;
  const std::clock_t begin = std::clock();
  const identification::Identification found = identification::identify({truth.record}, options);
  const double seconds = static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  row.slowest = std::max(row.slowest, seconds);
  const Status status = found.summary.status;
  ++(status == Status::ok ? row.ok : status == Status::warning ? row.warning : row.unusable);
  const std::string said = said_of(found.model);
  row.named += named(kind, said);
  std::string errors;
  if (status != Status::unusable) {
    const std::string how = wrong_parts(truth, found.model, row, errors);
    if (!how.empty() && status == Status::ok) ++row.wrong, row.how += fmt::format(" {}:{}", seed, how);
  }
  if (!each) return;
  fmt::print("{} chi2 {:.3f} {:.1f} s {}{}: {}", seed, found.summary.chi_square, seconds, to_string(status), errors,
             said);
  for (const std::string& w : found.summary.warnings) fmt::print("\n    {}", w);
  fmt::print("\n");
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 8;
  const int first = argc > 2 ? std::atoi(argv[2]) : 1;
  const double snr = argc > 3 ? std::atof(argv[3]) : 40;
  const std::string only = argc > 4 ? argv[4] : "all";
  const bool each = argc > 5;
  for (const testing::FieldName& kind : testing::field_kinds()) {
    if (only != "all" && only != kind.name) continue;
    Row row;
    for (int seed = first; seed < first + seeds; ++seed)
      count(kind, snr, static_cast<unsigned long long>(seed), each, row);
    fmt::print("| {}, {:g} dB | {} | {} | {} | {} | {} | {} of {} | {:.1f} |{}\n", kind.name, snr,
               kind.causes.empty() ? "-" : std::to_string(row.named), row.ok, row.warning, row.unusable, row.wrong,
               row.covered, row.intervals, row.slowest, row.how);
    std::fflush(stdout);
  }
}
