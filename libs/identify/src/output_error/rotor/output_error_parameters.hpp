#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "output_error/rotor/high_pass.hpp"
#include "output_error/rotor/output_error_kernel.hpp"
#include "whirl/identify/output_error_rotor.hpp"

namespace whirl::identification::detail {

/// What a parameter of the output-error fit acts on. A lane is integrated with the motion, the others enter the
/// readings.
enum class Kind {
  lane,
  term,
  reference,
  sensor,
  charge,
  offset,
  participation,
  pole_w,
  pole_zeta,
  decay_w,
  decay_zeta,
  decay,
  runout
};

struct Parameter {
  std::string name;
  Kind kind;
  int record;              // -1: shared
  int index = 0;           // lane, term (reference: the first of its entry), mode, amplitude; charge: 1 of the slope
  bool imaginary = false;  // of a delay: its growth
  const TermEntry* sensor = nullptr;
};

/// The estimate while it moves; angle corrections are kept as coefficients of (t / horizon)^k, k = 1 ...
struct Point {
  RotorModel model;
  std::vector<OutputErrorRecord> records;
  std::vector<Eigen::VectorXd> profile;
  std::vector<DecayingMode> decays;
  double delay = 0, clock_drift = 0;
  std::vector<RotorTerm> terms;
  SensorAxes sensor;
};

/// What the y probe reads of x and of y.
struct Lean {
  double x, y;
};
Lean lean(const SensorAxes& sensor);
/// When samples are taken.
struct Instants {
  double t0, dt;  ///< s
};
/// Where an error of the probes is asked for its part in the readings.
struct ProbePoint {
  const SensorAxes& sensor;
  const Eigen::VectorXcd &main, &signal;  ///< simulated motion as read, and as the probes give it to the converters
  Complex charge, charge_rate;            ///< of a high-pass, OutputErrorRecord
  double dt, t0;
};
/// Of readings dt apart.
HighPass high_pass_of(const SensorAxes& sensor, double dt);
/// v^3 of each axis.
Eigen::VectorXcd cubes(const Eigen::VectorXcd& motion);
/// What the probes give to the converters: bent by their curve, then high-passed.
Eigen::VectorXcd probe_signal(const SensorAxes& sensor, const Eigen::VectorXcd& motion, const Instants& at);
/// By what both probes read too much at each sample.
Eigen::ArrayXd drifted_gain(const SensorAxes& sensor, Eigen::Index samples, const Instants& at);
/// The motion as the probes read it.
Eigen::VectorXcd read_by(const SensorAxes& sensor, const Eigen::VectorXcd& motion, const Instants& at);
/// The motion that gives these readings. What a high-pass takes away and a bent curve adds is put right by the
/// simulated motion: a high-pass undone would carry the noise of all readings on.
Eigen::VectorXcd unread_by(const SensorAxes& sensor, const Eigen::VectorXcd& readings,
                           const Eigen::VectorXcd& simulated, const Instants& at);

/// Parameters that the options ask for, shared ones first, then those of each record.
std::vector<Parameter> parameter_list(const std::vector<RotorRecord>& records, const OutputErrorOptions& options,
                                      std::size_t modes);
/// Adds `change` to the parameter.
void move(Point& point, const Parameter& parameter, double change);
double value(const Point& point, const Parameter& parameter);

}  // namespace whirl::identification::detail
