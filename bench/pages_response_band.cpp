// The true radius of random rotors with forces beyond the plain one, identified from a run-down, in the 95 % band of
// `whirl response`: bench_pages_response_band MACHINES FIRST_SEED SNR_DB prints a row a kind.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "whirl/testing/systems/response_coverage.hpp"

int main(int argc, char** argv) {
  using namespace whirl::testing;
  const int machines = argc > 1 ? std::atoi(argv[1]) : 10;
  const auto first = static_cast<unsigned long long>(argc > 2 ? std::atoll(argv[2]) : 20000);
  const double snr = argc > 3 ? std::atof(argv[3]) : 20;
  fmt::print("| rotor | machines | points in the band | width / radius, median |\n| --- | --- | --- | --- |\n");
  int points = 0, inside = 0;
  for (std::size_t k = 0; k < kBandKinds.size(); ++k) {
    BandCoverage c;
    for (int m = 0; m < machines; ++m)
      cover_response(kBandKinds[k], first + 1000 * k + static_cast<unsigned long long>(m), snr, c);
    std::sort(c.widths.begin(), c.widths.end());
    fmt::print("| {} | {}{} | {} of {} ({:.1f} %) | {:.1f} % |\n", to_string(kBandKinds[k]), c.machines,
               c.refused + c.without > 0 ? fmt::format(" ({} refused, {} without a band)", c.refused, c.without) : "",
               c.inside, c.points, 100.0 * c.inside / std::max(1, c.points),
               c.widths.empty() ? 0 : 100 * c.widths[c.widths.size() / 2]);
    std::fflush(stdout);
    points += c.points;
    inside += c.inside;
  }
  fmt::print("| all | {} | {} of {} ({:.1f} %) | |\n", machines * static_cast<int>(kBandKinds.size()), inside, points,
             100.0 * inside / std::max(1, points));
}
