// Rotor records of kinds that no list of terms holds: what identify claims of them. Confidently wrong: status ok, a
// parameter more than 4 stated standard deviations and 1 % (0.1 % for k1) from the truth.
// Columns: kind, ok, warning, unusable or refused, confidently wrong, coverage of the intervals, slowest in s.
// Usage: bench_identify_odd [seeds = 6] [first seed = 1] [SNR dB = 20] [kind] [v: each result]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/identify/rotor_angle.hpp"
#include "whirl/testing/systems/odd_rotors.hpp"

using namespace whirl;

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 6;
  const int first = argc > 2 ? std::atoi(argv[2]) : 1;
  const double snr = argc > 3 ? std::atof(argv[3]) : 20;
  const std::string only = argc > 4 ? argv[4] : "";
  const bool each = argc > 5;
  identification::IdentifyOptions options;
  options.method = identification::Method::weak;
  int wrong_in_all = 0, all = 0;
  for (const auto& [kind, name] : testing::kOddKinds) {
    if (!only.empty() && only != "all" && only != name) continue;
    int ok = 0, warning = 0, unusable = 0, refused = 0, wrong = 0, covered = 0, intervals = 0;
    double slowest = 0;
    std::string how, said;
    for (int seed = first; seed < first + seeds; ++seed) {
      const testing::OddRecord odd = testing::odd_record(kind, snr, static_cast<unsigned long long>(seed));
      identification::Identification found;
      const std::clock_t begin = std::clock();
      try {
        const Recording r = odd.pulses ? identification::with_angle_from_pulses(odd.record, "pulse") : odd.record;
        found = identification::identify({r}, options);
      } catch (const Error& e) {
        ++refused;
        said = e.what();
        continue;
      }
      slowest = std::max(slowest, static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
      const Status status = found.summary.status;
      ++(status == Status::ok ? ok : status == Status::warning ? warning : unusable);
      if (!found.summary.warnings.empty()) said = found.summary.warnings.front();
      if (each) {
        fmt::print("  {} chi2 {:.2f}", seed, found.summary.chi_square);
        for (const auto& [parameter, value] : found.model.parameters)
          fmt::print(" {} {:.4g}({:.2g})", parameter, value.value, value.sd);
        for (const std::string& w : found.summary.warnings) fmt::print(" [{}]", w);
        fmt::print("\n");
      }
      if (status == Status::unusable) continue;
      bool is_wrong = false;
      for (const auto& [parameter, truth, tolerance] :
           {std::tuple{"k1", odd.k1, 0.001}, {"k2", odd.k2, 0.01}, {"c", odd.c, 0.01}, {"e", odd.e, 0.01}}) {
        const Estimate* p = found.model.parameter(parameter);
        if (p == nullptr || !std::isfinite(truth)) continue;
        const double error = p->value - truth;
        ++intervals;
        covered += std::abs(error) <= 2 * p->sd;
        if (std::abs(error) <= tolerance * std::abs(truth) || std::abs(error) <= 4 * p->sd) continue;
        if (status == Status::ok)
          how += fmt::format(" {} {:+.1f} % ({:.0f} sd)", parameter, 100 * error / truth, std::abs(error) / p->sd);
        is_wrong = true;
      }
      wrong += is_wrong && status == Status::ok;
      ++all;
    }
    wrong_in_all += wrong;
    fmt::print("| {}, {:g} dB | {} | {} | {} | {} | {:.2f} | {:.1f} |{} {}\n", name, snr, ok, warning,
               unusable + refused, wrong, intervals > 0 ? covered / static_cast<double>(intervals) : NAN, slowest, how,
               said);
    std::fflush(stdout);
  }
  fmt::print("confidently wrong {} of {}\n", wrong_in_all, all);
}
