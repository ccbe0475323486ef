// `whirl balance`: runs.toml and runs.csv. Oracles: what is read is finite or marked as not read; readings written in
// mm are a thousand times those in um; least squares never makes the readings worse.
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <string>

#include "harness.hpp"
#include "whirl/balancing/job.hpp"
#include "whirl/diagnosis/influence.hpp"

namespace {

using namespace whirl;

balancing::JobFile read(std::string_view bytes) {
  // In memory; the reader takes only a path, and its ending tells the format.
  const bool toml = bytes.find("[job]") != bytes.npos;
  static const std::string folder = "/dev/shm/whirl_fuzz_" + std::to_string(::getpid());
  const std::string path = folder + (toml ? ".toml" : ".csv");
  struct File {
    explicit File(const std::string& p, std::string_view text) : path(p) {
      std::FILE* f = std::fopen(p.c_str(), "wb");
      fuzz::require(f != nullptr && std::fwrite(text.data(), 1, text.size(), f) == text.size());
      std::fclose(f);
    }
    ~File() { std::remove(path.c_str()); }
    const std::string& path;
  } file(path, bytes);
  return balancing::read_job(path, {}, 0, true);
}

void finite(const balancing::JobFile& file) {
  for (const diagnosis::BalancingRun& run : file.job.runs) {
    fuzz::require(run.masses.allFinite() && std::isfinite(run.time));
    for (const auto& v : run.vibration) fuzz::require(std::isfinite(std::abs(v)) || std::isnan(std::abs(v)));
  }
}

void scaled(std::string_view bytes, const balancing::JobFile& file) {
  std::string other(bytes);
  for (std::size_t at = 0; (at = other.find("_um", at)) != std::string::npos;) other.replace(at, 3, "_mm");
  if (other == bytes) return;
  fuzz::only_errors([&] {
    const balancing::JobFile large = read(other);
    if (large.job.runs.size() != file.job.runs.size() || large.job.rows != file.job.rows) return;
    for (std::size_t r = 0; r < file.job.runs.size(); ++r) {
      const auto &a = file.job.runs[r].vibration, &b = large.job.runs[r].vibration;
      if (a.size() != b.size() || !a.allFinite() || !b.allFinite()) continue;
      const double one = (b - a).norm(), thousand = (b - 1000 * a).norm();
      fuzz::require(std::min(one, thousand) <= 1e-9 * (a.norm() + b.norm()));
    }
  });
}

void corrected(const diagnosis::BalancingJob& job) {
  if (!job.phases || job.runs.size() > 12) return;
  const diagnosis::InfluenceFit fit = diagnosis::fit_influence(job);
  diagnosis::CorrectionProblem problem;
  problem.influence = fit.influence;
  problem.vibration = fit.baseline;
  const auto solved = diagnosis::solve_correction(problem, diagnosis::Criterion::least_squares);
  const double before = problem.vibration.norm();
  fuzz::require(solved.masses.allFinite() && solved.objective <= before * (1 + 1e-9));
}

}  // namespace

void whirl::fuzz::run(std::string_view bytes) {
  only_errors([&] {
    const balancing::JobFile file = read(bytes);
    finite(file);
    scaled(bytes, file);
    corrected(file.job);
  });
}
