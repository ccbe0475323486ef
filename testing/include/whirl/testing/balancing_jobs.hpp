#pragma once
#include <Eigen/Dense>
#include <array>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>

#include "whirl/diagnosis/influence.hpp"

namespace whirl::testing {

/// A random flexible rotor with unbalance all along it, and the runs that a fitter makes on it: ten in all: as found,
/// trial masses on each plane alone and on all together, as found again. The vectors come from sums of modes; the rotor
/// warms up while the job lasts.
struct RandomJob {
  diagnosis::BalancingJob job;
  Eigen::MatrixXcd influence;  ///< true
  Eigen::VectorXcd vibration;  ///< true, warm (time of the last run), without masses
  int wrong = -1;              ///< the run whose sheet is wrong, -1: none
  std::string slip;            ///< what is wrong with it
};

struct RandomJobOptions {
  int planes = 2;
  int modes = 0;        ///< of the rotor; 0: one more than planes, so that no masses on them can take all of it away
  double noise = 0.01;  ///< sd per component, of the rms reading of its speed
  double drift = 0.1;   ///< the largest drift over the job, of the rms reading
  bool wrong_run = false;
};

inline RandomJob random_job(const RandomJobOptions& o, unsigned seed) {
  using Complex = std::complex<double>;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  const auto angle = [&] { return 2 * std::numbers::pi * uniform(random); };
  const int modes = o.modes > 0 ? o.modes : o.planes + 1, probes = 3, speeds = 2, rows = probes * speeds;
  std::vector<double> frequency(static_cast<std::size_t>(modes)), damping(frequency.size());
  std::vector<std::array<double, 3>> shape(frequency.size());
  for (std::size_t k = 0; k < frequency.size(); ++k) {
    const auto n = static_cast<double>(k + 1);
    frequency[k] = 150 * n * n * (0.85 + 0.3 * uniform(random));
    damping[k] = 0.01 + 0.05 * uniform(random);
    shape[k] = {0.2 * normal(random), 0.2 * normal(random), 0.15 * normal(random)};
  }
  const auto phi = [&](std::size_t k, double x) {
    return std::sin(static_cast<double>(k + 1) * std::numbers::pi * x) + shape[k][0] * (x - 0.5) +
           shape[k][1] * std::cos(std::numbers::pi * x) + shape[k][2];
  };
  std::vector<double> at_plane, at_probe;
  for (int p = 0; p < o.planes; ++p) at_plane.push_back((p + 0.6 + 0.5 * (uniform(random) - 0.5)) / (o.planes + 0.2));
  for (int p = 0; p < probes; ++p) at_probe.push_back((p + 0.6 + 0.5 * (uniform(random) - 0.5)) / (probes + 0.2));
  std::vector<double> omega;
  for (int s = 0; s < speeds; ++s)
    omega.push_back(frequency[static_cast<std::size_t>(s)] *
                    (uniform(random) < 0.5 ? 0.75 + 0.15 * uniform(random) : 1.1 + 0.2 * uniform(random)));
  const auto response = [&](double x_probe, double x_mass, double w) {
    Complex sum = 0;
    for (std::size_t k = 0; k < frequency.size(); ++k)
      sum += phi(k, x_probe) * phi(k, x_mass) * w * w /
             (frequency[k] * frequency[k] - w * w + Complex(0, 2 * damping[k] * frequency[k] * w));
    return sum;
  };

  RandomJob result;
  diagnosis::BalancingJob& job = result.job;
  for (int p = 0; p < o.planes; ++p) job.planes.push_back("P" + std::to_string(p + 1));
  result.influence.resize(rows, o.planes);
  result.vibration = Eigen::VectorXcd::Zero(rows);
  Eigen::VectorXcd warm(rows);
  std::vector<std::pair<double, Complex>> unbalance;
  for (int s = 0; s < 7; ++s)
    unbalance.emplace_back((s + uniform(random)) / 7, Complex(normal(random), normal(random)));
  for (int m = 0; m < rows; ++m) {
    const int speed = m / probes;
    job.rows.push_back("probe " + std::to_string(m % probes + 1) + " at speed " + std::to_string(speed + 1));
    job.speed.push_back(speed);
    const double x = at_probe[static_cast<std::size_t>(m % probes)], w = omega[static_cast<std::size_t>(speed)];
    for (int p = 0; p < o.planes; ++p) result.influence(m, p) = response(x, at_plane[static_cast<std::size_t>(p)], w);
    for (const auto& [where, u] : unbalance) result.vibration[m] += response(x, where, w) * u;
  }
  std::vector<double> level(speeds);
  for (int s = 0; s < speeds; ++s)
    level[static_cast<std::size_t>(s)] =
        result.vibration.segment(s * probes, probes).norm() / std::sqrt(double(probes));
  for (int m = 0; m < rows; ++m)
    warm[m] = std::polar(o.drift * uniform(random) * level[static_cast<std::size_t>(m / probes)], angle());

  std::vector<Eigen::VectorXcd> masses = {Eigen::VectorXcd::Zero(o.planes)};
  // Trial masses that change the readings by about a third to two thirds.
  std::vector<double> size;
  for (int p = 0; p < o.planes; ++p)
    size.push_back((0.35 + 0.3 * uniform(random)) * result.vibration.norm() / result.influence.col(p).norm());
  for (int p = 0; p < o.planes; ++p) {
    double turn = angle();
    for (int k = 0; k < 6 / o.planes; ++k, turn += (1 + uniform(random)) * std::numbers::pi / 2) {
      masses.emplace_back(Eigen::VectorXcd::Zero(o.planes));
      masses.back()[p] = std::polar(size[static_cast<std::size_t>(p)], turn);
    }
  }
  for (int k = 0; k < 2; ++k) {
    masses.emplace_back(Eigen::VectorXcd::Zero(o.planes));
    for (int p = 0; p < o.planes; ++p) masses.back()[p] = std::polar(0.7 * size[static_cast<std::size_t>(p)], angle());
  }
  masses.emplace_back(Eigen::VectorXcd::Zero(o.planes));
  const double last = static_cast<double>(masses.size()) - 1, warming = (1.5 + 3 * uniform(random)) * last;
  const auto warmth = [&](double t) { return (1 - std::exp(-t / warming)) / (1 - std::exp(-last / warming)); };
  if (o.wrong_run) result.wrong = 1 + static_cast<int>(uniform(random) * (last - 1));
  for (std::size_t r = 0; r < masses.size(); ++r) {
    const auto t = static_cast<double>(r);
    Eigen::VectorXcd on = masses[r], read(rows);
    const bool wrong = static_cast<int>(r) == result.wrong;
    const int kind = wrong ? static_cast<int>(uniform(random) * 5) : -1;
    const Eigen::Index plane = [&] {
      Eigen::Index p = 0;
      on.cwiseAbs().maxCoeff(&p);
      return p;
    }();
    if (kind == 0) result.slip = "carried no", on.setZero();
    if (kind == 1) result.slip = "opposite side", on = -on;
    if (kind == 2) {
      result.slip = "was on plane";
      std::swap(on[plane], on[(plane + 1) % o.planes]);
    }
    if (kind == 3) result.slip = "twice the mass", on *= 2;
    for (int m = 0; m < rows; ++m) {
      const double sd = o.noise * level[static_cast<std::size_t>(m / probes)];
      read[m] = result.vibration[m] + (result.influence.row(m) * on)(0) + warm[m] * warmth(t) +
                Complex(sd * normal(random), sd * normal(random));
    }
    if (kind == 4) result.slip = "other sign", read = read.conjugate().eval();
    job.runs.push_back({"run " + std::to_string(r + 1), t, masses[r], read});
  }
  result.vibration += warm;
  return result;
}

}  // namespace whirl::testing
