// The exported C was written apart from the library: whatever happens to a rotor, both decide the same at every tick.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>

#include "../step_difference.hpp"

namespace whirl::deploy {
namespace {

using Complex = std::complex<double>;
constexpr double kTick = 1e-3;
constexpr std::size_t kMemory = 32;  // ticks of the force that the actuator may be late

/// A disc on a linear shaft, four steps a tick, and what becomes of its force.
struct SmallRotor {
  double k1 = 3600, c = 6, omega = 150, slowing = 0, beta = 0;
  Complex z, v, eps;
  double gain_x = 1, gain_y = 1, growth = 0;
  std::size_t late = 0, tick = 0;
  std::array<Complex, kMemory> asked{};

  void turn(Complex acceleration) {
    asked[tick++ % kMemory] = acceleration;
    const Complex a = tick > late ? asked[(tick - 1 - late) % kMemory] : Complex{};
    for (int i = 0; i < 4; ++i) {
      const double h = kTick / 4;
      const Complex unbalance = eps * Complex(omega * omega, -slowing) * std::polar(1.0, beta);
      v += h * (-k1 * z - (c - growth) * v + unbalance + Complex(gain_x * a.real(), gain_y * a.imag()));
      z += h * v;
      beta += h * omega;
      omega = std::max(omega + h * slowing, 0.0);
    }
  }
};

/// What happens to it, from which tick to which.
struct Event {
  enum Kind { gains, late, unbalance, growth, lost, jitter, kinds };
  int kind = 0;
  long from = 0, until = 0;
  double first = 0, second = 0;
};

/// Numbers of a seed, the same with every library.
struct Draw {
  std::mt19937_64 random;
  double in(double low, double high) { return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53; }
  double of(std::initializer_list<double> values) { return values.begin()[random() % values.size()]; }
};

Event draw_event(Draw& draw, long ticks) {
  Event e;
  e.kind = static_cast<int>(draw.random() % Event::kinds);
  e.from = draw.random() % 5 == 0 ? 0 : static_cast<long>(draw.in(20, 0.8 * static_cast<double>(ticks)));
  e.until = draw.random() % 2 == 0 ? ticks : e.from + static_cast<long>(draw.in(3, 200));
  if (e.kind == Event::gains) {
    e.first = draw.of({0, 0, -1, 0.3, 0.5, 1, 1.3}), e.second = draw.of({0, -1, 0.2, 1, 1, e.first, e.first});
  } else if (e.kind == Event::late) {
    e.first = draw.of({3, 6, 8, 10, 12, 15});
  } else if (e.kind == Event::unbalance) {
    e.first = draw.of({0, 0.2, 0.6, 1.5, 2, 3, 5}), e.second = draw.of({0, 0, 0.5, 1.5, std::numbers::pi});
  } else if (e.kind == Event::growth) {
    e.first = draw.in(5, 60);
  } else if (e.kind == Event::jitter) {
    e.first = draw.in(20e-6, 600e-6), e.second = draw.in(20, 90);
  }
  return e;
}

/// Design of a rotor as it is believed to be.
ControllerDesign watched(const char* law, const char* estimator, double limit, double slew, double hysteresis) {
  ControllerDesign d;
  d.law = law;
  d.estimator = estimator;
  d.model.k1 = 3600;
  d.model.c = 6;
  d.model.gain = 1;
  d.model.eps = std::polar(200e-6, 0.7);
  d.sample_time = kTick;
  d.delay = 1.2e-3;
  d.force_limit = limit;
  d.feedforward = d.law != "tsmc_paper";  // there nothing but the feedback carries the unbalance
  d.parameters = {
      {"supervise", 1}, {"watch_level", 60e-6}, {"slew_limit", slew}, {"hysteresis", hysteresis}, {"stale_limit", 20}};
  return d;
}

struct Seen {
  std::uint32_t words = 0;
  long ticks = 0, trips = 0;
  double worst = 0, largest = 0;
};

/// One life of a rotor under both, until a trip.
void live(const ControllerDesign& d, const Exported& exported, std::uint64_t seed, Seen& seen) {
  Draw draw{std::mt19937_64(seed)};
  constexpr long kTicks = 900;
  SmallRotor r;
  r.k1 *= draw.in(0.8, 1.2), r.c *= draw.in(0.3, 1.5);
  r.eps = d.model.eps * draw.in(0.7, 1.4) * std::polar(1.0, draw.in(-0.3, 0.3));
  r.omega = draw.of({8, 40, 70, 110, 150, 150, 150}), r.slowing = draw.of({0, 0, -20, -80, 60});
  if (draw.random() % 3 != 0) {  // else at rest at full speed
    const double w = r.omega;
    r.z = r.eps * w * w / Complex(r.k1 - w * w, r.c * w), r.v = Complex(0, w) * r.z;
  }
  std::array<Event, 3> events;
  for (Event& e : events) e = draw_event(draw, kTicks);
  const double noise = draw.of({0.3e-6, 1e-6, 5e-6});
  const SmallRotor sound = r;
  exported.library->get<int()>("start")();
  control::Controller controller = control::make_controller(d);
  for (long k = 0; k < kTicks; ++k) {
    Measurement m{static_cast<double>(k) * kTick, r.z.real(), r.z.imag(), r.beta, r.omega, r.slowing, true};
    m.x += draw.in(-noise, noise), m.y += draw.in(-noise, noise);
    r.gain_x = r.gain_y = 1, r.late = 0, r.growth = 0, r.eps = sound.eps;
    for (const Event& e : events) {
      if (k < e.from || k >= e.until) continue;
      if (e.kind == Event::gains) r.gain_x = e.first, r.gain_y = e.second;
      if (e.kind == Event::late) r.late = static_cast<std::size_t>(e.first);
      if (e.kind == Event::unbalance) r.eps *= e.first * std::polar(1.0, e.second);
      if (e.kind == Event::growth) r.growth = e.first;
      if (e.kind == Event::lost) m.valid = (k - e.from) % 23 > 7;
      if (e.kind == Event::jitter) m.x += e.first * std::sin(e.second * m.t), m.y += 0.7 * e.first * std::cos(m.t);
    }
    const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
    double out[3] = {};
    const int status = exported.go(in, m.valid ? 1 : 0, out);
    const auto answer = controller.step(m);
    const std::uint32_t word = controller.state().supervision.word;
    ASSERT_EQ(status == 0, static_cast<bool>(answer)) << d.law << ", seed " << seed << ", tick " << k;
    const bool tripped = !answer && answer.error() == control::kSupervision;
    ASSERT_EQ(status == 4, tripped) << d.law << ", seed " << seed << ", tick " << k;
    seen.trips += tripped;
    if (!answer && !tripped) return;  // readings lost for too long: no word of the supervision
    ASSERT_EQ(static_cast<std::uint32_t>(out[2]), word) << d.law << ", seed " << seed << ", tick " << k;
    ++seen.ticks, seen.words |= word;
    if (tripped) return;
    const double off = std::max(std::abs(out[0] - answer->ux), std::abs(out[1] - answer->uy));
    seen.largest = std::max({seen.largest, std::abs(answer->ux), std::abs(answer->uy)});
    seen.worst = std::max(seen.worst, off);
    ASSERT_LE(off, 1e-9 * (1 + seen.largest)) << d.law << ", seed " << seed << ", tick " << k;
    r.turn({answer->ux, answer->uy});
  }
}

void compare(const ControllerDesign& d, std::uint32_t expected) {
  const Exported exported(d, "", testing::kStrictC99);
  ASSERT_NE(exported.go, nullptr);
  Seen seen;
  // The last ones: rounding left a sum of squares below zero at the first reading of these.
  for (std::uint64_t seed = 1; seed <= 123 && !::testing::Test::HasFatalFailure(); ++seed) {
    live(d, exported, seed <= 120 ? seed : std::array{197U, 1174U, 2010U}[seed - 121], seen);
  }
  EXPECT_EQ(seen.words & expected, expected) << control::supervision_text(seen.words);
  std::printf("%s %s: %ld ticks, %ld trips, forces apart by %.1e of the largest; %s\n", d.law.c_str(),
              d.estimator.c_str(), seen.ticks, seen.trips, seen.worst / seen.largest,
              control::supervision_text(seen.words).c_str());
}

constexpr std::uint32_t kForces =
    control::kForceLost | control::kForceReversed | control::kForceLate | control::kForceTested;
constexpr std::uint32_t kSteps = control::kGrowth | control::kWorseThanOpen | control::kSensorLost |
                                 control::kSaturation | control::kGainLowered | control::kFeedbackOff |
                                 control::kForceOff | control::kUnbalanceChanged;

TEST(SupervisionExport, AFixedFeedforwardIsWatchedTickByTick) {
  compare(watched("pd", "lpf", 12, 0, 0), kForces | kSteps | control::kFeedforwardPhase);
}

TEST(SupervisionExport, AnEstimateOfTheUnbalanceIsWatchedTickByTick) {
  compare(watched("lsmc", "kfe", 9, 4000, 0.2), kForces | kSteps);
}

TEST(SupervisionExport, AFeedbackThatCarriesTheUnbalanceIsWatchedTickByTick) {
  compare(watched("tsmc_paper", "lpf", 15, 0, 0.5), kForces | control::kGrowth | control::kFeedforwardReplaced);
}

}  // namespace
}  // namespace whirl::deploy
