// Two discs, two planes: the correction from the modes of a hammer test with no trial run or with one.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <cmath>
#include <numbers>
#include <random>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/modal_influence.hpp"

namespace whirl::diagnosis {
namespace {

using Complex = std::complex<double>;

/// A shaft with two discs, each direction alike; points: disc 1, disc 2.
struct TwoDiscs {
  Eigen::Matrix2d mass = Eigen::Matrix2d::Zero(), stiffness, damping;
  Eigen::Matrix2cd receptance(double w) const {
    return (stiffness.cast<Complex>() - w * w * mass.cast<Complex>() + Complex(0, w) * damping.cast<Complex>())
        .inverse();
  }
};

TwoDiscs draw(std::mt19937_64& random) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  TwoDiscs d;
  d.mass.diagonal() << uniform(0.8, 1.6), uniform(0.8, 1.6);
  const double a = uniform(4e4, 7e4), b = uniform(4e4, 7e4), k = uniform(3e4, 8e4);
  d.stiffness << a + k, -k, -k, b + k;
  d.damping = 2e-4 * d.stiffness + uniform(2, 6) * d.mass;
  return d;
}

/// Poles and residues of the receptance from the first-order form; f and zeta with the scatter of a hammer test. Blows
/// on disc 1 alone (`roving`: the sensor moves), or on both.
ModalModel modes_of(const TwoDiscs& d, bool roving, double sd_f, double sd_zeta, std::mt19937_64& random) {
  Eigen::Matrix4d a = Eigen::Matrix4d::Zero();
  const Eigen::Matrix2d by = d.mass.inverse();
  a.topRightCorner<2, 2>().setIdentity();
  a.bottomLeftCorner<2, 2>() = -by * d.stiffness;
  a.bottomRightCorner<2, 2>() = -by * d.damping;
  const Eigen::EigenSolver<Eigen::MatrixXd> eigen(Eigen::MatrixXd{a});
  const Eigen::Matrix4cd inverse = eigen.eigenvectors().inverse();
  std::normal_distribution<double> normal;
  ModalModel m;
  m.responses = {"d1:+X", "d2:+X"};
  m.references = {"d1:+X", "d1:+X"};
  if (!roving) {
    m.responses.insert(m.responses.end(), {"d1:+X", "d2:-X"});
    m.references.insert(m.references.end(), {"d2:+X", "d2:+X"});
  }
  for (int k = 0; k < 4; ++k) {
    Complex pole = eigen.eigenvalues()[k];
    if (pole.imag() <= 0) continue;
    // H = [I 0] V (s - p)^-1 V^-1 [0; M^-1]
    const Eigen::Matrix2cd residue = eigen.eigenvectors().topRows<2>().col(k) * inverse.row(k).rightCols<2>() * by;
    Mode mode;
    mode.residues.resize(static_cast<Eigen::Index>(m.responses.size()));
    mode.residues.head<2>() << residue(0, 0), residue(1, 0);
    if (!roving) mode.residues.tail<2>() << residue(0, 1), -residue(1, 1);
    const double w = std::abs(pole) * (1 + sd_f * normal(random));
    const double zeta = -pole.real() / std::abs(pole) * (1 + sd_zeta * normal(random));
    mode.pole = {-zeta * w, w * std::sqrt(1 - zeta * zeta)};
    mode.frequency = Estimate::from_sd(w / kTwoPi, sd_f * w / kTwoPi);
    mode.damping = Estimate::from_sd(zeta, sd_zeta * zeta);
    m.modes.push_back(mode);
  }
  return m;
}

ModalReadings readings(const std::vector<double>& speeds) {
  ModalReadings r;
  r.planes = {"d1", "d2"};
  r.radius = 0.08;
  for (const double w : speeds)
    for (const char* probe : {"d1", "d2"}) {
      r.probes.emplace_back(probe);
      r.speed.push_back(w);
      r.angle.push_back(probe[1] == '1' ? 0.4 : 0.4 + kTwoPi / 4);
    }
  return r;
}

Eigen::MatrixXcd truth_of(const TwoDiscs& d, const ModalReadings& r) {
  Eigen::MatrixXcd a(static_cast<Eigen::Index>(r.probes.size()), 2);
  for (std::size_t m = 0; m < r.probes.size(); ++m)
    for (int p = 0; p < 2; ++p)
      a(static_cast<Eigen::Index>(m), p) = r.radius * r.speed[m] * r.speed[m] *
                                           d.receptance(r.speed[m])(r.probes[m] == "d1" ? 0 : 1, p) *
                                           std::polar(1.0, r.mark - r.angle[m]);
  return a;
}

TEST(ModalInfluenceReference, TheModesGiveTheInfluenceOfBothPlanes) {
  std::mt19937_64 random(3);
  for (int k = 0; k < 10; ++k) {
    const TwoDiscs d = draw(random);
    ModalReadings r = readings({120, 190, 260});
    r.mark = 0.9;
    const Eigen::MatrixXcd truth = truth_of(d, r);
    for (const bool roving : {true, false})
      EXPECT_LT((modal_influence(modes_of(d, roving, 0, 0, random), r) - truth).norm(), 1e-9 * truth.norm()) << roving;
  }
}

TEST(ModalInfluence, PointsThatTheModesDoNotConnectAreNamed) {
  std::mt19937_64 random(3);
  ModalModel m = modes_of(draw(random), true, 0, 0, random);
  ModalReadings r = readings({120});
  r.planes[1] = "coupling";
  try {
    (void)modal_influence(m, r);
    FAIL();
  } catch (const Error& e) {
    EXPECT_NE(std::string(e.what()).find("plane 'coupling'"), std::string::npos) << e.what();
    EXPECT_NE(std::string(e.what()).find("d1, d2"), std::string::npos) << e.what();
  }
  r = readings({120});
  m.references = {"d1:+Y", "d1:+Y"};  // blown across: says nothing of this direction
  EXPECT_THROW((void)modal_influence(m, r), Error);
}

// Modes with their scatter, the stated relative errors on top; unbalance on both discs. `trials`: runs with a trial
// mass, on disc 1 first.
void expect_coverage(int trials, double most_left) {
  constexpr int kJobs = 300;
  constexpr double kCommon = 0.06, kEach = 0.03, kNoise = 1e-6;
  int held = 0;
  double left = 0, before = 0;
  for (unsigned job = 0; job < kJobs; ++job) {
    std::mt19937_64 random(41000 + job);
    std::normal_distribution<double> normal;
    const auto complex_normal = [&](double sd) {
      const double a = normal(random), b = normal(random);
      return sd / std::numbers::sqrt2 * Complex(a, b);
    };
    const TwoDiscs d = draw(random);
    const ModalModel modes = modes_of(d, job % 2 == 0, 2e-3, 0.05, random);
    const ModalReadings r = readings({120, 170});
    Eigen::MatrixXcd truth = truth_of(d, r);
    for (int s = 0; s < 2; ++s) {
      const Complex common = 1.0 + complex_normal(kCommon);
      for (int m = 2 * s; m < 2 * s + 2; ++m)
        for (int p = 0; p < 2; ++p) truth(m, p) *= common + complex_normal(kEach);
    }
    const Eigen::Vector2cd unbalance(complex_normal(3e-3), complex_normal(3e-3));  // kg at the radius
    BalancingJob found;
    found.planes = r.planes;
    for (int m = 0; m < 4; ++m) {
      found.rows.push_back(r.probes[static_cast<std::size_t>(m)] + " " + std::to_string(m / 2));
      found.speed.push_back(m / 2);
    }
    for (int k = 0; k <= trials; ++k) {
      BalancingRun run;
      run.name = std::to_string(k);
      run.masses = Eigen::VectorXcd::Zero(2);
      if (k > 0) run.masses[k - 1] = 4e-3;
      run.vibration = truth * (unbalance + run.masses);
      for (Complex& z : run.vibration) z += Complex(normal(random), normal(random)) * kNoise;
      found.runs.push_back(run);
    }
    const BayesianBalance b = balance_with_prior(found, modal_prior(modes, r, kCommon, kEach), kNoise, 800, job);
    for (int p = 0; p < 2; ++p) {
      const Complex best = -unbalance[p];
      held += b.real[static_cast<std::size_t>(p)].low <= best.real() &&
              best.real() <= b.real[static_cast<std::size_t>(p)].high;
      held += b.imag[static_cast<std::size_t>(p)].low <= best.imag() &&
              best.imag() <= b.imag[static_cast<std::size_t>(p)].high;
    }
    left += (truth * (unbalance + b.masses)).squaredNorm();
    before += (truth * unbalance).squaredNorm();
  }
  ::testing::Test::RecordProperty("held of 1200, " + std::to_string(trials), held);
  ::testing::Test::RecordProperty("left, percent", static_cast<int>(100 * std::sqrt(left / before)));
  EXPECT_GE(held, 0.92 * 4 * kJobs) << trials;
  EXPECT_LE(held, 0.985 * 4 * kJobs) << trials;
  EXPECT_LT(std::sqrt(left / before), most_left) << trials;
}

TEST(ModalPriorProperty, WithoutATrialRunTheIntervalsOfBothPlanesHold) { expect_coverage(0, 0.25); }
TEST(ModalPriorProperty, WithOneTrialRunTheIntervalsOfBothPlanesHold) { expect_coverage(1, 0.12); }

}  // namespace
}  // namespace whirl::diagnosis
