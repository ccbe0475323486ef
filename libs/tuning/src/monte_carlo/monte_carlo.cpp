#include "whirl/tuning/monte_carlo.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>

#include "monte_carlo/machine_lanes.hpp"
#include "monte_carlo/monte_carlo_checkpoint.hpp"
#include "monte_carlo/monte_carlo_draw.hpp"
#include "runs/design_scenarios.hpp"
#include "whirl/core/distributions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/parallel.hpp"

namespace whirl::tuning {
namespace {

/// The samples `indices`, at most Lanes of them.
template <int Lanes>
std::vector<MonteCarloSample> run_lanes(const ControllerDesign& design, const RigDraw& draw,
                                        const std::vector<int>& indices,
                                        const std::shared_ptr<const rig::RigTables>& like) {
  const MachineLanes<Lanes> machines(draw, indices, like);
  std::vector<MonteCarloSample> out;
  for (const LaneRun& run : machines.run(design)) {
    const RotorModel& rotor = machines.rigs()[out.size()].rotor;
    out.push_back({rotor, run.judged.open.all, run.judged.closed.all, run.judged.standstill_rms,
                   run.held && judge(run.judged).passed()});
  }
  return out;
}

}  // namespace

std::string to_string(CommonUnknown unknown) {
  switch (unknown) {
    case CommonUnknown::distribution:
      return "distribution of the tolerances";
    case CommonUnknown::runout:
      return "runout of all sensors";
    case CommonUnknown::ringing:
      return "ringing of the structure at the start";
  }
  return {};
}

Proportion proportion(long count, long n) {
  Proportion p{count, n};
  if (n <= 0) return p;
  const auto trials = static_cast<double>(n), successes = static_cast<double>(count);
  p.value = successes / trials;
  p.low = count == 0 ? 0 : proportion_lower_bound(trials, successes, 0.025);
  p.high = count == n ? 1 : proportion_upper_bound(trials, successes, 0.025);
  return p;
}

namespace {

/// The machines of `left`, lanes of them side by side, in the numbers of the checkpoint.
std::vector<double> run_groups(const ControllerDesign& trial, const RigDraw& draw, const std::vector<int>& left,
                               int lanes, int threads, const std::shared_ptr<const rig::RigTables>& like) {
  const auto width = static_cast<std::size_t>(lanes);
  const std::size_t groups = (left.size() + width - 1) / width;
  std::vector<std::vector<double>> numbers(groups);
  parallel_for(static_cast<int>(groups), threads, [&](int g) {
    const std::size_t from = width * static_cast<std::size_t>(g), to = std::min(left.size(), from + width);
    const std::vector<int> indices(left.begin() + static_cast<std::ptrdiff_t>(from),
                                   left.begin() + static_cast<std::ptrdiff_t>(to));
    const std::vector<MonteCarloSample> samples = lanes == 8    ? run_lanes<8>(trial, draw, indices, like)
                                                  : lanes == 16 ? run_lanes<16>(trial, draw, indices, like)
                                                                : run_lanes<32>(trial, draw, indices, like);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      append_numbers(numbers[static_cast<std::size_t>(g)], indices[i], samples[i]);
    }
  });
  std::vector<double> flat;
  for (const auto& group : numbers) flat.insert(flat.end(), group.begin(), group.end());
  return flat;
}

/// The interval of `exceeds` by what all machines may have in common.
void widen(MonteCarloResult& out, double limit) {
  double all = 0;
  for (int u = 0; u < kCommonUnknowns; ++u) {
    std::array<double, 2> count{}, exceeds{};
    for (std::size_t i = 0; i < out.samples.size(); ++i) {
      const std::size_t way = common_case(static_cast<CommonUnknown>(u), static_cast<int>(i)) ? 1 : 0;
      count[way] += 1;
      exceeds[way] += !out.samples[i].stable || out.samples[i].peak > limit;
    }
    if (count[0] == 0 || count[1] == 0) continue;
    const double p0 = exceeds[0] / count[0], p1 = exceeds[1] / count[1], half = 0.5 * (p1 - p0);
    const double scatter = 0.25 * (p0 * (1 - p0) / count[0] + p1 * (1 - p1) / count[1]);
    out.common[static_cast<std::size_t>(u)] = std::sqrt(std::max(half * half - scatter, 0.0));
    all += out.common[static_cast<std::size_t>(u)];
  }
  out.exceeds.low = std::max(out.exceeds.low - all, 0.0);
  out.exceeds.high = std::min(out.exceeds.high + all, 1.0);
}

/// The runout table of a design.
control::Runout removed_runout(const ControllerDesign& design) {
  control::Runout out;
  const auto take = [&](const char* name, std::array<double, control::Runout::kHarmonics>& to) {
    for (std::size_t k = 0; k < to.size(); ++k) {
      const auto at = design.parameters.find(fmt::format("{}_{}", name, k + 1));
      if (at != design.parameters.end()) to[k] = at->second;
    }
  };
  take("runout_x_cos", out.x_cos), take("runout_x_sin", out.x_sin);
  take("runout_y_cos", out.y_cos), take("runout_y_sin", out.y_sin);
  return out;
}

/// Quantiles and proportions over the samples.
void summarise(MonteCarloResult& out, const MonteCarloOptions& options) {
  std::vector<double> peaks;
  long stable = 0, exceeds = 0;
  for (const auto& s : out.samples) {
    peaks.push_back(s.peak);
    stable += s.stable;
    exceeds += !s.stable || s.peak > options.limit;
  }
  std::ranges::sort(peaks);
  const auto quantile = [&](double q) {
    return peaks[static_cast<std::size_t>(std::lround(q * static_cast<double>(peaks.size() - 1)))];
  };
  out.peak_median = quantile(0.5);
  out.peak_p95 = quantile(0.95);
  out.peak_p99 = quantile(0.99);
  out.peak_worst = peaks.back();
  out.stable = proportion(stable, options.samples);
  if (options.limit > 0) {
    out.exceeds = proportion(exceeds, options.samples);
    widen(out, options.limit);
  }
}

}  // namespace

MonteCarloResult monte_carlo(const ControllerDesign& design, const IdentifiedModel& model, const Hardware& hardware,
                             const MonteCarloOptions& options, const Ranks& ranks) {
  if (!model.rotor) throw Error("Monte Carlo: the model is no rotor");
  require_range("samples", options.samples, 1, 1e7);
  if (options.lanes != 8 && options.lanes != 16 && options.lanes != 32) {
    throw Error::in_field("lanes", fmt::format("{}", options.lanes), "8, 16 or 32");
  }
  RotorModel centre = *model.rotor;
  if (!(centre.gain > 0)) centre.gain = design.model.gain;
  if (!(centre.gain > 0)) throw Error("Monte Carlo: the input gain of the model is not known");
  // The rotors drawn rest at zero, their runout is another one.
  const ControllerDesign trial = on_scenario(design, {});
  const Hardware known = with_forces(hardware, model);
  const RigDraw draw(centre, model, options.other_machines ? known : tuning_hardware(design, known), options,
                     removed_runout(design));
  const auto like = rig::make_rig_tables(draw(0).rig);

  const auto n = static_cast<std::size_t>(options.samples);
  MonteCarloResult out;
  std::vector<double> done(n, 0);
  std::unique_ptr<MonteCarloCheckpoint> checkpoint;
  if (ranks.rank == 0) {
    out.samples.resize(n);
    if (!options.checkpoint.empty()) {
      checkpoint = std::make_unique<MonteCarloCheckpoint>(options.checkpoint, study_key(options, design), centre,
                                                          out.samples, done);
    }
  }
  if (ranks.size > 1) ranks.broadcast(done);
  std::vector<int> left;
  for (std::size_t i = 0; i < n; ++i) {
    if (done[i] == 0) left.push_back(static_cast<int>(i));
  }

  const int cores = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  const int threads = options.threads > 0 ? options.threads : std::max(1, cores / ranks.size);
  const auto lanes = static_cast<std::size_t>(options.lanes);
  const std::size_t mine = lanes * static_cast<std::size_t>(threads);
  const std::size_t round = mine * static_cast<std::size_t>(ranks.size);
  const auto report = [&](std::size_t finished) {
    if (options.progress) options.progress(static_cast<long>(n - left.size() + finished), options.samples);
  };
  if (ranks.rank == 0) report(0);
  for (std::size_t start = 0; start < left.size(); start += round) {
    const std::size_t first = std::min(left.size(), start + mine * static_cast<std::size_t>(ranks.rank));
    const std::size_t last = std::min(left.size(), first + mine);
    std::vector<double> flat = run_groups(
        trial, draw,
        {left.begin() + static_cast<std::ptrdiff_t>(first), left.begin() + static_cast<std::ptrdiff_t>(last)},
        options.lanes, threads, like);
    if (ranks.size > 1) flat = ranks.gather(flat);
    if (ranks.rank != 0) continue;
    for (std::size_t i = 0; i < flat.size(); i += kSampleNumbers) {
      out.samples[static_cast<std::size_t>(flat[i])] = sample_from(centre, &flat[i]);
    }
    if (checkpoint) checkpoint->append(flat);
    report(std::min(left.size(), start + round));
  }
  if (ranks.rank != 0) return out;

  summarise(out, options);
  return out;
}

}  // namespace whirl::tuning
