// Input that cannot give a model: every front end must say so and why, never return usable wrong numbers.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>

#include "rotor_synthetic.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/paper.hpp"
#include "whirl/identify/second_order.hpp"
#include "whirl/identify/sindy.hpp"
#include "whirl/testing/zoo.hpp"

namespace whirl::identification {
namespace {

using testing::kTurn;

Recording good_rotor(double seconds = 6) {
  RotorModel m;
  m.k1 = std::pow(kTurn * 12, 2);
  m.k2 = 0.25 * m.k1 / 9e-6;
  m.c = 2 * 0.02 * kTurn * 12;
  m.eps = std::polar(1e-4, 0.4);
  const testing::Sweep sweep{30, 0, seconds, 0.3, 1e-3};
  return testing::recording(testing::with_noise(testing::motion(m, sweep), 30, 3), sweep);
}

Recording good_general() {
  for (const testing::ZooSystem& s : testing::zoo()) {
    if (s.name == "Duffing forced") return testing::zoo_record(s, 0.01, 1);
  }
  throw Error("no such system");
}

Channel& channel(Recording& r, const char* name) {
  for (Channel& c : r.channels) {
    if (c.name == name) return c;
  }
  throw Error("no such channel");
}

void keep(Recording& r, Eigen::Index count) {
  for (Channel& c : r.channels) c.samples = c.samples.head(std::min(count, c.samples.size())).eval();
}

struct Spoiler {
  const char* name;
  std::function<void(Recording&)> spoil;  // of a record with displacement channels x and (rotor) y
  const char* reason;                     // part of the diagnosis
};

/// Diagnosis: text of the Error or of the failed summary; empty when the model claims to be usable.
std::string diagnosis(const std::function<IdentifiedModel()>& identify) {
  try {
    const IdentifiedModel m = identify();
    if (m.summary.status != Status::unusable) return "";
    EXPECT_FALSE(m.summary.warnings.empty());
    std::string all;
    for (const std::string& w : m.summary.warnings) all += w + "; ";
    return all;
  } catch (const Error& e) {
    return e.what();
  }
}

TEST(IllPosedRotor, IsDiagnosedByEveryMethod) {
  const Spoiler spoilers[] = {
      {"constant channel", [](Recording& r) { channel(r, "y").samples.setConstant(1e-4); }, "constant"},
      {"two equal columns", [](Recording& r) { channel(r, "y").samples = channel(r, "x").samples; }, "same signal"},
      {"10 samples", [](Recording& r) { keep(r, 10); }, "samples"},
      {"NaN everywhere", [](Recording& r) { channel(r, "x").samples.setConstant(std::nan("")); }, "missing"},
      {"NaN in the angle", [](Recording& r) { channel(r, "beta").samples[700] = std::nan(""); }, "finite"},
      {"1e-300 scale", [](Recording& r) { channel(r, "x").samples *= 1e-300, channel(r, "y").samples *= 1e-300; },
       "constant"},
      {"all zero", [](Recording& r) { channel(r, "x").samples.setZero(), channel(r, "y").samples.setZero(); },
       "constant"},
      {"one revolution", [](Recording& r) { keep(r, 40); }, "turn"},
      {"angle at rest", [](Recording& r) { channel(r, "beta").samples.setConstant(1.0); }, "turn"},
  };
  for (const Spoiler& s : spoilers) {
    Recording r = good_rotor();
    s.spoil(r);
    const std::pair<const char*, std::function<IdentifiedModel()>> methods[] = {
        {"weak", [&] { return identify_rotor(r); }},
        {"paper", [&] { return identify_paper(r); }},
        {"consistent", [&] { return identify_consistent(r); }},
    };
    for (const auto& [method, identify] : methods) {
      const std::string text = diagnosis(identify);
      EXPECT_NE(text.find(s.reason), std::string::npos) << s.name << ", " << method << ": '" << text << "'";
    }
  }
  const Recording good = good_rotor();
  EXPECT_EQ(diagnosis([&] { return identify_rotor(good); }), "");
}

TEST(IllPosedGeneral, IsDiagnosed) {
  const Spoiler spoilers[] = {
      {"constant state", [](Recording& r) { channel(r, "x").samples.setConstant(2.0); }, "constant"},
      {"constant input", [](Recording& r) { channel(r, "u").samples.setConstant(2.0); }, "constant"},
      {"two equal columns", [](Recording& r) { channel(r, "v").samples = channel(r, "x").samples; }, "same signal"},
      {"input equal to a state", [](Recording& r) { channel(r, "u").samples = 3 * channel(r, "x").samples; },
       "same signal"},
      {"10 samples", [](Recording& r) { keep(r, 10); }, "samples"},
      {"NaN everywhere", [](Recording& r) { channel(r, "x").samples.setConstant(std::nan("")); }, "finite"},
      {"1e-300 scale", [](Recording& r) { channel(r, "x").samples *= 1e-300; }, "range of numbers"},
      {"1e300 scale", [](Recording& r) { channel(r, "v").samples *= 1e300; }, "range of numbers"},
      {"all zero", [](Recording& r) { channel(r, "v").samples.setZero(); }, "zero"},
      {"noise alone",
       [](Recording& r) {
         std::mt19937_64 engine(8);
         std::normal_distribution<double> normal;
         for (double& v : channel(r, "x").samples) v = normal(engine);
       },
       "noise"},
  };
  for (const Spoiler& s : spoilers) {
    Recording r = good_general();
    s.spoil(r);
    for (const bool refine : {true, false}) {
      SindyOptions o;
      o.states = {"x", "v"};
      o.inputs = {"u"};
      o.refine = refine;
      const std::string text = diagnosis([&] { return fit_sindy({r}, o); });
      EXPECT_NE(text.find(s.reason), std::string::npos) << s.name << ": '" << text << "'";
    }
  }
  SindyOptions o;
  o.states = {"x", "v"};
  o.inputs = {"u"};
  const Recording good = good_general();
  EXPECT_EQ(diagnosis([&] { return fit_sindy({good}, o); }), "");
}

TEST(IllPosedGeneral, AMissingInputOrStateIsTold) {
  const Recording r = good_general();
  SindyOptions o;
  o.states = {"x", "v"};
  EXPECT_NE(diagnosis([&] { return fit_sindy({r}, o); }), "") << "input not named";
}

TEST(IllPosedSecondOrder, IsDiagnosed) {
  const Spoiler spoilers[] = {
      {"constant output", [](Recording& r) { channel(r, "x").samples.setConstant(2.0); }, "constant"},
      {"constant input", [](Recording& r) { channel(r, "u").samples.setConstant(2.0); }, "constant"},
      {"output is the input", [](Recording& r) { channel(r, "u").samples = channel(r, "x").samples; }, "same signal"},
      {"10 samples", [](Recording& r) { keep(r, 10); }, "samples"},
      {"NaN", [](Recording& r) { channel(r, "x").samples[7] = std::nan(""); }, "nan"},
      {"1e-300 scale", [](Recording& r) { channel(r, "x").samples *= 1e-300; }, "range of numbers"},
      {"all zero", [](Recording& r) { channel(r, "u").samples.setZero(); }, "zero"},
  };
  for (const Spoiler& s : spoilers) {
    Recording r = good_general();
    s.spoil(r);
    const std::string text = diagnosis([&] { return identify_second_order(r, {.output = "x"}); });
    EXPECT_NE(text.find(s.reason), std::string::npos) << s.name << ": '" << text << "'";
  }
}

}  // namespace
}  // namespace whirl::identification
