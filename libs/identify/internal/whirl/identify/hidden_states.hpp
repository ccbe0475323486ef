#pragma once
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/core/recording.hpp"
#include "whirl/identify/sindy.hpp"

namespace whirl::identification {

/// A kind of unmeasured state that was tried.
struct HiddenTrial {
  std::string kind;  ///< "none", "lag of u", "store of u, square root", "hysteresis of x", "memory in v'", ...
  double error = 0;  ///< free-run error of the part held out, share of the motion; infinite when it diverges
  bool chosen = false;
};

/// fit_sindy with up to `options.hidden` states that no channel shows, as few as needed, named h1, h2:
///
/// - lag of an input (actuator): h' = a (u - h), the equations get h for u;
/// - store of an input (a tank upstream): h' = a (u - sqrt(h)), they get its outflow sqrt(max(h, 0)) for u;
/// - hysteresis of Bouc and Wen (order 2, or x' = v known): v' = ... - h, h' = A v - B |v| h - C v |h|;
/// - memory of a state (relaxation, warming): s' = ... + h, h' = -a h + b s + d u.
///
/// Each kind is started from several values and from the equations found without it, or their linear part. All
/// coefficients are fitted on free runs, from some periods to the whole record, with starts of their own (multiple
/// shooting); then candidate terms in the hidden states too are added by the score test and kept when the free run over
/// the last 30 % of the record, which no fit has seen, improves; terms that it does not miss go. A kind is taken when
/// that error falls by a tenth. Source: Bouc 1967, Wen 1976; Ljung, System Identification, 1999, 10.2.
///
/// `trials`: what was tried. The summary says which kind was taken and the errors with and without.
IdentifiedModel fit_hidden(const std::vector<Recording>& records, const SindyOptions& options,
                           std::vector<HiddenTrial>* trials = nullptr);

}  // namespace whirl::identification
