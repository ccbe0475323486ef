#include "band.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"

namespace whirl::modal {
namespace {

double upper_median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// Noise of each line as the fourth difference shows it: a resonance over many lines cancels, independent noise does
// not. The binomial weights 1 4 6 4 1 have squares that sum to 70.
Eigen::VectorXd line_scatter(const Eigen::VectorXcd& h) {
  Eigen::VectorXd scatter = Eigen::VectorXd::Zero(h.size());
  for (Eigen::Index i = 2; i + 2 < h.size(); ++i) {
    scatter[i] = std::abs(h[i - 2] - 4.0 * h[i - 1] + 6.0 * h[i] - 4.0 * h[i + 1] + h[i + 2]) / std::sqrt(70.0);
  }
  return scatter;
}

// Whether that scatter is curvature of smooth, noise-free data: then the sixth difference (weights 1 6 15 20 15 6 1,
// squares summing to 924) is far smaller still, where for independent noise it would be as large.
bool is_smooth(const Eigen::VectorXcd& h, const Eigen::VectorXd& scatter) {
  std::vector<double> fourth, sixth;
  for (Eigen::Index i = 3; i + 3 < h.size(); ++i) {
    fourth.push_back(scatter[i]);
    sixth.push_back(std::abs(h[i - 3] - 6.0 * h[i - 2] + 15.0 * h[i - 1] - 20.0 * h[i] + 15.0 * h[i + 1] -
                             6.0 * h[i + 2] + h[i + 3]) /
                    std::sqrt(924.0));
  }
  return upper_median(sixth) < 0.3 * upper_median(fourth);
}

// Exponent e of noise ~ |H|^e, from the lines where |H| is small and middling: about 0 for equal noise, 1 for
// proportional. (The highest third holds the peaks, whose curvature a few lines wide would pass for noise.)
double noise_exponent(const Eigen::MatrixXcd& h) {
  double sum = 0;
  double weight = 0;
  for (Eigen::Index c = 0; c < h.cols(); ++c) {
    const Eigen::VectorXd scatter = line_scatter(h.col(c));
    if (is_smooth(h.col(c), scatter)) continue;
    std::vector<std::pair<double, double>> lines;
    for (Eigen::Index i = 2; i + 2 < h.rows(); ++i) {
      const double size = std::abs(h(i, c));
      if (size > 0 && scatter[i] > 0) lines.emplace_back(std::log(size), std::log(scatter[i]));
    }
    if (lines.size() < 12) continue;
    std::sort(lines.begin(), lines.end());
    const std::size_t third = lines.size() / 3;
    std::vector<double> size[2], noise[2];
    for (std::size_t i = 0; i < third; ++i) {
      size[0].push_back(lines[i].first);
      noise[0].push_back(lines[i].second);
      size[1].push_back(lines[third + i].first);
      noise[1].push_back(lines[third + i].second);
    }
    const double range = upper_median(size[1]) - upper_median(size[0]);
    sum += range * (upper_median(noise[1]) - upper_median(noise[0]));
    weight += range * range;
  }
  return weight > 0 ? sum / weight : 0;
}

/// Width of a line. Throws Error where the axis is not uniform.
double line_of(const FrequencyResponse& frf) {
  const Eigen::Index all = frf.frequency.size();
  if (all < 3 || frf.channels.empty()) throw Error("frequency response without lines or channels");
  const double step = (frf.frequency[all - 1] - frf.frequency[0]) / static_cast<double>(all - 1);
  for (Eigen::Index i = 0; i < all; ++i) {
    if (!(std::abs(frf.frequency[i] - frf.frequency[0] - step * static_cast<double>(i)) < 1e-3 * step)) {
      throw Error(fmt::format("frequency axis is not uniform at line {} ({:g} Hz)", i, frf.frequency[i]));
    }
  }
  return step;
}

void check_channel(const FrfChannel& channel, Eigen::Index all, const Eigen::VectorXcd& inside) {
  if (channel.value.size() != all) {
    throw Error(fmt::format("channel {}/{} has {} lines: must have the {} of the frequency axis", channel.response,
                            channel.reference, channel.value.size(), all));
  }
  if (!inside.allFinite()) {
    throw Error(
        fmt::format("channel {}/{}: every line in the band must be finite", channel.response, channel.reference));
  }
  if (inside.norm() == 0) {
    throw Error(fmt::format("channel {}/{} is zero in the band", channel.response, channel.reference));
  }
}

void set_weights(const FrequencyResponse& frf, Eigen::Index first, LineWeighting weighting, Band& band) {
  const Eigen::Index n = band.h.rows(), channels = band.h.cols();
  band.weight.resize(n, channels);
  for (Eigen::Index c = 0; c < channels; ++c) {
    const Eigen::VectorXd size = band.h.col(c).cwiseAbs();
    switch (weighting) {
      case LineWeighting::variance: {
        const Eigen::VectorXd variance = frf.channels[static_cast<std::size_t>(c)].variance.segment(first, n);
        // A line whose few blows happened to agree must not own the fit.
        const double floor = 0.1 * upper_median({variance.data(), variance.data() + n});
        band.weight.col(c) = variance.cwiseMax(std::max(floor, 1e-12 * size.squaredNorm() / static_cast<double>(n)))
                                 .cwiseSqrt()
                                 .cwiseInverse();
        break;
      }
      case LineWeighting::proportional: {
        // A receptance falls by decades over the band; its accelerance has peaks of like size.
        const Eigen::VectorXd level = band.omega.array().pow(2 - band.power);
        const double largest = size.cwiseProduct(level).maxCoeff();
        band.weight.col(c) = size.cwiseMax(0.02 * largest * level.cwiseInverse()).cwiseInverse();
        break;
      }
      default:
        band.weight.col(c).setConstant(std::sqrt(static_cast<double>(n)) / size.norm());
    }
  }
}

}  // namespace

bool inside(const Band& band, std::complex<double> p) {
  const double f = std::abs(p) / kTwoPi;
  return f >= band.low && f <= band.high;
}

Band select_band(const FrequencyResponse& frf, double low, double high, LineWeighting weighting) {
  const double step = line_of(frf);
  const Eigen::Index all = frf.frequency.size();
  if (!(low >= 0) || !(high >= 0) || (high > 0 && high <= low)) {
    throw Error(fmt::format("band {:g} to {:g} Hz: must be positive and ascending", low, high));
  }
  Eigen::Index first = 0;
  while (first < all && (frf.frequency[first] < 0.5 * step || frf.frequency[first] < low - 1e-6 * step)) ++first;
  Eigen::Index last = all - 1;
  while (high > 0 && last > first && frf.frequency[last] > high + 1e-6 * step) --last;
  const Eigen::Index n = last - first + 1;
  if (n < 20) throw Error(fmt::format("band {:g} to {:g} Hz holds {} lines: must hold at least 20", low, high, n));

  Band band;
  band.grid = arrange_grid(frf).channel;
  band.power = static_cast<int>(frf.kind);
  band.decay = frf.window_decay;
  band.leakage_free = frf.leakage_free;
  band.omega = kTwoPi * frf.frequency.segment(first, n);
  band.low = frf.frequency[first];
  band.high = frf.frequency[last];
  const auto channels = static_cast<Eigen::Index>(frf.channels.size());
  band.h.resize(n, channels);
  bool has_variance = true;
  for (Eigen::Index c = 0; c < channels; ++c) {
    const FrfChannel& channel = frf.channels[static_cast<std::size_t>(c)];
    const Eigen::VectorXcd inside =
        channel.value.size() == all ? Eigen::VectorXcd(channel.value.segment(first, n)) : Eigen::VectorXcd();
    check_channel(channel, all, inside);
    band.h.col(c) = inside;
    has_variance = has_variance && channel.variance.size() == all && channel.variance.segment(first, n).maxCoeff() > 0;
  }
  if (has_variance) {
    double sum = 0;
    for (const FrfChannel& channel : frf.channels) sum += channel.variance.segment(first, n).sum();
    band.noise_floor = std::sqrt(2 * sum) / band.h.norm();  // the variance is that of |H|: half of the complex one
  }
  if (weighting == LineWeighting::variance && !has_variance) {
    throw Error("weighting by variance: every channel must state its variance (two or more impacts)");
  }
  if (weighting == LineWeighting::automatic) {
    band.guessed_weight = !has_variance;
    weighting = has_variance                   ? LineWeighting::variance
                : noise_exponent(band.h) > 0.5 ? LineWeighting::proportional
                                               : LineWeighting::flat;
  }
  band.common_weight = weighting == LineWeighting::flat;
  set_weights(frf, first, weighting, band);
  band.energy = (band.h.array().abs2() * band.weight.array().square()).sum();
  return band;
}

Band with_common_weight(const Band& band) {
  Band common = band;
  const Eigen::VectorXd scale = band.weight.colwise().mean().cwiseInverse();
  const Eigen::MatrixXd relative = band.weight * scale.asDiagonal();
  const Eigen::VectorXd noise = relative.cwiseInverse().cwiseAbs2().rowwise().mean().cwiseSqrt();
  common.weight = noise.cwiseInverse() * scale.cwiseInverse().transpose();
  common.common_weight = true;
  common.energy = (common.h.array().abs2() * common.weight.array().square()).sum();
  return common;
}

Grid arrange_grid(const FrequencyResponse& frf) {
  Grid grid;
  const auto index = [](std::vector<std::string>& names, const std::string& name) {
    const auto found = std::find(names.begin(), names.end(), name);
    if (found != names.end()) return static_cast<Eigen::Index>(found - names.begin());
    names.push_back(name);
    return static_cast<Eigen::Index>(names.size()) - 1;
  };
  const auto count = static_cast<Eigen::Index>(frf.channels.size());
  std::vector<std::pair<Eigen::Index, Eigen::Index>> cells;
  for (const auto& channel : frf.channels) {
    const Eigen::Index row = index(grid.outputs, channel.response);
    cells.emplace_back(row, index(grid.references, channel.reference));
  }
  const auto rows = static_cast<Eigen::Index>(grid.outputs.size());
  const auto columns = static_cast<Eigen::Index>(grid.references.size());
  grid.channel = Eigen::MatrixXi::Constant(rows, columns, -1);
  for (Eigen::Index c = 0; c < count; ++c) {
    grid.channel(cells[static_cast<std::size_t>(c)].first, cells[static_cast<std::size_t>(c)].second) =
        static_cast<int>(c);
  }
  if (rows * columns == count && grid.channel.minCoeff() >= 0) {
    // The matrix fraction may stand on either side: its size is that of the smaller set.
    if (columns > rows) {
      grid.channel = grid.channel.transpose().eval();
      std::swap(grid.outputs, grid.references);
    }
    return grid;
  }
  grid.outputs.clear();
  for (const auto& channel : frf.channels) grid.outputs.push_back(channel.response + "/" + channel.reference);
  grid.references = {"all"};
  grid.channel = Eigen::VectorXi::LinSpaced(count, 0, static_cast<int>(count) - 1);
  return grid;
}

}  // namespace whirl::modal
