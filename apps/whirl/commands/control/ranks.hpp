#pragma once
#include "whirl/tuning/monte_carlo.hpp"

namespace whirl::app {

/// The MPI processes of this run, when the program was started by mpirun and built with MPI; else one rank.
class MpiRanks {
 public:
  MpiRanks();
  ~MpiRanks();
  MpiRanks(const MpiRanks&) = delete;
  MpiRanks& operator=(const MpiRanks&) = delete;
  const tuning::Ranks& ranks() const { return ranks_; }
  /// Ends all processes, which may wait for this one; does nothing for a process alone.
  void abort(int code) const;

 private:
  tuning::Ranks ranks_;
  bool started_ = false;
};

}  // namespace whirl::app
