#pragma once
#include <string>
#include <utility>
#include <vector>

#include "whirl/balancing/solve.hpp"
#include "whirl/diagnosis/next_run.hpp"

namespace whirl::balancing {

/// A job that is made run by run, kept in one file (TOML) that can be corrected by hand. SI; angles as the convention
/// counts them; 0 or empty: not stated.
struct NewJob {
  std::vector<std::string> planes, probes;
  std::vector<double> speeds;               ///< rad/s, at which each run is read
  VectorConvention convention{"", "", ""};  ///< must be stated
  std::vector<double> probe_angles;         ///< rad, by probe
  double keyphasor = 0, notch = 0;          ///< rad: the keyphasor's probe, the width of the mark
  std::string edge = "leading";             ///< of the mark that triggers: leading or trailing
  double critical_speed = 0;                ///< rad/s: tells on which side the heavy spot is
  double trial = 0;                         ///< kg; else from options.rotor
  std::string unit = "um";                  ///< of the readings: um, mil, mm_s, in_s, g or m_s2
  double target = 0, allowed = 0;           ///< SI, in the kind of the readings
  double slow_roll = 0;                     ///< rad/s: readings at or below are runout
  JobOptions options;
};

/// A run that was made.
struct RunMade {
  std::string
      readings;         ///< "48.3@270 12@5": unit of the job and degrees, all probes at the first speed, then the next;
                        ///< "-": missing
  std::string record;   ///< or a record with keyphasor whose channels are named as the probes
  bool steady = false;  ///< record: vectors of a rotor that stays at each speed, from modes fitted to the run-up
  std::string masses;   ///< "10@90 0": grams and degrees, plane by plane; empty: as proposed
  std::string name;     ///< empty: after its purpose
  VectorConvention typed{"", "", ""};  ///< of readings and masses, where it differs from the job's
};

/// What to do next, and what the runs so far tell.
struct GuidedStep {
  JobFile file;
  diagnosis::NextRun next;
  std::vector<diagnosis::Foretold> check;  ///< the last run against what the runs before foretold
  std::vector<std::pair<std::string, std::string>> instructions;  ///< what, why, and the mass of every plane
  std::optional<SolvedJob> solved;                                ///< when the runs tell every plane's influence
  Summary summary;
  io::Json json;  ///< whirl.balancing_step
};

/// The text of a job's file. Throws Error for what is not stated: planes, probes, phase, amplitude, angles, trial mass.
/// `path`: for messages.
std::string new_job_text(const NewJob& job, const std::string& path);

struct RunTaken {
  std::size_t number = 0;  ///< from 1
  std::string name;
};
/// Adds a run to the job's file. Throws Error where the readings or masses do not fit the job, or
/// another process writes the file; the file is then as it was.
RunTaken add_run(const std::string& path, const RunMade& run, const JobOptions& options = {});

/// Takes the last run back. Throws Error when there is none, or another process writes the file.
void undo_run(const std::string& path);

/// The next run to make, where the masses go and why. Warns of a run that is not as foretold, and of vectors that were
/// read at differing rates of the speed (they are not linear in the masses).
GuidedStep guided_step(const std::string& path, const JobOptions& options = {});

}  // namespace whirl::balancing
