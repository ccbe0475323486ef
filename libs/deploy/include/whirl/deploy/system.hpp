#pragma once
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::deploy {

/// A quantity of a system with its SI unit.
struct SystemVariable {
  std::string name, unit, meaning;
  double nominal = 0;  ///< usual size in its unit, for tolerances; 0: not known
};

/// The right-hand side of a model with its coefficients as named parameters, the common source of every exported form:
/// x' = f(t, x, u, p), y = g(t, x, u, p), or x[k+1] = f for a map. Names are C identifiers; `t` is time.
struct ModelSystem {
  std::string title;
  std::vector<CodeParameter> parameters;
  std::vector<SystemVariable> states, inputs, outputs;
  std::vector<expr::Expr> rates;         ///< one per state: derivative, or next value of a map
  std::vector<expr::Expr> output_terms;  ///< one per output
  std::vector<expr::Expr> events;        ///< arguments of sgn(): the rates jump where one crosses zero
  bool discrete = false;
  double sample_time = 0;  ///< of the training record; the period of a map, s
};

/// A model with `rotor` becomes the rotor with the physical parameters k1, k2, c, eps, gain, ..., with inputs beta,
/// omega, alpha (rad, rad/s, rad/s^2), ux, uy (N) and the displacement the sensors see as outputs. Every other model
/// becomes its equations with one parameter xi_i_j for coefficient j of equation i (paper eq. 18); its states are its
/// outputs. Throws Error when an equation cannot be read.
ModelSystem model_system(const IdentifiedModel& model);

/// `e` with every sgn(events[i]) replaced by the symbol sign_i (from 1): smooth between the events.
expr::Expr with_frozen_signs(const expr::Expr& e, const std::vector<expr::Expr>& events);

/// Right-hand side as C99, like controller_code: PREFIX_rates, PREFIX_outputs, PREFIX_step (Runge-Kutta of order 4; the
/// angle inputs go on with the speed within the step, the others are held; one application of the map for a map).
struct ModelCode {
  SourceFile header, source;
};
ModelCode model_code(const ModelSystem& system, const CodeOptions& options);
/// model_code with a self-test on golden vectors, CMakeLists.txt and Makefile.
std::vector<SourceFile> export_c99(const IdentifiedModel& model, const CodeOptions& options);

}  // namespace whirl::deploy
