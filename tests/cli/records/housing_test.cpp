#include "whirl/testing/records/housing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <numbers>
#include <sstream>

#include "../program.hpp"
#include "whirl/io/json.hpp"

namespace whirl::testing {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;
constexpr double kCircle = 2 * std::numbers::pi;
constexpr double kStandardGravity = 9.80665;

/// `vibration` of `whirl info --json` for one channel.
io::Json vibration_of(const std::string& text, const std::string& channel) {
  const io::Json document = io::parse_json(text, "info");
  for (const io::Json& table : *document.find("tables")->get<io::Json::Array>()) {
    for (const io::Json& v : *table.find("vibration")->get<io::Json::Array>()) {
      if (*v.find("channel")->get<std::string>() == channel) return v;
    }
  }
  ADD_FAILURE() << "no vibration of " << channel << " in " << text.substr(0, 500);
  return io::Json::object();
}

double number(const io::Json& json, const std::string& group, const std::string& name) {
  const io::JsonReader in(json, "vibration");
  return in.at(group).at(name).number();
}

TEST(HousingE2e, LevelAndOrderOfEverySensorAreTheTruth) {
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    Housing machine(seed, 900 + 400 * static_cast<double>(seed));
    if (seed % 3 == 1) machine.teeth = 1;
    if (seed % 3 == 2) machine.teeth = 6, machine.missing = 1;
    const Folder folder;
    folder.write("casing.csv", machine.csv({}));
    const Outcome info = folder.whirl("info casing.csv --json");
    ASSERT_EQ(info.exit_code, 0) << info.err;
    const io::Json acc = vibration_of(info.out, "DE_acc"), vel = vibration_of(info.out, "NDE_vel"),
                   probe = vibration_of(info.out, "probe");
    EXPECT_NEAR(1e3 * number(acc, "housing", "velocity_rms") / machine.velocity_rms(), 1, 0.02) << seed;
    EXPECT_NEAR(1e3 * number(vel, "housing", "velocity_rms") / machine.velocity_rms(), 1, 0.02) << seed;
    EXPECT_NEAR(1e3 * number(acc, "housing", "below_rms") / machine.drift, 1, 0.05) << seed;
    EXPECT_EQ(probe.find("housing"), nullptr);
    EXPECT_NEAR(io::JsonReader(probe, "").at("mean").number() * 1e6, machine.gap_um, 1) << seed;
    EXPECT_NEAR(io::JsonReader(acc, "").at("mean").number() / kStandardGravity, 1, 0.01) << seed;
    if (machine.teeth == 0) {
      EXPECT_EQ(acc.find("synchronous"), nullptr);
      continue;
    }
    EXPECT_NEAR(number(acc, "synchronous", "peak") / machine.one_x_acceleration(), 1, 0.02) << seed;
    EXPECT_NEAR(1e6 * number(probe, "synchronous", "peak") / machine.one_x_displacement(), 1, 0.02) << seed;
    EXPECT_NEAR(number(acc, "synchronous", "speed") / kCircle * 60 / machine.rpm, 1, 1e-3) << seed;
  }
}

TEST(HousingE2e, ReportNamesTheZoneOfTheStatedMachineAndOtherwiseWhatIsMissing) {
  const Folder folder;
  Housing machine(3);
  machine.tones = {{25, 3, 0}};  // 3 mm/s: zone C of 2-rigid, B of 1-rigid and 2-flexible, A of 1-flexible
  folder.write("casing.csv", machine.csv({.accelerometer = true, .velocity = false, .probe = false}));
  for (const auto& [machine_class, zone] :
       {std::pair{"1-rigid", "B"}, {"1-flexible", "A"}, {"2-rigid", "C"}, {"2-flexible", "B"}}) {
    const Outcome o = folder.whirl(std::string("report casing.csv --force --out page.html --machine ") + machine_class);
    ASSERT_EQ(o.exit_code, 0) << o.err;
    const std::string page = slurp(folder / "page.html");
    EXPECT_THAT(page, HasSubstr(std::string("zone ") + zone + " of ISO 20816-3, " + machine_class));
    EXPECT_THAT(page, AllOf(HasSubstr("Housing vibration"), HasSubstr("mm/s rms in channel DE_acc"),
                            HasSubstr("Spectrum of the whole record"), HasSubstr("acceleration, peak [m/s²]"),
                            HasSubstr("integrated in the frequency domain")));
  }
  ASSERT_EQ(folder.whirl("report casing.csv --force --out page.html").exit_code, 0);
  EXPECT_THAT(slurp(folder / "page.html"),
              AllOf(HasSubstr("The class of the machine is not stated"), HasSubstr("B (1-rigid), A (1-flexible)")));
  EXPECT_EQ(folder.whirl("report casing.csv --force --out page.html --machine 3-rigid").exit_code, 2);
}

TEST(HousingE2e, TheGapOfAProbeIsNoMotion) {
  const Folder folder;
  std::string text = "t_s,x_mm,y_mm,beta_rad\n";
  for (int i = 0; i < 4000; ++i) {
    const double t = i / 1000.0, theta = kCircle * 25 * t;
    text += std::to_string(t) + "," + std::to_string(1.273 + 0.49 * std::cos(theta)) + "," +
            std::to_string(-1.5 + 0.3 * std::sin(theta)) + "," + std::to_string(theta) + "\n";
  }
  folder.write("gap.csv", text);
  ASSERT_EQ(folder.whirl("report gap.csv --out page.html").exit_code, 0);
  const std::string page = slurp(folder / "page.html");
  EXPECT_THAT(page, AllOf(HasSubstr(">0.490 mm<"), HasSubstr(">1.27 mm<"), Not(HasSubstr("1.763"))));
  // The spectrum of the motion has the unit of the motion, not of the gap.
  ASSERT_EQ(folder.whirl("plot gap.csv --what waterfall --out map.csv").exit_code, 0);
  EXPECT_THAT(slurp(folder / "map.csv"), HasSubstr("re 0.490 mm peak"));
}

/// A run-up from 10 to 40 Hz of a housing with a resonance at 25 Hz: x in um, and its acceleration.
std::string run_up_csv(double rate = 2000) {
  std::string text = "t_s,acc_m_s2,beta_rad\n";
  char line[120];
  for (int i = 0; i < static_cast<int>(10 * rate); ++i) {
    const double t = i / rate, f = 10 + 3 * t, theta = kCircle * (10 * t + 1.5 * t * t), w = kCircle * f;
    const std::complex<double> z = 2e-5 * f * f / std::complex<double>(625 - f * f, 5 * f);
    std::snprintf(line, sizeof line, "%.5f,%.9g,%.9g\n", t, (-w * w * z * std::polar(1.0, theta)).real(), theta);
    text += line;
  }
  return text;
}

/// First line of a file, and the columns below.
struct Columns {
  std::string header;
  std::vector<std::vector<double>> rows;
  explicit Columns(const std::filesystem::path& file) {
    std::istringstream in(slurp(file));
    std::getline(in, header);
    for (std::string line; std::getline(in, line);) {
      rows.emplace_back();
      std::istringstream cells(line);
      for (std::string cell; std::getline(cells, cell, ',');)
        rows.back().push_back(cell.empty() ? NAN : std::stod(cell));
    }
  }
};

TEST(HousingE2e, FiguresHaveTheQuantityKindAndUnitOfTheirChannel) {
  const Folder folder;
  folder.write("up.csv", run_up_csv());
  const auto bode = [&](const std::string& more) {
    EXPECT_EQ(folder.whirl("plot up.csv --force --what bode --out bode.csv " + more).exit_code, 0) << more;
    return Columns(folder / "bode.csv");
  };
  const Columns peak = bode(""), pp = bode("--amplitude p-p"), rms = bode("--amplitude rms"),
                again = bode("--amplitude pp"), velocity = bode("--unit mm_s --amplitude rms"),
                mil = bode("--unit mil --amplitude pp");
  EXPECT_THAT(peak.header, HasSubstr("1X amplitude, peak [m/s²]"));
  EXPECT_THAT(pp.header, HasSubstr("1X amplitude, p-p [m/s²]"));
  EXPECT_EQ(pp.header, again.header);
  EXPECT_THAT(rms.header, HasSubstr("1X amplitude, rms [m/s²]"));
  EXPECT_THAT(velocity.header, HasSubstr("1X amplitude, rms [mm/s]"));
  EXPECT_THAT(mil.header, HasSubstr("1X amplitude, p-p [mil]"));
  ASSERT_GT(peak.rows.size(), 100U);
  for (std::size_t i = 5; i + 5 < peak.rows.size(); ++i) {
    const double a = peak.rows[i][1], w = kCircle * peak.rows[i][0] / 60;
    EXPECT_NEAR(pp.rows[i][1] / a, 2, 1e-6);
    EXPECT_NEAR(rms.rows[i][1] / a, std::sqrt(0.5), 1e-6);
    EXPECT_NEAR(velocity.rows[i][1] / (1e3 * a / w * std::sqrt(0.5)), 1, 1e-6);
    EXPECT_NEAR(mil.rows[i][1] / (2 * a / (w * w) / 25.4e-6), 1, 1e-6);
  }
  for (const char* what : {"polar", "nyquist", "orders", "spectrum", "waterfall", "cascade", "run-map", "traces"}) {
    ASSERT_EQ(folder.whirl(std::string("plot up.csv --force --amplitude p-p --out f.svg --what ") + what).exit_code, 0)
        << what;
    const std::string svg = slurp(folder / "f.svg");
    EXPECT_THAT(svg, HasSubstr("m/s²")) << what;
    EXPECT_THAT(svg, AllOf(Not(HasSubstr("[mm]")), Not(HasSubstr("[µm]")), Not(HasSubstr("peak [")))) << what;
  }
  // A spectrum as velocity: the lines divided by their frequency, and told.
  ASSERT_EQ(folder.whirl("plot up.csv --force --what spectrum --unit mm_s --out f.svg").exit_code, 0);
  EXPECT_THAT(slurp(folder / "f.svg"),
              AllOf(HasSubstr("velocity, peak [mm/s]"), HasSubstr("velocity of acc by integration from 10 Hz on")));
  EXPECT_THAT(folder.whirl("plot up.csv --what bode --unit N").err, HasSubstr("--unit"));
}

TEST(HousingE2e, ABodeTableGoesFromCommandToCommand) {
  const Folder folder;
  folder.write("up.csv", run_up_csv());
  ASSERT_EQ(folder.whirl("plot up.csv --what bode --amplitude rms --unit g --out bode.csv --out bode.svg").exit_code,
            0);
  const auto modes = [&](const std::string& arguments) {
    const Outcome o = folder.whirl("transient " + arguments + " --modes 1 --json");
    EXPECT_LE(o.exit_code, 1) << arguments << o.err;
    const io::Json json = io::parse_json(o.out, "transient");
    return io::JsonReader(json, "").at("transient").at("modes").items().front().at("omega").at("value").number();
  };
  const double from_record = modes("up.csv"), from_table = modes("bode.csv");
  EXPECT_NEAR(from_record / kCircle, 25, 0.5);  // the generator's vectors are those of steady states
  EXPECT_NEAR(from_table / from_record, 1, 1e-4);
  ASSERT_EQ(folder.whirl("plot bode.csv --what polar --out polar.svg").exit_code, 0);
  EXPECT_THAT(slurp(folder / "polar.svg"), HasSubstr("1X amplitude, peak [m/s²]"));
  // The same vectors: drawn again, the table has the same numbers.
  ASSERT_EQ(folder.whirl("plot bode.csv --what bode --amplitude rms --unit g --out again.csv").exit_code, 0);
  const Columns first(folder / "bode.csv"), again(folder / "again.csv");
  ASSERT_EQ(first.rows.size(), again.rows.size());
  for (std::size_t i = 0; i < first.rows.size(); ++i) {
    for (std::size_t c = 0; c < 2; ++c)
      EXPECT_NEAR(again.rows[i][c], first.rows[i][c], 1e-6 * std::abs(first.rows[i][c]));
  }
  // Columns that state kind and sign.
  folder.write("lag.csv",
               "rpm,amp_pp_DE_um,phase_lag_DE_deg\n1000,4,10\n1100,6,40\n1200,10,90\n1300,6,140\n1400,4,170\n");
  ASSERT_EQ(folder.whirl("plot lag.csv --what bode --out lag_again.csv").exit_code, 0);
  const Columns lag(folder / "lag_again.csv");
  EXPECT_NEAR(lag.rows[2][1], 5, 1e-9);
  EXPECT_NEAR(lag.rows[2].back(), 90, 1e-6);
}

TEST(HousingE2e, IdentifyOfSensorsWithoutADirectionIsRefusedByNameWithWhatToDo) {
  const Folder folder;
  std::string two = run_up_csv();
  two.replace(0, two.find('\n'), "t_s,DE_acc_m_s2,beta_rad,NDE_acc_m_s2");
  for (std::size_t at = two.find('\n') + 1; (at = two.find('\n', at)) != std::string::npos; at += 5)
    two.insert(at, ",0.1");
  folder.write("up.csv", two);
  const Outcome o = folder.whirl("identify up.csv");
  EXPECT_EQ(o.exit_code, 2);
  EXPECT_THAT(o.err, AllOf(HasSubstr("'DE_acc' is an acceleration"), HasSubstr("--columns \"DE_acc:x\""),
                           HasSubstr("whirl transient"), Not(HasSubstr("no column"))));
  folder.write("one.csv", run_up_csv());
  const Outcome paper = folder.whirl("identify one.csv --method consistent --columns acc_m_s2:x_m_s2 t_s beta_rad");
  EXPECT_EQ(paper.exit_code, 2);
  EXPECT_THAT(paper.err, HasSubstr("'x' is an acceleration: --method consistent takes displacements"));
}

}  // namespace
}  // namespace whirl::testing
