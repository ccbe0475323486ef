// Balancing of machines that do not repeat: `bench_diagnosis_repeatability [jobs] [seed]` prints coverage of the stated
// intervals, sound runs dropped and slips named by non-repeatability. Seeds of docs/validation.md: 71000 on; 3000 on
// served for choices.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>

#include "whirl/diagnosis/influence.hpp"
#include "whirl/testing/unrepeatable_jobs.hpp"

namespace {

using namespace whirl;
using Eigen::Index;

struct Score {
  int jobs = 0, inside = 0, all = 0, masses = 0, angles = 0, planes = 0, sound = 0, dropped = 0, jobs_dropped = 0;
  int wrong = 0, untold = 0, named = 0, slip = 0, unknown = 0, failed = 0;
  int reversed = 0, mirrored = 0;  ///< jobs whose angles are called reversed; of the same jobs with all angles reversed
  std::vector<double> width;       ///< of the mass interval over the mass
};

testing::UnrepeatableJobOptions options_of(unsigned seed, double unrepeatable, bool slip) {
  std::mt19937 random(seed * 7919 + 13);
  testing::UnrepeatableJobOptions o;
  o.planes = 1 + static_cast<int>(random() % 2);
  if (std::getenv("PLANES")) o.planes = std::atoi(std::getenv("PLANES"));
  o.probes = 1 + static_cast<int>(random() % 4);
  o.runs = o.planes + 3 + static_cast<int>(random() % 5);
  o.unrepeatable = unrepeatable;
  o.drift = random() % 3 == 0 ? 0.05 : 0;
  o.slip = slip;
  return o;
}

bool within(const Estimate& e, double angle) {
  const double off = std::remainder(angle - e.value, 2 * std::numbers::pi);
  return e.value + off >= e.low && e.value + off <= e.high;
}

void add(Score& s, const testing::UnrepeatableJob& j) {
  ++s.jobs;
  diagnosis::InfluenceFit fit;
  try {
    fit = diagnosis::fit_influence(j.job);
  } catch (const std::exception& e) {
    ++s.failed;
    return;
  }
  diagnosis::CorrectionProblem found{fit.influence, fit.baseline, {}, {}}, truth{j.influence, j.vibration, {}, {}};
  const Eigen::VectorXcd w = diagnosis::solve_correction(found, diagnosis::Criterion::least_squares).masses,
                         best = diagnosis::solve_correction(truth, diagnosis::Criterion::least_squares).masses;
  const diagnosis::CorrectionUncertainty u = diagnosis::correction_uncertainty(fit, found, w);
  s.reversed += fit.angles_reversed;
  diagnosis::BalancingJob mirror = j.job;
  for (diagnosis::BalancingRun& run : mirror.runs) run.masses = run.masses.conjugate().eval();
  s.mirrored += diagnosis::fit_influence(mirror).angles_reversed;
  bool any = false;
  for (const diagnosis::Contradiction& c : fit.contradictions) {
    any = any || (c.run != j.wrong && c.left_out);
    s.dropped += c.run != j.wrong && c.left_out;
  }
  const bool undecided = fit.summary.find(FindingCode::runs_undecided) != nullptr;
  s.sound += static_cast<int>(j.job.runs.size()) - (j.wrong >= 0);
  s.jobs_dropped += any;
  if (j.wrong >= 0 && !j.visible) {
    ++s.untold;
  } else if (j.wrong >= 0) {
    ++s.wrong;
    bool named = false;
    for (const auto& c : fit.contradictions)
      if (c.run == j.wrong || std::count(c.or_run.begin(), c.or_run.end(), j.wrong) > 0)
        named = true, s.slip += c.run == j.wrong && c.slip.find(j.slip) != std::string::npos;
    s.named += named;
    if (!named && std::getenv("SHOW")) {
      fmt::print("  missed: {} runs {} planes {} rows, run {} '{}' size {:.2f}, found:", j.job.runs.size(),
                 j.job.planes.size(), j.job.rows.size(), j.wrong + 1, j.slip, j.slip_size);
      for (const auto& c : fit.contradictions)
        fmt::print(" run {} {} ({} others) chance {:.2g}", c.run + 1, c.slip, c.or_run.size(), c.chance);
      fmt::print("\n");
    }
  }
  if (std::isnan(u.quantile) || undecided) {
    ++s.unknown;
    return;
  }
  for (Index p = 0; p < w.size(); ++p) {
    s.inside += u.real(p, w).covers(best[p].real()) + u.imag(p, w).covers(best[p].imag());
    s.all += 2;
    const Estimate mass = u.magnitude(p, w);
    s.masses += mass.covers(std::abs(best[p]));
    s.angles += within(u.angle(p, w), std::arg(best[p]));
    ++s.planes;
    s.width.push_back((mass.high - mass.low) / std::abs(best[p]));
  }
}

double percent(int part, int all) { return all > 0 ? 100.0 * part / all : 0; }

double median(std::vector<double> v) {
  if (v.empty()) return 0;
  std::nth_element(v.begin(), v.begin() + static_cast<long>(v.size() / 2), v.end());
  return v[v.size() / 2];
}

void print(const std::string& name, const Score& s) {
  fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} | {:.2f} | {} of {} | {} | {} of {} | {} | {} | {} | {} | {} |\n",
             name, s.jobs, percent(s.inside, s.all), percent(s.masses, s.planes), percent(s.angles, s.planes),
             median(s.width), s.dropped, s.sound, s.jobs_dropped, s.named, s.wrong, s.slip, s.untold,
             s.unknown + s.failed, s.reversed, s.mirrored);
}

}  // namespace

int main(int argc, char** argv) {
  const int jobs = argc > 1 ? std::atoi(argv[1]) : 200;
  const auto seed = static_cast<unsigned>(argc > 2 ? std::atoi(argv[2]) : 71000);
  fmt::print(
      "| non-repeatability | jobs | re, im % | mass % | angle % | width / mass | sound runs dropped | jobs with one | "
      "slips named | with its cause | slips nobody can see | no interval | called reversed | of the reversed jobs "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (const bool slip : {false, true}) {
    Score all;
    for (const double unrepeatable : {0.0, 0.02, 0.1, 0.2, 0.3, 0.5}) {
      if (slip && unrepeatable > 0.02) continue;
      Score s;
      for (int k = 0; k < jobs; ++k) {
        const auto own =
            seed + static_cast<unsigned>(k) + (slip ? 100000u : 0u) + static_cast<unsigned>(unrepeatable * 1e7);
        const testing::UnrepeatableJob j = testing::unrepeatable_job(options_of(own, unrepeatable, slip), own);
        add(s, j);
        add(all, j);
      }
      print(fmt::format("{:.0f} %{}", 100 * unrepeatable, slip ? ", one slip" : ""), s);
    }
    print(slip ? "all with a slip" : "all without", all);
  }
}
