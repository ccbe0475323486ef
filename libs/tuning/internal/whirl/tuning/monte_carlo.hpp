#pragma once
#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "whirl/core/identified_model.hpp"
#include "whirl/tuning/design.hpp"

namespace whirl::tuning {

/// Share of the machines that must be able to pass the judge (upper end of the interval) for a study not to fail.
inline constexpr double kEnoughPass = 0.95;

struct MonteCarloOptions {
  int samples = 200;
  std::uint64_t seed = 1;
  int lanes = 16;    ///< rigs side by side in vector registers: 8, 16 or 32; the result does not depend on it
  int threads = 0;   ///< 0 = all cores; the result does not depend on it
  double limit = 0;  ///< displacement not to be exceeded, peak, m; 0: none
  double covariance_scale = 1;  ///< factor on the identified standard deviations
  /// Relative standard deviations added to the identified ones: what a covariance of the noise alone does not hold. The
  /// axes of the shaft differ in stiffness by a fifth of `stiffness_sd`. Modes with a participation above 1 are of the
  /// shaft and move with its stiffness.
  double stiffness_sd = 0.05, damping_sd = 0.2, unbalance_sd = 0.02;
  double gain_sd = 0.03;      ///< of the actuator gain, relative
  double rotation_sd = 0.02;  ///< of the actuator axes, rad
  /// Of what the data sheet states of sensors (low-pass, hysteresis) and actuators (bandwidth, current limit, slew,
  /// hysteresis), relative: a corner of resistors and capacitors of IEC 60062 J and K (5 %, 10 %) is within 15 %, which
  /// evenly spread is 9 %.
  double sheet_sd = 0.1;
  double runout_sd = 0.3;      ///< of each runout harmonic against the data sheet, relative
  double runout_common = 0.4;  ///< of its logarithm, on all machines alike (CommonUnknown::runout)
  /// Other machines of the make: each with a runout of its own under the table that the controller keeps, and an
  /// unbalance of any angle. Otherwise the machine that was identified: of a runout that the controller removes, what
  /// its identification leaves (tuning_hardware).
  bool other_machines = false;
  double participation_sd = 0.3;  ///< of the participation of structural modes, relative; a sign that is not
                                  ///< known is + or - with equal chance
  double ringing = 0.1;  ///< of the structure at the beginning: velocity (standard deviation) of each mode whose
                         ///< deflection the data sheet does not say, relative to eccentricity times top speed
  /// Finished samples are appended here, and a study that finds its own file goes on where it was stopped; empty: none.
  std::filesystem::path checkpoint;
  std::string key;  ///< what the study depends on beside these options, e.g. hashes of the input files
  std::function<void(long done, long samples)> progress;  ///< first with what the checkpoint held
};

/// What no data sheet says and what all machines of one make have in common: half of the samples are drawn each way.
/// What difference that makes is no scatter from machine to machine, and widens the interval of `exceeds`.
enum class CommonUnknown : std::uint8_t {
  distribution,  ///< tolerances with tails (Student, four degrees of freedom; k1 and c normal), or evenly spread
                 ///< between limits, with the same standard deviation
  runout,        ///< all sensors exp(-runout_common) or exp(runout_common) times the data sheet
  ringing,       ///< the structure is still at the beginning, or rings
};
inline constexpr int kCommonUnknowns = 3;
std::string to_string(CommonUnknown unknown);
/// Which of the two ways sample i is drawn.
constexpr bool common_case(CommonUnknown unknown, int sample) { return (sample >> static_cast<int>(unknown) & 1) != 0; }

struct MonteCarloSample {
  RotorModel model;           ///< the rotor drawn
  double open_peak = 0;       ///< whole run without control, x axis, zero-to-peak, m
  double peak = 0;            ///< the same with control
  double standstill_rms = 0;  ///< m
  bool stable = false;
};

/// A count k of n with its two-sided 95 % interval by Clopper and Pearson (Biometrika 26, 1934): the exact one, never
/// too narrow.
struct Proportion {
  long count = 0, n = 0;
  double value = 0, low = 0, high = 1;
};
Proportion proportion(long count, long n);

struct MonteCarloResult {
  std::vector<MonteCarloSample> samples;
  double peak_median = 0, peak_p95 = 0, peak_p99 = 0, peak_worst = 0;  ///< m
  Proportion stable;
  /// Not stable, or peak above the limit; not computed without a limit. The interval is that of Clopper and Pearson,
  /// wider at both ends by the sum of `common`.
  Proportion exceeds;
  /// By how much the share moves to either side with each CommonUnknown: half the difference of its two cases, its
  /// scatter taken off.
  std::array<double, kCommonUnknowns> common{};
};

/// The processes that share a study (MPI ranks). Every call is made by all of them in the same order.
struct Ranks {
  int rank = 0, size = 1;
  /// All ranks' numbers one after the other on rank 0, empty elsewhere.
  std::function<std::vector<double>(const std::vector<double>&)> gather;
  /// Rank 0's numbers on all ranks; the sizes agree.
  std::function<void(std::vector<double>&)> broadcast;
};

/// Draws rotors from the identified covariance (IdentifiedModel::rotor_covariance, may be empty) and hardware
/// tolerances, runout phases and sensor noise, and runs the design on each, many rigs at a time. Sample i depends on
/// (seed, i) alone: the result is the same, to the last bit, for any number of lanes, threads and ranks of one build on
/// one kind of processor, and for a study that was killed and resumed. Ranks other than 0 return no samples.
///
/// Throws Error when the model has no rotor or input gain, the covariance is not 5 x 5 and positive semi-definite, or
/// the checkpoint is of another study.
MonteCarloResult monte_carlo(const ControllerDesign& design, const IdentifiedModel& model, const Hardware& hardware,
                             const MonteCarloOptions& options = {}, const Ranks& ranks = {});

}  // namespace whirl::tuning
