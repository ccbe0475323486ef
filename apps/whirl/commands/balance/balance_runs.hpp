#pragma once
#include <string>
#include <vector>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::app {

/// How the vectors of a job are written. A phase lag and angles against rotation belong together as lead and with do.
struct VectorConvention {
  std::string phase = "lag";        ///< lag or lead
  std::string amplitude = "0p";     ///< 0p, pp or rms
  std::string angles = "with";      ///< of the masses: with or against rotation
  double amplitude_factor() const;  ///< to zero-to-peak
  double phase_sign() const { return phase == "lag" ? -1 : 1; }
  double angle_sign() const { return angles == "against" ? -1 : 1; }
  void check() const;
};

/// A balancing job as read from a file.
struct JobFile {
  diagnosis::BalancingJob job;
  VectorConvention convention;
  std::vector<double> speeds;  ///< rad/s, ascending
  std::vector<std::string> probes;
  std::vector<std::string> slow_roll;  ///< probes whose slow-roll vector was taken off
};

/// `slow_roll`: rad/s; readings at or below it are runout and taken off the others, probe by probe. CSV: one row a run
/// and speed. TOML: [job] and [[run]]. See docs/balancing.md. Throws Error naming file, line or column.
JobFile read_job(const std::string& path, VectorConvention convention, double slow_roll);

}  // namespace whirl::app
