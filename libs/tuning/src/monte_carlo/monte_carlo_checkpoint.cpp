#include "monte_carlo/monte_carlo_checkpoint.hpp"

#include <fcntl.h>
#include <fmt/format.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/hash.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::tuning {

namespace {

/// Of the text of a line: a digit changed by hand or by a disk must not change a result.
std::string checksum(std::string_view line) { return io::sha256(line).substr(0, 16); }

}  // namespace

void append_numbers(std::vector<double>& out, int index, const MonteCarloSample& s) {
  out.insert(out.end(), {static_cast<double>(index), s.model.k1, s.model.k2, s.model.c, s.model.eps.real(),
                         s.model.eps.imag(), s.open_peak, s.peak, s.standstill_rms, s.stable ? 1.0 : 0.0});
}

MonteCarloSample sample_from(const RotorModel& centre, const double* n) {
  MonteCarloSample s{centre, n[6], n[7], n[8], n[9] != 0};
  s.model.k1 = n[1], s.model.k2 = n[2], s.model.c = n[3];
  s.model.eps = {n[4], n[5]};
  return s;
}

std::string study_key(const MonteCarloOptions& o, const ControllerDesign& design) {
  const std::string text =
      fmt::format("{} {} {:a} {:a} {:a} {:a} {:a} {:a} {:a} {:a} {:a} {:a} {:a} {} {}", o.samples, o.seed,
                  o.covariance_scale, o.stiffness_sd, o.damping_sd, o.unbalance_sd, o.gain_sd, o.rotation_sd,
                  o.sheet_sd, o.runout_sd, o.runout_common, o.participation_sd, o.ringing, o.other_machines, o.key) +
      to_json(design).dump();
  return "whirl.robustness.checkpoint/7 " + io::sha256(text);
}

MonteCarloCheckpoint::MonteCarloCheckpoint(const std::filesystem::path& path, const std::string& key,
                                           const RotorModel& centre, std::vector<MonteCarloSample>& samples,
                                           std::vector<double>& done)
    : path_(path.string()), lock_(std::make_unique<io::WriterLock>(path)) {
  std::string kept = key + "\n";
  if (std::ifstream in(path, std::ios::binary); in) {
    std::string line;
    if (!std::getline(in, line) || line != key) {
      throw Error(
          path_ +
          ": checkpoint of another study (other controller, model, seed or options); remove it or name another");
    }
    for (int row = 2; std::getline(in, line) && !in.eof();
         ++row) {  // eof: the last line has no end, its writer was killed
      const std::size_t sum = line.rfind(' ');
      if (sum == std::string::npos || line.substr(sum + 1) != checksum(std::string_view(line).substr(0, sum))) {
        throw Error::in_file(path_, row,
                             "the line does not fit its checksum: the checkpoint was changed or damaged; "
                             "remove the line, and the sample is computed again");
      }
      double numbers[kSampleNumbers];
      const char* at = line.c_str();
      bool complete = true;
      for (double& v : numbers) {
        char* end = nullptr;
        v = std::strtod(at, &end);
        complete = complete && end != at;
        at = end;
      }
      if (!complete || !(numbers[0] >= 0) || numbers[0] >= static_cast<double>(samples.size()))
        throw Error::in_file(path_, row, "is no sample of this study");
      const auto i = static_cast<std::size_t>(numbers[0]);
      samples[i] = sample_from(centre, numbers);
      done[i] = 1;
      kept += line + "\n";
    }
  }
  io::write_text(path, kept);                      // a kill in here must not lose what the file holds
  lock_ = std::make_unique<io::WriterLock>(path);  // of the new file; the old one's ends
  file_ = open(path_.c_str(), O_WRONLY | O_APPEND | O_CLOEXEC);
  if (file_ < 0) throw Error(path_ + ": cannot be written: " + std::strerror(errno));
}

MonteCarloCheckpoint::~MonteCarloCheckpoint() {
  if (file_ >= 0) close(file_);
}

void MonteCarloCheckpoint::append(const std::vector<double>& numbers) {
  std::string text, line;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    line += fmt::format("{}{:a}", line.empty() ? "" : " ", numbers[i]);
    if ((i + 1) % kSampleNumbers != 0) continue;
    text += line + " " + checksum(line) + "\n";
    line.clear();
  }
  std::string_view left = text;
  while (!left.empty()) {
    const ssize_t n = write(file_, left.data(), left.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) throw Error(path_ + ": cannot be written: " + std::strerror(errno));
    left.remove_prefix(static_cast<std::size_t>(n));
  }
  if (fdatasync(file_) != 0 && errno != EINTR) throw Error(path_ + ": cannot be written: " + std::strerror(errno));
}

}  // namespace whirl::tuning
