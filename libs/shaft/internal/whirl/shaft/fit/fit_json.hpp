#pragma once
#include "whirl/io/json.hpp"
#include "whirl/shaft/fit/fit.hpp"

namespace whirl::shaft {

/// An unknown as it is printed: a complex one as its amplitude and angle.
struct FitRow {
  std::string name;
  UnknownKind kind = UnknownKind::stiffness;
  std::string unit;  ///< SI
  Estimate value;
  bool complex = false;
  double angle = 0, angle_half = 0;  ///< rad, half width of the 95 % interval; of a complex one
  double relative_half_width = 0;
  bool identifiable = true;
};
std::vector<FitRow> fit_rows(const RotorFit& fit);
std::string_view to_string(UnknownKind kind);

/// Document of docs/formats.md.
io::Json fit_json(const RotorFit& fit, const std::vector<VirtualProbe>& motions,
                  const std::vector<VirtualForce>& forces);

}  // namespace whirl::shaft
