#include "fit/fit_model.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/core/decompositions.hpp"
#include "whirl/shaft/reduction.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Complex = std::complex<double>;
constexpr Complex kImaginary{0, 1};

/// The rotor with a station for every trial, all sizes of unbalance and bow zero.
Rotor with_stations(Rotor r, const std::vector<Trial>& trials) {
  for (const Trial& t : trials) r.unbalances.push_back({t.position, t.position, 0, 0});
  for (Unbalance& u : r.unbalances) u.size = u.angle = 0;
  for (BowPoint& b : r.bow) b.size = b.angle = 0;
  return r;
}

/// Unit force of each unbalance station and bow point of the rotor, in the full coordinates.
MatrixXd unit_forces(const Rotor& rotor, const ParameterSet& set, Index bows, Index size) {
  const auto stations = static_cast<Index>(rotor.unbalances.size());
  MatrixXd forces(size, stations + bows);
  for (Index k = 0; k < stations + bows; ++k) {
    const bool bow = k >= set.stations && k < set.stations + bows;
    const auto u = static_cast<std::size_t>(bow ? 0 : k < set.stations ? k : k - bows);
    Rotor one = rotor;
    if (bow) {
      one.bow[static_cast<std::size_t>(k - set.stations)].size = 1;
      forces.col(k) = assemble(one).bow.real();
      continue;
    }
    one.unbalances[u].size = 1;
    forces.col(k) = assemble(one).unbalance.real();
  }
  return forces;
}

}  // namespace

FitModel::FitModel(const Rotor& drawn, ParameterSet set, const std::vector<Trial>& trials, const VectorXd& t, int modes)
    : drawn_(drawn), set_(std::move(set)), trials_(trials), modes_(modes), base_(t.head(set_.structural)) {
  // Damping of material and joints is linear from zero on, and may turn out below it.
  for (Index k = 0; k < set_.structural; ++k) {
    const UnknownKind kind = set_.all[static_cast<std::size_t>(k)].kind;
    if (kind == UnknownKind::material_damping || kind == UnknownKind::joint_damping) base_[k] = 0;
  }
  VectorXd at = t;
  at.head(set_.structural) = base_;
  const Rotor stations = with_stations(drawn_, trials_);
  const Rotor rotor = with_values(stations, set_, at);
  System full = assemble(rotor);
  ReductionOptions options;
  options.modes = modes;
  options.highest = set_.highest;
  options.speeds = 0;
  System shapes = full;
  shapes.weight.setZero();
  // Static shapes under the forces of supports, and under forces and moments of discs.
  for (const Disc& d : rotor.discs) {
    const Index node = full.node_at(d.position);
    shapes.supports.push_back({d.name, full.deflection.row(node), full.slope.row(node), {}, 0, 0});
  }
  const Reduction reduction = reduce(shapes, options);
  const MatrixXd& basis = reduction.basis;
  reduced_ = project(full, basis);
  const MatrixXd forces = unit_forces(rotor, set_, set_.bows, full.size());
  base_columns_ = basis.transpose() * forces;
  for (Index k = 0; k < set_.structural; ++k) {
    const Parameter& p = set_.all[static_cast<std::size_t>(k)];
    if (is_support(p)) continue;
    const double h = 1e-3 * std::min(p.prior_sd, 1.0);
    VectorXd moved = at;
    moved[k] += h;
    const Rotor other = with_values(stations, set_, moved);
    const System system = assemble(other);
    const auto onto = [&](const MatrixXd& a, const MatrixXd& b) {
      return MatrixXd(basis.transpose() * ((a - b) / h) * basis);
    };
    Slope s{k,
            onto(system.mass, full.mass),
            onto(system.gyroscopic, full.gyroscopic),
            onto(system.stiffness, full.stiffness),
            onto(system.rotating, full.rotating),
            {}};
    if (p.kind == UnknownKind::disc_position || set_.bows > 0)
      s.columns = basis.transpose() * ((unit_forces(other, set_, set_.bows, system.size()) - forces) / h);
    slopes_.push_back(std::move(s));
  }
  const Index r = reduced_.size(), probes = static_cast<Index>(drawn_.probes.size());
  probe_rows_.resize(probes, 2 * r);
  for (Index k = 0; k < probes; ++k) {
    const Probe& probe = drawn_.probes[static_cast<std::size_t>(k)];
    const Eigen::RowVectorXd row = reduced_.deflection.row(reduced_.node_at(probe.position));
    probe_rows_.row(k) << std::cos(probe.angle) * row, std::sin(probe.angle) * row;
  }
  this->set(t);
}

void FitModel::set(const VectorXd& t) {
  t_ = t.head(set_.structural);
  VectorXd all = VectorXd::Zero(set_.size());
  all.head(set_.structural) = t_;
  const Rotor rotor = with_values(drawn_, set_, all);
  laws_.clear();
  for (const Support& s : rotor.supports) laws_.push_back(s.law);
  mass_ = reduced_.mass;
  gyroscopic_ = reduced_.gyroscopic;
  stiffness_ = reduced_.stiffness;
  rotating_ = reduced_.rotating;
  columns_ = base_columns_;
  for (const Slope& s : slopes_) {
    const double step = t_[s.parameter] - base_[s.parameter];
    mass_ += step * s.mass;
    gyroscopic_ += step * s.gyroscopic;
    stiffness_ += step * s.stiffness;
    rotating_ += step * s.rotating;
    if (s.columns.size() > 0) columns_ += step * s.columns;
  }
}

VectorXcd FitModel::sizes(const VectorXd& t, const std::string& run) const {
  VectorXcd sizes = VectorXcd::Zero(columns());
  for (Index k = 0; k < set_.stations; ++k) sizes[k] = set_.complex_value(t, set_.unbalance + 2 * k);
  for (Index k = 0; k < set_.bows; ++k) sizes[set_.stations + k] = set_.complex_value(t, set_.bow + 2 * k);
  for (std::size_t k = 0; k < trials_.size(); ++k)
    if (trials_[k].run == run)
      sizes[set_.stations + set_.bows + static_cast<Index>(k)] = std::polar(trials_[k].size, trials_[k].angle);
  return sizes;
}

VectorXcd FitModel::force(Index column) const {
  // Re(f e^{i theta}) along x is Re(-i f e^{i theta}) along y.
  VectorXcd both(2 * size());
  both << columns_.col(column).cast<Complex>(), -kImaginary * columns_.col(column);
  return both;
}

Equations<MatrixXd> FitModel::equations(double speed) const {
  System s;
  s.mass = mass_;
  s.gyroscopic = gyroscopic_;
  s.stiffness = stiffness_;
  s.rotating = rotating_;
  s.supports = reduced_.supports;
  for (std::size_t k = 0; k < laws_.size(); ++k) s.supports[k].law = laws_[k];
  return plane_equations(s, speed);
}

Equations<MatrixXd> FitModel::speed_slopes(double speed) const {
  const Index r = size();
  Equations<MatrixXd> e{MatrixXd::Zero(2 * r, 2 * r), MatrixXd::Zero(2 * r, 2 * r), MatrixXd::Zero(2 * r, 2 * r)};
  e.damping.topRightCorner(r, r) = gyroscopic_;
  e.damping.bottomLeftCorner(r, r) = -gyroscopic_;
  e.stiffness.topRightCorner(r, r) = rotating_;
  e.stiffness.bottomLeftCorner(r, r) = -rotating_;
  const double h = 1e-3 * set_.highest;
  for (std::size_t k = 0; k < laws_.size(); ++k) {
    if (laws_[k].constant()) continue;
    const SupportLaw::Values low = laws_[k].at(speed - h), high = laws_[k].at(speed + h);
    const VectorXd& row = reduced_.supports[k].row;
    const MatrixXd product = row * row.transpose() / (2 * h);
    for (Index i = 0; i < 2; ++i)
      for (Index j = 0; j < 2; ++j) {
        e.damping.block(i * r, j * r, r, r) += (high.damping(i, j) - low.damping(i, j)) * product;
        e.stiffness.block(i * r, j * r, r, r) += (high.stiffness(i, j) - low.stiffness(i, j)) * product;
      }
  }
  return e;
}

SteadyPoint FitModel::steady(double speed) const {
  const Index r = size();
  MatrixXcd d(2 * r, 2 * r);
  const MatrixXd direct = stiffness_ - speed * speed * mass_;
  d.topLeftCorner(r, r) = direct + kImaginary * speed * rotating_;
  d.bottomRightCorner(r, r) = d.topLeftCorner(r, r);
  d.topRightCorner(r, r) = speed * rotating_ + kImaginary * (speed * speed) * gyroscopic_;
  d.bottomLeftCorner(r, r) = -d.topRightCorner(r, r);
  for (std::size_t k = 0; k < laws_.size(); ++k) {
    const SupportLaw::Values v = laws_[k].at(speed);
    const Attachment& a = reduced_.supports[k];
    for (Index i = 0; i < 2; ++i)
      for (Index j = 0; j < 2; ++j) {
        const Complex s(v.stiffness(i, j) - speed * speed * v.mass(i, j), speed * v.damping(i, j));
        if (s != 0.0) d.block(i * r, j * r, r, r) += (s * a.row) * a.row.transpose();
      }
    if (a.tilt.size() == 0) continue;
    const Complex s(a.tilt_stiffness, speed * a.tilt_damping);
    for (const Index i : {Index{0}, r}) d.block(i, i, r, r) += (s * a.tilt) * a.tilt.transpose();
  }
  const Eigen::PartialPivLU<MatrixXcd> lu(d);
  MatrixXcd forces(2 * r, columns());
  for (Index k = 0; k < columns(); ++k) forces.col(k) = factor(k, speed) * force(k);
  SteadyPoint p;
  p.answers = lu.solve(forces);
  p.adjoint = lu.transpose().solve(MatrixXcd(probe_rows_.transpose().cast<Complex>()));
  p.readings = probe_rows_ * p.answers;
  return p;
}

MatrixXcd FitModel::steady_slopes(double speed, const SteadyPoint& point, const VectorXcd& sizes) const {
  MatrixXcd force = -dynamic_slopes(speed, Complex(0, speed), point.answers * sizes);
  for (const Slope& g : slopes_) {
    if (g.columns.size() == 0) continue;
    for (Index c = 0; c < columns(); ++c) {
      const VectorXcd f = (factor(c, speed) * sizes[c]) * g.columns.col(c);
      force.col(g.parameter).head(size()) += f;
      force.col(g.parameter).tail(size()) -= kImaginary * f;
    }
  }
  return point.adjoint.transpose() * force;
}

MatrixXcd FitModel::dynamic_slopes(double speed, Complex s, const VectorXcd& v) const {
  const Index r = size();
  MatrixXcd slopes = MatrixXcd::Zero(2 * r, set_.structural);
  for (Index k = 0; k < set_.structural; ++k) {
    const Parameter& p = set_.all[static_cast<std::size_t>(k)];
    if (!is_support(p)) continue;
    const VectorXd& row = reduced_.supports[p.index].row;
    const double value = p.logarithmic ? p.value(t_[k]) : p.scale;
    const double size = value * set_.shape(p, drawn_.supports[p.index].law, speed);
    const Complex factor = p.kind == UnknownKind::stiffness ? Complex(size) : s * size;
    slopes.col(k).segment(p.row * r, r) = (factor * row.dot(v.segment(p.column * r, r))) * row;
    if (set_.axes_alike && p.row == p.column) slopes.col(k).tail(r) = (factor * row.dot(v.tail(r))) * row;
  }
  for (const Slope& g : slopes_) {
    const MatrixXcd direct = s * s * g.mass + s * g.rotating + g.stiffness;
    const MatrixXcd cross = s * speed * g.gyroscopic + speed * g.rotating;
    slopes.col(g.parameter) << direct * v.head(r) + cross * v.tail(r), direct * v.tail(r) - cross * v.head(r);
  }
  return slopes;
}

MatrixXcd FitModel::force_slopes(Index parameter) const {
  for (const Slope& g : slopes_) {
    if (g.parameter != parameter || g.columns.size() == 0) continue;
    MatrixXcd both(2 * size(), columns());
    both << g.columns.cast<Complex>(), -kImaginary * g.columns;
    return both;
  }
  return {};
}

}  // namespace whirl::shaft
