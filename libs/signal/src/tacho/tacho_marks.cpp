#include "tacho_marks.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <complex>
#include <map>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"

namespace whirl::signal {

double TachoPattern::unevenness() const {
  double most = 0;
  for (const double mark : marks) {
    const double place = mark * places;
    most = std::max(most, std::abs(place - std::round(place)));
  }
  return most;
}

std::string TachoPattern::text() const {
  if (places == 1 && marks.size() == 1) return "one pulse a turn";
  std::string out = fmt::format("{} pulses a turn", marks.size());
  if (missing() > 0) out = fmt::format("{} places a turn, {} without a pulse", places, missing());
  if (unevenness() < 0.1) return out + fmt::format(", even within {:.2g} % of their spacing", 100 * unevenness());
  out += ", uneven: at";
  for (const double mark : marks) out += fmt::format(" {:.1f}", 360 * mark);
  return out + " deg";
}

namespace detail {
namespace {

constexpr long kMostPlaces = 200;  // a turn
constexpr int kMostFolded = 128;   // places a turn that small deviations may tell
constexpr double kAlwaysAbsent = 0.8;

/// Places at which the count of evenly spaced pulses found none, in all and by the place in a turn of `places`.
struct AbsentPlaces {
  long places = 0;
  std::vector<long> missing;  ///< of a turn, without a pulse as a rule
  long explained = 0, total = 0;
};

std::vector<long> absent_of(const std::vector<double>& turns) {
  std::vector<long> out;
  for (std::size_t k = 1; k < turns.size(); ++k)
    for (long q = std::lround(turns[k - 1]) + 1; q < std::lround(turns[k]); ++q) out.push_back(q);
  return out;
}

AbsentPlaces absent_at(const std::vector<long>& absent, long span, long places) {
  AbsentPlaces out;
  out.places = places;
  out.total = static_cast<long>(absent.size());
  std::vector<long> count(static_cast<std::size_t>(places), 0);
  for (const long q : absent) ++count[static_cast<std::size_t>(q % places)];
  for (long r = 0; r < places; ++r) {
    const long seen = (span - r) / places + 1;
    const long here = count[static_cast<std::size_t>(r)];
    if (seen < 3 || static_cast<double>(here) < kAlwaysAbsent * static_cast<double>(seen)) continue;
    out.missing.push_back(r);
    out.explained += here;
  }
  return out;
}

/// The smallest turn that explains absent places by places that never have a pulse; places 0 where none does. In so
/// many turns no place is without a pulse by chance; in fewer the wheel must explain most of what is absent.
AbsentPlaces missing_places(const std::vector<long>& absent, long span) {
  constexpr long kSureTurns = 8;  // of 12 % lost pulses one place in 10 million is absent in 80 % of them
  for (long n = 3; absent.size() >= 3 && n <= std::min(kMostPlaces, span / 3); ++n) {
    AbsentPlaces out = absent_at(absent, span, n);
    const auto few = static_cast<long>(out.missing.size());
    const double rest = static_cast<double>(out.total - out.explained) / static_cast<double>(span);
    const bool sure = 10 * out.explained >= 7 * out.total || span / n >= kSureTurns;
    if (few > 0 && 2 * few <= n && sure && rest < 0.1) return out;
  }
  return {};
}

/// Running mean over n, half of its weight at both ends where n is even; the ends keep their values.
std::vector<double> without_mean(const std::vector<double>& v, std::size_t n) {
  std::vector<double> sum(v.size() + 1, 0), out(v.size(), 0);
  for (std::size_t k = 0; k < v.size(); ++k) sum[k + 1] = sum[k] + v[k];
  const std::size_t h = n / 2;
  for (std::size_t k = h; k + h < v.size(); ++k) {
    double s = sum[k + h + 1] - sum[k - h];
    if (n % 2 == 0) s -= 0.5 * (v[k - h] + v[k + h]);
    out[k] = v[k] - s / static_cast<double>(n);
  }
  return out;
}

/// Deviations of the marks from even places, by their place in a turn of n.
struct Folded {
  int places = 0;
  double gain = 0;    ///< by BIC
  double size = 0;    ///< rms of the deviations, in places
  double alike = 0;   ///< correlation of both halves of the record
  double spread = 0;  ///< share of the largest harmonic
};

Folded fold(const std::vector<double>& place, int places) {
  const auto n = static_cast<std::size_t>(places);
  const std::vector<double> y = without_mean(without_mean(place, n), n);
  const std::size_t first = 2 * (n / 2) + 1, last = y.size() - first, middle = (first + last) / 2;
  std::vector<double> sizes;
  for (std::size_t k = first; k < last; ++k) sizes.push_back(std::abs(y[k]));
  std::nth_element(sizes.begin(), sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2), sizes.end());
  const double limit = 9 * sizes[sizes.size() / 2];  // six deviations
  Eigen::ArrayXd sum = Eigen::ArrayXd::Zero(places), early = sum, count = sum, early_count = sum;
  double squares = 0;
  for (std::size_t k = first; k < last; ++k) {
    const double v = std::clamp(y[k], -limit, limit);
    const auto r = static_cast<Eigen::Index>(k % n);
    sum[r] += v, ++count[r], squares += v * v;
    if (k < middle) early[r] += v, ++early_count[r];
  }
  Folded out;
  out.places = places;
  const Eigen::ArrayXd mean = sum / count, a = early / early_count, b = (sum - early) / (count - early_count);
  const double m = static_cast<double>(last - first), within = squares - (count * mean.square()).sum();
  out.gain = m * std::log(squares / std::max(within, 1e-9 * squares)) - (places - 1) * std::log(m);
  out.size = std::sqrt(mean.square().mean());
  out.alike = (a * b).sum() / std::sqrt(std::max(a.square().sum() * b.square().sum(), 1e-300));
  for (int h = 1; 2 * h <= places; ++h) {
    std::complex<double> z = 0;
    for (int r = 0; r < places; ++r) z += mean[r] * std::polar(1.0, -kTwoPi * h * r / places);
    const double twice = 2 * h == places ? 1 : 2;
    out.spread = std::max(out.spread, twice * std::norm(z) / (places * std::max(mean.square().sum(), 1e-300)));
  }
  return out;
}

/// Places a turn by small deviations of evenly counted pulses; 0: none that is sure. Throws Error where a cycle stands
/// out that may be one of the speed as well.
int small_deviations(const CountedPulses& p, double quantum) {
  std::vector<double> log_step, place;
  for (std::size_t k = 1; k < p.times.size(); ++k) {
    const long steps = std::lround(p.turns[k] - p.turns[k - 1]);
    const double v = std::log((p.times[k] - p.times[k - 1]) / static_cast<double>(steps));
    log_step.insert(log_step.end(), static_cast<std::size_t>(steps), v);
  }
  double mean = 0, sum = 0;
  for (const double v : log_step) mean += v / static_cast<double>(log_step.size());
  place.push_back(0);
  for (const double v : log_step) place.push_back(sum += v - mean);
  Folded best;
  for (int n = 2; n <= kMostFolded && place.size() >= 8 * static_cast<std::size_t>(n); ++n) {
    const Folded f = fold(place, n);
    if (f.gain > 1.02 * best.gain + 10) best = f;
  }
  std::nth_element(log_step.begin(), log_step.begin() + static_cast<std::ptrdiff_t>(log_step.size() / 2),
                   log_step.end());
  const double interval = std::exp(log_step[log_step.size() / 2]);
  const auto [fast, slow] = std::minmax_element(log_step.begin(), log_step.end());
  // At a steady speed the steps of the times alone may repeat.
  const bool seen = best.size * interval > 0.4 * quantum || (*slow - *fast > 0.5 && best.gain > 100);
  if (best.gain < 30 || best.size < 2e-3 || best.alike < 0.8 || !seen) return 0;
  if (best.size > 0.02 || (best.places > 4 && best.spread < 0.8)) return best.places;
  throw Error(
      fmt::format("pulses: evenly spaced but for {:.2g} % in a cycle of {} pulses: marks of a wheel or a speed that "
                  "varies; state the number of marks a turn, 1 or {} (--pulses)",
                  100 * best.size, best.places, best.places));
}

MarkedPulses one_a_turn(CountedPulses p) {
  MarkedPulses out;
  out.mark.assign(p.times.size(), 0);
  out.pulses = std::move(p);
  return out;
}

/// Counted pulses, evenly spaced, as marks of a wheel; mark 0 follows the longest run of missing ones.
MarkedPulses of_a_wheel(CountedPulses p, long places, const std::vector<long>& missing, long explained) {
  std::vector<bool> has(static_cast<std::size_t>(places), true);
  for (const long r : missing) has[static_cast<std::size_t>(r)] = false;
  long zero = missing.empty() ? 0 : -1, longest = 0;
  for (long r = 0; r < places && !missing.empty(); ++r) {
    if (!has[static_cast<std::size_t>(r)]) continue;
    long run = 0;
    while (!has[static_cast<std::size_t>(((r - run - 1) % places + places) % places)]) ++run;
    if (run > longest) longest = run, zero = r;
  }
  MarkedPulses out;
  out.pattern.places = static_cast<int>(places);
  out.pattern.marks.clear();
  std::vector<long> index(static_cast<std::size_t>(places), -1);
  for (long r = 0; r < places; ++r) {
    if (!has[static_cast<std::size_t>((r + zero) % places)]) continue;
    index[static_cast<std::size_t>(r)] = static_cast<long>(out.pattern.marks.size());
    out.pattern.marks.push_back(static_cast<double>(r) / static_cast<double>(places));
  }
  out.pulses.missing = p.missing - explained;
  out.pulses.extra = p.extra;
  const long back = places * ((zero + places - 1) / places);
  for (std::size_t k = 0; k < p.times.size(); ++k) {
    const long q = std::lround(p.turns[k]) - zero + back, mark = index[static_cast<std::size_t>(q % places)];
    if (mark < 0) {
      ++out.pulses.extra, --out.pulses.missing;
      continue;
    }
    out.pulses.times.push_back(p.times[k]);
    out.pulses.turns.push_back(static_cast<double>(q - back) / static_cast<double>(places));
    out.mark.push_back(static_cast<std::size_t>(mark));
  }
  return out;
}

void require_whole(const MarkedPulses& p, std::size_t seen) {
  const long damaged = std::max(p.pulses.missing, 0L) + p.pulses.extra;
  if (static_cast<double>(damaged) <= kDamagedPulses * static_cast<double>(seen) + 2) return;
  throw Error(
      fmt::format("pulses: {} seen; with {}, {} would be lost and {} added: no pattern that repeats each turn; "
                  "state it (--pulses, --missing) or look at the tacho",
                  seen, p.pattern.text(), p.pulses.missing, p.pulses.extra));
}

/// Marks of a whole turn where `marks` of them look alike to their next ones, but for small deviations (four magnets,
/// two and two nearly alike).
int marks_of_turn(const std::vector<double>& times, int marks, double quantum) {
  constexpr int kMostMarks = 24;
  const auto [first, last] = alike_turns(times, marks);
  std::vector<double> place{0};
  for (std::size_t k = first + 1; k <= last; ++k)
    place.push_back(place.back() + std::log(times[k] - times[k - 1]) - std::log(times[first + 1] - times[first]));
  const double interval = (times[last] - times[first]) / static_cast<double>(last - first);
  const double first_turn = times[first + static_cast<std::size_t>(marks)] - times[first];
  const double last_turn = times[last] - times[last - static_cast<std::size_t>(marks)];
  const bool varies = std::abs(std::log(first_turn / last_turn)) > 0.4;
  const auto enough = [&](int n) { return n <= kMostMarks && place.size() >= 8 * static_cast<std::size_t>(n); };
  if (!enough(2 * marks)) return marks;
  Folded best = fold(place, marks);
  for (int n = 2 * marks; enough(n); n += marks) {
    const Folded f = fold(place, n);
    const double more = std::sqrt(std::max(f.size * f.size - best.size * best.size, 0.0));
    // Steps of the times repeat with the turn at a steady speed only.
    if (f.gain > best.gain + 30 && more > 1e-3 && (varies || more * interval > 0.4 * quantum)) best = f;
  }
  return best.places;
}

/// Gaps between evenly spaced pulses that come as often as a wheel's would, though no wheel explains them: most
/// distances from one to the next are alike.
bool gaps_repeat(const std::vector<long>& absent) {
  std::map<long, long> distances;
  long gaps = 0, most = 0;
  for (std::size_t k = 1; k < absent.size(); ++k)
    if (absent[k] > absent[k - 1] + 1) ++distances[absent[k] - absent[k - 1]], ++gaps;
  for (const auto& [distance, count] : distances) {
    const auto near = [&](long d) { return distances.contains(d) ? distances.at(d) : 0; };
    most = std::max(most, count + near(distance - 1) + near(distance + 1));
  }
  return gaps >= 12 && 10 * most > 4 * gaps;
}

/// Evenly spaced pulses counted by their trend, which neither a lost nor an added one moves.
CountedPulses count_teeth(const std::vector<double>& times) {
  CountedPulses out = follow_marks(times, 1).pulses;
  const double first = out.turns.front();
  for (double& turn : out.turns) turn -= first;
  return out;
}

MarkedPulses even_marks(const std::vector<double>& times, const TachoOptions& known, double quantum) {
  const long stated = known.pulses, missing = known.missing;
  CountedPulses counted = count_teeth(times);
  const std::vector<long> absent = absent_of(counted.turns);
  const long span = std::lround(counted.turns.back());
  AbsentPlaces found = missing_places(absent, span);
  if (stated > 0 && found.places > 0 && stated % found.places != 0)
    throw Error(fmt::format("pulses: the record shows {} places a turn, {} without a pulse, not {}", found.places,
                            found.missing.size(), stated));
  if (stated > 0) {
    found = absent_at(absent, span, stated);
    if (missing == 0) found.missing.clear(), found.explained = 0;
  }
  if (missing > 0 && static_cast<long>(found.missing.size()) != missing)
    throw Error(
        fmt::format("pulses: {} places a turn without a pulse are stated, {} are seen", missing, found.missing.size()));
  if (found.places == 0) found.places = small_deviations(counted, quantum);
  if (found.missing.empty() && gaps_repeat(absent))
    throw Error(
        fmt::format("pulses: evenly spaced with {} gaps that come regularly, but not at the same places of a "
                    "turn: state the pulses a turn (--pulses N --missing M) or look at the tacho",
                    absent.size()));
  if (found.places > 1) return of_a_wheel(std::move(counted), found.places, found.missing, found.explained);
  MarkedPulses out = one_a_turn(count_turns(times));
  out.pattern.assumed = stated == 0;
  return out;
}

}  // namespace

MarkedPulses mark_pulses(const std::vector<double>& times, const TachoOptions& stated, double quantum) {
  TachoOptions known = stated;
  if (known.edge == Edge::both)
    known.pulses *= 2, known.missing = known.missing > 0 ? 2 * known.missing : known.missing;
  if (known.pulses == 1) return one_a_turn(count_turns(times));
  const int marks = known.pulses - std::max(known.missing, 0), seen = uneven_marks(times, quantum);
  if (seen <= 1) {
    MarkedPulses out = even_marks(times, known, quantum);
    require_whole(out, times.size());
    return out;
  }
  const int n = known.pulses > 0 ? seen * (marks / seen) : marks_of_turn(times, seen, quantum);
  if (n == 0 || (known.pulses > 0 && known.missing >= 0 && n != marks))
    throw Error(fmt::format("pulses: their intervals repeat after {} pulses, not after the {} stated", seen, marks));
  MarkedPulses out = follow_marks(times, n);
  if (known.pulses > 0) out.pattern.places = known.pulses;
  require_whole(out, times.size());
  return out;
}

}  // namespace detail
}  // namespace whirl::signal
