#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <complex>
#include <string>
#include <vector>

#include "whirl/core/rotor_model.hpp"
#include "whirl/core/summary.hpp"
#include "whirl/identify/rotor_record.hpp"
#include "whirl/identify/rotor_terms.hpp"

namespace whirl::identification {

/// A mode that decays freely from the start of each record, whatever set it going: amplitudes of e^{p t} and
/// e^{conj(p) t}, p = -zeta w + i w sqrt(1 - zeta^2), belong to the record and do not predict another run.
struct DecayingMode {
  double omega = 0;  ///< undamped, rad/s
  double zeta = 0;   ///< damping ratio, below 1
  bool operator==(const DecayingMode&) const = default;
};

/// What the y probe reads of the motion: (1 + gain) (y cos angle + x sin angle), later than x is read by `skew`
/// (converters that take one channel after the other). Before, both probes may be bent and AC-coupled. Beside it,
/// readings have offset, modes, runout.
struct SensorAxes {
  double gain = 0;   ///< y reads too much by this share
  double angle = 0;  ///< the y probe leans towards x by this angle, rad
  double skew = 0;   ///< s
  /// High-pass of both probes, s^2 / (s^2 + high_pass s + high_pass_square), rad/s and rad^2/s^2, >= 0. Without the
  /// square it is of the first order (AC coupling); with it of the second (a pickup of velocity and an integrator),
  /// corner sqrt(high_pass_square). 0: none.
  double high_pass = 0;
  double cubic = 0;  ///< curve of both probes: a displacement v is read as v + cubic v^3 (each axis), 1/m^2
  double high_pass_square = 0;
  double gain_drift = 0;   ///< both probes read 1 + gain_drift (t - drift_start) times the displacement, 1/s
  double drift_start = 0;  ///< s
  bool operator==(const SensorAxes&) const = default;
};

/// Starting values of k1_change and c_change of each record (the first one's are 0), estimated for the others; empty:
/// all records have the same k1, c.
struct RecordChanges {
  std::vector<double> k1, c;
  bool operator==(const RecordChanges&) const = default;
};

/// Modes beside the main one.
struct FurtherModes {
  bool participation = true;         ///< of the forced modes, per record, complex, is estimated
  std::vector<DecayingMode> decays;  ///< free decays
  bool poles = false;                ///< w and zeta of the forced and decaying modes are estimated
  int given = -1;                    ///< place of a forced mode whose w and zeta stay all the same; -1: none
  bool operator==(const FurtherModes&) const = default;
};

/// The angle against the displacement.
struct ClockOptions {
  bool delay = false;      ///< that of the displacement channels (positive: they are older) is estimated, shared
  bool drift = false;      ///< it grows in proportion to the time of the record
  double start_drift = 0;  ///< starting value of that share
  /// Correction of the angle by a polynomial of this degree without constant term (the phase of eps takes the
  /// constant), per record: 2 for an assumed constant acceleration, 0 for a measured angle. At most 6.
  int profile_degree = 0;
  bool operator==(const ClockOptions&) const = default;
};

/// What the probes add to the motion.
struct ProbeOptions {
  SensorAxes start;                           ///< starting value
  std::vector<const TermEntry*> errors = {};  ///< that are estimated
  /// Shaft runout read beside the motion: harmonics 1 .. n of the angle, forward and backward, per record.
  int runout_harmonics = 0;
  bool operator==(const ProbeOptions&) const = default;
};

struct FreeRunOptions {
  /// Runge-Kutta steps per sample, at most 16; 0: as many as keep their error below a quarter of the standard deviation
  /// of every parameter.
  int substeps = 0;
  int max_iterations = 30;
  double tolerance = 0.02;  ///< stops when no parameter moves by more than this share of its standard deviation
  bool operator==(const FreeRunOptions&) const = default;
};

/// Which parameters the output-error fit estimates. Parameters that are not estimated keep their starting value.
struct OutputErrorOptions {
  bool rotor = true;            ///< k1, k2, c
  bool conj_stiffness = false;  ///< k1_conj
  bool conj_damping = false;    ///< c_conj
  RecordChanges changes;
  bool unbalance = true;  ///< eps, per record
  bool offset = true;     ///< sensor offset, per record
  FurtherModes modes;
  ClockOptions clock;
  /// Forces beyond RotorModel, with their starting values; at most 10.
  std::vector<RotorTerm> terms;
  bool free_terms = true;  ///< their coefficients are estimated
  ProbeOptions probes;
  FreeRunOptions solver;

  bool estimates(const TermEntry& sensor_error) const {
    return std::ranges::find(probes.errors, &sensor_error) != probes.errors.end();
  }
  bool operator==(const OutputErrorOptions&) const = default;
};

/// What belongs to one record of an output-error fit.
struct OutputErrorRecord {
  double t0 = 0;                                    ///< time of sample 0, s
  std::complex<double> eps;                         ///< unbalance, m
  double k1_change = 0, c_change = 0;               ///< k1 and c of this record beyond those of the first, 1/s^2, 1/s
  std::complex<double> offset;                      ///< sensor offset, as read
  std::complex<double> charge;                      ///< that a high-pass adds to the readings of sample 0, m
  std::complex<double> charge_rate;                 ///< and one of the second order to their slope there, m per sample
  std::complex<double> z0, dz0;                     ///< main mode at sample 0, m and m/s
  std::vector<std::complex<double>> participation;  ///< of each forced mode, m
  std::vector<std::complex<double>> decay;          ///< amplitudes of e^{p t} and e^{conj(p) t} of each decay, m
  std::vector<std::complex<double>> runout;         ///< amplitudes of e^{i beta}, e^{-i beta}, e^{2 i beta}, ..., m
  AngleSignal angle;                                ///< with the fitted correction and delay
  Eigen::VectorXcd main, main_rate;                 ///< simulated main mode, m and m/s
  Eigen::VectorXcd main_read;                       ///< in the quantity of the record; empty: displacement, `main`
  Eigen::VectorXcd beside;                          ///< offset + charge + modes + runout + hum + drift, as read
  /// Readings with the samples left out replaced by simulated ones, m; empty when all are used.
  Eigen::VectorXcd readings;
  double rmse_x = 0, rmse_y = 0;  ///< measured minus simulated, rms, SI unit of the record's quantity

  const Eigen::VectorXcd& as_read() const { return main_read.size() > 0 ? main_read : main; }
};

struct OutputErrorFit {
  RotorModel model;  ///< eps, offset and participations of the first record
  std::vector<DecayingMode> decays;
  double delay = 0;        ///< s
  double clock_drift = 0;  ///< share of the time by which the delay grows
  std::vector<RotorTerm> terms;
  SensorAxes sensor;
  std::vector<OutputErrorRecord> records;
  std::vector<std::string> names;  ///< of the estimated parameters; from the second record on with suffix _2, _3, ...
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;  ///< from the noise alone, not scaled by chi_square
  int substeps = 1;            ///< Runge-Kutta steps per sample
  int iterations = 0;
  Summary summary;  ///< residual: rms of the weighted residual; chi_square: its square by degrees of freedom

  /// Main mode of record r as the probes read it.
  Eigen::VectorXcd read_main(std::size_t r) const;
  /// Index of a parameter in names; -1 when it was not estimated.
  Eigen::Index index(const std::string& name) const;
};

/// Maximum-likelihood refinement: minimises sum |z_model(t_i) - z_i|^2 / sigma^2 over the trajectory of
///
///   z_model = z1(t) + offset + sum_k Gamma_k q_k(t) [+ free decays] [+ runout]   [z1 as SensorAxes reads it],
///
/// z1 the main mode of RotorModel, q_k'' + 2 zeta_k w_k q_k' + w_k^2 q_k = F. Of a record of velocity or acceleration
/// z1 and q_k stand differentiated once or twice: z1' is a state, z1'' the right-hand side of the equation of motion;
/// offset, decays and errors of the sensors are in the unit of the readings. Gauss-Newton with forward sensitivities
/// integrated together with the motion (RK4, one or more steps a sample), Levenberg damping when a
/// step fails; the linear parameters (offset, Gamma, decay, runout) are solved in every step with the others.
/// `start` gives the rotor parameters and modes; eps per record may be given in `start_eps` (otherwise start.eps).
/// Starting delay: `start_delay`. Records share all but eps, initial state, offset, angle correction, Gamma, decay and
/// runout. Status unusable when a record is, the simulation diverges from the start or the equations are singular;
/// warning when not converged.
OutputErrorFit fit_output_error_rotor(const std::vector<RotorRecord>& records, const RotorModel& start,
                                      const OutputErrorOptions& options = {},
                                      const std::vector<std::complex<double>>& start_eps = {}, double start_delay = 0);

}  // namespace whirl::identification
