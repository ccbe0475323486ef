#include "whirl/tuning/law_file.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <string>

#include "whirl/core/error.hpp"
#include "whirl/io/json.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::tuning {
namespace {

using Complex = std::complex<double>;

OwnLaw law_of(const std::string& text, double sample_time = 1e-3) {
  return read_law(io::parse_json(R"({"schema": "whirl.law/1", )" + text + "}", "law.json"), "law.json", sample_time);
}

/// Response of an axis to one input at a frequency, from many samples of a sine.
Complex response(control::LinearAxis law, std::size_t input, double omega, double h) {
  constexpr int kSamples = 40000;
  Complex sum = 0;
  for (int k = 0; k < 2 * kSamples; ++k) {
    control::LinearAxis::Inputs u{};
    u[input] = std::cos(omega * h * k);
    const double a = law.step(u);
    if (k >= kSamples) sum += a * std::polar(2.0 / kSamples, -omega * h * k);
  }
  return sum;
}

// K / (T s + 1) with s = (2/h)(z - 1)/(z + 1): pole (2T - h)/(2T + h), step response K (1 - r^k (1 - d/K)).
TEST(LawFileReference, ALagIsItsBilinearClosedForm) {
  const double K = -4000, T = 0.02, h = 1e-3;
  for (const char* law :
       {R"("x": {"num": [-4000], "den": [0.02, 1]})", R"("x": {"A": [[-50]], "B": [1], "C": [-200000], "D": 0})"}) {
    control::LinearAxis x = law_of(law, h).x;
    const double pole = (2 * T - h) / (2 * T + h), first = K * h / (2 * T + h);
    for (int k = 0; k < 100; ++k) {
      const double expected = K - (K - first) * std::pow(pole, k);
      EXPECT_NEAR(x.step({1, 0, 0, 0}), expected, 1e-9 * std::abs(K)) << law << " " << k;
    }
  }
}

// The bilinear rule maps frequency to (2/h) tan(w h / 2) and leaves the response as it is.
TEST(LawFileReference, ATransferFunctionOfTheLargestOrderHasItsResponse) {
  // Two resonances, two notches, lead and lags: order 12 in s, poles from 20 to 2500 rad/s.
  std::vector<double> den{1}, num{1};
  const auto times = [](std::vector<double>& p, std::vector<double> factor) {
    std::vector<double> out(p.size() + factor.size() - 1, 0);
    for (std::size_t i = 0; i < p.size(); ++i)
      for (std::size_t j = 0; j < factor.size(); ++j) out[i + j] += p[i] * factor[j];
    p = out;
  };
  for (const double w : {20.0, 80.0, 290.0, 700.0, 1500.0, 2500.0}) {
    times(den, {1 / (w * w), 0.6 / w, 1});
    times(num, {1 / (w * w), 0.4 / w, 1});
  }
  num.pop_back();
  num.insert(num.begin(), 0);
  const auto list = [](const std::vector<double>& p) {
    std::string out;
    for (const double v : p) out += fmt::format("{}{:.17g}", out.empty() ? "" : ", ", v);
    return out;
  };
  const double h = 1e-4;
  const OwnLaw law = law_of(fmt::format(R"("x": {{"num": [{}], "den": [{}]}})", list(num), list(den)), h);
  EXPECT_EQ(law.x.order, 12);
  for (const double w : {2 * std::numbers::pi * 10, 2 * std::numbers::pi * 50, 2 * std::numbers::pi * 300}) {
    const Complex s{0, 2 / h * std::tan(0.5 * w * h)};
    Complex n = 0, d = 0;
    for (const double v : num) n = n * s + v;
    for (const double v : den) d = d * s + v;
    EXPECT_LT(std::abs(response(law.x, 0, w, h) - n / d), 1e-6 * std::abs(n / d)) << w;
    EXPECT_LT(std::abs(response(law.y, 1, w, h) - n / d), 1e-6 * std::abs(n / d)) << w;
  }
}

TEST(LawFileUnit, AxesMayBeAloneAlikeOrCoupled) {
  OwnLaw law = law_of(R"("sample_time_s": 0.001, "x": {"D": [-100, -2]}, "y": {"D": [[-300]]})");
  EXPECT_EQ(law.x.step({1, 10, 100, 1000}), -300);
  EXPECT_EQ(law.y.step({1, 10, 100, 1000}), -3000);
  EXPECT_EQ(law.sample_time, 1e-3);
  law = law_of(R"("D": [[1, 2, 3, 4], [5, 6, 7, 8]])");
  EXPECT_EQ(law.x.step({1, 10, 100, 1000}), 4321);
  EXPECT_EQ(law.y.step({1, 10, 100, 1000}), 8765);
  law = law_of(R"("sample_time_s": 0.001, "A": [[0.5, 0], [0, 0.25]], "B": [[1, 0], [0, 1]], "C": [[0, 1], [1, 0]])");
  law.x.step({1, 10, 0, 0}), law.y.step({1, 10, 0, 0});
  EXPECT_EQ(law.x.step({}), 10);
  EXPECT_EQ(law.y.step({}), 1);
  law = law_of(R"("sample_time_s": 0.001, "x": {"num": [2, 1], "den": [1, -0.5]})");
  EXPECT_EQ(law.x.step({1, 0, 0, 0}), 2);
  EXPECT_EQ(law.x.step({}), 2);
}

TEST(LawFileUnit, WhatIsWrongGivesOneErrorWithPlaceValueAndWhatIsAllowed) {
  const std::pair<const char*, std::vector<const char*>> cases[] = {
      {R"("x": {"num": [1, 0, 0], "den": [1, 1]})", {"$.x.num", "degree 2", "1", "not proper"}},
      {R"("x": {"num": [1], "den": [0, 0]})", {"$.x.den", "not 0"}},
      {R"("x": {"num": [1], "den": [1,1,1,1,1,1,1,1,1,1,1,1,1,1]})", {"$.x.den", "order 13", "at most 12"}},
      {R"("x": {"num": [1]})", {"$.x", "den"}},
      {R"("x": {"num": [1, "a"], "den": [1, 1]})", {"$.x.num"}},
      {R"("x": {"num": [null], "den": [1, 1]})", {"$.x.num"}},
      {R"("x": {"A": [[1, 2]], "B": [[1]], "C": [[1]]})", {"$.x.A[0]", "2 numbers", "must be 1"}},
      {R"("x": {"A": [[1, 2], [3, 4]], "B": [[1], [2]], "C": [[1]]})", {"$.x.C", "1", "2"}},
      {R"("x": {"A": [[1]], "B": [[1, 2, 3]], "C": [[1]]})", {"$.x.B", "3 columns", "1 (displacement)"}},
      {R"("x": {"A": [[1]], "B": [[1]]})", {"$.x", "A, B and C"}},
      {R"("x": {"A": [[1e400]], "B": [[1]], "C": [[1]]})", {"law.json"}},
      {R"("x": {"gain": 1})", {"$.x", "key 'gain'"}},
      {R"("x": {"D": [1]}, "z": 1)", {"key 'z'"}},
      {R"("x": {"D": [1]}, "D": [[1, 0], [0, 1]])", {"either"}},
      {R"("y": {"D": [1]})", {"either"}},
      {R"("D": [[1, 0], [0, 1]], "y": {"D": [1]})", {"$.y", "leave it out"}},
      {R"("D": [[1, 0, 0], [0, 1, 0]])", {"$.D", "3 columns", "2 (displacement) or 4"}},
      {R"("sample_time_s": 0.002, "x": {"D": [1]})", {"$.sample_time_s", "0.002 s", "0.001 s"}},
      {R"("sample_time_s": 0, "x": {"D": [1]})", {"$.sample_time_s", "0 s", "0.001 s"}},
      {R"("x": {"num": [1], "den": [1, -2000]})", {"$.x", "2000 1/s"}},
      {R"("x": 3)", {"$.x"}},
  };
  for (const auto& [text, parts] : cases) {
    const std::string why = testing::error_of([&] { law_of(text); });
    EXPECT_NE(why.find("law.json"), std::string::npos) << text << ": " << why;
    for (const char* part : parts) EXPECT_NE(why.find(part), std::string::npos) << text << ": " << why;
  }
}

}  // namespace
}  // namespace whirl::tuning
