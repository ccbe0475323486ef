// General systems from records that were damaged between sensor and file.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <random>

#include "whirl/identify/identify.hpp"
#include "whirl/testing/damaged_channels.hpp"
#include "whirl/testing/sequential_rate.hpp"

namespace whirl::identification {
namespace {

using testing::ChannelDamage;

struct Plant {
  std::function<Eigen::Vector2d(const Eigen::Vector2d&, double)> rate;
  std::map<std::string, double> truth;
};

const Plant kPlants[] = {
    {[](const Eigen::Vector2d& s, double u) {
       return Eigen::Vector2d(s[1], u - 4 * s[0] - 0.15 * s[1] + 0.5 * s[0] * s[0] * s[0]);
     },
     {{"x': v", 1}, {"v': x", -4}, {"v': v", -0.15}, {"v': u", 1}, {"v': x^3", 0.5}}},
    {[](const Eigen::Vector2d& s, double u) {
       return Eigen::Vector2d(s[1], 0.5 * u - s[0] + 0.8 * s[1] - 0.8 * s[0] * s[0] * s[1]);
     },
     {{"x': v", 1}, {"v': x", -1}, {"v': v", 0.8}, {"v': u", 0.5}, {"v': v*x^2", -0.8}}},
    {[](const Eigen::Vector2d& s, double u) {
       return Eigen::Vector2d(-0.3 * s[0] + 2 * s[1], u - 2 * s[0] - 0.1 * s[1]);
     },
     {{"x': x", -0.3}, {"x': v", 2}, {"v': x", -2}, {"v': v", -0.1}, {"v': u", 1}}},
};

/// Runge-Kutta, 20 steps a sample, at 100 Hz; `noise`: sd relative to the rms of each channel.
Recording run(const Plant& plant, unsigned seed, double noise = 0.005) {
  constexpr int kSamples = 1500, kSteps = 20;
  constexpr double kRate = 100, kStep = 1 / (kRate * kSteps);
  std::mt19937_64 random(7919ull * seed);
  std::normal_distribution<double> normal;
  const double phase = normal(random);
  const auto u = [&](double t) { return 0.7 * std::sin(0.4 * t + 0.03 * t * t + phase); };
  Eigen::Vector2d s(0.2 * normal(random), 0.2 * normal(random));
  Eigen::VectorXd x(kSamples), v(kSamples), input(kSamples);
  for (int i = 0; i < kSamples; ++i) {
    x[i] = s[0];
    v[i] = s[1];
    input[i] = u(i / kRate);
    for (int k = 0; k < kSteps; ++k) {
      const double t = i / kRate + k * kStep;
      const Eigen::Vector2d a = plant.rate(s, u(t)), b = plant.rate(s + kStep / 2 * a, u(t + kStep / 2)),
                            c = plant.rate(s + kStep / 2 * b, u(t + kStep / 2)),
                            d = plant.rate(s + kStep * c, u(t + kStep));
      s += kStep / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  for (Eigen::VectorXd* channel : {&x, &v}) {
    const double size = noise * std::sqrt(channel->squaredNorm() / kSamples);
    for (double& value : *channel) value += size * normal(random);
  }
  Recording record;
  record.dt = 1 / kRate;
  record.source = "run";
  record.add("x", Quantity::displacement, x);
  record.add("v", Quantity::velocity, v);
  record.add("u", Quantity::force, input);
  return record;
}

IdentifyOptions options() {
  IdentifyOptions o;
  o.method = Method::sindy;
  o.sindy.states = {"x", "v"};
  o.sindy.inputs = {"u"};
  return o;
}

std::string text(const IdentifiedModel& model) {
  std::string out;
  for (const auto& [name, e] : model.parameters) out += fmt::format("{} = {:.6g} +- {:.2g}; ", name, e.value, e.sd);
  return out;
}

bool right(const IdentifiedModel& model, const std::map<std::string, double>& truth) {
  if (model.parameters.size() != truth.size()) return false;
  return std::all_of(model.parameters.begin(), model.parameters.end(), [&](const auto& p) {
    const auto at = truth.find(p.first);
    return at != truth.end() && std::abs(p.second.value - at->second) < 5 * p.second.sd + 1e-3 * std::abs(at->second);
  });
}

TEST(DamagedSystemsProperty, EquationsAreThoseOfTheMachineOrTheDamageIsNamed) {
  constexpr ChannelDamage kDamages[] = {ChannelDamage::clipped, ChannelDamage::frozen, ChannelDamage::zeros,
                                        ChannelDamage::spikes};
  testing::SequentialRate found(0.97, 0.5, 0.02);
  for (unsigned draw = 0; found.open(); ++draw) {
    const Plant& plant = kPlants[draw % 3];
    const ChannelDamage damage = kDamages[draw % 4];
    const unsigned seed = draw + 1;
    Recording record = run(plant, seed);
    const Channel input = record.channels.back();
    record.channels.pop_back();
    const std::string channel = testing::spoil_channel(record, damage, 3 * seed + 11);
    record.channels.push_back(input);
    const Identification id = identify(record, options());
    const bool named = std::any_of(id.summary.warnings.begin(), id.summary.warnings.end(), [&](const std::string& w) {
      return w.find("channel " + channel) != std::string::npos;
    });
    const bool good = right(id.model, plant.truth);
    EXPECT_TRUE(good || named) << seed << " " << static_cast<int>(damage) << " " << channel;
    EXPECT_TRUE(good || id.summary.chi_square > 2 || !id.usable()) << seed << " " << static_cast<int>(damage);
    found.add(good);
  }
  EXPECT_TRUE(found.sound()) << found.successes() << " of " << found.draws();
}

TEST(DamagedSystems, SoundRecordsAreNotLookedAt) {
  for (const Plant& plant : kPlants) {
    const Identification id = identify(run(plant, 5), options());
    EXPECT_TRUE(id.summary.warnings.empty()) << id.summary.warnings.front();
    EXPECT_TRUE(right(id.model, plant.truth)) << text(id.model);
  }
}

// Another run of the same machine is predicted to its noise; a machine that is another one, and a record that is
// damaged, are not, and the damage is named.
TEST(DamagedSystemsProperty, ValidationFailsForAnotherMachineAndADamagedRecordOnly) {
  for (const Plant& plant : kPlants) {
    for (const double noise : {0.0, 0.005, 0.05}) {
      const IdentifiedModel model = identify(run(plant, 21, noise), options()).model;
      for (unsigned seed = 31; seed <= 34; ++seed) {
        const Recording record = run(plant, seed, noise);
        const Summary sound = validate(model, std::vector{record}).summary;
        EXPECT_EQ(sound.status, Status::ok) << noise << " " << sound.warnings.front();
        if (noise > 0.01) continue;
        const Plant other{[&](const Eigen::Vector2d& s, double u) {
                            return Eigen::Vector2d(plant.rate(s, u)[0], plant.rate(s, u)[1] - 0.4 * s[0]);
                          },
                          {}};
        EXPECT_EQ(validate(model, std::vector{run(other, seed, noise)}).summary.status, Status::unusable)
            << noise << " " << seed;
        if (noise == 0) continue;
        Recording spoiled = record;
        const Channel input = spoiled.channels.back();  // stays as it is
        spoiled.channels.pop_back();
        const std::string channel = testing::spoil_channel(spoiled, ChannelDamage::spikes, seed);
        spoiled.channels.push_back(input);
        const Summary told = validate(model, std::vector{spoiled}).summary;
        EXPECT_NE(told.status, Status::ok) << seed;
        EXPECT_TRUE(std::any_of(told.warnings.begin(), told.warnings.end(), [&](const std::string& w) {
          return w.find("this may be the cause: channel " + channel) == 0;
        })) << seed;
      }
    }
  }
}

// Chaos carries the noise of a restart further; other runs of the same machine are still predicted.
TEST(DamagedSystemsProperty, ValidationOfANoisyChaoticMachineHolds) {
  const auto lorenz = [](unsigned seed) {
    std::mt19937_64 random(104729ull * seed);
    std::normal_distribution<double> normal;
    Eigen::Vector3d s(normal(random), normal(random), 20 + normal(random));
    const auto rate = [](const Eigen::Vector3d& a) {
      return Eigen::Vector3d(10 * (a[1] - a[0]), a[0] * (28 - a[2]) - a[1], a[0] * a[1] - 8.0 / 3 * a[2]);
    };
    Eigen::MatrixXd y(4000, 3);
    for (int i = -500; i < 4000; ++i) {
      if (i >= 0) y.row(i) = s;
      for (int k = 0; k < 10; ++k) {
        constexpr double h = 5e-4;
        const Eigen::Vector3d a = rate(s), b = rate(s + h / 2 * a), c = rate(s + h / 2 * b), d = rate(s + h * c);
        s += h / 6 * (a + 2 * b + 2 * c + d);
      }
    }
    Recording record;
    record.dt = 5e-3;
    record.source = "run";
    for (int c = 0; c < 3; ++c) {
      const double size = 0.05 * std::sqrt(y.col(c).squaredNorm() / 4000);
      for (int i = 0; i < 4000; ++i) y(i, c) += size * normal(random);
      record.add(std::string(1, static_cast<char>('x' + c)), Quantity::dimensionless, y.col(c));
    }
    return record;
  };
  IdentifyOptions o;
  o.method = Method::sindy;
  const IdentifiedModel model = identify(lorenz(1), o).model;
  for (unsigned seed = 2; seed <= 9; ++seed) {
    const Summary s = validate(model, std::vector{lorenz(seed)}).summary;
    EXPECT_EQ(s.status, Status::ok) << seed << " " << s.warnings.back();
  }
}

}  // namespace
}  // namespace whirl::identification
