#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

#include "channel.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::records::detail {
namespace {

/// Amplitude (complex) of a line over samples first .. first + length, Hann window.
std::complex<double> line(const Eigen::VectorXd& v, Eigen::Index first, Eigen::Index length, double cycles_per_sample) {
  std::complex<double> sum = 0, turn = std::polar(1.0, -kTwoPi * cycles_per_sample), phase = 1;
  double weights = 0;
  for (Eigen::Index i = 0; i < length; ++i) {
    const double w = 0.5 - 0.5 * std::cos(kTwoPi * (static_cast<double>(i) + 0.5) / static_cast<double>(length));
    sum += w * v[first + i] * phase;
    weights += w;
    phase *= turn;
  }
  return 2.0 * sum / weights * std::polar(1.0, -kTwoPi * cycles_per_sample * static_cast<double>(first));
}

}  // namespace

void find_lines(ChannelCheck& c, const std::vector<double>& mains, double lowest_turning, double highest_turning) {
  const Eigen::Index n = c.samples.size();
  const double duration = c.dt * static_cast<double>(n);
  if (n < 512 || duration < 1 || !(c.spread > 0)) return;
  // One long spectrum with a Hann window; a line is one narrow peak in it.
  const double mean = c.samples.mean();
  Eigen::VectorXd windowed(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    windowed[i] =
        (c.samples[i] - mean) * (1 - std::cos(kTwoPi * (static_cast<double>(i) + 0.5) / static_cast<double>(n)));
  }
  const Eigen::VectorXd power = signal::real_fft(windowed).cwiseAbs2();
  const double step = 1 / duration;
  for (const double base : mains) {
    for (int multiple = 1; multiple <= 3; ++multiple) {
      const double hz = base * multiple;
      if (hz > 0.4 / c.dt) continue;
      // A rotor that turns at the mains frequency makes the same line.
      if (hz > 0.97 * lowest_turning && hz < 1.03 * highest_turning && highest_turning < 1.1 * lowest_turning) continue;
      const auto at = [&](double f) { return static_cast<Eigen::Index>(std::lround(f / step)); };
      const Eigen::Index reach = std::max<Eigen::Index>(2, at(0.15)), side = std::max<Eigen::Index>(24, at(2.0));
      const Eigen::Index centre = at(hz), low = centre - side, high = centre + side;
      if (low < 2 || high + 2 >= power.size()) continue;
      Eigen::Index peak = centre - reach;
      for (Eigen::Index k = centre - reach; k <= centre + reach; ++k) {
        if (power[k] > power[peak]) peak = k;
      }
      std::vector<double> around;
      double next = 0;  // highest peak of the neighbourhood
      for (Eigen::Index k = low; k <= high; ++k) {
        if (std::abs(k - peak) <= 3) continue;
        around.push_back(power[k]);
        next = std::max(next, power[k]);
      }
      const double floor = median(std::move(around)) / std::numbers::ln2;  // mean of an exponential law
      if (!(power[peak] > 40 * floor) || !(power[peak] > 6 * next)) continue;
      // Frequency between the lines of the transform, from the neighbours under a Hann window.
      const double a = std::sqrt(power[peak - 1]), b = std::sqrt(power[peak]), d = std::sqrt(power[peak + 1]);
      const double ratio = d > a ? d / b : a / b;
      const double shift = (2 * ratio - 1) / (ratio + 1) * (d > a ? 1 : -1);
      const double f = (static_cast<double>(peak) + std::clamp(shift, -0.5, 0.5)) * step;
      // The same size in the thirds of the record: a transient or a sweep passing by is not.
      std::array<double, 3> size{};
      for (int k = 0; k < 3; ++k)
        size[static_cast<std::size_t>(k)] = std::abs(line(c.samples, k * (n / 3), n / 3, f * c.dt));
      const double whole = std::abs(line(c.samples, 0, n, f * c.dt));
      if (*std::min_element(size.begin(), size.end()) < 0.3 * whole) continue;
      if (whole < 2e-3 * c.spread || whole < 0.5 * c.quantum) continue;  // harmonics of the converter's steps
      Finding finding{.kind = FindingKind::hum, .severity = Severity::model, .size = whole, .frequency = f};
      finding.advice = "a line of the mains is estimated beside the motion; check the shielding and the ground";
      c.report(std::move(finding), 0, n - 1);
    }
  }
}

}  // namespace whirl::records::detail
