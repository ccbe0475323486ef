#include "monte_carlo_checkpoint.hpp"

#include <fmt/format.h>

#include <cstdlib>
#include <fstream>

#include "whirl/core/error.hpp"
#include "whirl/io/hash.hpp"
#include "whirl/io/model_json.hpp"

namespace whirl::tuning {

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
  const std::string text = fmt::format("{} {} {:a} {:a} {:a} {:a} {:a} {:a} {}", o.samples, o.seed, o.covariance_scale,
                                       o.stiffness_sd, o.damping_sd, o.unbalance_sd, o.gain_sd, o.rotation_sd, o.key) +
                           to_json(design).dump();
  return "whirl.robustness.checkpoint/1 " + io::sha256(text);
}

MonteCarloCheckpoint::MonteCarloCheckpoint(const std::filesystem::path& path, const std::string& key,
                                           const RotorModel& centre, std::vector<MonteCarloSample>& samples,
                                           std::vector<double>& done)
    : path_(path.string()) {
  std::string kept = key + "\n";
  if (std::ifstream in(path, std::ios::binary); in) {
    std::string line;
    if (!std::getline(in, line) || line != key) {
      throw Error(
          path_ +
          ": checkpoint of another study (other controller, model, seed or options); remove it or name another");
    }
    while (std::getline(in, line) && !in.eof()) {  // eof: the last line has no end
      double numbers[kSampleNumbers];
      const char* at = line.c_str();
      bool complete = true;
      for (double& v : numbers) {
        char* end = nullptr;
        v = std::strtod(at, &end);
        complete = complete && end != at;
        at = end;
      }
      if (!complete || !(numbers[0] >= 0) || numbers[0] >= static_cast<double>(samples.size())) continue;
      const auto i = static_cast<std::size_t>(numbers[0]);
      samples[i] = sample_from(centre, numbers);
      done[i] = 1;
      kept += line + "\n";
    }
  }
  // A kill in here must not lose what the file holds.
  const std::string fresh = path_ + ".new";
  {
    std::ofstream out(fresh, std::ios::binary);
    out << kept;
    if (!out.flush()) throw Error(fresh + ": cannot be written");
  }
  std::filesystem::rename(fresh, path);
  file_ = std::fopen(path_.c_str(), "ab");
  if (file_ == nullptr) throw Error(path_ + ": cannot be written");
}

MonteCarloCheckpoint::~MonteCarloCheckpoint() {
  if (file_ != nullptr) std::fclose(file_);
}

void MonteCarloCheckpoint::append(const std::vector<double>& numbers) {
  std::string text;
  for (std::size_t i = 0; i < numbers.size(); ++i) {
    text += fmt::format("{:a}{}", numbers[i], (i + 1) % kSampleNumbers == 0 ? "\n" : " ");
  }
  if (std::fputs(text.c_str(), file_) < 0 || std::fflush(file_) != 0) throw Error(path_ + ": cannot be written");
}

}  // namespace whirl::tuning
