#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/lagrange/derive.hpp"

namespace whirl::lagrange {

/// What a fit says about the unknowns of a library, in the order of its groups.
struct UnknownEstimates {
  Eigen::VectorXd value;
  Eigen::MatrixXd covariance;  ///< NaN on the diagonal where an unknown has no interval
  std::vector<std::string> notes;
};

/// The unknowns of the library as an identified model has them: its parameters of the same name, else its equations,
/// whose terms are multiplied out and compared with the library's. Covariances from `parameter_covariance` (parameters
/// named after groups, or after terms as fit_sindy does), or for the groups of tied_rotor_library from
/// `rotor_covariance`; otherwise unknowns count as independent. Throws Error when the model has no equation of a
/// left-hand side of the library, or its coefficients do not fit the ties within four standard deviations.
UnknownEstimates unknown_estimates(const IdentifiedModel& model, const expr::CandidateLibrary& library);

/// A quantity with its estimate: a parameter, or a combination such as "K1/m".
struct PhysicalQuantity {
  std::string name;
  std::string unit;
  Estimate value;
};

struct PhysicalParameters {
  std::vector<PhysicalQuantity> parameters;    ///< determined by the fit, in the order declared
  std::vector<PhysicalQuantity> combinations;  ///< of the others: what the fit determines, e.g. "K1/m"
  std::vector<std::string> undetermined;       ///< parameters that need another measurement
  std::vector<PhysicalQuantity> reported;      ///< the terms asked for, where determined
  Eigen::MatrixXd covariance;                  ///< of `parameters`
  int excess = 0;                              ///< relations and given values beyond the parameters determined
  /// residual: chi^2 of the excess relations (sum, not per degree); warnings: what is not determined and why.
  Summary summary;
};

/// Physical parameters from the unknowns of a derived library.
///
/// Solves coefficient_g(parameters) = unknown_g for all groups by least squares, weighted with the covariance
/// (Levenberg and Marquardt; started from the linear system of the logarithms). Parameters with a value and an sd are
/// measurements beside the fit. Intervals by linear propagation, cov = (J^T S^-1 J)^+. The null space of J, in
/// logarithms, shows what the fit cannot tell: a parameter is determined when it has no share in it, and products of
/// powers orthogonal to it are listed as combinations, each other parameter being taken per power of the first that
/// lacks (K1/m, C/m when m does). Angles (unit rad) are between -pi and pi. `report`: further terms in the parameters,
/// e.g. "m*e". The parameters are looked for as positive numbers first. Throws Error when the sizes do not fit or a
/// text cannot be read; status unusable when no solution is found.
PhysicalParameters physical_parameters(const expr::CandidateLibrary& library, const UnknownEstimates& fit,
                                       const std::vector<PhysicalParameter>& parameters,
                                       const std::vector<std::string>& report = {});

}  // namespace whirl::lagrange
