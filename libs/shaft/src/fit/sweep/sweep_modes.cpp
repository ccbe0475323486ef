#include <algorithm>
#include <cmath>

#include "fit/sweep/mode_groups.hpp"
#include "fit/sweep/sweep.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Complex = std::complex<double>;

/// All eigenpairs, those that oscillate below a frequency first; none where the solver does not find them.
struct StatePairs {
  std::vector<StatePair> near, others;
};
StatePairs state_pairs(const Equations<MatrixXd>& e, const MatrixXd& inverse_mass, double highest) {
  const Index n = e.mass.rows();
  MatrixXd a = MatrixXd::Zero(2 * n, 2 * n);
  a.topRightCorner(n, n).setIdentity();
  a.bottomLeftCorner(n, n) = -inverse_mass * e.stiffness;
  a.bottomRightCorner(n, n) = -inverse_mass * e.damping;
  const Eigen::EigenSolver<MatrixXd> solver(a, true);
  if (solver.info() != Eigen::Success) return {};  // of values that no rotor has: another start goes on
  const MatrixXcd vectors = solver.eigenvectors();
  const MatrixXcd inverse_vectors = Eigen::PartialPivLU<MatrixXcd>(vectors).inverse();
  StatePairs pairs;
  for (Index k = 0; k < 2 * n; ++k) {
    const Complex pole = solver.eigenvalues()[k];
    const bool near = pole.imag() > 0 && pole.imag() <= highest && std::abs(pole.real()) <= pole.imag();
    (near ? pairs.near : pairs.others).push_back({pole, vectors.col(k), inverse_vectors.row(k).transpose()});
  }
  return pairs;
}

/// Continues the modes of a node by those of the next: of each the one, or the group of equal poles, with the largest
/// product of both overlaps, turned so that its shapes change least. False where two go on as the same one.
bool continue_pairs(const std::vector<StatePair>& before, StatePairs& found) {
  const std::vector<ModeGroup> groups = groups_of(found.near);
  std::vector<std::vector<std::size_t>> going_on(groups.size());  // which of those before go on in a group
  for (std::size_t i = 0; i < before.size(); ++i) {
    double best = 0;
    std::size_t at = groups.size();
    for (std::size_t g = 0; g < groups.size(); ++g) {
      const double overlap = std::abs(groups[g].overlap(found.near, before[i]));
      if (going_on[g].size() == groups[g].size() || overlap <= best) continue;
      best = overlap;
      at = g;
    }
    if (at == groups.size()) return false;
    going_on[at].push_back(i);
  }
  std::vector<StatePair> kept(before.size());
  for (std::size_t g = 0; g < groups.size(); ++g) {
    std::vector<StatePair> earlier;
    for (const std::size_t i : going_on[g]) earlier.push_back(before[i]);
    const std::vector<StatePair> all = groups[g].continued(found.near, earlier);
    for (std::size_t j = 0; j < all.size(); ++j) {
      if (j < earlier.size())
        kept[going_on[g][j]] = all[j];
      else
        found.others.push_back(all[j]);
    }
  }
  found.near = std::move(kept);
  return true;
}

/// Slopes of the mass over the structural unknowns, times `v`: what is quadratic in s of those of the dynamic
/// stiffness.
MatrixXcd mass_slopes(const FitModel& model, double speed, const VectorXcd& v) {
  const MatrixXcd one = model.dynamic_slopes(speed, speed, v), other = model.dynamic_slopes(speed, -speed, v);
  return (one + other - 2 * model.dynamic_slopes(speed, 0, v)) / (2 * speed * speed);
}

/// Slopes of pole, shape and source of each mode over the structural unknowns: r_k moves by sum_j r_j (l_j' dA r_k) /
/// (a_k - a_j) over all other modes, l_k alike (Nelson's sum; Adhikari, Structural Dynamic Analysis, 2013, ch. 1).
void add_slopes(const FitModel& model, double speed, const MatrixXd& inverse_mass, const MatrixXcd& lower,
                const MatrixXcd& shape, const VectorXcd& poles, SweepNode& node) {
  const Index count = node.pole.size(), all = poles.size(), unknowns = model.parameters().structural;
  const Index probes = model.probe_rows().rows(), columns = model.columns();
  const MatrixXcd readings = model.probe_rows() * shape;
  MatrixXcd forces(lower.rows(), columns);
  for (Index c = 0; c < columns; ++c) forces.col(c) = model.force(c);
  const MatrixXcd sources = lower.transpose() * forces;
  const MatrixXcd accelerations = inverse_mass.cast<Complex>() * forces;
  node.pole_slopes.resize(count, unknowns);
  node.reading_slopes = MatrixXcd::Zero(probes * count, unknowns);
  node.source_slopes = MatrixXcd::Zero(count * columns, unknowns);
  // A' acts from r_j on l_k too, so that both ways are needed: of every mode j, l_k' dA r_j.
  std::vector<MatrixXcd> of_right(static_cast<std::size_t>(all));
  for (Index j = 0; j < all; ++j)
    of_right[static_cast<std::size_t>(j)] =
        -lower.transpose() * model.dynamic_slopes(speed, poles[j], shape.col(j));  // row i: l_i' dA r_j
  for (Index k = 0; k < count; ++k) {
    const MatrixXcd& mine = of_right[static_cast<std::size_t>(k)];
    node.pole_slopes.row(k) = mine.row(k);
    for (Index j = 0; j < all; ++j) {
      const Complex apart = poles[k] - poles[j];
      if (j == k || equal_poles(poles[k], poles[j])) continue;
      for (Index u = 0; u < unknowns; ++u) {
        const Complex turn_right = mine(j, u) / apart;
        const Complex turn_left = of_right[static_cast<std::size_t>(j)](k, u) / apart;
        for (Index p = 0; p < probes; ++p) node.reading_slopes(k * probes + p, u) += turn_right * readings(p, j);
        for (Index c = 0; c < columns; ++c) node.source_slopes(c * count + k, u) += turn_left * sources(j, c);
      }
    }
  }
  for (Index c = 0; c < columns; ++c) {  // the force moves the rotor by the inverse of its mass
    const MatrixXcd lost = lower.leftCols(count).transpose() * mass_slopes(model, speed, accelerations.col(c));
    node.source_slopes.middleRows(c * count, count) -= lost;
  }
  for (Index u = 0; u < unknowns; ++u) {
    const MatrixXcd moved = model.force_slopes(u);
    if (moved.size() == 0) continue;
    const MatrixXcd added = lower.leftCols(count).transpose() * moved;
    node.source_slopes.col(u) += added.reshaped();
  }
}

SweepNode make_node(const FitModel& model, double speed, const MatrixXd& inverse_mass, const StatePairs& pairs) {
  const Index n = 2 * model.size(), count = static_cast<Index>(pairs.near.size());
  const Index all = count + static_cast<Index>(pairs.others.size());
  const Equations<MatrixXd> turn = model.speed_slopes(speed);
  MatrixXcd lower(n, all), shape(n, all);
  VectorXcd poles(all);
  for (Index k = 0; k < all; ++k) {
    const StatePair& p =
        k < count ? pairs.near[static_cast<std::size_t>(k)] : pairs.others[static_cast<std::size_t>(k - count)];
    poles[k] = p.pole;
    shape.col(k) = p.right.head(n);
    lower.col(k) = inverse_mass.transpose() * p.left.tail(n);
  }
  SweepNode node;
  node.pole = poles.head(count);
  node.slope.resize(count);
  node.reading = model.probe_rows() * shape.leftCols(count);
  node.source.resize(count, model.columns());
  node.coupling = MatrixXcd::Zero(count, count);
  for (Index c = 0; c < model.columns(); ++c) node.source.col(c) = lower.leftCols(count).transpose() * model.force(c);
  add_slopes(model, speed, inverse_mass, lower, shape, poles, node);
  for (Index j = 0; j < count; ++j) {
    const VectorXcd change = -(node.pole[j] * (turn.damping * shape.col(j)) + turn.stiffness * shape.col(j));
    for (Index k = 0; k < count; ++k) {
      const Complex part = product(lower.col(k), change);
      if (k == j) {
        node.slope[k] = part;
        continue;
      }
      const Complex apart = node.pole[j] - node.pole[k];
      if (!equal_poles(node.pole[j], node.pole[k])) node.coupling(k, j) = -part / apart;
    }
  }
  return node;
}

}  // namespace

SweepModes sweep_modes(const FitModel& model, double lowest, double highest, int nodes) {
  // Modes up to a third above the highest speed are still pulled along; faster ones follow at once.
  constexpr double kNear = 1.33;
  SweepModes modes;
  modes.speed = VectorXd::LinSpaced(nodes, lowest, highest);
  modes.nodes.resize(static_cast<std::size_t>(nodes));
  std::vector<StatePair> before;
  const MatrixXd inverse_mass = inverse(model.equations(highest).mass);
  for (Index k = nodes - 1; k >= 0; --k) {
    const double speed = modes.speed[k];
    const bool first = k == nodes - 1;
    StatePairs pairs = state_pairs(model.equations(speed), inverse_mass, (first ? 1 : 1.5) * kNear * highest);
    // Without a mode, or where one stops to oscillate, the motion counts as steady.
    if (first ? pairs.near.empty() : !continue_pairs(before, pairs)) return modes;
    if (first) make_planar(pairs.near);
    modes.nodes[static_cast<std::size_t>(k)] = make_node(model, speed, inverse_mass, pairs);
    before = std::move(pairs.near);
  }
  modes.count = static_cast<Index>(before.size());
  return modes;
}

void SweepModes::read(double v, SweepNode& node, Part part) const {
  const Index n = speed.size();
  const double spacing = (speed[n - 1] - speed[0]) / static_cast<double>(n - 1);
  const double place = std::clamp((v - speed[0]) / spacing, 0.0, static_cast<double>(n - 1));
  const Index k = std::min<Index>(n - 2, static_cast<Index>(place));
  const double b = place - static_cast<double>(k), a = 1 - b;
  const auto at = [this](Index i) -> const SweepNode& { return nodes[static_cast<std::size_t>(i)]; };
  const SweepNode &l = at(k), &r = at(k + 1);
  // Hermite's cubic.
  node.pole = (a * a * (1 + 2 * b)) * l.pole + (b * b * (1 + 2 * a)) * r.pole + (spacing * a * a * b) * l.slope -
              (spacing * b * b * a) * r.slope;
  // Lagrange's through four nodes, those at the ends twice as far inside.
  const Index from = std::clamp<Index>(k - 1, 0, n - 4);
  const double x = place - static_cast<double>(from);
  const double w0 = -(x - 1) * (x - 2) * (x - 3) / 6, w1 = x * (x - 2) * (x - 3) / 2;
  const double w2 = -x * (x - 1) * (x - 3) / 2, w3 = x * (x - 1) * (x - 2) / 6;
  const SweepNode &n0 = at(from), &n1 = at(from + 1), &n2 = at(from + 2), &n3 = at(from + 3);
  node.source = w0 * n0.source + w1 * n1.source + w2 * n2.source + w3 * n3.source;
  node.coupling = w0 * n0.coupling + w1 * n1.coupling + w2 * n2.coupling + w3 * n3.coupling;
  if (part == Part::motion) return;
  node.pole_slopes = w0 * n0.pole_slopes + w1 * n1.pole_slopes + w2 * n2.pole_slopes + w3 * n3.pole_slopes;
  node.source_slopes = w0 * n0.source_slopes + w1 * n1.source_slopes + w2 * n2.source_slopes + w3 * n3.source_slopes;
  if (part == Part::slopes) return;
  node.reading = w0 * n0.reading + w1 * n1.reading + w2 * n2.reading + w3 * n3.reading;
  // The derivatives of the weights.
  const double d0 = -((x - 2) * (x - 3) + (x - 1) * (x - 3) + (x - 1) * (x - 2)) / (6 * spacing);
  const double d1 = ((x - 2) * (x - 3) + x * (x - 3) + x * (x - 2)) / (2 * spacing);
  const double d2 = -((x - 1) * (x - 3) + x * (x - 3) + x * (x - 1)) / (2 * spacing);
  const double d3 = ((x - 1) * (x - 2) + x * (x - 2) + x * (x - 1)) / (6 * spacing);
  node.reading_rate = d0 * n0.reading + d1 * n1.reading + d2 * n2.reading + d3 * n3.reading;
  node.reading_slopes =
      w0 * n0.reading_slopes + w1 * n1.reading_slopes + w2 * n2.reading_slopes + w3 * n3.reading_slopes;
}

}  // namespace whirl::shaft
