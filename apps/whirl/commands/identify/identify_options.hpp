#pragma once
#include <string>
#include <vector>

#include "commands/machine/record_options.hpp"
#include "whirl/identify/identify.hpp"

namespace whirl::app {

/// Values of --selection.
inline const std::vector<std::pair<std::string, regression::Selection>> kSelections{
    {"automatic", regression::Selection::automatic},
    {"bic", regression::Selection::bic},
    {"aic", regression::Selection::aic},
    {"cv", regression::Selection::cv},
    {"cv-1se", regression::Selection::cv_1se}};

/// Everything that can be said on the command line of `whirl identify`.
struct IdentifyFlags {
  std::vector<std::string> files;
  std::string out, method, modes, angle = "measured", output = "y", input = "u";
  std::string slow_roll, slow_roll_reads = "unknown";
  double filter_ms = 0;
  RecordOptions record;

  // sindy
  bool trapping = false;
  double least_decay = -1;  ///< of the linear part, 1/s; negative: free
  std::vector<std::string> states, inputs, known, signs, bounds, holds, dead_times;
  std::string library, term_list;
  int order = 0, degree = 0, fourier = 0, max_passes = identification::SindyOptions{}.search.max_passes;
  bool discrete = false, time = false, no_refine = false, stream = false;
  double window = 0, term_t_value = 4;
  bool no_timing = false;
  int hidden = 0;
  std::string denominators;

  // drive
  std::string drive;
  double inertia = 0, mass = 0;

  // regression
  std::string regressor, selection = "automatic";
  regression::SolveOptions solve;

  bool compare = false, no_holdout = false;
  double holdout = 0.3;

  void add_to(CommandLine* sub);
  /// weak, unless another method is named or flags of sindy are given.
  identification::Method method_chosen() const;
  /// Throws Error when one of the flags given is none that the method takes.
  void check(const std::vector<std::string>& given) const;
  /// Channels that the record must have.
  std::vector<std::string> required() const;
  bool of_a_rotor() const;  ///< does the method chosen take a rotor's record?
  /// The record with its angle, from pulses where it has none of its own.
  Recording with_angle(const Recording& read) const;
  /// Throws Error, with what may be given instead, where a rotor method lacks the second direction or the angle.
  void require_rotor_channels(const Recording& like) const;
  /// What `identify` is to do with records like this one.
  identification::IdentifyOptions options(const Recording& like) const;
  /// States default to all channels of `like` that are no inputs.
  identification::SindyOptions sindy(const Recording& like) const;

 private:
  void add_general_to(CommandLine* sub);
  void add_regression_to(CommandLine* sub);
  regression::SolveOptions solver(const regression::SolveOptions& defaults) const;
  identification::RotorIdentifyOptions weak() const;
  identification::PaperOptions paper() const;
  identification::ConsistentOptions consistent() const;
  identification::SecondOrderOptions second_order() const;
  /// --library. Where the file names no equations they are of --states, else of all channels of `like` that are no
  /// inputs; where it does, Error when --states, --inputs, --order or --discrete say otherwise.
  expr::CandidateLibrary candidate_library(const Recording& like) const;
};

}  // namespace whirl::app
