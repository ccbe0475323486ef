// What a step uses of a model changes its numbers, and they agree with `simulate` of the whole model (`simulate` itself
// with a machine integrated apart).
#include <deque>
#include <numbers>

#include "part_numbers.hpp"

namespace whirl::testing {
namespace {

using identification::Consumer;
using identification::ModelPart;
using identification::Treatment;

/// Two models in a folder: with.json with a part, without.json as it is without.
void write_pair(const Folder& folder, ModelPart part) {
  io::save(folder / "with.json", model_with(part));
  if (part == ModelPart::tilting_disc) {
    Machine stiff = tilting_machine();
    stiff.k_couple *= 0.9;
    io::save(folder / "without.json", tilting_model(stiff));
  } else {
    io::save(folder / "without.json", rotor_with(plain_machine()));
  }
}

double relative(double a, double b) { return std::abs(a / b - 1); }

const std::vector<ModelPart> kMotion{ModelPart::cubic_spring,  ModelPart::unequal_axes, ModelPart::coupled_damping,
                                     ModelPart::further_modes, ModelPart::tilting_disc, ModelPart::further_forces,
                                     ModelPart::twice_speed};
constexpr double kSame = 0.005, kOther = 0.008;  // shares of an amplitude

TEST(PartsUsedReference, TheResponseIsThatOfASimulationWithThePart) {
  for (const ModelPart part : kMotion) {
    ASSERT_EQ(use_of(Consumer::response, part).treatment, Treatment::used) << to_string(part);
    const Folder folder;
    write_pair(folder, part);
    double most = 0;
    for (const double hz : {11.0, 58.0}) {
      const double with = response_at(folder, "with.json", hz);
      EXPECT_LT(relative(with, simulated_at(folder, "with.json", hz)), kSame) << to_string(part) << " " << hz;
      most = std::max(most, relative(with, response_at(folder, "without.json", hz)));
    }
    EXPECT_GT(most, kOther) << to_string(part);
  }
}

/// Peak of the passage of that many from the slowest, m, and its rate, rad/s^2.
std::pair<double, double> passage(const Answer& plan, std::size_t k) {
  const io::JsonReader p = plan.read().at("up").at("passages").items().at(k);
  return {p.at("peak").number(), p.at("rate").number()};
}

TEST(PartsUsedReference, TheRunUpPeaksWhereASimulationWithThePartDoes) {
  for (const ModelPart part :
       {ModelPart::cubic_spring, ModelPart::unequal_axes, ModelPart::coupled_damping, ModelPart::further_modes}) {
    ASSERT_EQ(use_of(Consumer::runup, part).treatment, Treatment::used);
    const Folder folder;
    write_pair(folder, part);
    const bool mode = part == ModelPart::further_modes;
    const double from = mode ? 2400 : 300, to = mode ? 4200 : 1100;
    const std::string range = fmt::format(" --from-rpm {} --to-rpm {}", from, to);
    const Answer with = ask(folder, "runup with.json" + range), without = ask(folder, "runup without.json" + range);
    const std::size_t k = with.read().at("up").at("passages").items().size() / 2;
    const auto [peak, rate] = passage(with, k);
    const double seconds = (to - from) * std::numbers::pi / 30 / rate;
    const Answer run =
        ask(folder, fmt::format("simulate with.json{} --seconds {} --dwell-s 1 --rate-hz 2000", range, seconds));
    EXPECT_LT(relative(peak, run.read().at("peak_radius_m").number()), kSame) << to_string(part);
    EXPECT_GT(relative(peak, passage(without, k).first), kOther) << to_string(part);
  }
}

// The machines are integrated apart (testing/machines.hpp), and their further mode and force here.
TEST(PartsUsedReference, ASimulationIsTheMachineWithThePart) {
  std::vector<std::pair<ModelPart, Machine>> all(4, {ModelPart::cubic_spring, plain_machine()});
  all[0].second.cubic = 1.5e8;
  all[1] = {ModelPart::unequal_axes, plain_machine()};
  all[1].second.split = 114 / all[1].second.k;
  all[2] = {ModelPart::further_forces, plain_machine()};
  all[2].second.quadratic = 20;
  all[3] = {ModelPart::drifts, plain_machine()};
  all[3].second.k_in_time = -30 / all[3].second.k, all[3].second.horizon = 1;
  all.emplace_back(ModelPart::tilting_disc, tilting_machine());
  for (const auto& [part, machine] : all) {
    ASSERT_EQ(use_of(Consumer::simulate, part).treatment, Treatment::used);
    const Folder folder;
    write_pair(folder, part);
    whirl::testing::Run run;
    run.from_hz = 5, run.to_hz = 20, run.seconds = 8;
    const Eigen::MatrixX2d z = readings(machine, run);
    const double truth = (z.col(0).array().square() + z.col(1).array().square()).sqrt().maxCoeff();
    const auto peak = [&](const char* model) {
      return ask(folder, fmt::format("simulate {} --from-rpm 300 --to-rpm 1200 --seconds 8", model))
          .read()
          .at("peak_radius_m")
          .number();
    };
    const double with = peak("with.json");
    EXPECT_LT(relative(with, truth), kSame) << to_string(part);
    EXPECT_GT(relative(with, peak("without.json")), kOther) << to_string(part);
  }
}

// A linear mode, and a force whatever the motion is: closed forms at one speed.
TEST(PartsUsedReference, ASimulationHasTheFurtherModeAndTheForceAtTwiceTheSpeed) {
  const Folder folder;
  const std::complex<double> i(0, 1);
  const Machine m = plain_machine();
  write_pair(folder, ModelPart::further_modes);
  const double w = 2 * std::numbers::pi * 58;
  const ForcedMode mode = further_mode();
  const std::complex<double> main = w * w * std::polar(m.e, m.e_phase) / (m.k - w * w + i * m.c * w);
  const std::complex<double> upper =
      w * w * mode.participation / (mode.omega * mode.omega - w * w + 2.0 * i * mode.zeta * mode.omega * w);
  EXPECT_LT(relative(simulated_at(folder, "with.json", 58), std::abs(main + upper)), kSame);
  EXPECT_LT(relative(simulated_at(folder, "without.json", 58), std::abs(main)), kSame);
  EXPECT_GT(relative(std::abs(main + upper), std::abs(main)), kOther);

  write_pair(folder, ModelPart::twice_speed);
  const double v = 2 * std::numbers::pi * 11, turns = 2 * v;
  const double once = std::abs(v * v * m.e / (m.k - v * v + i * m.c * v)),
               twice = std::abs(v * v * 1e-4 / (m.k - turns * turns + i * m.c * turns));
  EXPECT_LT(relative(simulated_at(folder, "with.json", 11), once + twice), kSame);
}

// What the probes do beside the motion is made here; the record without noise is that of `simulate`.
TEST(PartsUsedReference, AValidationPredictsARecordOfTheWholeModel) {
  std::vector<ModelPart> parts = kMotion;
  parts.insert(parts.end(), {ModelPart::drifts, ModelPart::runout, ModelPart::sensor_delay, ModelPart::sensor_errors});
  for (const ModelPart part : parts) {
    ASSERT_EQ(use_of(Consumer::validate, part).treatment, Treatment::used) << to_string(part);
    const Folder folder;
    write_pair(folder, part);
    const bool late = part == ModelPart::sensor_delay;
    write_record(folder, "with.json", part == ModelPart::further_modes ? 62 : 20,
                 [&](Eigen::MatrixX2d& z, const Eigen::VectorXd& beta) {
                   if (part == ModelPart::sensor_errors) z.col(1) *= 1.03;
                   for (Eigen::Index k = 0; part == ModelPart::runout && k < beta.size(); ++k) {
                     const std::complex<double> read = std::complex<double>(2e-5, -1e-5) * std::polar(1.0, beta[k]) +
                                                       1e-5 * std::polar(1.0, -beta[k]);
                     z(k, 0) += read.real(), z(k, 1) += read.imag();
                   }
                   // One sample of 1 ms late.
                   for (Eigen::Index k = z.rows() - 1; late && k > 0; --k) z.row(k) = z.row(k - 1).eval();
                 });
    const double with = validated(folder, "with.json"), without = validated(folder, "without.json");
    EXPECT_LT(with, 3.5e-6) << to_string(part);
    EXPECT_GT(without, 3 * with) << to_string(part);
  }
}

TEST(PartsUsedReference, TheCovarianceMakesTheIntervals) {
  const Folder folder;
  write_pair(folder, ModelPart::covariance);
  write_record(folder, "with.json");
  const auto interval = [](const io::JsonReader& in, const char* key) {
    const std::vector<io::JsonReader> ends = in.at(key).items();
    return std::pair(ends[0].number(), ends[1].number());
  };
  // The linear rotor at 10 Hz: e w^2 / (k - w^2), with 2 % of e and 0.3 % of k.
  const Answer curve = ask(folder, "response with.json --from-rpm 597 --to-rpm 600");
  const auto [low, high] = interval(curve.read(), "peak_interval");
  const Machine m = plain_machine();
  const double w = 2 * std::numbers::pi * 10, gap = m.k - w * w;
  const double share = std::hypot(0.02, 0.003 * m.k / gap), middle = m.e * w * w / gap;
  EXPECT_NEAR(0.5 * (high - low) / middle, 1.96 * share, 0.15 * share);
  EXPECT_FALSE(ask(folder, "response without.json --from-rpm 597 --to-rpm 600").read().has("peak_interval"));

  const Answer plan = ask(folder, "runup with.json --from-rpm 300 --to-rpm 900");
  EXPECT_TRUE(plan.read().at("up").has("peak_interval"));
  EXPECT_FALSE(ask(folder, "runup without.json --from-rpm 300 --to-rpm 900").read().at("up").has("peak_interval"));

  const char* balance = "balance {}.json --mass-kg 1.5 --radius-mm 80 --speed-rpm 1800";
  const Answer mass = ask(folder, fmt::format(fmt::runtime(balance), "with"));
  const std::vector<io::JsonReader> ends = mass.read().at("correction_mass").at("ci95").items();
  const double half = 0.5 * (ends[1].number() - ends[0].number()), own = mass.read().at("correction_mass_kg").number();
  EXPECT_NEAR(half / own, 1.96 * 0.02, 0.002);
  EXPECT_FALSE(ask(folder, fmt::format(fmt::runtime(balance), "without")).read().has("correction_mass"));

  std::deque<Answer> answers;  // what is read refers to them
  const auto band = [&](const char* model) {
    answers.push_back(ask(folder, fmt::format("validate {} run.csv", model)));
    return answers.back().read().at("runs").items().front().at("band_x");
  };
  EXPECT_GT(band("with.json").number_or_nan(), 0);
  EXPECT_TRUE(std::isnan(band("without.json").number_or_nan()));
}

/// The model by its alternative, written out.
IdentifiedModel by_alternative(ModelPart part) {
  IdentifiedModel model = model_with(part);
  const Ambiguity open = model.ambiguities.front();
  model.ambiguities.clear();
  for (const auto& [name, e] : open.alternatives.front().parameters) put(model, name, e.value, e.sd);
  model.rotor->k1 = model.parameter("k1")->value;
  model.rotor->k2 = model.parameter("k2")->value;
  return model;
}

// The records allow two readings: every interval holds the answer of the other one too.
TEST(PartsUsedReference, TheOtherReadingIsInTheIntervals) {
  const Folder folder;
  io::save(folder / "with.json", model_with(ModelPart::other_readings));
  io::save(folder / "other.json", by_alternative(ModelPart::other_readings));
  for (const char* command :
       {"response {} --from-rpm 640 --to-rpm 690", "runup {} --from-rpm 300 --to-rpm 900 --slowest-rpm-s 20",
        "simulate {} --from-rpm 300 --to-rpm 900 --seconds 20"}) {
    const Answer with = ask(folder, fmt::format(fmt::runtime(command), "with.json")),
                 other = ask(folder, fmt::format(fmt::runtime(command), "other.json"));
    std::vector<io::JsonReader> ends;
    double theirs = 0;
    if (with.read().has("points")) {
      ends = with.read().at("peak_interval").items();
      for (const io::JsonReader& p : other.read().at("points").items())
        if (p.at("stable").flag()) theirs = std::max(theirs, p.at("amplitude").number());
    } else if (with.read().has("up")) {
      ends = with.read().at("up").at("peak_interval").items();
      theirs = 0.5 * (ends[0].number() + ends[1].number());  // between its own run and the other's
      EXPECT_GT(ends[1].number(), 1.001 * ends[0].number());
    } else {
      ends = with.read().at("peak_radius_readings_m").items();
      theirs = other.read().at("peak_radius_m").number();
    }
    EXPECT_LE(ends[0].number(), 1.001 * theirs) << command;
    EXPECT_GE(ends[1].number(), 0.999 * theirs) << command;
    EXPECT_LT(ends[0].number(), ends[1].number()) << command;
  }
}

// An oscillator of equations and a map.
TEST(PartsUsedReference, EquationsOfOtherSystemsAreRun) {
  const Folder folder;
  const double w = 15;
  Recording in;
  in.dt = 1e-2;
  in.add("u", Quantity::dimensionless,
         Eigen::VectorXd::LinSpaced(1500, 0, 14.99).unaryExpr([&](double t) { return std::cos(w * t); }));
  in.add("x", Quantity::dimensionless, Eigen::VectorXd::Zero(1500));
  in.add("v", Quantity::dimensionless, Eigen::VectorXd::Zero(1500));
  io::write_csv(folder / "in.csv", in);
  for (const bool hidden : {false, true}) {
    io::save(folder / "model.json", oscillator_model(hidden));
    const Answer curve =
        ask(folder, fmt::format("response model.json --input u --amplitude 1 --from-rpm {} --to-rpm {}",
                                w * 30 / std::numbers::pi, w * 30 / std::numbers::pi + 1));
    EXPECT_LT(relative(curve.read().at("points").items().front().at("amplitude").number(), oscillator_gain(hidden, w)),
              kSame);
    const Outcome run = folder.whirl("simulate model.json --record in.csv --out out.csv --force");
    ASSERT_EQ(run.exit_code, 0) << run.err;
    const io::Table out = io::read_table(folder / "out.csv");
    EXPECT_LT(relative(out["x"].tail(600).cwiseAbs().maxCoeff(), oscillator_gain(hidden, w)), 0.02);
  }
  io::save(folder / "model.json", map_model());
  ASSERT_EQ(folder.whirl("simulate model.json --record in.csv --out out.csv --force").exit_code, 0);
  const io::Table map = io::read_table(folder / "out.csv");
  EXPECT_NEAR(map["x"][2], 0.5 * map["x"][1] + in["u"][1], 1e-9);
}

}  // namespace
}  // namespace whirl::testing
