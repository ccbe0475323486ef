#pragma once
#include <array>
#include <numbers>
#include <string>
#include <vector>

#include "whirl/identify/identify.hpp"
#include "whirl/pages/steady_response.hpp"
#include "whirl/testing/machines.hpp"

namespace whirl::testing {

/// Kinds of rotors whose band is not the closed form's.
inline constexpr std::array kBandKinds{Oddity::anisotropic,       Oddity::quintic,       Oddity::gyroscopic,
                                       Oddity::quadratic_damping, Oddity::coulomb,       Oddity::rotating_damping,
                                       Oddity::cross_coupled,     Oddity::cubic_per_axis};

/// Radius of the steady whirl at a constant speed, by integration of the machine, without its sensors.
inline double whirl_radius(Machine m, double hz) {
  Run run;
  run.from_hz = run.to_hz = hz;
  run.seconds = 12 / m.c + 0.4;
  m.offset_x = m.offset_y = 0;
  return readings(m, run).bottomRows(400).rowwise().norm().maxCoeff();
}

struct BandCoverage {
  int machines = 0, refused = 0, without = 0, points = 0, inside = 0;
  std::vector<double> widths;  ///< of the band over the true radius
};

/// One machine, identified from a run-down with noise `snr` dB below the motion: is its true radius below and above the
/// resonance, where the steady whirl is one, in the band?
inline void cover_response(Oddity oddity, unsigned long long seed, double snr, BandCoverage& c) {
  constexpr double turn = 2 * std::numbers::pi;
  const DrawnMachine d = draw_machine(oddity, seed);
  identification::IdentifyOptions options;
  options.holdout = 0;
  const identification::Identification found = identification::identify({machine_record(d, snr, seed)}, options);
  if (found.model.summary.status == Status::unusable || !found.model.rotor) {
    ++c.refused;
    return;
  }
  pages::SteadyOptions o;
  o.curve.from = turn * 5;
  o.curve.to = turn * 25;
  const pages::SteadyResponse response = pages::steady_response(found.model, o);
  ++c.machines;
  if (!response.band) {
    ++c.without;
    return;
  }
  const Eigen::VectorXd &w = response.band->omega, &low = response.band->low, &high = response.band->high;
  for (const double hz : {6.0, 7.5, 9.0, 10.0, 17.0, 19.0, 21.0, 24.0}) {
    const double at = (turn * hz - w[0]) / (w[1] - w[0]);
    const auto k = static_cast<Eigen::Index>(at);
    const double part = at - static_cast<double>(k), truth = whirl_radius(d.machine, hz);
    const double from = (1 - part) * low[k] + part * low[k + 1], to = (1 - part) * high[k] + part * high[k + 1];
    ++c.points;
    c.inside += truth >= from && truth <= to;
    c.widths.push_back((to - from) / truth);
  }
}

}  // namespace whirl::testing
