#pragma once
#include <Eigen/Core>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "whirl/shaft/fit/fit.hpp"

namespace whirl::shaft {

/// An unknown as the descent moves it: value = exp(t) or offset + scale t.
struct Parameter {
  UnknownKind kind = UnknownKind::stiffness;
  std::size_t index = 0;
  int row = 0, column = 0, part = 0;
  bool logarithmic = false;
  double offset = 0, scale = 1;
  double prior = 0, prior_sd = 0;  ///< of t, Gaussian
  std::string name, unit;

  double value(double t) const { return logarithmic ? std::exp(t) : offset + scale * t; }
  double internal(double v) const { return logarithmic ? std::log(v) : (v - offset) / scale; }
};

/// Freed by a tolerance of the drawing.
inline bool is_tolerance(UnknownKind kind) {
  return kind == UnknownKind::youngs_modulus || kind == UnknownKind::diameter || kind == UnknownKind::disc_position ||
         kind == UnknownKind::disc_mass;
}

/// All unknowns of a fit: structural ones first, then unbalance, bow, gain and runout, each as real and imaginary part.
struct ParameterSet {
  std::vector<Parameter> all;
  Eigen::Index structural = 0;
  Eigen::Index unbalance = 0, bow = 0, gain = 0, runout = 0;  ///< place of the first of each
  Eigen::Index stations = 0, bows = 0, probes = 0;
  OverSpeed stiffness = OverSpeed::constant, damping = OverSpeed::constant;
  bool axes_alike = false;
  double lowest = 0, highest = 0;  ///< speeds of the records, rad/s

  Eigen::Index size() const { return static_cast<Eigen::Index>(all.size()); }
  /// The value of the file.
  Eigen::VectorXd start() const;
  /// The complex unknown whose real part is at `place`.
  std::complex<double> complex_value(const Eigen::VectorXd& t, Eigen::Index place) const;
  /// What a coefficient of a support gains at a speed per unit of its parameter's value.
  double shape(const Parameter& p, const SupportLaw& law, double speed) const;
};

/// Throws Error for a support of an unknown name, or one whose stiffness is zero where it is to be found.
ParameterSet make_parameters(const Rotor& drawn, const FitSetup& setup, double lowest, double highest);

/// The rotor with structural values. A disc that stands elsewhere is `moved`, which keeps the mesh, or, for a `file`,
/// has another position and that of the unbalance at its hub, with the estimates of unbalance and bow too.
Rotor with_values(const Rotor& drawn, const ParameterSet& set, const Eigen::VectorXd& t, bool file = false);

/// The disc whose hub carries the unbalance; nothing when there is none.
std::optional<std::size_t> disc_at_hub(const Rotor& rotor, const Unbalance& unbalance);

}  // namespace whirl::shaft
