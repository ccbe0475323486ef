#pragma once
#include <Eigen/Core>
#include <cmath>
#include <complex>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/rotor/further_forces.hpp"

namespace whirl::identification {

struct TermEntry;
struct SensorAxes;
namespace detail {
struct Growth;
struct ProbePoint;
struct ScoreColumns;
class ScorePoint;
}  // namespace detail

/// A force beyond RotorModel per unit mass, with one real coefficient. An entry with several parameters has as many.
struct RotorTerm {
  const TermEntry* entry = nullptr;
  std::size_t part = 0;  ///< of the parameters of the entry
  double value = 0;
  double reference = 0;  ///< TermEntry::reference_name
  std::string_view parameter() const;
  std::string_view unit() const;
  bool is(const TermEntry& other) const { return entry == &other; }
  bool operator==(const RotorTerm&) const = default;
};

/// State of the rotor: m, m/s, speed rad/s, angle rad, time s, acceleration of the angle rad/s^2.
struct TermPoint {
  double x = 0, y = 0, vx = 0, vy = 0, w = 0, beta = 0, time = 0, alpha = 0;
  const std::complex<double>*turned = nullptr, *turned_twice = nullptr;  ///< e^{i beta}, e^{2 i beta} where worked out

  std::complex<double> turn() const { return turned != nullptr ? *turned : turn_by(beta); }
  std::complex<double> turn_twice() const { return turned_twice != nullptr ? *turned_twice : turn_by(2 * beta); }
  static std::complex<double> turn_by(double angle) { return {std::cos(angle), std::sin(angle)}; }
};

/// Force of a term for coefficient 1, and its derivatives.
struct TermForce {
  double x = 0, y = 0;                            ///< m/s^2 per unit of the coefficient
  double x_x = 0, x_y = 0, y_x = 0, y_y = 0;      ///< by the displacement
  double x_vx = 0, x_vy = 0, y_vx = 0, y_vy = 0;  ///< by the velocity

  void displaced(const TermPoint& p, double g) { x = -g * p.x, y = -g * p.y, x_x = y_y = -g; }   ///< -g z
  void damped(const TermPoint& p, double g) { x = -g * p.vx, y = -g * p.vy, x_vx = y_vy = -g; }  ///< -g z'
};

/// What a term adds to the equation of x'' or y'', as a function of the paper's states; its coefficient enters with
/// `sign`.
struct TermText {
  std::string function;
  double sign;
};
/// The equation that a text is for: its states and the sign of the other axis in i z.
struct TermAxis {
  bool x;
  std::string own, rate, other, other_rate;
  double turn;
};

/// Sizes of a motion that usual coefficients refer to.
struct TermScale {
  double k1 = 0, k2 = 0, c = 0;                 ///< 1/s^2, 1/(m^2 s^2), 1/s (size)
  double peak = 0, top_speed = 0, seconds = 0;  ///< m, rad/s, s
  double w() const { return std::sqrt(k1); }
  double v() const { return w() * peak; }
};

/// What is known of a term before the records.
struct TermPrior {
  double chance = 0.1;    ///< share of rotors that have it
  double positive = 0.5;  ///< share of these where the coefficient is positive
  /// Weight that a model with the term has at least, once the records do not speak against it: below two deviations
  /// the evidence for a common term is none, and it is as likely as not.
  double least = 0;
};

/// The measurement that decides between two terms; of two the first counts.
enum class Decider { dc_coupling, one_clock, probes, second_run, another_rate, free_decay, unbalance, hammer_test };
std::string_view to_string(Decider decider);

struct TermParameter {
  std::string_view name, unit;
};

/// All that the search, the kernel, the verdict and the text know of a term. One file of src/terms holds one entry, and
/// nothing else of the tree knows what it is; a term of three kinds: a force, an error of the probes, or what brings
/// its own `with` and `columns`.
struct TermEntry {
  std::string_view label;                      ///< as an engineer calls it
  std::vector<TermParameter> parameters = {};  ///< as they stand in a model; none: they are the rotor's own

  // A force.
  TermForce (*force)(const TermPoint& point, double reference, std::size_t part) = nullptr;
  /// Derivative of x and y by the reference, where that is estimated too.
  TermForce (*by_reference)(const TermPoint& point, double reference, std::size_t part) = nullptr;
  std::vector<TermText> (*text)(const TermAxis& axis, const RotorTerm& term) = nullptr;
  std::string_view reference_name = {};  ///< the parameter that keeps RotorTerm::reference
  double (*reference)(double peak, double frequency, double start) = nullptr;  ///< m, rad/s, s
  bool external = false;                                                       ///< it acts whatever the motion is
  bool drives_whirl = false;  ///< it can drive a forward whirl by itself
  bool drifts = false;        ///< it changes with time
  bool moves_middle = false;  ///< spring or damping in the middle of a run are not those at its start or at rest
  bool dry = false;           ///< it holds small motion
  bool twice_a_turn = false;  ///< it asks for TermPoint::turn_twice
  std::size_t parts_of_one_axis = 8;  ///< where one axis reads forward and backward alike
  // Its parts as the plants of a design have them; null: they have none. (Doxygen does not read pointers to members.)
  /// @cond
  double rotor::FurtherForces<double>::*plant[4] = {};
  double rotor::FurtherForces<double>::*plant_reference = nullptr;
  /// @endcond

  // An error of the probes.
  double SensorAxes::*sensor = nullptr;
  Eigen::VectorXcd (*reading)(const detail::ProbePoint& at) = nullptr;  ///< derivative of the readings by it
  bool not_negative = false;
  const TermEntry& (*after)() = nullptr;      ///< the one that it needs
  void (*start)(SensorAxes& axes) = nullptr;  ///< beside that one

  // In the search. Null: that of a force or of an error of the probes.
  detail::Growth (*with)(detail::Growth growth, int place, bool poles) = nullptr;
  std::optional<detail::Growth> (*without)(detail::Growth growth, int place) = nullptr;
  std::vector<detail::ScoreColumns> (*columns)(const detail::ScorePoint& at) = nullptr;
  double (*frequency)(const detail::Growth& growth, int place) = nullptr;  ///< for its name, rad/s
  std::vector<int> (*tries)(const detail::Growth& growth) = nullptr;       ///< places tried for one candidate
  bool numbered = false;                                                   ///< its name has the place
  bool one_at_a_time = false;    ///< those next to each other are one candidate
  bool both_axes = false;        ///< seen by two probes only
  bool in_model = true;          ///< a model can hold it
  bool plain_threshold = false;  ///< it needs no more score for the number of terms
  double chances = 1;            ///< tries of which one may look like it by chance, beside the number of terms
  std::string_view charge = {};  ///< of a high-pass: the parameter of what it holds at sample 0, per record
  bool hinted = true;            ///< a weak sign of it is worth a word
  bool rare = false;             ///< sought only where the others leave more than the noise
  bool of_displacement = false;  ///< an error of displacement probes: velocity and acceleration have none

  // Before the records, and what is said of it.
  double (*usual)(const TermScale& scale) = nullptr;  ///< coefficient among rotors that have it; null: none is usual
  double (*plausible)(const TermScale& scale) = nullptr;  ///< coefficient that is none too large, whatever is usual
  TermPrior prior = {};
  Decider decider = Decider::unbalance;
  std::string_view hidden_note = {};  ///< where it may hide beside k1, k2 or c
  std::string_view hidden_decider = "a second run, or less noise";
};

inline std::string_view RotorTerm::parameter() const { return entry->parameters[part].name; }
inline std::string_view RotorTerm::unit() const { return entry->parameters[part].unit; }

/// All entries, in the order of their parameters.
std::span<const TermEntry* const> term_catalogue();
/// The force with that parameter, coefficient 0; throws Error where there is none.
RotorTerm force_term(std::string_view parameter);
/// Whether a model parameter of that name is the coefficient of a force.
bool is_force_parameter(std::string_view name);

/// Those among the parameters of a model.
std::vector<RotorTerm> terms_of(const IdentifiedModel& model);
std::vector<TermText> term_text(const RotorTerm& term, bool x);
/// "Coulomb friction, gyroscopic term"; empty without terms.
std::string names_of(const std::vector<RotorTerm>& terms);

/// Lowest of 1000 equal steps of speed up to `most`, rad/s, from which on small motion about rest grows by rotating
/// damping, cross-coupled stiffness or negative damping; infinite where it does not. Dry friction, which holds small
/// motion, is left out.
double unstable_from(const RotorModel& rotor, const std::vector<RotorTerm>& terms, double most);

inline TermForce term_force(const RotorTerm& term, const TermPoint& point) {
  return term.entry->force(point, term.reference, term.part);
}

}  // namespace whirl::identification
