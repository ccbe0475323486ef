#include "whirl/records/check.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <numbers>
#include <random>

#include "whirl/testing/damages.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::records {
namespace {

using testing::Damage;
using testing::Oddity;

constexpr double kTurn = 2 * std::numbers::pi;

Recording sound(unsigned seed, double snr) {
  const testing::DrawnMachine d = testing::draw_machine(Oddity::none, seed);
  static std::map<unsigned, Eigen::MatrixX2d> motions;
  if (!motions.contains(seed)) motions[seed] = testing::readings(d.machine, d.run);
  Eigen::MatrixX2d z = motions[seed];
  testing::add_noise(z, snr, seed * 31 + 7);
  return testing::machine_record(z, d.run);
}

std::string all(const RecordReport& report) {
  std::string out;
  for (const Finding& f : report.findings) out += f.text() + "\n";
  return out;
}

struct Expected {
  Damage damage;
  FindingKind kind;
  Severity severity;
};

// Every damage is named on the channel it concerns, in 20 seeds at 20 and 40 dB.
TEST(RecordCheckProperty, NamesEveryDamage) {
  const Expected expected[] = {
      {Damage::outliers, FindingKind::spikes, Severity::mask},
      {Damage::nan_gap, FindingKind::gap, Severity::mask},
      {Damage::zero_gap, FindingKind::dropout, Severity::mask},
      {Damage::clipping, FindingKind::clipping, Severity::mask},
      {Damage::hum50, FindingKind::hum, Severity::model},
      {Damage::hum60, FindingKind::hum, Severity::model},
      {Damage::drift, FindingKind::drift, Severity::model},
      {Damage::frozen, FindingKind::frozen, Severity::mask},
      {Damage::splice, FindingKind::splice, Severity::refuse},
      {Damage::swapped_axes, FindingKind::whirl_sense, Severity::refuse},
      {Damage::reversed_axis, FindingKind::whirl_sense, Severity::refuse},
      {Damage::reversed_rotation, FindingKind::whirl_sense, Severity::refuse},
      {Damage::degrees, FindingKind::angle_unit, Severity::refuse},
      {Damage::millimetres, FindingKind::size, Severity::refuse},
  };
  for (const Expected& e : expected) {
    int found = 0, others = 0;
    std::string text;
    for (unsigned seed = 1; seed <= 10; ++seed) {
      for (const double snr : {20.0, 40.0}) {
        const RecordReport r = check(testing::damaged(sound(seed, snr), e.damage, seed));
        const Finding* f = r.find(e.kind);
        found += f != nullptr && f->severity == e.severity;
        for (const Finding& g : r.findings) {
          // A jump of x or y where two runs are joined may look like a spike.
          if (g.kind == e.kind || (e.damage == Damage::splice && g.kind == FindingKind::spikes)) continue;
          ++others;
          text += g.text() + "\n";
        }
      }
    }
    EXPECT_GE(found, 20) << to_string(e.damage);
    EXPECT_LE(others, 0) << to_string(e.damage) << "\n" << text;
  }
}

// The samples masked are the damaged ones.
TEST(RecordCheckProperty, MasksWhatIsDamagedAndLittleElse) {
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const Recording before = sound(seed, 20);
    for (const Damage d : {Damage::outliers, Damage::frozen, Damage::zero_gap, Damage::nan_gap, Damage::clipping}) {
      const Recording after = testing::damaged(before, d, seed);
      const RecordReport r = check(after);
      Eigen::Index damaged = 0, caught = 0, wrong = 0;
      for (const char* name : {"x", "y"}) {
        const ChannelMask* m = r.mask(name);
        for (Eigen::Index i = 0; i < before.size(); ++i) {
          const bool bad = !(after[name][i] == before[name][i]);
          const bool masked = m != nullptr && !m->usable[i];
          damaged += bad;
          caught += bad && masked;
          wrong += masked && !bad;
        }
      }
      EXPECT_GE(static_cast<double>(caught), 0.98 * static_cast<double>(damaged)) << to_string(d) << " seed " << seed;
      EXPECT_LE(static_cast<double>(wrong), 0.02 * static_cast<double>(damaged) + 2)
          << to_string(d) << " seed " << seed;
    }
  }
}

Recording one_channel(const Eigen::VectorXd& v, double dt, Quantity q = Quantity::displacement) {
  Recording r;
  r.dt = dt;
  r.source = "made";
  r.add("x", q, v);
  return r;
}

Eigen::VectorXd rounded(const Eigen::VectorXd& v, double quantum) {
  return (v / quantum).array().round().matrix() * quantum;
}

/// Sound records of many kinds.
Recording clean_record(unsigned seed, std::string& kind) {
  std::mt19937_64 random(seed * 7 + 3);
  std::normal_distribution<double> normal;
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  const double dt = 1e-3;
  const Eigen::Index n = 8000;
  Eigen::VectorXd v(n);
  switch (seed % 10) {
    case 0:
      kind = "rotor, noise";
      return sound(seed, uniform(5, 60));
    case 1: {  // odd rotors, quantised by the converter
      kind = "odd rotor, quantised";
      const auto oddity = testing::kOddities[seed / 10 % testing::kOddities.size()];
      Recording r = testing::machine_record(testing::draw_machine(oddity, seed), uniform(20, 80), seed);
      for (int k = 0; k < 2; ++k)
        r.channels[static_cast<std::size_t>(k)].samples =
            rounded(r.channels[static_cast<std::size_t>(k)].samples, std::pow(10, uniform(-8, -5)));
      return r;
    }
    case 2: {  // multisine with noise, as in a laboratory
      kind = "multisine";
      v.setZero();
      for (int k = 1; k <= 200; ++k) {
        const double phase = uniform(-3, 3);
        for (Eigen::Index i = 0; i < n; ++i) v[i] += std::cos(kTurn * k * static_cast<double>(i) / n * 4 + phase);
      }
      for (double& s : v) s += 0.1 * normal(random);
      return one_channel(v, dt, Quantity::voltage);
    }
    case 3: {  // ring-down after blows, from rest, without noise
      kind = "blows";
      double x = 0, u = 0;
      const double w = kTurn * uniform(5, 60), z = uniform(0.005, 0.05);
      for (Eigen::Index i = 0; i < n; ++i) {
        if (i % 2500 == 400) u += uniform(0.5, 2);
        for (int k = 0; k < 10; ++k) {
          u += dt / 10 * (-w * w * x - 2 * z * w * u);
          x += dt / 10 * u;
        }
        v[i] = x;
      }
      return one_channel(uniform(0, 1) < 0.5 ? v : rounded(v, 1e-5), dt);
    }
    case 4: {  // slow sine, coarse converter, no noise: long equal stretches at the turns
      kind = "quantised sine";
      const double f = uniform(0.1, 30);
      for (Eigen::Index i = 0; i < n; ++i) v[i] = std::sin(kTurn * f * dt * static_cast<double>(i));
      return one_channel(rounded(v, std::pow(2, -std::floor(uniform(6, 15)))), dt);
    }
    case 5: {  // chaotic: Roessler x, y, z
      kind = "Roessler";
      Eigen::Vector3d s(uniform(-5, 5), uniform(-5, 5), 0);
      const double c = uniform(5, 14), level = std::pow(10, uniform(-6, -1));
      Eigen::MatrixX3d out(n, 3);
      for (Eigen::Index i = 0; i < n + 4000; ++i) {
        for (int k = 0; k < 4; ++k) {
          const Eigen::Vector3d d(-s[1] - s[2], s[0] + 0.2 * s[1], 0.2 + s[2] * (s[0] - c));
          s += 0.005 * d;
        }
        if (i >= 4000) out.row(i - 4000) = s.transpose();
      }
      Recording r;
      r.dt = 0.02;
      for (int k = 0; k < 3; ++k) {
        Eigen::VectorXd q = out.col(k);
        for (double& e : q) e += level * normal(random);
        r.add(std::string(1, static_cast<char>('x' + k)), Quantity::dimensionless, q);
      }
      return r;
    }
    case 6: {  // broad-band response
      kind = "random vibration";
      const double a = uniform(0, 0.99);
      double s = 0;
      for (double& e : v) e = s = a * s + normal(random);
      return one_channel(v, dt, Quantity::acceleration);
    }
    case 7: {  // commands: square wave, held random steps, trapezoid
      kind = "commands";
      Recording r;
      r.dt = dt;
      Eigen::VectorXd a(n), b(n), t(n);
      const auto hold = static_cast<Eigen::Index>(uniform(3, 200));
      for (Eigen::Index i = 0; i < n; ++i) {
        a[i] = i / 500 % 2 ? 1 : -1;
        b[i] = i % hold == 0 ? normal(random) : b[i - 1];
        t[i] = std::clamp(2 * std::sin(kTurn * 0.5 * dt * static_cast<double>(i)), -1.0, 1.0);
      }
      r.add("u", Quantity::voltage, a);
      r.add("v", Quantity::force, t);
      r.add("w", Quantity::dimensionless, b);
      return r;
    }
    case 8: {  // steady speed, several orders
      kind = "steady";
      const double f = uniform(8, 70);
      Recording r;
      r.dt = dt;
      Eigen::VectorXd y(n), beta(n);
      for (Eigen::Index i = 0; i < n; ++i) {
        beta[i] = kTurn * f * dt * static_cast<double>(i);
        v[i] = 1e-4 * std::cos(beta[i]) + 1e-5 * std::cos(2 * beta[i] + 1) + 2e-6 * normal(random);
        y[i] = 0.9e-4 * std::sin(beta[i]) + 1e-5 * std::sin(2 * beta[i] + 1) + 2e-6 * normal(random);
      }
      r.add("x", Quantity::displacement, v);
      r.add("y", Quantity::displacement, y);
      r.add("beta", Quantity::angle, beta.unaryExpr([](double b) { return std::fmod(b, kTurn); }));
      return r;
    }
    default: {  // run-up from rest, encoder of 1024 counts
      kind = "run-up";
      testing::DrawnMachine d = testing::draw_machine(Oddity::anisotropic, seed);
      std::swap(d.run.from_hz, d.run.to_hz);
      Recording r = testing::machine_record(d, uniform(20, 60), seed);
      r.channels[2].samples = r.channels[2].samples.unaryExpr(
          [](double b) { return std::remainder(std::floor(b / kTurn * 1024) / 1024 * kTurn, kTurn); });
      return r;
    }
  }
}

// What a logger writes where it has no reading, some samples in a row: no limit of the range, and no motion.
TEST(RecordCheckProperty, RunsOfEqualSamplesOutOfReachAreBadSamplesAndNoClipping) {
  for (unsigned seed = 1; seed <= 6; ++seed) {
    const Recording before = sound(seed, 40);
    const double most = before["y"].cwiseAbs().maxCoeff();
    for (const double value : {-9999e-6, 5 * most, -5 * most}) {
      for (const Eigen::Index length : {2, 3, 4, 9, 30}) {
        Recording after = before;
        Eigen::VectorXd& y = std::ranges::find(after.channels, "y", &Channel::name)->samples;
        const std::array starts{after.size() / 5, after.size() / 2, 3 * after.size() / 4};
        for (const Eigen::Index first : starts) y.segment(first, length).setConstant(value);
        const RecordReport r = check(after);
        EXPECT_EQ(r.find(FindingKind::clipping), nullptr) << value << ' ' << length << '\n' << all(r);
        const ChannelMask* m = r.mask("y");
        ASSERT_NE(m, nullptr) << value << ' ' << length;
        for (const Eigen::Index first : starts)
          EXPECT_FALSE(m->usable.segment(first, length).any()) << value << ' ' << length;
        EXPECT_LE((!m->usable).count(), 3 * length + 3) << value << ' ' << length;
      }
    }
    // Two such values, one above and one below.
    Recording both = before;
    Eigen::VectorXd& y = std::ranges::find(both.channels, "y", &Channel::name)->samples;
    y.segment(y.size() / 3, 4).setConstant(5 * most);
    y.segment(y.size() / 2, 4).setConstant(-5 * most);
    EXPECT_EQ(check(both).find(FindingKind::clipping), nullptr) << all(check(both));
    EXPECT_NE(check(both).mask("y"), nullptr);
  }
}

// A signal that is cut off reaches its limit by its own slope, also where it is short and steep.
TEST(RecordCheck, AShortSteepMotionAtTheLimitIsClipping) {
  std::mt19937_64 random(4);
  std::normal_distribution<double> normal(0, 0.01);
  Eigen::VectorXd v(4000);
  for (Eigen::Index i = 0; i < v.size(); ++i) {
    const double t = 1e-3 * static_cast<double>(i), near = 30 * (t - 2);
    v[i] = std::min(
        1.0, 0.2 * std::sin(kTurn * 20 * t) + 8 * std::exp(-near * near) * std::cos(kTurn * 40 * t) + normal(random));
  }
  const RecordReport r = check(one_channel(v, 1e-3));
  EXPECT_NE(r.find(FindingKind::clipping), nullptr) << all(r);
}

// Fewer than 1 % of sound records are found fault with.
// Four to five samples a period: a limit holds single samples, never two in a row.
TEST(RecordCheck, FastSignalsAreCutOffForSingleSamples) {
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  Recording record;
  record.dt = 1e-2;
  Eigen::VectorXd clean(8000), coarse(8000), shares(8000);
  std::complex<double> q;
  for (Eigen::Index i = 0; i < clean.size(); ++i) {
    q = std::polar(0.97, kTurn * 0.22) * q + normal(random);
    clean[i] = q.real();
    const auto t = static_cast<double>(i);
    coarse[i] = std::round(20 * std::sin(kTurn * 0.2137 * t + 0.3)) / 20;
    shares[i] = std::sin(kTurn * 0.2 * t + 0.1);  // every value comes back after five samples
  }
  Eigen::VectorXd cut = clean.cwiseMin(0.6 * clean.maxCoeff());
  for (const auto& [name, v] : {std::pair{"clean", clean}, {"coarse", coarse}, {"shares", shares}, {"cut", cut}})
    record.add(name, Quantity::acceleration, v);
  const RecordReport report = check(record);
  for (const char* name : {"clean", "coarse", "shares"})
    EXPECT_EQ(report.find(FindingKind::clipping, name), nullptr) << name << "\n" << all(report);
  const Finding* f = report.find(FindingKind::clipping, "cut");
  ASSERT_NE(f, nullptr) << all(report);
  EXPECT_EQ(f->samples, (cut.array() == cut.maxCoeff()).count());
}

// A mark that passes a probe ever faster: at the end one sample wide, which is no spike.
TEST(RecordCheck, PulsesOnceATurnAreNoSpikes) {
  Recording r;
  r.dt = 1.0 / 2000;
  std::mt19937 random(9);
  std::normal_distribution<double> normal;
  Eigen::VectorXd pulse(40000);
  double turns = 0.3;
  for (Eigen::Index i = 0; i < pulse.size(); ++i) {
    turns += r.dt * (2 + 40 * static_cast<double>(i) / 40000);
    pulse[i] = (turns - std::floor(turns) < 0.03 ? 5 : 0) + 0.03 * normal(random);
  }
  r.add("probe", Quantity::voltage, pulse);
  EXPECT_TRUE(check(r).findings.empty()) << all(check(r));
  // Needles at any time on a quiet channel of the same size are.
  for (Eigen::Index i = 0; i < pulse.size(); ++i) pulse[i] = 0.03 * normal(random);
  for (int k = 0; k < 60; ++k) pulse[std::uniform_int_distribution<Eigen::Index>(10, 39990)(random)] += 5;
  r.channels.front().samples = pulse;
  EXPECT_FALSE(check(r).findings.empty());
}

// An angle that goes on over the turns is read right at any rate; the motion once a turn is not.
TEST(RecordCheck, TwoSamplesATurnAreToldAsSuchAndNotAsASplice) {
  for (const double samples : {1.7, 2.3, 4.0}) {
    for (const bool wrapped : {false, true}) {
      Recording r;
      r.dt = 0.02;
      Eigen::VectorXd x(600), y(600), beta(600);
      for (Eigen::Index i = 0; i < beta.size(); ++i) {
        const double turns = 0.5 * static_cast<double>(i * i) / (600 * samples) + 0.1;  // a run-up
        beta[i] = kTurn * (wrapped ? turns - std::floor(turns) : turns);
        x[i] = 1e-4 * std::cos(kTurn * turns), y[i] = 1e-4 * std::sin(kTurn * turns);
      }
      r.add("x", Quantity::displacement, x);
      r.add("y", Quantity::displacement, y);
      r.add("beta", Quantity::angle, beta);
      const RecordReport report = check(r);
      const Finding* f = report.find(FindingKind::undersampled, "beta");
      if (samples > 2.56) {
        EXPECT_EQ(f, nullptr) << all(report);
        continue;
      }
      if (wrapped && samples < 2) continue;  // nothing tells such an angle from a slower one
      ASSERT_NE(f, nullptr) << samples << all(report);
      EXPECT_NEAR(f->size, samples, 0.1 * samples);
      EXPECT_EQ(f->severity == Severity::refuse, samples < 2);
      EXPECT_EQ(report.find(FindingKind::splice, "beta"), nullptr);
    }
  }
}

TEST(RecordCheckProperty, SoundRecordsRaiseNoAlarm) {
  std::map<std::string, int> alarms;
  int total = 0, records = 400;
  std::string texts;
  for (unsigned seed = 1; seed <= static_cast<unsigned>(records); ++seed) {
    std::string kind;
    const RecordReport r = check(clean_record(seed, kind));
    if (r.findings.empty()) continue;
    ++total;
    ++alarms[kind];
    texts += std::to_string(seed) + " " + kind + ": " + all(r);
  }
  EXPECT_LT(total, records / 100) << texts;
}

}  // namespace
}  // namespace whirl::records
