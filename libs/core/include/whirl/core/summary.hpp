#pragma once
#include <limits>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/finding.hpp"

namespace whirl {

/// Outcome of a numerical step. A poor outcome is data, not an exception.
enum class Status {
  ok,        ///< the numbers may be used
  warning,   ///< usable with the stated warnings
  unusable,  ///< do not use the numbers; the program exits with code 1
};
std::string_view to_string(Status status);

/// What every result carries beside its numbers.
struct Summary {
  Status status = Status::ok;
  double residual = std::numeric_limits<double>::quiet_NaN();          ///< meaning and unit set by the method
  double condition_number = std::numeric_limits<double>::quiet_NaN();  ///< of the scaled regression matrix
  double chi_square = std::numeric_limits<double>::quiet_NaN();  ///< whitened residual variance, 1 when the model fits
  std::string trust;                                             ///< one sentence: what the result may be trusted for
  std::vector<std::string> warnings;
  std::string reason;              ///< why the numbers must not be used, one of `warnings`; empty unless unusable
  std::vector<std::string> notes;  ///< said beside the result, which holds as it is
  /// What later steps decide on; each stands in `warnings` or, a note, in `notes` in words too.
  std::vector<Finding> findings;

  /// Adds a finding, its words (`because`, if any, after them) and its consequence for the status and the trust.
  void add(Finding finding, std::string_view because = "");
  /// First finding of a code; nullptr when there is none.
  const Finding* find(FindingCode code) const;
  /// First finding that takes the trust; nullptr when the result may be relied on beyond its records.
  const Finding* distrust() const;

  void warn(std::string message) {
    warnings.push_back(std::move(message));
    if (status == Status::ok) status = Status::warning;
  }
  void fail(std::string message) {
    reason = message;
    warnings.push_back(std::move(message));
    status = Status::unusable;
  }
  /// The warnings of a part, and its failure, are those of the whole.
  void take(const Summary& part) {
    for (const std::string& w : part.warnings) warn(w);
    if (part.status != Status::unusable) return;
    status = Status::unusable;
    reason = part.reason;
  }
};

/// Where a result comes from: enough to make it again.
struct Provenance {
  std::string version;              ///< whirl version
  std::vector<std::string> inputs;  ///< "name sha256:..." of every input file
  std::string options;              ///< the options used, as one line of text
  unsigned long long seed = 0;
};
/// Version of this library, e.g. "0.1.0".
std::string_view version();

}  // namespace whirl
