#include "whirl/io/json.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <random>
#include <regex>

#include "whirl/io/file.hpp"
#include "whirl/io/model_json.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using whirl::testing::error_of;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

IdentifiedModel rotor_model() {
  IdentifiedModel m;
  m.method = "weak";
  m.states = {"X1", "X2"};
  m.inputs = {"X5"};
  m.equations = {
      {"X2'", {{"X1", Estimate::from_sd(-5667.1, 3.2), "1/s^2"}, {"X1^3", {-1e7, kNan, kNan, kNan}, "1/(m^2 s^2)"}}}};
  m.parameters = {
      {"k1", Estimate::from_sd(5667.1, 3.2)}, {"k2", Estimate::from_sd(1e7, 1e5)}, {"c", Estimate::from_sd(1, 0.1)}};
  RotorModel r;
  r.k1 = 5667.1;
  r.k2 = 1e7;
  r.c = 1;
  r.eps = {3e-4, 4e-4};
  r.k1_conj = {50, -1};
  r.modes = {{80.5, 0.01, {0.1, 0.2}}};
  m.rotor = r;
  m.rotor_covariance.assign(25, 0.1);
  m.sample_time = 1e-3;
  m.noise_sd = 2e-6;
  m.summary.chi_square = 1.02;
  m.summary.trust = "prediction inside the band \"12 Hz\"";
  m.summary.warn("short record");
  m.provenance = {"0.1.0", {"a.csv sha256:00"}, "rate=1000", 0xFFFFFFFFFFFFFFFFull};
  return m;
}

TEST(ModelJson, IdentifiedModelRoundTripsAndHoldsTheContractKeys) {
  const auto file = std::filesystem::path(::testing::TempDir()) / "model.json";
  const IdentifiedModel m = rotor_model();
  save(file, m);
  const auto back = load<IdentifiedModel>(file);
  EXPECT_EQ(to_json(back).dump(), to_json(m).dump());
  EXPECT_EQ(back.provenance.seed, m.provenance.seed);
  EXPECT_EQ(back.rotor->k1_conj, m.rotor->k1_conj);
  EXPECT_EQ(back.summary.status, Status::warning);
  EXPECT_TRUE(std::isnan(back.summary.residual));
  const Json document = load_json(file);
  const JsonReader in(document, "model.json");
  for (const char* key : {"k1", "k2", "c", "e", "e_phase"}) {
    EXPECT_EQ(in.at("parameters").at(key).at("ci95").items().size(), 2u) << key;
    EXPECT_TRUE(in.at("parameters").at(key).has("unit")) << key;
  }
  EXPECT_DOUBLE_EQ(in.at("parameters").at("e").at("value").number(), 5e-4);
  EXPECT_EQ(in.at("equations").items()[0].at("terms").items()[1].at("coefficient").number(), -1e7);
  EXPECT_EQ(in.at("summary").at("chi_square").number(), 1.02);
}

TEST(ModelJson, TheReasonOfAFailureIsKeptAndThatOfAnEarlierFileIsItsLastWarning) {
  IdentifiedModel m = rotor_model();
  m.summary.fail("no passage");
  m.summary.warn("few samples");
  const Json written = to_json(m);
  EXPECT_EQ(JsonReader(written, "a.json").at("summary").at("reason").text(), "no passage");
  const auto file = std::filesystem::path(::testing::TempDir()) / "reason.json";
  save(file, m);
  EXPECT_EQ(load<IdentifiedModel>(file).summary.reason, "no passage");
  std::ofstream(file) << std::regex_replace(written.dump(), std::regex("\"reason\"\\s*:\\s*\"no passage\",?"), "");
  EXPECT_EQ(load<IdentifiedModel>(file).summary.reason, "few samples");
}

TEST(ModelJson, CovarianceOfTheParametersRoundTripsAndMustFit) {
  IdentifiedModel m = rotor_model();
  m.rotor.reset();  // a rotor adds e and e_phase to the parameters, whose covariance is not known
  m.parameter_covariance = {1, 2, 3, 2, 5, 6, 3, 6, 9};
  Json document = parse_json(to_json(m).dump(), "m");
  EXPECT_EQ(from_json<IdentifiedModel>(document, "m").parameter_covariance, m.parameter_covariance);
  document.set("parameter_covariance", Json(std::vector<double>{1, 2}));
  EXPECT_THROW((void)from_json<IdentifiedModel>(document, "m"), Error);
}

TEST(ModelJson, TimingOfInputsRoundTrips) {
  IdentifiedModel m = rotor_model();
  m.timing = {{"u", Hold::zero, Estimate::from_sd(0.02, 0.001)}};
  m.noise_correlation = {{"x", 0.9}, {"v", 0.25}};
  Json document = parse_json(to_json(m).dump(), "m");
  const IdentifiedModel back = from_json<IdentifiedModel>(document, "m");
  ASSERT_EQ(back.timing.size(), 1u);
  EXPECT_EQ(back.timing[0].input, "u");
  EXPECT_EQ(back.timing[0].hold, Hold::zero);
  EXPECT_EQ(back.timing[0].dead_time.value, 0.02);
  EXPECT_EQ(back.noise_correlation_of("v"), 0.25);
  EXPECT_EQ(back.noise_correlation_of("u"), 0);
}

TEST(ModelJson, ParametersHaveTheirUnit) {
  EXPECT_EQ(parameter_unit("k2"), "1/(m^2 s^2)");
  EXPECT_EQ(parameter_unit("e_phase_x"), "rad");
  EXPECT_EQ(parameter_unit("e_x"), "m");
  EXPECT_EQ(parameter_unit("natural_frequency"), "rad/s");
  EXPECT_EQ(parameter_unit("runout2-_im"), "m");
  EXPECT_EQ(parameter_unit("delay"), "s");
  EXPECT_EQ(parameter_unit("e_tilt_phase"), "rad");
  EXPECT_EQ(parameter_unit("k_tilt"), "1/s^2");
  EXPECT_EQ(parameter_unit("second_frequency"), "rad/s");
  EXPECT_EQ(parameter_unit("unheard"), "");
}

TEST(ModelJson, TheOtherResultsRoundTrip) {
  const auto dir = std::filesystem::path(::testing::TempDir());
  StiffnessLaw law;
  law.k1 = Estimate::from_sd(8500, 1);
  law.hysteresis = 0.3;
  law.points = 12;
  save(dir / "s.json", law);
  EXPECT_EQ(to_json(load<StiffnessLaw>(dir / "s.json")).dump(), to_json(law).dump());

  FrequencyResponse frf;
  frf.frequency = Eigen::VectorXd::LinSpaced(5, 0, 1);
  frf.channels = {{"1:+Z", "3:-Z", Eigen::VectorXcd::Random(5), Eigen::VectorXd::Ones(5), {}}};
  frf.averages = 4;
  frf.estimator = FrfEstimator::hv;
  save(dir / "f.json.gz", frf);
  const auto frf_back = load<FrequencyResponse>(dir / "f.json.gz");
  EXPECT_EQ(frf_back.channels[0].value, frf.channels[0].value);
  EXPECT_EQ(to_json(frf_back).dump(), to_json(frf).dump());

  ModalModel modes;
  modes.modes = {{Estimate::from_sd(12, 0.1), Estimate::from_sd(0.01, 0.001), {-1, 75}, Eigen::VectorXcd::Random(2)}};
  modes.lower = modes.upper = modes.upper_slope = Eigen::VectorXcd::Random(2);
  modes.responses = {"3:+X", "4:+Y"};
  modes.references = {"3:+X", "3:+X"};
  modes.window_decay = 4.6;
  modes.band_high = 100;
  save(dir / "m.json", modes);
  EXPECT_EQ(to_json(load<ModalModel>(dir / "m.json")).dump(), to_json(modes).dump());
  EXPECT_EQ(load<ModalModel>(dir / "m.json").responses, modes.responses);

  ControllerDesign design;
  design.law = "tsmc";
  design.parameters = {{"C", 60}, {"q_over_p", 7 / 9.0}};
  design.margins = {{"gain_margin", kNan}};
  design.model = *rotor_model().rotor;
  save(dir / "c.json", design);
  const auto design_back = load<ControllerDesign>(dir / "c.json");
  EXPECT_EQ(design_back.parameters.at("q_over_p"), 7 / 9.0);
  EXPECT_EQ(to_json(design_back).dump(), to_json(design).dump());
}

TEST(ModelJson, EveryDefectNamesFilePathAndReason) {
  const std::string good = to_json(rotor_model()).dump();
  const auto with = [&](std::string_view from, std::string_view to) {
    std::string text = good;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    text.replace(at, from.size(), to);
    return error_of([&] { from_json<IdentifiedModel>(parse_json(text, "m.json"), "m.json"); });
  };
  EXPECT_EQ(with("weak", "weak"), "no error");
  EXPECT_THAT(with("whirl.model/1", "whirl.model/2"), AllOf(HasSubstr("m.json: $: "), HasSubstr("newer program")));
  EXPECT_THAT(with("whirl.model/1", "whirl.modes/1"), HasSubstr("must be 'whirl.model/1'"));
  EXPECT_THAT(with("whirl.model/1", "whirl.model/1x"), HasSubstr("must be 'whirl.model/1'"));
  EXPECT_THAT(with("\"schema\"", "\"scheme\""), HasSubstr("no key 'schema'"));
  EXPECT_THAT(with("\"e_phase\"", "\"phase\""), HasSubstr("m.json: $.parameters: no key 'e_phase'"));
  EXPECT_THAT(with("\"value\": 5667.1", "\"value\": \"5667\""),
              HasSubstr("$.parameters.k1.value: is text, must be a finite number"));
  EXPECT_THAT(with("\"coefficient\": -5667.1", "\"coefficient\": null"),
              HasSubstr("$.equations[0].terms[0].coefficient: is null"));
  EXPECT_THAT(with("\"coefficient\": -5667.1", "\"coefficient\": NaN"), HasSubstr("damaged JSON"));
  EXPECT_THAT(with("\"coefficient\": -5667.1", "\"coefficient\": 1e999"), HasSubstr("m.json"));
  EXPECT_THAT(with("\"status\": \"warning\"", "\"status\": \"fine\""), HasSubstr("must be ok, warning or unusable"));
  EXPECT_THAT(with("\"seed\": \"1", "\"seed\": \"x"), HasSubstr("$.provenance.seed"));
  EXPECT_THAT(error_of([] { parse_json("{\n\"a\": 1,\n}", "x.json"); }), HasSubstr("x.json:3: damaged JSON"));
  EXPECT_THAT(error_of([] { parse_json("{\"a\":1,\"a\":2}", "x.json"); }), HasSubstr("key 'a' is there twice"));
  EXPECT_THAT(error_of([] { parse_json(std::string(100000, '['), "x.json"); }), HasSubstr("nested deeper"));
  EXPECT_THAT(error_of([] { parse_json("", "x.json"); }), HasSubstr("damaged JSON"));
  EXPECT_THAT(error_of([] { parse_json("{} {}", "x.json"); }), HasSubstr("damaged JSON"));
}

// Other programs write what JSON has not: the message names the field, not the text beside it.
TEST(Json, NumbersThatAreNoneAreNamedWithTheirField) {
  for (const char* value : {"NaN", "nan", "Infinity", "-Infinity", "inf", "1e999", "-1e999"}) {
    const std::string text = fmt::format("{{\n\"A\": [[0, 1],\n [{}, -0.3]],\n\"B\": [0, 1]}}", value);
    EXPECT_EQ(error_of([&] { parse_json(text, "plant.json"); }),
              fmt::format("plant.json:3: damaged JSON: $.A[1][0] = {}: must be a finite number", value));
    const std::string member = fmt::format("{{\"x\": {{\"eccentricity_m\":{}}}}}", value);
    EXPECT_EQ(error_of([&] { parse_json(member, "plant.json"); }),
              fmt::format("plant.json:1: damaged JSON: $.x.eccentricity_m = {}: must be a finite number", value));
  }
}

TEST(JsonProperty, DoublesSurviveARoundTripExactly) {
  std::mt19937_64 random(7);
  for (int i = 0; i < 20000; ++i) {
    std::uint64_t bits = random();
    double v = 0;
    static_assert(sizeof v == sizeof bits);
    std::memcpy(&v, &bits, sizeof v);
    if (!std::isfinite(v)) continue;
    const Json back = parse_json(Json(v).dump(), "x");
    ASSERT_EQ(JsonReader(back, "x").number(), v);
  }
}

TEST(Json, NegativeZeroKeepsItsSign) {
  const Json back = parse_json(Json(-0.0).dump(), "x");
  EXPECT_TRUE(std::signbit(JsonReader(back, "x").number()));
}

TEST(Json, TextWithBadEncodingIsStillWrittenAsValidJson) {
  const std::string text = Json(std::string("a\xff\n\"")).dump();
  EXPECT_NO_THROW(parse_json(text, "x"));
}

TEST(Json, LettersStayWhatTheyAre) {
  EXPECT_EQ(Json(std::string("\xC2\xB5m, Pr\xC3\xBC"
                             "fstand"))
                .dump(),
            "\"\xC2\xB5m, Pr\xC3\xBC"
            "fstand\"");
}

}  // namespace
}  // namespace whirl::io
