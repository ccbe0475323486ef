#include "whirl/shaft/centrifuge/load_check.hpp"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "centrifuge/load_posterior.hpp"
#include "fit/fit_problem.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/fit/fit.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::VectorXd;

namespace {

constexpr Index kLeastBlocks = 8;
// Normal quantiles of kWrongProbability and of a record in which 95 of 100 are found.
constexpr double kWrongQuantile = 2.326, kFoundQuantile = 1.645;
constexpr double kHighestCritical = 1e4;  // rad/s, of those looked for

double normal_below(double z) { return 0.5 * std::erfc(-z / std::sqrt(2.0)); }

/// The blocks before the speed first passes `highest`.
LoadRecord blocks_below(const OrderRun& run, double highest) {
  Index blocks = 0;
  while (blocks < run.blocks() && run.speed[blocks] <= highest) ++blocks;
  if (blocks < kLeastBlocks)
    throw Error::in_field("run " + run.name,
                          fmt::format("{} blocks of whole turns up to {:.0f} rpm", blocks, highest * kRpmPerRadPerSec),
                          fmt::format("{} and more: spin up slower, or hold a speed below it", kLeastBlocks));
  LoadRecord record;
  record.vectors = run.vectors.leftCols(blocks);
  record.weights.resize(run.vectors.rows(), blocks);
  OrderRun kept = run;
  kept.speed = run.speed.head(blocks);
  kept.samples = run.samples.head(blocks);
  kept.vectors = record.vectors;
  const VectorXd sd = scatter(kept);
  const Index step = static_cast<Index>(run.turns) * kGridPerTurn;
  const auto middle = [&](Index b) { return 0.5 * (run.time[b * step] + run.time[(b + 1) * step]); };
  for (Index b = 0; b < blocks; ++b) {
    record.speeds.push_back(run.speed[b]);
    const Index from = std::max<Index>(0, b - 1), to = std::min(blocks - 1, b + 1);
    record.rates.push_back((run.speed[to] - run.speed[from]) / (middle(to) - middle(from)));
    record.weights.col(b) = std::sqrt(0.5 * run.samples[b]) * sd.cwiseInverse();
  }
  return record;
}

/// Buckets nearest to the heavy side, and what two of them weigh too much.
void name_buckets(const CentrifugeSetup& setup, const LoadSamples& s, LoadCheck& check) {
  const int n = setup.buckets;
  const double apart = kTwoPi / n;
  VectorXd share = VectorXd::Zero(n);
  for (Index k = 0; k < s.values.size(); ++k) {
    const long nearest = std::lround((std::arg(s.values[k]) - setup.first_bucket) / apart);
    share[(nearest % n + n) % n] += s.weights[k];
  }
  Index best = 0;
  const double most = share.maxCoeff(&best);
  const Index left = (best + n - 1) % n, right = (best + 1) % n, next = share[left] > share[right] ? left : right;
  const auto number = [](Index k) { return static_cast<int>(k) + 1; };
  if (most >= kNameProbability)
    check.named = {number(best)};
  else if (most + share[next] >= kNameProbability)
    check.named = {number(best), number(next)};
  // The two beside the heavy side; with two buckets their line alone.
  const double place = (check.angle.value - setup.first_bucket) / apart;
  const long below = n == 2 ? std::lround(place) : static_cast<long>(std::floor(place));
  const auto direction = [&](long k) { return std::polar(1.0, setup.first_bucket + apart * static_cast<double>(k)); };
  Eigen::Matrix2d both;
  const std::complex<double> one = direction(below),
                             other = n == 2 ? one * std::complex<double>(0, 1) : direction(below + 1);
  both << one.real(), other.real(), one.imag(), other.imag();
  const Eigen::Matrix2d inverse = both.inverse();
  for (int side = 0; side < (n == 2 ? 1 : 2); ++side) {
    const VectorXd mass = (inverse(side, 0) * s.values.real() + inverse(side, 1) * s.values.imag()) / setup.radius;
    check.changes.push_back({static_cast<int>(((below + side) % n + n) % n) + 1, shortest_interval(mass, s.weights)});
  }
}

/// What records like this one find, and how much longer it would take.
void set_rates(const CentrifugeSetup& setup, const LoadRecord& record, const LoadSamples& s, LoadCheck& check) {
  const double noise = s.noise_sd / setup.radius, allowed = setup.allowed;
  const auto sd = [&](double size) { return std::hypot(noise, s.tolerance_sd * size); };
  // The size at which size = allowed + quantiles * sd(size).
  constexpr double kQuantiles = kWrongQuantile + kFoundQuantile;
  const double left = 1 - std::pow(kQuantiles * s.tolerance_sd, 2), reach = kQuantiles * noise;
  check.smallest_found =
      left > 0 ? (allowed + std::sqrt(allowed * allowed - left * (allowed * allowed - reach * reach))) / left
               : std::numeric_limits<double>::infinity();
  check.miss_rate = normal_below(kWrongQuantile - allowed / sd(2 * allowed));
  if (check.verdict != LoadVerdict::open) return;
  const double size = check.imbalance.value;
  const double needed = std::abs(size - allowed) / kWrongQuantile, fixed = s.tolerance_sd * size;
  check.seconds_more = std::numeric_limits<double>::infinity();
  if (needed <= fixed) return;
  // Information of a second at the last speed.
  const double duration = kTwoPi / record.speeds.back();
  double per_block = 0;
  for (Index k = 0; k < s.last_readings.size(); ++k)
    per_block += std::norm(s.last_readings[k] * record.weights(k, record.weights.cols() - 1));
  const double turns =
      std::max(1.0, std::round(check.seconds / (duration * static_cast<double>(record.speeds.size()))));
  const double per_second = per_block / (s.misfit * duration * turns) * setup.radius * setup.radius;
  check.seconds_more = std::max(0.0, (1 / (needed * needed - fixed * fixed) - 1 / (noise * noise)) / per_second);
}

/// Chi-square of the residual against its differences from block to block. Residuals of less than a hundredth of the
/// readings contradict nothing: the machines drawn are no closer to each other, and they move the imbalance by less.
void set_load_misfit(const LoadRecord& record, const LoadSamples& s, LoadCheck& check) {
  constexpr double kApart = 0.01;
  const Index blocks = s.residuals.cols();
  const double differences = (s.residuals.rightCols(blocks - 1) - s.residuals.leftCols(blocks - 1)).squaredNorm();
  const auto pairs = static_cast<double>(s.residuals.rows() * (blocks - 1));
  check.chi_square = s.misfit / (differences / (4 * pairs));
  check.misfit_deviations = (check.chi_square - 1) * std::sqrt(2 * pairs);
  check.summary.chi_square = check.chi_square;
  check.summary.trust = "Its imbalance may be used within its interval, for this loading.";
  const double readings = record.weights.cwiseProduct(record.vectors.cwiseAbs()).squaredNorm();
  if (check.misfit_deviations <= kMisfitLimit || s.residuals.squaredNorm() < kApart * kApart * readings) return;
  check.summary.add({FindingCode::model_error,
                     Consequence::unusable,
                     {{"chi_square", check.chi_square}, {"deviations", check.misfit_deviations}}},
                    ": the readings do not grow with speed as those of an imbalance on this machine");
  check.summary.trust = "Do not trust this check: the record contradicts the rotor file.";
}

}  // namespace

std::string_view to_string(LoadVerdict verdict) {
  return verdict == LoadVerdict::right ? "right" : verdict == LoadVerdict::wrong ? "wrong" : "open";
}

LoadCheck check_load(const Rotor& rotor, const CentrifugeSetup& setup, const OrderRun& run,
                     const std::vector<CentrifugeSensor>& sensors, const LoadCheckOptions& options) {
  require_range("draws", options.draws, 10, 1000000);
  if (run.vectors.rows() != static_cast<Index>(sensors.size()))
    throw Error::in_field("run " + run.name, fmt::format("{} channels", run.vectors.rows()),
                          fmt::format("one of each sensor, {}", sensors.size()));
  const CentrifugeModel model(rotor, setup, sensors);
  LoadCheck check;
  const std::vector<double> criticals = model.forward_criticals(kHighestCritical);
  if (criticals.empty()) throw Error("the rotor has no forward critical speed below 95000 rpm");
  check.first_critical = criticals.front();
  const LoadRecord record = blocks_below(run, options.highest > 0 ? options.highest : 0.5 * check.first_critical);
  check.decided_at = *std::ranges::max_element(record.speeds);
  const auto blocks = static_cast<Index>(record.speeds.size());
  check.seconds = run.time[blocks * run.turns * kGridPerTurn] - run.time[0];
  const LoadSamples samples = sample_load(model, setup, record, options.draws, options.seed);
  const VectorXd size = samples.values.cwiseAbs() / setup.radius;
  check.imbalance = shortest_interval(size, samples.weights);
  check.angle = shortest_arc(samples.values, samples.weights);
  for (Index k = 0; k < size.size(); ++k)
    if (size[k] > setup.allowed) check.wrong_probability += samples.weights[k];
  check.verdict = check.wrong_probability >= kWrongProbability       ? LoadVerdict::wrong
                  : 1 - check.wrong_probability >= kRightProbability ? LoadVerdict::right
                                                                     : LoadVerdict::open;
  name_buckets(setup, samples, check);
  set_rates(setup, record, samples, check);
  set_load_misfit(record, samples, check);
  return check;
}

}  // namespace whirl::shaft
