#pragma once
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "whirl/identify/identify.hpp"
#include "whirl/testing/systems/driven_oscillators.hpp"

/// What is found of driven oscillators, against the machine's own coefficients.
namespace whirl::testing {

inline identification::Identification identified_oscillator(const std::vector<Recording>& records) {
  identification::IdentifyOptions options;
  options.method = identification::Method::sindy;
  options.sindy.states = {"x", "v"};
  options.sindy.inputs = {"u"};
  options.holdout = 0;
  return identification::identify(records, options);
}

inline bool warns_of(const identification::Identification& id, const std::string& words) {
  return std::any_of(id.summary.warnings.begin(), id.summary.warnings.end(),
                     [&](const std::string& w) { return w.find(words) != std::string::npos; });
}

/// How far the coefficients found are from the machine's own; a term that is missing is outside by 99.
struct Tally {
  int all = 0, inside = 0, far = 0;  ///< inside 95 % intervals; beyond 4 standard deviations
  int extra = 0;                     ///< terms that the machine does not have
  double worst = 0;                  ///< standard deviations
  void add(const identification::Identification& id, const DrivenOscillator& machine) {
    const auto truth = machine.truth();
    for (const auto& [name, value] : truth) {
      const Estimate* e = id.model.parameter(name);
      const double off = e == nullptr ? 99 : std::abs(e->value - value) / e->sd;
      ++all;
      inside += off < 1.96;
      far += off > 4;
      worst = std::max(worst, off);
    }
    for (const auto& [name, value] : id.model.parameters) extra += truth.count(name) == 0;
  }
};

}  // namespace whirl::testing
