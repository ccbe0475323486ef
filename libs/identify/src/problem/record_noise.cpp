#include "problem/record_noise.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <vector>

#include "rules/rules.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::identification::detail {
namespace {

/// Readings between which an axis was cut off.
struct CutOff {
  double low = -INFINITY, high = INFINITY;
  bool any() const { return std::isfinite(low) || std::isfinite(high); }
};

/// Masked samples of one axis: the curve {1, cos beta, sin beta} times a cubic through the usable samples around them.
/// Returns the mask without the samples whose curve passes the limits: near a limit only readings whose noise points
/// away from it survive, which would pull the fit.
Eigen::ArrayXd bridge(const Eigen::VectorXd& beta, const Eigen::ArrayXd& used, Eigen::Index per_turn,
                      const CutOff& limits, Eigen::VectorXd& v) {
  const Eigen::Index n = v.size();
  Eigen::ArrayXd inside = used;
  const Eigen::VectorXd given = v;
  for (Eigen::Index i = 0; i < n;) {
    if (used[i] != 0) {
      ++i;
      continue;
    }
    Eigen::Index end = i;
    while (end < n && used[end] == 0) ++end;
    const Eigen::Index margin = std::clamp<Eigen::Index>(std::max(2 * (end - i), per_turn), 24, 2000);
    const Eigen::Index low = std::max<Eigen::Index>(0, i - margin), high = std::min(n, end + margin);
    std::vector<Eigen::Index> around;
    for (Eigen::Index k = low; k < high; ++k) {
      if (used[k] != 0) around.push_back(k);
    }
    const auto row = [&](Eigen::Index k) {
      const double s = 2 * static_cast<double>(k - low) / static_cast<double>(high - low) - 1;
      const double c = std::cos(beta[k]), d = std::sin(beta[k]);
      Eigen::Matrix<double, 9, 1> r;
      r << 1, c, c * s, c * s * s, c * s * s * s, d, d * s, d * s * s, d * s * s * s;
      return r;
    };
    if (around.size() < 18) {
      const double left = i > 0 ? v[i - 1] : 0.0, right = end < n ? given[end] : left;
      for (Eigen::Index k = i; k < end; ++k)
        v[k] = left + (right - left) * static_cast<double>(k - i + 1) / static_cast<double>(end - i + 1);
    } else {
      const auto m = static_cast<Eigen::Index>(around.size());
      Eigen::MatrixXd a(m, 9);
      Eigen::VectorXd b(m);
      for (Eigen::Index k = 0; k < m; ++k) {
        a.row(k) = row(around[static_cast<std::size_t>(k)]).transpose();
        b[k] = given[around[static_cast<std::size_t>(k)]];
      }
      Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr;
      qr.setThreshold(1e-4);  // near standstill cosine and sine hardly change
      qr.compute(a);
      const Eigen::VectorXd amplitude = qr.solve(b);
      for (Eigen::Index k = i; k < end; ++k) v[k] = row(k).dot(amplitude);
      const Eigen::Index reach = limits.any() ? margin / 2 : 0;
      for (Eigen::Index k = std::max(low, i - reach); k < std::min(high, end + reach); ++k) {
        const double curve = row(k).dot(amplitude);
        if (curve > limits.high || curve < limits.low) inside[k] = 0;
      }
    }
    i = end;
  }
  return inside;
}

/// White noise sd from sixth differences of usable samples.
double sixth_difference_sd(const Eigen::VectorXd& v, const Eigen::ArrayXd& used) {
  std::vector<double> d;
  Eigen::Index run = 0;
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    run = used.size() == 0 || used[i] != 0 ? run + 1 : 0;
    if (run < 7) continue;
    const auto s = v.segment(i - 6, 7);
    d.push_back(std::abs((s[0] + s[6]) - 6 * (s[1] + s[5]) + 15 * (s[2] + s[4]) - 20 * s[3]));
  }
  if (d.size() < 10) return 0;
  const auto middle = d.begin() + static_cast<std::ptrdiff_t>(d.size() / 2);
  std::nth_element(d.begin(), middle, d.end());
  return *middle / 0.6745 / std::sqrt(924.0);
}

/// Power spectrum, Hann windows of 512 samples that overlap by half and hold usable samples only.
Eigen::VectorXd spectrum(const Eigen::VectorXd& v, const Eigen::ArrayXd& used, double& windows) {
  constexpr Eigen::Index kLength = 512;
  Eigen::VectorXd power = Eigen::VectorXd::Zero(kLength / 2 + 1);
  Eigen::ArrayXd window(kLength);
  for (Eigen::Index i = 0; i < kLength; ++i)
    window[i] = 1 - std::cos(kTwoPi * (static_cast<double>(i) + 0.5) / kLength);
  windows = 0;
  for (Eigen::Index first = 0; first + kLength <= v.size(); first += kLength / 2) {
    // Bridged samples carry no noise: a few of them do no harm.
    if (used.size() && used.segment(first, kLength).sum() < 0.97 * kLength) continue;
    power +=
        signal::real_fft((v.segment(first, kLength).array() * window).matrix()).cwiseAbs2() / window.square().sum();
    ++windows;
  }
  return power / std::max(1.0, windows);
}

/// Autoregression from reflection coefficients (Levinson).
Eigen::VectorXd autoregression(const Eigen::VectorXd& reflection) {
  Eigen::VectorXd a = Eigen::VectorXd::Zero(reflection.size());
  for (Eigen::Index p = 0; p < reflection.size(); ++p) {
    const Eigen::VectorXd before = a;
    a[p] = reflection[p];
    for (Eigen::Index k = 0; k < p; ++k) a[k] = before[k] - reflection[p] * before[p - 1 - k];
  }
  return a;
}

double gain_squared(const Eigen::VectorXd& a, double w) {  // |1 - sum a_k e^{-i k w}|^2
  std::complex<double> s = 1;
  for (Eigen::Index k = 0; k < a.size(); ++k) s -= a[k] * std::polar(1.0, -w * static_cast<double>(k + 1));
  return std::norm(s);
}

/// Spectral shape above the motion. Lines (hum, gear mesh) are passed over.
struct Whittle {
  std::vector<double> w, power;

  /// Mean of log S + P / S with the level solved for; `level`: variance of the innovations.
  double operator()(const Eigen::VectorXd& reflection, double& level) const {
    const Eigen::VectorXd a = autoregression(reflection);
    double sum = 0, logs = 0;
    for (std::size_t k = 0; k < w.size(); ++k) {
      const double g = gain_squared(a, w[k]);
      sum += power[k] * g;
      logs -= std::log(g);
    }
    level = sum / static_cast<double>(w.size());
    return std::log(level) + logs / static_cast<double>(w.size()) + 1;
  }
};

/// Minimum over the reflection coefficients, one after the other (Brent), until none moves.
double minimise(const Whittle& cost, Eigen::VectorXd& reflection, double& level) {
  double best = cost(reflection, level);
  for (int round = 0; round < 40; ++round) {
    const double before = best;
    for (Eigen::Index p = 0; p < reflection.size(); ++p) {
      // Coefficients near 1 matter as their distance from it: search in the inverse hyperbolic tangent.
      const double centre = std::atanh(reflection[p]), reach = round == 0 ? 3.0 : 0.5;
      const auto at = [&](double u) {
        Eigen::VectorXd r = reflection;
        r[p] = std::tanh(u);
        double ignored = 0;
        return cost(r, ignored);
      };
      constexpr int kBits = 16;
      const auto [u, least] = boost::math::tools::brent_find_minima(at, std::max(-3.5, centre - reach),
                                                                    std::min(3.5, centre + reach), kBits);
      if (least >= best) continue;
      reflection[p] = std::tanh(u);
      best = least;
    }
    if (before - best < 1e-7) break;
  }
  cost(reflection, level);
  return best;
}

/// Autoregression of both axes (order by BIC) from the spectrum above a frequency, Hz.
void fit_colour(const std::array<Eigen::VectorXd, 2>& v, const std::array<Eigen::ArrayXd, 2>& used, double from,
                RotorRecord& r) {
  double windows = 0;
  const double step = 1 / (512 * r.dt), axes = r.one_axis() ? 1 : 2;
  Whittle cost;
  Eigen::VectorXd p = Eigen::VectorXd::Zero(257);
  if (r.axes != Axes::y) p += spectrum(v[0], used[0], windows) / (axes * r.noise_x * r.noise_x);
  if (r.axes != Axes::x) p += spectrum(v[1], used[1], windows) / (axes * r.noise_y * r.noise_y);
  for (Eigen::Index k = 1; k + 1 < p.size(); ++k) {
    if (step * static_cast<double>(k) < from) continue;
    std::vector<double> around;
    for (Eigen::Index j = std::max<Eigen::Index>(1, k - 8); j <= std::min(p.size() - 2, k + 8); ++j)
      around.push_back(p[j]);
    const auto middle = around.begin() + static_cast<std::ptrdiff_t>(around.size() / 2);
    std::nth_element(around.begin(), middle, around.end());
    if (p[k] > 2.5 * *middle) continue;
    cost.w.push_back(kTwoPi * static_cast<double>(k) / 512);
    cost.power.push_back(std::max(p[k], 1e-12));
  }
  if (cost.w.size() < 60 || windows < 8) return;
  // Independent numbers behind the spectrum: of each axis two per line and window, a window in two counts.
  const double count = axes * static_cast<double>(cost.w.size()) * 0.6 * windows;
  double level = 1, lowest = cost(Eigen::VectorXd(), level);
  Eigen::VectorXd reflection(0);
  double found = level;
  for (Eigen::Index order = 1; order <= 2; ++order) {
    Eigen::VectorXd trial(order);
    trial << reflection, Eigen::VectorXd::Zero(order - reflection.size());
    double trial_level = 1;
    const double value = minimise(cost, trial, trial_level);
    if (count * (lowest - value) < rules::kColoured + std::log(count) * static_cast<double>(order - reflection.size()))
      continue;
    lowest = value;
    reflection = trial;
    found = trial_level;
  }
  if (reflection.size() == 0 || reflection.cwiseAbs().maxCoeff() < 0.1) return;
  // Lines and modes in the spectrum are motion, not noise: the smooth curve must fit as noise would.
  const Eigen::VectorXd a = autoregression(reflection);
  double mean = 0, squares = 0;
  for (std::size_t k = 0; k < cost.w.size(); ++k) {
    const double ratio = std::log(cost.power[k] * gain_squared(a, cost.w[k]) / found);
    mean += ratio / static_cast<double>(cost.w.size());
    squares += ratio * ratio / static_cast<double>(cost.w.size());
  }
  if ((squares - mean * mean) * axes * 0.6 * windows > 2.5) return;
  r.colour = a;
  const double size = std::sqrt(found * r.noise_power());
  r.noise_x *= size;
  r.noise_y *= size;
}

}  // namespace

void take_findings(const records::RecordReport& report, const RotorRecordOptions& options, RotorRecord& r) {
  for (const records::Finding& f : report.findings) {
    const bool used = f.channel.empty() || f.channel == options.x || f.channel == options.y ||
                      (f.channel == options.angle && !options.known_angle) || f.channel == "t";
    if (!used) continue;
    f.severity == records::Severity::refuse ? r.summary.fail(f.text()) : r.summary.warn(f.text());
    if (f.kind == records::FindingKind::drift) r.drift = true;
    if (f.kind == records::FindingKind::hum &&
        std::none_of(r.hum.begin(), r.hum.end(), [&](double hz) { return std::abs(hz - f.frequency) < 0.5; })) {
      r.hum.push_back(f.frequency);
    }
  }
  const records::ChannelMask* mx = report.mask(options.x);
  const records::ChannelMask* my = report.mask(options.y);
  if (mx == nullptr && my == nullptr) return;
  r.usable_x = mx ? Eigen::ArrayXd(mx->usable.cast<double>()) : Eigen::ArrayXd::Ones(r.size());
  r.usable_y = my ? Eigen::ArrayXd(my->usable.cast<double>()) : Eigen::ArrayXd::Ones(r.size());
  const Eigen::VectorXd beta = r.angle.beta(Eigen::seqN(Eigen::Index{0}, r.size(), Eigen::Index{2}));
  const double speed = std::max(r.speed_high(), 1e-9);
  const auto per_turn = static_cast<Eigen::Index>(std::min(1e6, kTwoPi / (speed * r.dt)));
  const auto fill = [&](const std::string& channel, Eigen::ArrayXd& used, std::optional<Clipped>& clipped,
                        Eigen::VectorXd v) {
    CutOff limits;
    Clipped cut{.readings = v, .sound = used};
    const double margin = 3 * sixth_difference_sd(v, used), middle = v.dot(used.matrix()) / std::max(1.0, used.sum());
    for (const records::Finding& f : report.findings) {
      if (f.kind != records::FindingKind::clipping || f.channel != channel) continue;
      (f.size > middle ? limits.high : limits.low) = f.size > middle ? f.size - margin : f.size + margin;
      (f.size > middle ? cut.high : cut.low) = f.size;
      cut.sound += (v.array() == f.size).cast<double>() * (1 - cut.sound);
    }
    const Eigen::VectorXd given = v;
    const Eigen::ArrayXd inside = bridge(beta, used, per_turn, limits, v);
    if (limits.any()) {
      clipped = std::move(cut);
      used = inside;
      v = given;
      bridge(beta, used, per_turn, {}, v);
    }
    return v;
  };
  // Values that are not numbers must not reach the sums, masked or not.
  const auto finite = [](Eigen::VectorXd v) { return Eigen::VectorXd(v.array().isFinite().select(v.array(), 0.0)); };
  if (r.axes != Axes::y) {
    const Eigen::VectorXd x = fill(options.x, r.usable_x, r.clipped_x, finite(r.z.real()));
    r.z.real() = x;
  }
  if (r.axes != Axes::x) {
    const Eigen::VectorXd y = fill(options.y, r.usable_y, r.clipped_y, finite(r.z.imag()));
    r.z.imag() = y;
  }
}

void measure_noise(const RotorRecordOptions& options, RotorRecord& r) {
  const Eigen::VectorXd x = r.z.real(), y = r.z.imag();
  const auto spread = [](const Eigen::VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); };
  // Sixth differences of coarsely quantised or noise-free data vanish; a millionth of the signal keeps weights finite.
  r.noise_x = std::max(sixth_difference_sd(x, r.usable_x), 1e-6 * spread(x));
  r.noise_y = std::max(sixth_difference_sd(y, r.usable_y), 1e-6 * spread(y));
  if (r.axes == Axes::x) r.noise_y = r.noise_x;
  if (r.axes == Axes::y) r.noise_x = r.noise_y;
  if (options.noise_sd > 0) {
    r.noise_x = r.noise_y = options.noise_sd;
    return;
  }
  fit_colour({x, y}, {r.usable_x, r.usable_y}, 2.5 * r.speed_high() / kTwoPi, r);
}

void refine_noise(const OutputErrorRecord& fit, RotorRecord& r) {
  if (r.colour.size() == 0) return;
  // Where the motion is small its errors are too: what is left there is noise at every frequency.
  const Eigen::ArrayXd size = fit.as_read().cwiseAbs().array();
  const Eigen::ArrayXd quiet = (size < 0.35 * size.maxCoeff()).cast<double>();
  const Eigen::VectorXcd residual = r.z - fit.as_read() - fit.beside;
  const Eigen::ArrayXd used_x = r.usable_x.size() ? Eigen::ArrayXd(quiet * r.usable_x) : quiet;
  const Eigen::ArrayXd used_y = r.usable_y.size() ? Eigen::ArrayXd(quiet * r.usable_y) : quiet;
  fit_colour({residual.real(), residual.imag()}, {used_x, used_y}, 1.5 / (512 * r.dt), r);
}

}  // namespace whirl::identification::detail
