#include "whirl/modal/frf.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "blow.hpp"
#include "blow_agreement.hpp"
#include "blow_damage.hpp"
#include "cross_spectra.hpp"
#include "frf_channels.hpp"
#include "whirl/core/counted.hpp"
#include "whirl/core/error.hpp"
#include "whirl/signal/fft.hpp"
#include "whirl/signal/window.hpp"

namespace whirl::modal {
namespace {

const Channel& force_channel(const Recording& recording, const FrfOptions& options) {
  if (!options.force.empty()) return force_named(recording, options.force);
  const Channel* found = nullptr;
  for (const auto& channel : recording.channels) {
    if (channel.quantity != Quantity::force) continue;
    if (found != nullptr) {
      throw Error(fmt::format("{}: force channels '{}' and '{}': name the one of the hammer", recording.source,
                              found->name, channel.name));
    }
    found = &channel;
  }
  if (found == nullptr)
    throw Error(
        fmt::format("{}: no channel of quantity force; where a motion is the input (transmissibility): --base CHANNEL",
                    recording.source));
  return *found;
}

void check_options(const FrfOptions& options) {
  require_range("trigger", options.cut.trigger, 1e-3, 0.99);
  require_range("pre_trigger", options.cut.pre_trigger, 0, 1e3, "s");
  require_range("separation", options.cut.separation, 0, 1e6, "s");
  require_range("duration", options.cut.duration, 0, 1e6, "s");
  require_range("force_taper", options.window.taper, 0, 1e3, "s");
  require_range("window_end", options.window.end, 1e-12, 1);
  require_range("noise_ratio", options.noise_ratio, 0, INFINITY);
  require_range("band_drop_db", options.band_drop_db, 0, 200, "dB");
}

// A response that never moves gives an FRF of zeros, which no fit can use.
void drop_dead_responses(const std::vector<Recording>& blows, FrequencyResponse& result) {
  std::erase_if(result.channels, [&](const FrfChannel& channel) {
    const bool dead = std::all_of(blows.begin(), blows.end(), [&](const Recording& blow) {
      return blow[channel.response].maxCoeff() == blow[channel.response].minCoeff();
    });
    if (dead) result.summary.warn(fmt::format("response '{}' never changes: left out", channel.response));
    return dead;
  });
  if (result.channels.empty()) throw Error("every response is dead: none ever changes");
}

std::vector<std::string> names_of(const FrequencyResponse& result) {
  std::vector<std::string> names;
  for (const FrfChannel& channel : result.channels) names.push_back(channel.response);
  return names;
}

// Blows on several points have no common response: their average would be that of no point. Disagreement that noise
// may explain is left to the coherence.
void require_one_point(const std::vector<BlowSpectra>& blows, bool clean) {
  if (blows.size() < 3) return;
  const BlowGroups groups = groups_of(blows);
  if (2 * groups.largest > blows.size() || !(clean || groups.all_paired)) return;
  throw Error(fmt::format(
      "at most {} of {} impacts agree in every response: they are not those of one point and direction. Points of a "
      "roving test are estimated one by one: one `whirl frf` for each point, with --reference naming it, and `whirl "
      "modes` takes all files; --keep-odd-impacts averages them all the same",
      groups.largest, blows.size()));
}

// Whether the responses of every blow rise well above what they were before it.
bool well_above_noise(const std::vector<Recording>& blows, const std::vector<Pulse>& pulses,
                      const std::vector<std::string>& responses) {
  constexpr double kAbove = 10;  // rms: the correlation of two such blows of one point is above 0.98
  constexpr Eigen::Index kLeastQuiet = 8;
  for (std::size_t b = 0; b < blows.size(); ++b) {
    const Eigen::Index quiet = pulses[b].quiet;
    if (quiet < kLeastQuiet) return false;
    for (const std::string& name : responses) {
      const Eigen::VectorXd& x = blows[b][name];
      const double rest = x.head(quiet).mean();
      const auto rms = [&](const auto& part) { return std::sqrt((part.array() - rest).square().mean()); };
      if (rms(x.tail(x.size() - quiet)) < kAbove * rms(x.head(quiet))) return false;
    }
  }
  return true;
}

// Names the blows that disagree with the others, and leaves out those that certainly do.
void drop_odd_blows(std::vector<BlowSpectra>& spectra, const std::vector<std::size_t>& measured,
                    const FrfOptions& options, double dt, Eigen::Index samples, bool clean,
                    std::vector<BlowReport>& found, FrequencyResponse& result) {
  if (spectra.size() < 2) return;
  Eigen::VectorXd ff = Eigen::VectorXd::Zero(spectra.front().force.size());
  for (const BlowSpectra& blow : spectra) ff += blow.force.cwiseAbs2();
  const Eigen::Index lines = usable_lines(ff, options.band_drop_db > 0 ? options.band_drop_db : 20);
  std::vector<BlowSpectra> excited;
  for (const BlowSpectra& blow : spectra) {
    excited.push_back({blow.force.segment(1, lines - 1), {}});
    for (const auto& a : blow.responses) excited.back().responses.push_back(a.segment(1, lines - 1));
  }
  if (options.exclude.odd) require_one_point(excited, clean);
  const auto verdicts = judge_blows(excited, names_of(result), dt, samples);
  std::vector<BlowSpectra> kept;
  for (std::size_t i = 0; i < spectra.size(); ++i) {
    BlowReport& report = found[measured[i]];
    bool certain = false;
    for (const BlowDisagreement& d : verdicts[i]) {
      report.disagreements.push_back(d.finding);
      certain = certain || d.certain;
    }
    report.used = !(certain && options.exclude.odd);
    for (const std::string& finding : report.disagreements) {
      result.summary.warn(fmt::format("impact {} at {:.4g} s: {}{}", measured[i] + 1, report.time, finding,
                                      report.used ? "" : "; left out"));
    }
    if (report.used) kept.push_back(std::move(spectra[i]));
  }
  spectra = std::move(kept);
}

}  // namespace

std::vector<Recording> split_blows(const Recording& recording, const FrfOptions& options) {
  check_options(options);
  recording.check();
  const Eigen::VectorXd& force = force_channel(recording, options).samples;
  const Pulse largest = find_pulse(force);
  const double rest = largest.quiet > 0 ? force.head(largest.quiet).mean() : 0.0;
  const Eigen::VectorXd height = largest.sign * (force.array() - rest);
  const double level = options.cut.trigger * height.maxCoeff();
  if (!(level > 0)) return {};
  const auto samples = [&](double time) { return static_cast<Eigen::Index>(std::lround(time / recording.dt)); };
  constexpr Eigen::Index kShortest = 16;
  if (options.cut.duration > 0 && samples(options.cut.duration) < kShortest)
    throw Error::in_field(
        "duration", fmt::format("{:g} s", options.cut.duration),
        fmt::format("0 (to the next impact) or {:g} s at least, {} samples", kShortest * recording.dt, kShortest));
  const Eigen::Index separation =
      std::max<Eigen::Index>(1, samples(std::max(options.cut.separation, options.cut.duration)));

  std::vector<Eigen::Index> triggers;
  for (Eigen::Index i = 0; i < height.size(); ++i) {
    if (height[i] > level && (triggers.empty() || i - triggers.back() >= separation)) triggers.push_back(i);
  }
  std::vector<Recording> blows;
  for (std::size_t b = 0; b < triggers.size(); ++b) {
    const Eigen::Index first = std::max<Eigen::Index>(0, triggers[b] - samples(options.cut.pre_trigger));
    Eigen::Index end = b + 1 < triggers.size()
                           ? std::max(triggers[b] + 1, triggers[b + 1] - samples(options.cut.pre_trigger))
                           : height.size();
    if (options.cut.duration > 0) {
      if (first + samples(options.cut.duration) > end) continue;  // cut off by the end of the record or the next blow
      end = first + samples(options.cut.duration);
    }
    Recording blow;
    blow.t0 = recording.t0 + recording.dt * static_cast<double>(first);
    blow.dt = recording.dt;
    blow.source = recording.source;
    for (const auto& channel : recording.channels) {
      blow.add(channel.name, channel.quantity, channel.samples.segment(first, end - first));
    }
    blows.push_back(std::move(blow));
  }
  return blows;
}

namespace {

/// Every complete blow of the recordings, which must have one rate; `owner`: the recording of each.
std::vector<Recording> all_blows(const std::vector<Recording>& recordings, const FrfOptions& options,
                                 std::vector<std::size_t>& owner) {
  std::vector<Recording> blows;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const Recording& recording = recordings[r];
    if (std::abs(recording.dt - recordings.front().dt) > 1e-9 * recording.dt) {
      throw Error(fmt::format("{}: sample time {:g} s: must be {:g} s as in the first recording", recording.source,
                              recording.dt, recordings.front().dt));
    }
    for (auto& blow : split_blows(recording, options)) blows.push_back(std::move(blow));
    owner.resize(blows.size(), r);
  }
  if (blows.empty()) throw Error("no complete hammer impact found in the recordings");
  for (const int number : options.exclude.blows) {
    if (number < 1 || number > static_cast<int>(blows.size()))
      throw Error(fmt::format("exclude = {}: must be 1 to {}, the number of impacts", number, blows.size()));
  }
  return blows;
}

/// What is said of blow `number` (from 0), with warnings; whether it is used.
BlowReport report_blow(const Recording& blow, const BlowCheck& check, Eigen::Index quiet, std::size_t number,
                       const std::vector<std::string>& damage, const FrfOptions& options, FrequencyResponse& result) {
  const std::string force_name = force_channel(blow, options).name;
  BlowReport report;
  report.damage = damage;
  report.time = blow.t0 + check.time;
  report.peak = check.peak;
  report.pulse_width = check.pulse_width;
  report.force_overload = check.overload;
  report.second_hits = check.second_hits;
  for (const auto& channel : result.channels) {
    if (is_overloaded(blow[channel.response])) report.overloaded_responses.push_back(channel.response);
  }
  const bool overloaded = check.overload || !report.overloaded_responses.empty();
  const bool excluded =
      std::count(options.exclude.blows.begin(), options.exclude.blows.end(), static_cast<int>(number) + 1) > 0;
  report.used = !excluded && !(options.exclude.overloads && (overloaded || !damage.empty())) &&
                !(options.exclude.double_hits && !check.second_hits.empty());
  if (overloaded) {
    result.summary.warn(fmt::format("impact at {:.4g} s: {} overloaded{}", report.time,
                                    check.overload ? force_name : report.overloaded_responses.front(),
                                    report.used ? "" : ", left out"));
  }
  for (const std::string& finding : damage) {
    result.summary.warn(
        fmt::format("impact {} at {:.4g} s: {}{}", number + 1, report.time, finding, report.used ? "" : "; left out"));
  }
  for (const auto& hit : check.second_hits) {
    result.summary.warn(fmt::format("impact at {:.4g} s: second hit of {:.0f} % after {:.1f} ms{}", report.time,
                                    100 * hit.ratio, 1e3 * hit.time, report.used ? "" : ", left out"));
  }
  if (report.used && quiet < 8) {
    result.summary.warn(fmt::format("impact at {:.4g} s: {} samples before the pulse: too few to remove the DC{}",
                                    report.time, quiet, quiet == 0 ? "; it was left in" : ""));
  }
  return report;
}

/// Spectra of one blow from the pulse on, without DC, under the windows.
BlowSpectra transform(const Recording& blow, const Pulse& pulse, const BlowCheck& check, const std::string& force_name,
                      const Eigen::VectorXd& decay, const FrfOptions& options, const FrequencyResponse& result) {
  const Eigen::Index n = decay.size();
  const auto without_dc = [&](const Eigen::VectorXd& x) {
    Eigen::VectorXd y = x.segment(pulse.quiet, n);
    if (pulse.quiet > 0) y.array() -= x.head(pulse.quiet).mean();
    return y;
  };
  Eigen::VectorXd force = without_dc(blow[force_name]).cwiseProduct(decay);
  if (options.window.force) {
    Eigen::Index end = pulse.last + 1 + pulse.width() - pulse.quiet;
    if (!check.second_hits.empty()) end += static_cast<Eigen::Index>(check.second_hits.back().time / blow.dt);
    const auto taper = static_cast<Eigen::Index>(std::lround(options.window.taper / blow.dt));
    force = force.cwiseProduct(signal::force_window(n, std::min(end, n), taper));
  }
  BlowSpectra spectra{signal::real_fft(force), {}};
  for (const FrfChannel& channel : result.channels) {
    spectra.responses.push_back(signal::real_fft(without_dc(blow[channel.response]).cwiseProduct(decay)));
  }
  return spectra;
}

}  // namespace

namespace {

/// Whether the structure answers at sample i: a blow shorter than a sample looks like a spike of the force, but the
/// responses begin with it.
bool answered(const Recording& recording, const Channel& force, Eigen::Index i) {
  constexpr Eigen::Index kAbout = 20;
  constexpr double kRises = 5;
  const auto rms = [](const Eigen::VectorXd& x, Eigen::Index from, Eigen::Index to) {
    from = std::max<Eigen::Index>(from, 0), to = std::min(to, x.size());
    return to > from ? x.segment(from, to - from).norm() / std::sqrt(static_cast<double>(to - from)) : 0.0;
  };
  return std::ranges::any_of(recording.channels, [&](const Channel& c) {
    return c.name != force.name && c.quantity != Quantity::force &&
           rms(c.samples, i, i + kAbout) > kRises * rms(c.samples, i - 1 - kAbout, i - 1);
  });
}

/// The recordings without single-sample spikes of the force, which are no blows, for finding the blows; nothing where
/// there are none.
std::vector<Recording> without_force_spikes(const std::vector<Recording>& recordings, const FrfOptions& options,
                                            std::vector<std::string>& told) {
  std::vector<Recording> mended;
  for (std::size_t r = 0; r < recordings.size(); ++r) {
    const Recording& recording = recordings[r];
    const Channel& force = force_channel(recording, options);
    std::vector<Eigen::Index> spikes = force_spikes(force.samples);
    std::erase_if(spikes, [&](Eigen::Index i) { return answered(recording, force, i); });
    if (spikes.empty()) continue;
    if (mended.empty()) mended = recordings;
    for (Channel& channel : mended[r].channels) {
      if (channel.name != force.name) continue;
      for (const Eigen::Index i : spikes) channel.samples[i] = 0.5 * (channel.samples[i - 1] + channel.samples[i + 1]);
    }
    told.push_back(
        fmt::format("{}{}: {} spike{} of single samples, the first at {:.4g} s: no impact; look for loose "
                    "contacts{}",
                    recording.source.empty() ? "" : recording.source + ": ", force.name, spikes.size(),
                    spikes.size() == 1 ? "" : "s", recording.t0 + recording.dt * static_cast<double>(spikes.front()),
                    options.repair ? "; bridged" : "; kept (--repair bridges them)"));
  }
  return mended;
}

/// The force of each blow as it was recorded.
void as_recorded(std::vector<Recording>& blows, const std::vector<Recording>& recordings,
                 const std::vector<std::size_t>& owner, const std::string& force) {
  for (std::size_t b = 0; b < blows.size(); ++b) {
    const Recording& recording = recordings[owner[b]];
    const auto first = static_cast<Eigen::Index>(std::llround((blows[b].t0 - recording.t0) / recording.dt));
    for (Channel& channel : blows[b].channels)
      if (channel.name == force) channel.samples = recording[force].segment(first, channel.samples.size());
  }
}

}  // namespace

FrequencyResponse estimate_frf(const std::vector<Recording>& given, const FrfOptions& options,
                               std::vector<BlowReport>* reports) {
  std::vector<std::string> spikes;
  const std::vector<Recording> mended = without_force_spikes(given, options, spikes);
  const std::vector<Recording>& recordings = mended.empty() ? given : mended;
  std::vector<std::size_t> owner;
  std::vector<Recording> blows = all_blows(recordings, options, owner);
  const double dt = blows.front().dt;
  const std::string force_name = force_channel(blows.front(), options).name;
  // The transform starts just before the pulse: what is cut off at the end of a response that still rings then only
  // scales its residues, where a start long before the pulse would leave ripples over 1/(that time).
  Eigen::Index n = blows.front().size();
  std::vector<Pulse> pulses;
  for (const auto& blow : blows) {
    pulses.push_back(find_pulse(blow[force_name]));
    n = std::min(n, blow.size() - pulses.back().quiet);
  }
  if (n < 16) throw Error(fmt::format("shortest impact has {} samples: must have at least 16", n));

  FrequencyResponse result;
  result.estimator = options.estimator;
  name_channels(blows.front(), {force_name}, {options.reference.empty() ? force_name : options.reference}, result);
  drop_dead_responses(blows, result);

  const double length = dt * static_cast<double>(n);
  result.window_decay = -std::log(options.window.end) / length;
  const Eigen::VectorXd decay = signal::exponential_window(n, dt, result.window_decay);
  const auto damage = blow_damage(recordings, blows, pulses, owner, names_of(result), options.repair, spikes);
  for (const std::string& text : spikes) result.summary.warn(text);
  std::vector<BlowCheck> checks;
  for (const Recording& blow : blows) checks.push_back(check_blow(blow[force_name], dt, options.converter_range));
  if (!mended.empty() && !options.repair) as_recorded(blows, given, owner, force_name);
  std::vector<BlowReport> found;
  std::vector<BlowSpectra> spectra;
  std::vector<std::size_t> measured;  // blow of each of `spectra`
  for (std::size_t b = 0; b < blows.size(); ++b) {
    const BlowCheck& check = checks[b];
    found.push_back(report_blow(blows[b], check, pulses[b].quiet, b, damage[b], options, result));
    if (!found.back().used) continue;
    spectra.push_back(transform(blows[b], pulses[b], check, force_name, decay, options, result));
    measured.push_back(b);
  }
  drop_odd_blows(spectra, measured, options, dt, n, well_above_noise(blows, pulses, names_of(result)), found, result);
  CrossSpectra sums = sum(spectra, n / 2 + 1, result.channels.size());
  result.averages += static_cast<long>(spectra.size());
  if (reports != nullptr) *reports = found;
  if (result.averages == 0)
    throw Error(
        fmt::format("every impact was left out (overload, second hit, or a frozen response): none "
                    "remains to average{}{}",
                    result.summary.warnings.empty() ? "" : "; the first: ",
                    result.summary.warnings.empty() ? "" : result.summary.warnings.front()));

  const Eigen::Index kept = usable_lines(sums.ff, options.band_drop_db);
  result.frequency = Eigen::VectorXd::LinSpaced(kept, 0, static_cast<double>(kept - 1)) / length;
  for (std::size_t c = 0; c < result.channels.size(); ++c)
    sums.noise.push_back(noise_part(spectra, c, sums.ff.head(kept), sums.af[c].head(kept)));
  estimate_channels(sums, options, result);
  if (result.averages == 1) result.summary.warn("one impact: coherence and variance are undefined");
  result.summary.trust = fmt::format("{}, 0 to {:.4g} Hz in steps of {:.4g} Hz", counted(result.averages, "impact"),
                                     result.frequency[kept - 1], 1 / length);
  result.provenance.version = version();
  for (const auto& recording : recordings) result.provenance.inputs.push_back(recording.source);
  result.provenance.options =
      fmt::format("estimator {} window_end {:g} force_window {} band_drop_db {:g}", to_string(options.estimator),
                  options.window.end, options.window.force, options.band_drop_db);
  return result;
}

}  // namespace whirl::modal
