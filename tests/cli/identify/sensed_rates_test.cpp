// A rotor from accelerometers: identify, validate, report, and what does not take such a record.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <random>
#include <string>

#include "../program.hpp"
#include "whirl/io/json.hpp"
#include "whirl/testing/records/rotor_sensors.hpp"

namespace whirl::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

constexpr double kGravity = 9.80665;  // m/s^2

SensedRotor accelerometers() {
  std::mt19937_64 random(7101);
  return drawn_rotor(Quantity::acceleration, random);
}

/// Columns t_s, ax_g, ay_g and beta_deg, the latter back to 0 every turn where asked.
std::string in_g(const Recording& r) {
  std::string text = "t_s,ax_g,ay_g,beta_deg\n";
  for (Eigen::Index i = 0; i < r.size(); ++i)
    text += fmt::format("{:.6f},{:.7g},{:.7g},{:.6f}\n", r.dt * static_cast<double>(i), r["x"][i] / kGravity,
                        r["y"][i] / kGravity, r["beta"][i] * 180 / std::numbers::pi);
  return text;
}

TEST(SensedRatesE2e, ARotorIsIdentifiedValidatedAndReportedFromAccelerometers) {
  const Folder folder;
  const SensedRotor truth = accelerometers();
  folder.write("accel.csv", in_g(sensed_record(truth, 1)));
  SensedRotor again = truth;
  std::swap(again.from, again.to);
  folder.write("again.csv", in_g(sensed_record(again, 2)));

  const Outcome found = folder.whirl("identify accel.csv --out model.json");
  EXPECT_LE(found.exit_code, 0) << found.out << found.err;
  EXPECT_THAT(found.err, HasSubstr("'ax' is taken for x, acceleration"));
  EXPECT_THAT(found.out, AllOf(HasSubstr("m/s²"), HasSubstr("x and y are the acceleration of one place")));
  const io::Json json = io::load_json(folder / "model.json");
  const io::JsonReader model(json, "model.json");
  EXPECT_EQ(model.at("quantity").text(), "acceleration");
  EXPECT_GT(model.at("noise_sd_m_s2").number(), 0);
  EXPECT_FALSE(model.has("noise_sd_m"));
  const io::JsonReader k1 = model.at("parameters").at("k1");
  EXPECT_NEAR(k1.at("value").number() / truth.k1, 1, 1e-3);
  EXPECT_EQ(model.at("parameters").at("offset_acceleration_x").at("unit").text(), "m/s^2");
  EXPECT_EQ(model.at("evidence").at("held_out").at("unit").text(), "m/s^2");
  // The largest radius is one of displacement, by the free run: below what a peak without damping would be.
  EXPECT_LT(model.at("evidence").at("range").at("amplitude_m").number(), 60 * truth.e);

  const Outcome checked = folder.whirl("validate model.json again.csv --out validation.json");
  EXPECT_EQ(checked.exit_code, 0) << checked.out << checked.err;
  EXPECT_THAT(checked.out, AllOf(HasSubstr("m/s²"), Not(HasSubstr("mm"))));
  const io::Json validation = io::load_json(folder / "validation.json");
  const io::JsonReader run = io::JsonReader(validation, "").at("runs").items().front();
  EXPECT_EQ(run.at("quantity").text(), "acceleration");
  // The run passes a fold of the resonance: the parameters' errors are seen beside the noise.
  EXPECT_LT(run.at("rmse_x").number(), 1.5 * run.at("noise_x").number());

  ASSERT_LE(folder.whirl("report model.json again.csv validation.json --out page.html").exit_code, 1);
  const std::string page = slurp(folder / "page.html");
  EXPECT_THAT(page, HasSubstr("Models run free against records"));
  const std::string table = page.substr(page.find("Models run free against records"));
  EXPECT_THAT(table.substr(0, table.find("</table>")), HasSubstr("m/s²"));
}

TEST(SensedRatesE2e, ADisplacementBesideAnAccelerationIsRefusedByName) {
  const Folder folder;
  std::string text = in_g(sensed_record(accelerometers(), 1));
  text.replace(0, text.find('\n'), "t_s,x_mm,y_g,beta_deg");
  folder.write("mixed.csv", text);
  const Outcome o = folder.whirl("identify mixed.csv");
  EXPECT_EQ(o.exit_code, 2);
  EXPECT_THAT(o.err, AllOf(HasSubstr("channel y"), HasSubstr("acceleration"), HasSubstr("both directions")));
  text.replace(0, text.find('\n'), "t_s,x_g,y_g,beta_deg");
  folder.write("accel.csv", text);
  const Outcome slow = folder.whirl("identify accel.csv --slow-roll accel.csv");
  EXPECT_EQ(slow.exit_code, 2);
  EXPECT_THAT(slow.err, HasSubstr("displacement of the shaft"));
}

}  // namespace
}  // namespace whirl::testing
