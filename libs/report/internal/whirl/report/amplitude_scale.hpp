#pragma once
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "whirl/report/format.hpp"

namespace whirl::report {

/// "peak", "p-p" or "rms".
std::string_view short_name(AmplitudeKind kind);

/// How amplitudes are stated: their kind, and the unit of one quantity where the reader asked for it (mil, g).
struct AmplitudeScale {
  AmplitudeKind kind = AmplitudeKind::peak;
  std::optional<std::pair<Quantity, Unit>> unit{};

  AmplitudeScale(AmplitudeKind stated = AmplitudeKind::peak) : kind(stated) {}
  /// The unit asked for, where it is of this quantity; else the engineering unit that shows `largest`.
  Unit unit_for(Quantity quantity, double largest) const;
  /// "0.492 mm peak": a value that is stated as `kind`, in SI.
  std::string text(double value, Quantity quantity, int digits = 3) const;
};

}  // namespace whirl::report
