#include "whirl/pages/rotor_curves.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numeric>

#include "whirl/core/angles.hpp"

namespace whirl::pages {

using Eigen::Index;

std::vector<RotorPlace> rotor_places(const shaft::Rotor& rotor, const shaft::System& system) {
  std::vector<RotorPlace> list;
  for (const shaft::Probe& p : rotor.probes) list.push_back({p.name, system.node_at(p.position), p});
  if (list.empty())
    for (const shaft::Disc& d : rotor.discs) list.push_back({d.name, system.node_at(d.position), {}});
  return list;
}

std::vector<PlaceCurve> place_curves(const shaft::Rotor& rotor, const shaft::System& system, const shaft::Response& r) {
  std::vector<PlaceCurve> curves;
  const auto count = static_cast<Index>(r.speeds.size());
  for (const RotorPlace& p : rotor_places(rotor, system)) {
    const double angle = p.probe ? p.probe->angle : 0;
    PlaceCurve c{p.probe ? p.name : p.name + " major axis", system.nodes[static_cast<std::size_t>(p.node)], angle,
                 Eigen::VectorXd(count), Eigen::VectorXd(count)};
    for (Index k = 0; k < count; ++k) {
      const std::complex<double> x = r.x(p.node, k), y = r.y(p.node, k),
                                 z = p.probe ? shaft::probe_reading(x, y, angle) : x;
      c.amplitude[k] = p.probe ? std::abs(z) : shaft::orbit(x, y).major;
      c.phase[k] = -std::arg(z);
    }
    curves.push_back(std::move(c));
  }
  return curves;
}

namespace {

/// Middles beside the maxima of a curve that a step of the grid still changes.
void add_middles(const std::vector<double>& speeds, const Eigen::VectorXd& amplitude, std::vector<double>& middles) {
  constexpr double kKnown = 2e-3;
  for (Index k = 1; k + 1 < amplitude.size(); ++k) {
    const double here = amplitude[k], before = amplitude[k - 1], after = amplitude[k + 1];
    if (here < before || here < after || std::min(before, after) > (1 - kKnown) * here) continue;
    const auto i = static_cast<std::size_t>(k);
    middles.push_back(0.5 * (speeds[i - 1] + speeds[i]));
    middles.push_back(0.5 * (speeds[i] + speeds[i + 1]));
  }
}

Eigen::MatrixXcd columns_at(const Eigen::MatrixXcd& one, const Eigen::MatrixXcd& other,
                            const std::vector<std::size_t>& order) {
  Eigen::MatrixXcd out(one.rows(), one.cols() + other.cols());
  for (std::size_t k = 0; k < order.size(); ++k) {
    const auto from = static_cast<Index>(order[k]);
    out.col(static_cast<Index>(k)) = from < one.cols() ? one.col(from) : other.col(from - one.cols());
  }
  return out;
}

/// Both responses as one over ascending speed.
shaft::Response joined(const shaft::Response& one, const shaft::Response& other) {
  std::vector<double> speeds = one.speeds;
  speeds.insert(speeds.end(), other.speeds.begin(), other.speeds.end());
  std::vector<std::size_t> order(speeds.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::ranges::sort(order, {}, [&](std::size_t k) { return speeds[k]; });
  shaft::Response out;
  for (const std::size_t k : order) out.speeds.push_back(speeds[k]);
  out.x = columns_at(one.x, other.x, order);
  out.y = columns_at(one.y, other.y, order);
  out.body_x = columns_at(one.body_x, other.body_x, order);
  out.body_y = columns_at(one.body_y, other.body_y, order);
  return out;
}

}  // namespace

shaft::Response refined_response(const shaft::Rotor& rotor, const shaft::System& system, std::vector<double> speeds) {
  constexpr int kHalvings = 20;
  shaft::Response r = shaft::unbalance_response(system, speeds);
  for (int pass = 0; pass < kHalvings; ++pass) {
    std::vector<double> middles;
    for (const PlaceCurve& c : place_curves(rotor, system, r)) add_middles(r.speeds, c.amplitude, middles);
    std::ranges::sort(middles);
    middles.erase(std::unique(middles.begin(), middles.end()), middles.end());
    if (middles.empty()) break;
    r = joined(r, shaft::unbalance_response(system, middles));
  }
  return r;
}

std::optional<shaft::Threshold> warn_if_unstable(const shaft::System& system, double from, double to,
                                                 Summary& summary) {
  const auto threshold = shaft::stability_threshold(system, from, to);
  if (threshold && threshold->frequency == 0)
    summary.warn(
        "the rotor falls away from its place: a support has a negative stiffness, and without control it is unstable");
  else if (threshold)
    summary.warn(fmt::format("unstable from {:.5g} rpm: no rotor stays in this motion there",
                             threshold->speed * kRpmPerRadPerSec));
  return threshold;
}

}  // namespace whirl::pages
