#pragma once
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/quantity.hpp"
#include "whirl/diagnosis/correction.hpp"
#include "whirl/diagnosis/influence.hpp"

namespace whirl::balancing {

/// How the vectors of a job are written. A phase lag and angles against rotation belong together as lead and with do.
struct VectorConvention {
  std::string phase = "lag";     ///< lag or lead
  std::string amplitude = "0p";  ///< 0p (or peak), pp or rms
  std::string angles = "with";   ///< of the masses: with or against rotation
  bool amplitude_stated = true;  ///< `amplitude` was, too
  bool sense_stated = true;      ///< both `phase` and `angles` were stated, not taken as usual
  /// As a user states it: an empty text takes the usual one and says that it was not stated.
  static VectorConvention stated(const std::string& phase, const std::string& amplitude, const std::string& angles);
  double amplitude_factor() const;  ///< to zero-to-peak
  double phase_sign() const { return phase == "lag" ? -1 : 1; }
  double angle_sign() const { return angles == "against" ? -1 : 1; }
  void check() const;
};

/// "least-squares", "min-max"; "automatic", "linear", "none"; nothing for an empty name.
std::optional<diagnosis::Criterion> criterion_of(const std::string& name);
std::optional<diagnosis::Drift> drift_of(const std::string& name);

/// Where masses fit, and in which sizes. 0: not stated.
struct MassPlaces {
  int holes = 0;               ///< equally spaced, of each plane
  double first_hole = 0;       ///< rad, counted as the job counts angles
  double piece = 0, hole = 0;  ///< masses are multiples of `piece`; largest mass in one hole, kg
};

/// The rotor that is balanced. 0: not stated.
struct BalancedRotor {
  double mass = 0, radius = 0;  ///< of the rotor, kg; where masses are added, m
  double grade = 0;             ///< mm/s; else 6.3
  double service_speed = 0;     ///< rad/s; else the highest speed of the job
};

/// What a guided job states beside its runs: tables [setup], [plan] and [machine] of runs.toml. NaN or 0: not stated.
struct JobPlan {
  std::string edge = "leading";      ///< of the mark that triggers the keyphasor: leading or trailing
  double keyphasor = 0, notch = 0;   ///< rad, with rotation from the angle zero of the housing; width of the mark
  std::vector<double> probe_angles;  ///< by probe, rad with rotation from the same zero; empty: not stated
  double critical_speed = 0;         ///< rad/s
  double trial = 0, limit = 0;       ///< kg
  double target = 0, allowed = 0;    ///< SI, in the convention of the job (p-p, 0-p, rms)
  double noise = 0, slow_roll = 0;   ///< m 0-p; rad/s
  MassPlaces places;
  std::optional<diagnosis::Criterion> criterion;
  std::optional<diagnosis::Drift> drift;
  bool drop_dependent = false;
  BalancedRotor rotor;
};

/// A balancing job as read from a file.
struct JobFile {
  diagnosis::BalancingJob job;
  VectorConvention convention;
  std::vector<double> speeds;  ///< rad/s, ascending
  std::vector<std::string> probes;
  Quantity quantity = Quantity::displacement;  ///< of the readings: displacement, velocity or acceleration
  std::string unit;                    ///< suffix in which the readings are written: "mil", "mm_s"; TOML: job.unit
  std::vector<std::string> slow_roll;  ///< probes whose slow-roll vector was taken off
  std::vector<double> stated_speeds;   ///< runs.toml: job.speeds, rad/s, in the order of the readings, slow roll too
  JobPlan plan;                        ///< runs.toml
  /// runs.toml, by run: rate of the run-up over the square of the speed where it was read, 1; 0: the rotor stayed at
  /// its speeds; NaN: not stated.
  std::vector<double> sweeps;
};

/// `slow_roll`: rad/s; readings at or below it are runout and taken off the others, probe by probe. CSV: one row a run
/// and speed. TOML: [job] and [[run]], where plan.slow_roll stands in for a `slow_roll` of 0. See docs/balancing.md.
/// `may_be_empty`: a TOML job without a run. Throws Error naming file, line or column.
JobFile read_job(const std::string& path, VectorConvention convention, double slow_roll, bool may_be_empty = false);

}  // namespace whirl::balancing
