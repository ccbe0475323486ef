#pragma once
#include <algorithm>
#include <cmath>
#include <random>
#include <string>

#include "whirl/core/recording.hpp"

/// What happens to one channel of many between the sensor and the file, seeded: any record of moving signals.
namespace whirl::testing {

enum class ChannelDamage {
  clipped,  ///< limits that 2 to 30 % of its samples exceed
  frozen,   ///< holds one value for 5 to 30 % of the record
  zeros,    ///< reads 0 for as long
  spikes,   ///< 0.1 to 0.4 % of its samples are 8 to 40 times its rms off
};

/// Spoils one channel, drawn at random, and returns its name.
inline std::string spoil_channel(Recording& record, ChannelDamage damage, unsigned seed) {
  std::mt19937_64 random(40503ull * seed + static_cast<unsigned>(damage));
  std::uniform_real_distribution<double> uniform(0, 1);
  Channel& c = record.channels[random() % record.channels.size()];
  Eigen::VectorXd& v = c.samples;
  const double rms = std::sqrt((v.array() - v.mean()).square().mean());
  const auto n = v.size();
  if (damage == ChannelDamage::clipped) {
    std::vector<double> size(v.data(), v.data() + n);
    for (double& s : size) s = std::abs(s);
    std::sort(size.begin(), size.end());
    const double limit = size[static_cast<std::size_t>((0.98 - 0.28 * uniform(random)) * static_cast<double>(n))];
    v = v.cwiseMin(limit).cwiseMax(-limit);
  } else if (damage == ChannelDamage::spikes) {
    const auto count = static_cast<int>((0.001 + 0.003 * uniform(random)) * static_cast<double>(n));
    for (int k = 0; k < count; ++k)
      v[static_cast<Eigen::Index>(random() % static_cast<unsigned long>(n))] +=
          (uniform(random) < 0.5 ? -1 : 1) * rms * (8 + 32 * uniform(random));
  } else {
    const auto length = static_cast<Eigen::Index>((0.05 + 0.25 * uniform(random)) * static_cast<double>(n));
    const auto first = static_cast<Eigen::Index>(uniform(random) * static_cast<double>(n - length));
    v.segment(first, length).setConstant(damage == ChannelDamage::zeros ? 0 : v[first]);
  }
  return c.name;
}

}  // namespace whirl::testing
