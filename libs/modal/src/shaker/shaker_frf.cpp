#include "whirl/modal/shaker_frf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "ambient/usable_record.hpp"
#include "blows/frf_channels.hpp"
#include "local_polynomial.hpp"
#include "period.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMostLines = 8192;
constexpr Index kPooled = 3;        // steps on either side whose noise is taken together
constexpr double kWithPower = 0.7;  // share of the lines of the band

std::vector<std::string> force_names(const Recording& recording, const ShakerOptions& options) {
  if (!options.base.empty()) {
    (void)kind_of(recording.at(options.base));
    return {options.base};
  }
  std::vector<std::string> names = options.forces;
  if (names.empty()) {
    for (const Channel& channel : recording.channels)
      if (channel.quantity == Quantity::force) names.push_back(channel.name);
  }
  if (names.empty())
    throw Error(
        fmt::format("{}: no channel of quantity force; where a motion is the input (transmissibility): --base "
                    "CHANNEL",
                    recording.source));
  for (const std::string& name : names) force_named(recording, name);
  return names;
}

/// Values of every step of the frequency axis, before the band is cut.
struct Steps {
  double first = 0, width = 0;        // Hz
  std::vector<MatrixXcd> value;       // per step: forces x responses; empty where none
  std::vector<MatrixXd> leverage;     // the same: variance for noise of unit power
  MatrixXd left, power, force_power;  // steps x responses, responses, forces
  VectorXd freedom, lines;
  std::string made;  // how, for the user

  explicit Steps(Index steps, Index forces, Index responses)
      : value(static_cast<std::size_t>(steps)),
        leverage(value.size()),
        left(MatrixXd::Zero(steps, responses)),
        power(left),
        force_power(MatrixXd::Zero(steps, forces)),
        freedom(VectorXd::Zero(steps)),
        lines(freedom) {}
};

/// Spectra without the mean; noise has one power per line whatever the length.
MatrixXcd spectra_of(const Recording& record, const std::vector<std::string>& names, Index first, Index count) {
  MatrixXcd spectra(count / 2 + 1, static_cast<Index>(names.size()));
  for (std::size_t c = 0; c < names.size(); ++c) {
    const auto part = record[names[c]].segment(first, count);
    spectra.col(static_cast<Index>(c)) =
        signal::real_fft(part.array() - part.mean()) / std::sqrt(static_cast<double>(count));
  }
  return spectra;
}

/// Steps of `width` over the lines of the records. `hidden`: share of the steps with power in which a force looks like
/// a transient: that of a sweep is as short there as the beginning or the end of the record.
Steps steps_of(const std::vector<LineSpectra>& spectra, double width, Index steps, double band_drop_db,
               double& hidden) {
  constexpr double kExcited = 0.2;
  const Index nu = spectra.front().forces.cols();
  Steps result(steps, nu, spectra.front().responses.cols());
  result.first = result.width = width;
  result.made = "local polynomials";
  MatrixXd given(steps, nu);
  for (Index j = 0; j < steps; ++j) {
    LocalEstimate step = local_polynomial(spectra, width * static_cast<double>(j + 1), width);
    result.lines[j] = step.lines;
    given.row(j) = step.given_power.transpose();
    result.force_power.row(j) = step.force_power.transpose();
    if (!step.solved) continue;
    result.value[static_cast<std::size_t>(j)] = std::move(step.value);
    result.leverage[static_cast<std::size_t>(j)] = std::move(step.leverage);
    result.left.row(j) = step.left.transpose();
    result.power.row(j) = step.power.transpose();
    result.freedom[j] = step.freedom;
  }
  const double drop = band_drop_db > 0 ? std::pow(10, -band_drop_db / 10) : 0;
  const Eigen::ArrayXXd limit = (drop * given.colwise().maxCoeff()).replicate(steps, 1);
  const Eigen::ArrayXX<bool> excited = given.array() > limit;
  const auto unseen = (excited && result.force_power.array() < kExcited * given.array()).count();
  hidden = static_cast<double>(unseen) / static_cast<double>(std::max<Index>(1, excited.count()));
  return result;
}

/// Lines of the records: the finest steps that leave something for the noise, and wider ones where these hide too much
/// of a force.
Steps local_steps(const std::vector<Recording>& records, const std::vector<std::string>& forces,
                  const std::vector<std::string>& responses, const ShakerOptions& options) {
  std::vector<LineSpectra> spectra;
  double time = 0;
  for (const Recording& record : records) {
    spectra.push_back({1 / record.duration(), spectra_of(record, forces, 0, record.size()),
                       spectra_of(record, responses, 0, record.size())});
    time += record.duration();
  }
  const double dt = records.front().dt,
               finest = static_cast<double>(least_lines(static_cast<Index>(forces.size()), records.size())) / time;
  double width = options.resolution > 0 ? options.resolution : std::max(finest, 0.5 / dt / kMostLines);
  if (options.resolution > 0 && width < finest)
    throw Error::in_field("resolution", fmt::format("{:g} Hz", options.resolution),
                          fmt::format("0 (automatic) or {:.3g} Hz at least with {:.4g} s of records", finest, time));
  constexpr double kHidden = 0.02, kWidest = 8;
  for (double wider = 1;; wider *= 2) {
    const auto steps = static_cast<Index>(0.5 / dt / (wider * width) - 0.5);
    if (steps < 16)
      throw Error(fmt::format("{:.3g} s of records give {} frequency lines: too short, must give 16 at least", time,
                              std::max<Index>(0, steps)));
    double hidden = 0;
    Steps result = steps_of(spectra, wider * width, steps, options.band_drop_db, hidden);
    if (hidden < kHidden || options.resolution > 0 || wider >= kWidest || steps < 32) return result;
  }
}

/// Harmonics of a force of `period` samples.
Steps periodic_steps(const std::vector<Recording>& records, const std::string& force,
                     const std::vector<std::string>& responses, Index period) {
  const auto ny = static_cast<Index>(responses.size());
  Steps result((period - 1) / 2, 1, ny);
  result.first = result.width = 1 / (records.front().dt * static_cast<double>(period));
  Index all = 0;
  std::vector<double> information(result.value.size(), 0);
  for (const Recording& record : records) {
    const Index periods = record.size() / period, samples = periods * period;
    if (periods < 2) continue;
    all += periods;
    // From the end: what the structure does before it is steady belongs to the part that is left.
    const MatrixXcd f = spectra_of(record, {force}, record.size() - samples, samples);
    const MatrixXcd y = spectra_of(record, responses, record.size() - samples, samples);
    for (Index j = 0; j < result.freedom.size(); ++j) {
      const Index k = (j + 1) * periods;
      const TransientEstimate transient = transient_at(y, k, periods);
      const double power = std::norm(f(k, 0));
      result.force_power(j, 0) += power;
      result.lines[j] += 1;
      if (transient.freedom < 1 || !(power > 0)) continue;
      MatrixXcd& value = result.value[static_cast<std::size_t>(j)];
      if (value.size() == 0) value = MatrixXcd::Zero(1, ny);
      const double weight = power / (1 + transient.leverage);
      value += weight * ((y.row(k) - transient.value.transpose()) / f(k, 0));
      information[static_cast<std::size_t>(j)] += weight;
      result.left.row(j) += transient.left.transpose();
      result.power.row(j) += y.row(k).cwiseAbs2();
      result.freedom[j] += transient.freedom;
    }
  }
  for (std::size_t j = 0; j < result.value.size(); ++j) {
    if (!(information[j] > 0)) continue;
    result.value[j] /= information[j];
    result.leverage[j] = MatrixXd::Constant(1, ny, 1 / information[j]);
  }
  result.made = fmt::format("{} periods of {:.4g} s", all, records.front().dt * static_cast<double>(period));
  return result;
}

/// First and last step where every force has power. Throws where most steps between have none.
std::pair<Index, Index> band_of(const Steps& steps, double drop_db) {
  const Index n = steps.lines.size();
  Eigen::ArrayX<bool> excited = Eigen::ArrayX<bool>::Constant(n, true);
  for (Index i = 0; i < steps.force_power.cols(); ++i) {
    const VectorXd power = steps.force_power.col(i).cwiseQuotient(steps.lines.cwiseMax(1));
    const double limit = drop_db > 0 ? power.maxCoeff() * std::pow(10, -drop_db / 10) : 0;
    excited = excited && power.array() > limit;
  }
  Index first = 0, last = n - 1;
  while (first < n && !excited[first]) ++first;
  while (last > first && !excited[last]) --last;
  const Index count = last - first + 1;
  const auto with_power = first < n ? excited.segment(first, count).count() : 0;
  const auto at = [&](Index line) { return steps.first + steps.width * static_cast<double>(line); };
  if (count < 16 || static_cast<double>(with_power) < kWithPower * static_cast<double>(count))
    throw Error(
        fmt::format("the force has power on {} of the {} frequency lines from {:.4g} to {:.4g} Hz: must have on "
                    "most of 16 or more (random, burst, sweep or periodic random, no sine)",
                    with_power, std::max<Index>(0, count), at(std::min(first, n - 1)), at(last)));
  Index solved = 0;
  for (Index j = first; j <= last; ++j) solved += steps.value[static_cast<std::size_t>(j)].size() > 0;
  if (static_cast<double>(solved) < kWithPower * static_cast<double>(count))
    throw Error(fmt::format("the forces cannot be separated on {} of {} frequency lines: they must not be one signal",
                            count - solved, count));
  return {first, last};
}

/// Values, coherence and variance of the band into the channels, which are ordered by force, then response.
void fill_channels(const Steps& steps, Index first, Index last, FrequencyResponse& result) {
  const Index lines = last - first + 1, ny = steps.left.cols();
  result.frequency =
      (VectorXd::LinSpaced(lines, static_cast<double>(first), static_cast<double>(last)) * steps.width).array() +
      steps.first;
  for (std::size_t c = 0; c < result.channels.size(); ++c) {
    const Index force = static_cast<Index>(c) / ny, response = static_cast<Index>(c) % ny;
    FrfChannel& channel = result.channels[c];
    channel.value = Eigen::VectorXcd::Zero(lines);
    channel.coherence = VectorXd::Zero(lines);
    channel.variance = VectorXd::Zero(lines);
    double worst = 0, unexplained = 0, all = 0;
    for (Index j = 0; j < lines; ++j) {
      const Index at = first + j, low = std::max(first, at - kPooled), high = std::min(last, at + kPooled);
      const double noise = steps.left.col(response).segment(low, high - low + 1).sum() /
                           std::max(1.0, steps.freedom.segment(low, high - low + 1).sum());
      const MatrixXcd& value = steps.value[static_cast<std::size_t>(at)];
      if (value.size() == 0) continue;
      channel.value[j] = value(force, response);
      channel.variance[j] =
          0.5 * noise *
          steps.leverage[static_cast<std::size_t>(at)](force, response);  // of the modulus: half of the complex one
      worst = std::max(worst, channel.variance[j]);
      const double power = steps.power(at, response) / steps.lines[at];
      unexplained += noise;
      all += power;
      channel.coherence[j] = power > 0 ? std::clamp(1 - noise / power, 0.0, 1.0) : 0;
    }
    constexpr double kMuch = 0.2;
    if (force == 0 && unexplained > kMuch * all)
      result.summary.warn(
          fmt::format("response '{}': the forces do not explain {:.0f} % of its power: noise, play, "
                      "another source of motion, or a force that is not measured",
                      channel.response, 100 * std::min(1.0, unexplained / all)));
    const double unknown = std::max(worst, channel.value.cwiseAbs2().maxCoeff());
    for (Index j = 0; j < lines; ++j)
      if (steps.value[static_cast<std::size_t>(first + j)].size() == 0) channel.variance[j] = unknown;
  }
}

bool acts_all_the_time(const Recording& recording, const std::vector<std::string>& forces) {
  constexpr double kQuiet = 0.05, kBusy = 0.08;
  for (const Channel& channel : recording.channels) {
    if (forces.empty() ? channel.quantity != Quantity::force : channel.name != forces.front()) continue;
    VectorXd sorted = channel.samples;
    if (sorted.size() == 0 || !sorted.allFinite()) continue;
    std::nth_element(sorted.begin(), sorted.begin() + sorted.size() / 2, sorted.end());
    const Eigen::ArrayXd height = (channel.samples.array() - sorted[sorted.size() / 2]).abs();
    const auto above = (height > kQuiet * height.maxCoeff()).count();
    if (static_cast<double>(above) > kBusy * static_cast<double>(height.size())) return true;
  }
  return false;
}

void leave_out_dead(std::vector<Recording>& records, Summary& summary) {
  std::vector<std::string> dead;
  for (const Channel& channel : records.front().channels) {
    const bool moves = std::any_of(records.begin(), records.end(), [&](const Recording& record) {
      const Channel* same = record.find(channel.name);
      return same == nullptr || same->samples.maxCoeff() > same->samples.minCoeff();
    });
    if (!moves) dead.push_back(channel.name);
  }
  for (const std::string& name : dead) {
    summary.warn(fmt::format("response '{}' never changes: left out", name));
    for (Recording& record : records) std::erase_if(record.channels, [&](const Channel& c) { return c.name == name; });
  }
}

}  // namespace

bool excited_by_shakers(const std::vector<Recording>& recordings, const std::vector<std::string>& forces) {
  if (recordings.empty() || forces.size() > 1) return forces.size() > 1;
  for (const std::string& force : forces) force_named(recordings.front(), force);
  const bool first = acts_all_the_time(recordings.front(), forces);
  for (const Recording& recording : recordings) {
    if (acts_all_the_time(recording, forces) != first)
      throw Error(fmt::format("{}: {}, unlike {}: say whether it is a hammer or a shaker, or take the records apart",
                              recording.source, first ? "impacts" : "a force that acts all the time",
                              recordings.front().source));
  }
  return first;
}

FrequencyResponse estimate_shaker_frf(const std::vector<Recording>& recordings, const ShakerOptions& options) {
  require_range("resolution", options.resolution, 0, 1e6, "Hz");
  require_range("band_drop_db", options.band_drop_db, 0, 200, "dB");
  if (recordings.empty()) throw Error("no record");
  const std::vector<std::string> forces = force_names(recordings.front(), options);
  if (forces.size() > 1 && !options.reference.empty())
    throw Error::in_field("reference", options.reference,
                          "empty where several forces act: they are called by their channels");
  FrequencyResponse result;
  result.leakage_free = true;
  std::vector<Recording> records;
  for (const Recording& recording : recordings) {
    recording.check();
    if (std::abs(recording.dt - recordings.front().dt) > 1e-9 * recording.dt)
      throw Error(fmt::format("{}: sample time {:g} s: must be {:g} s as in the first recording", recording.source,
                              recording.dt, recordings.front().dt));
    records.push_back(usable_record(recording, result.summary, false));
    if (result.summary.status == Status::unusable) throw Error(recording.source + ": " + result.summary.reason);
    for (const std::string& force : forces) {
      const VectorXd& f = records.back().at(force).samples;
      if (!(f.maxCoeff() > f.minCoeff()))
        throw Error(
            fmt::format("{}: {} '{}' never changes", recording.source, options.base.empty() ? "force" : "base", force));
    }
  }
  leave_out_dead(records, result.summary);
  name_channels(records.front(), forces,
                options.reference.empty() ? forces : std::vector<std::string>{options.reference}, result);
  if (!options.base.empty()) {
    const Channel& base = records.front().at(options.base);
    if (result.kind != kind_of(base))
      throw Error(fmt::format("{}: base '{}' is a {}: the responses must be of its quantity", records.front().source,
                              base.name, to_string(base.quantity)));
    // 1 + s^2 / (s^2 + ...) whatever the quantity: an accelerance, whose lower residual is the 1.
    result.kind = FrfKind::accelerance;
  }
  std::vector<std::string> responses;
  for (std::size_t c = 0; c < result.channels.size() / forces.size(); ++c)
    responses.push_back(result.channels[c].response);
  Index period = forces.size() == 1 && options.resolution == 0 ? period_of(records.front()[forces.front()]) : 0;
  for (const Recording& record : records)
    if (period > 0 && period_of(record[forces.front()]) != period) period = 0;
  const Steps steps = period > 0 ? periodic_steps(records, forces.front(), responses, period)
                                 : local_steps(records, forces, responses, options);
  const auto [first, last] = band_of(steps, options.band_drop_db);
  fill_channels(steps, first, last, result);
  const Index lines = result.frequency.size();
  result.summary.trust =
      fmt::format("{} force{} that act{} all the time, {}, {:.4g} to {:.4g} Hz in steps of {:.4g} Hz", forces.size(),
                  forces.size() == 1 ? "" : "s", forces.size() == 1 ? "s" : "", steps.made, result.frequency[0],
                  result.frequency[lines - 1], steps.width);
  if (!options.base.empty())
    result.summary.trust = fmt::format(
        "transmissibility, motion over that of '{}', {}, {:.4g} to {:.4g} Hz in steps of {:.4g} Hz; its modes are "
        "those "
        "with that point held, their modal masses mean nothing",
        options.base, steps.made, result.frequency[0], result.frequency[lines - 1], steps.width);
  result.provenance.version = version();
  for (const Recording& record : recordings) result.provenance.inputs.push_back(record.source);
  result.provenance.options =
      fmt::format("resolution {:g} band_drop_db {:g}", options.resolution, options.band_drop_db);
  return result;
}

}  // namespace whirl::modal
