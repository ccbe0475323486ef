#pragma once
#include <complex>
#include <string>
#include <vector>

#include "whirl/balancing/job.hpp"

namespace whirl::balancing {

/// Readings of one run, and how fast the speed changed there: d Omega / dt / Omega^2; 0 for vectors of a rotor that
/// stays.
struct RecordVectors {
  std::vector<std::complex<double>> readings;
  double sweep = 0;
};

/// 1X vectors of a record with a keyphasor or encoder, probe by probe at each stated speed of the job, m 0-p, lead: the
/// mean of the revolutions within 1 % of it. `steady`: instead those of a rotor that stays at the speed, from linear
/// modes fitted to the run-up or run-down, so that runs of differing rates belong together. Throws Error where no
/// revolution is at a speed, or, for `steady`, where the modes leave more than a twentieth of the run and
/// more than its scatter from turn to turn unexplained.
RecordVectors read_vectors(const std::string& record, const JobFile& file, bool steady);

}  // namespace whirl::balancing
