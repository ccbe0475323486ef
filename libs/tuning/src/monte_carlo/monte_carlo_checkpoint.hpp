#pragma once
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "whirl/io/output.hpp"
#include "whirl/tuning/monte_carlo.hpp"

namespace whirl::tuning {

/// A sample as numbers, for the checkpoint and between processes: index, k1, k2, c, eps, open peak, peak, standstill,
/// stable.
inline constexpr std::size_t kSampleNumbers = 10;
void append_numbers(std::vector<double>& out, int index, const MonteCarloSample& sample);
MonteCarloSample sample_from(const RotorModel& centre, const double* numbers);

/// One line that tells studies apart: samples of the same key are the same.
std::string study_key(const MonteCarloOptions& options, const ControllerDesign& design);

/// Finished samples in a text file, one a line in hexadecimal floating point, so that a study goes on where it was
/// killed. Each line ends with a checksum: one that was changed is an error; one cut short by a kill is dropped.
class MonteCarloCheckpoint {
 public:
  /// Opens or makes the file and fills in the samples it holds (`done[i]` = 1). Throws Error when it is of another
  /// study, or another process writes it.
  MonteCarloCheckpoint(const std::filesystem::path& path, const std::string& key, const RotorModel& centre,
                       std::vector<MonteCarloSample>& samples, std::vector<double>& done);
  ~MonteCarloCheckpoint();
  MonteCarloCheckpoint(const MonteCarloCheckpoint&) = delete;
  MonteCarloCheckpoint& operator=(const MonteCarloCheckpoint&) = delete;

  void append(const std::vector<double>& numbers);

 private:
  int file_ = -1;
  std::string path_;
  std::unique_ptr<io::WriterLock> lock_;
};

}  // namespace whirl::tuning
