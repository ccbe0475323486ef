// Rotors with printed whirl speeds, against the sources named in rotors.hpp. 0.1 %, 0.6 % for mode 6 of the first.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "rotors.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/response.hpp"

namespace whirl::shaft {
namespace {

using testing::kHz;
using testing::kRpm;

void expect_within(const std::vector<double>& found, const std::vector<double>& printed, double part,
                   const std::string& what) {
  ASSERT_GE(found.size(), printed.size()) << what;
  for (std::size_t k = 0; k < printed.size(); ++k)
    EXPECT_NEAR(found[k] / printed[k], 1, part) << what << ", mode " << k + 1 << ": " << found[k];
}

std::vector<double> damped(const Rotor& rotor, double speed, int count, double unit) {
  std::vector<double> list;
  for (const Mode& m : modes(assemble(rotor), speed, count)) list.push_back(m.frequency() / unit);
  std::sort(list.begin(), list.end());
  return list;
}
std::vector<double> natural(const Rotor& rotor, double speed, int count, double unit) {
  std::vector<double> list;
  for (const Mode& m : modes(assemble(rotor), speed, count)) list.push_back(std::abs(m.pole) / unit);
  return list;
}

TEST(ShaftReference, NelsonMcVaughWhirlSpeeds) {
  const System s = assemble(testing::nelson_mcvaugh());
  const struct {
    double ratio;
    std::vector<double> printed;  // rpm, spin or whirl as the table of the source has it
    double unit;
  } rows[] = {{1, {15470, 17159, 46612, 49983, 64752, 96547}, 1},
              {0.5, {15858, 16700, 47520, 49204, 69640, 85552}, 1},
              {0.25, {4015, 4120.2, 11989.25, 12200, 18184.25, 20162.25}, 0.25}};
  for (const auto& row : rows) {
    const std::vector<Critical> found = criticals(s, 1e5, row.ratio);
    ASSERT_GE(found.size(), 6u);
    for (std::size_t k = 0; k < 6; ++k) {
      EXPECT_NEAR(found[k].frequency * row.unit / kRpm / row.printed[k], 1, k == 5 ? 6e-3 : 1e-3)
          << row.ratio << " " << k;
      EXPECT_NEAR(found[k].direction, k % 2 == 0 ? -1 : 1, 1e-6);
    }
  }
}

TEST(ShaftReference, FriswellIsotropicAndAnisotropicBearings) {
  const auto iso = testing::friswell(testing::diagonal(1e6, 1e6)),
             aniso = testing::friswell(testing::diagonal(1e6, 0.8e6));
  const double w = 4000 * kRpm;
  expect_within(damped(iso, 0, 6, 1), {86.65811, 86.65811, 274.31285, 274.31285, 716.78631, 716.78631}, 1e-6,
                "5.9.1, 0");
  expect_within(damped(iso, w, 6, 1), {85.38947, 87.79586, 251.78460, 294.71333, 600.17936, 827.07536}, 1e-6, "5.9.1");
  expect_within(damped(aniso, 0, 6, 1), {82.65304, 86.65811, 254.52048, 274.31285, 679.48903, 716.78631}, 1e-6,
                "5.9.2, 0");
  expect_within(damped(aniso, w, 6, 1), {82.32547, 86.86370, 239.64228, 287.24958, 583.48783, 806.88728}, 1e-6,
                "5.9.2");
}

TEST(ShaftReference, FriswellCrossCoupledAndDampedBearings) {
  const double w = 4000 * kRpm;
  Eigen::Matrix2d k;
  k << 1e6, 0.5e6, 0, 1e6;  // on the row of x only, as the values in use were computed
  expect_within(natural(testing::friswell(k), w, 6, 1),
                {84.19790, 89.03269, 246.44121, 301.08623, 594.81950, 834.04204}, 1e-5, "5.9.4");
  const Rotor damping = testing::friswell(testing::diagonal(1e6, 1e6), 3e3);
  expect_within(natural(damping, 0, 6, kHz), {13.90537, 13.90537, 48.17762, 48.17762, 137.06058, 137.06058}, 2e-4,
                "5.9.5, 0");
  expect_within(natural(damping, w, 6, kHz), {13.69731, 14.09186, 43.60796, 52.17870, 122.36523, 149.80604}, 2e-4,
                "5.9.5");
  const double decay[] = {4.0835, 4.7423, 74.121, 78.846, 402.57, 667.23};  // with Hutchinson's coefficient
  Rotor hutchinson = damping;
  hutchinson.shear.model = ShearModel::hutchinson;
  const std::vector<Mode> found = modes(assemble(hutchinson), w, 6);
  for (std::size_t m = 0; m < 6; ++m) EXPECT_NEAR(found[m].pole.real() / -decay[m], 1, 2e-5);
}

TEST(ShaftReference, FriswellOverhungDiscAndItsCoarseMesh) {
  const double w = 4000 * kRpm;
  Rotor twelve = testing::overhung(8, 4);
  twelve.shear.model = ShearModel::hutchinson;  // as these were computed
  expect_within(damped(testing::overhung(1, 1), 0, 6, kHz),
                {14.34690, 14.34690, 109.31683, 109.31683, 134.05187, 134.05187}, 1e-4, "5.9.9, two elements");
  expect_within(damped(twelve, 0, 6, kHz), {14.3474, 14.3474, 100.3621, 100.3621, 132.1606, 132.1606}, 1e-5,
                "twelve elements, 0");
  expect_within(damped(twelve, w, 6, kHz), {12.1265, 16.5386, 90.0869, 100.9189, 103.0708, 186.8019}, 1e-5,
                "twelve elements");
  const MeshCheck coarse = check_mesh(testing::overhung(1, 1), 0, 6), fine = check_mesh(testing::overhung(8, 4), 0, 6);
  EXPECT_TRUE(coarse.coarse);  // 9 % in the second mode
  EXPECT_NEAR(coarse.worst, 0.09, 0.03);
  EXPECT_FALSE(fine.coarse);
}

TEST(ShaftReference, LalanneFerrarisThreeDiscs) {
  const Rotor rotor = testing::lalanne_ferraris();
  expect_within(damped(rotor, 25000 * kRpm, 9, kHz),
                {55.408, 67.209, 157.90, 193.71, 249.90, 407.62, 446.62, 622.65, 715.03}, 1e-3, "25000 rpm");
  // Computed by another program with the same elements.
  const double damping[] = {0.00029486, 0.00061825, 0.00310825, 0.00275041, 0.00459969,
                            0.00602096, 0.00460944, 0.00276769, 0.00743238};
  std::vector<Mode> found = modes(assemble(rotor), 25000 * kRpm, 9);
  for (std::size_t k = 0; k < 9; ++k) EXPECT_NEAR(found[k].damping(), damping[k], 1e-7);
  std::vector<double> speeds;
  for (const Critical& c : criticals(assemble(rotor), 3000)) speeds.push_back(c.speed / kRpm);
  ASSERT_EQ(speeds.size(), 7u);
  expect_within(speeds, {3620.4, 3798.1, 10017, 11278, 16769, 24399, 26603}, 2e-4, "criticals");
}

/// Amplitudes of 5.9.1 with c = 100 N s/m, U = 1e-4 kg m at the left disc, 4 digits. Where two large terms cancel (at
/// 200 rad/s) the last printed digit decides.
TEST(ShaftReference, FriswellUnbalanceResponse) {
  const std::vector<double> speeds{50, 80, 86, 100, 200, 260, 272, 300, 400};
  const struct {
    double ky;
    std::vector<double> x, y;  // um
  } cases[] = {{1e6, {0.5105, 5.3744, 44.3229, 3.6904, 0.0633, 4.5801, 9.2574, 18.158, 3.6602}, {}},
               {0.8e6,
                {0.5104, 5.1371, 62.9326, 3.6655, 0.0230, 9.7528, 20.3951, 12.9394, 3.5845},
                {0.5872, 13.6402, 8.1119, 2.8120, 0.5515, 1.5888, 7.8886, 9.3235, 3.2815}}};
  for (const auto& c : cases) {
    Rotor rotor = testing::friswell(testing::diagonal(1e6, c.ky), 100);
    rotor.unbalances = {{0.5, 0.5, 1e-4, 0}};
    const System s = assemble(rotor);
    const Response r = unbalance_response(s, speeds);
    const Eigen::Index disc = s.node_at(0.5);
    for (std::size_t k = 0; k < speeds.size(); ++k) {
      const auto i = static_cast<Eigen::Index>(k);
      EXPECT_NEAR(std::abs(r.x(disc, i)) * 1e6, c.x[k], std::max(6e-5, 6e-5 * c.x[k])) << c.ky << " x " << speeds[k];
      if (!c.y.empty()) {
        EXPECT_NEAR(std::abs(r.y(disc, i)) * 1e6, c.y[k], std::max(6e-5, 6e-5 * c.y[k])) << c.ky << " y " << speeds[k];
      }
    }
  }
}

}  // namespace
}  // namespace whirl::shaft
