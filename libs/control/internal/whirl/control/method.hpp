#pragma once
#include <functional>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/estimators.hpp"
#include "whirl/control/laws.hpp"

namespace whirl::control {

using Parameters = std::map<std::string, double>;  ///< resolved: every parameter of a design, SI

/// What turns a method into C99: the fragment `file` (NAME of src/laws/c/NAME.c.in or src/estimators/c/NAME.c.in), the
/// HAS_ switches and the slots it asks for. CONTRIBUTING.md shows the sections of a fragment.
struct CodeFragment {
  std::string file;
  std::set<std::string, std::less<>> features = {};
  std::map<std::string, std::string, std::less<>> slots = {};
  std::string memory = {};              ///< laws: what the one value kept per axis is; empty: none is kept
  std::string memory_start = "R(0.0)";  ///< its value after a reset, as C
};

/// A condition between parameters, in the library and in the exported C.
struct Condition {
  std::string parameter;  ///< the one that is refused
  bool (*holds)(const Parameters&);
  std::string allowed;  ///< for the message
  std::string c;        ///< the same as C on `p->`
};

/// Everything whirl knows about one control law: a file of src/laws.
struct LawEntry {
  MethodInfo info;
  std::string equation;  ///< for one axis x' = v, v' = f + a + D: lines of a comment
  std::string latex;     ///< the same for a document
  AnyLaw (*make)(const ControllerDesign&, const Parameters&) = nullptr;
  CodeFragment (*code)(const Parameters&) = nullptr;
  bool model_free = false;           ///< f is the disturbance alone: nothing of the stiffness is cancelled
  bool cancels_synchronous = false;  ///< finds the synchronous force itself
  bool continuous_angle = false;     ///< counts whole turns
  Parameters design_values = {};     ///< what `design` takes instead of the defaults
  std::vector<Condition> conditions = {};
  std::vector<std::string> weights = {};  ///< found by trial on random machines (`design`), not by the search
  /// Parameters of the exported C where they are not those of the law.
  std::vector<std::pair<ParameterInfo, double>> (*code_parameters)(const ControllerDesign&,
                                                                   const Parameters&) = nullptr;
  /// Parameters whose number the design itself states, from those that are given.
  std::vector<ParameterInfo> (*entries)(const Parameters& given) = nullptr;
  std::vector<std::string> (*remarks)(const Parameters&) = nullptr;  ///< advice that is no error
  /// Numbers of the machine by which the law measures, for `design`: from its model and the top speed, rad/s.
  Parameters (*measures)(const ControllerDesign&, double top_speed) = nullptr;
  bool own = false;  ///< a law that the user wrote: nothing of it is tuned or compared
};

/// Everything whirl knows about one estimator: a file of src/estimators.
struct EstimatorEntry {
  MethodInfo info;
  AnyEstimator (*make)(const ControllerDesign&, const Parameters&) = nullptr;
  CodeFragment (*code)(const Parameters&) = nullptr;
  bool model_based = false;        ///< predicts with the model: `design` then predicts over the loop delay
  bool finds_disturbance = false;  ///< estimates the unbalance itself: the feedforward is not from a fixed one
  bool knows_noise = false;        ///< has `measurement_noise`, which `design` takes from the data sheet
};

/// Throw Error listing the known names when there is none such.
const LawEntry& law_entry(std::string_view name);
const EstimatorEntry& estimator_entry(std::string_view name);

}  // namespace whirl::control
