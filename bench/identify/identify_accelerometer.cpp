// Rotors identified from what accelerometers and velocity pickups with a high-pass read: errors, coverage, held-out
// error, chi-square, time. Usage: bench_identify_accelerometer [rotors per row = 20] [first seed = 1] [v, print each]
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <random>
#include <vector>

#include "whirl/identify/identify.hpp"
#include "whirl/testing/records/rotor_sensors.hpp"

namespace {

using namespace whirl;
using namespace whirl::testing;

struct Row {
  int records = 0, usable = 0, warned = 0;
  std::vector<double> error[4], held, seconds, chi_square;  // k1, c, k2, e in %
  int inside[5] = {};                                       // of the 95 % interval; last: e_phase
};

double at(std::vector<double> v, double share) {
  if (v.empty()) return NAN;
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(share * static_cast<double>(v.size() - 1) + 0.5)];
}

void add(const SensedRotor& truth, unsigned long long seed, bool each, Row& row) {
  const Recording record = sensed_record(truth, seed);
  const auto begin = std::chrono::steady_clock::now();
  const identification::Identification id = identification::identify(record);
  row.seconds.push_back(std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count());
  ++row.records;
  if (each)
    std::printf(
        "  seed %llu: %.3g to %.3g Hz, %.3g s, f %.4g Hz, zeta %.3g %%, corner %.3g Hz, noise %.3g dB: %s, "
        "chi-square %.3g\n",
        seed, truth.from, truth.to, truth.seconds, std::sqrt(truth.k1) / 6.2831853, 50 * truth.c / std::sqrt(truth.k1),
        truth.corner, truth.noise_db, std::string(to_string(id.summary.status)).c_str(), id.summary.chi_square);
  if (each) {
    for (const std::string& w : id.summary.warnings) std::printf("      %s\n", w.c_str());
    for (const auto& [name, e] : id.model.parameters)
      std::printf("      %s %.6g +- %.2g\n", name.c_str(), e.value, e.sd);
    std::printf("      truth: k1 %.6g k2 %.6g c %.6g e %.6g phase %.4g\n", truth.k1, truth.k2, truth.c, truth.e,
                truth.phase);
    if (!id.evidence.held_out.reason.empty()) std::printf("      held out: %s\n", id.evidence.held_out.reason.c_str());
  }
  if (!id.usable()) return;
  ++row.usable;
  row.chi_square.push_back(id.summary.chi_square);
  if (!id.evidence.held_out.scores.empty()) {
    double worst = 0;
    for (const auto& s : id.evidence.held_out.scores) worst = std::max(worst, s.rmse / s.noise);
    row.held.push_back(worst);
  }
  const std::pair<const char*, double> names[] = {
      {"k1", truth.k1}, {"c", truth.c}, {"k2", truth.k2}, {"e", truth.e}, {"e_phase", truth.phase}};
  for (std::size_t k = 0; k < 5; ++k) {
    const Estimate& e = *id.model.parameter(names[k].first);
    const double off = k == 4 ? std::remainder(e.value - names[k].second, 2 * M_PI) : e.value - names[k].second;
    if (k < 4) row.error[k].push_back(100 * std::abs(off / names[k].second));
    row.inside[k] += e.value - off >= e.low && e.value - off <= e.high;
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int rotors = argc > 1 ? std::atoi(argv[1]) : 20;
  const auto first = static_cast<unsigned long long>(argc > 2 ? std::atoll(argv[2]) : 1);
  for (const Quantity quantity : {Quantity::acceleration, Quantity::velocity, Quantity::displacement}) {
    Row row;
    for (int k = 0; k < rotors; ++k) {
      const unsigned long long seed = first + static_cast<unsigned long long>(k);
      std::mt19937_64 random(seed);
      SensedRotor truth = drawn_rotor(quantity, random);
      add(truth, seed, argc > 3, row);
    }
    std::printf("%s: %d rotors, usable %d, inside 95 %%: k1 %d, c %d, k2 %d, e %d, e_phase %d\n",
                std::string(to_string(quantity)).c_str(), row.records, row.usable, row.inside[0], row.inside[1],
                row.inside[2], row.inside[3], row.inside[4]);
    const char* names[] = {"k1", "c", "k2", "e"};
    for (std::size_t k = 0; k < 4; ++k)
      std::printf("  error of %-3s median %8.4f  95 %% %8.4f %%\n", names[k], at(row.error[k], 0.5),
                  at(row.error[k], 0.95));
    std::printf(
        "  chi-square median %.3f, largest %.3f; held out: error over noise median %.3f, largest %.3f (%zu); "
        "time median %.2f s, largest %.2f s\n",
        at(row.chi_square, 0.5), at(row.chi_square, 1), at(row.held, 0.5), at(row.held, 1), row.held.size(),
        at(row.seconds, 0.5), at(row.seconds, 1));
    std::fflush(stdout);
  }
  return 0;
}
