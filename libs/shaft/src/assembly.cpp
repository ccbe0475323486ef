#include <algorithm>
#include <cmath>

#include "bow_spline.hpp"
#include "mesh.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/shaft/system.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

/// Coordinates of a plane: deflection and angle of node after node, the inner ones of element after element, then
/// deflection and (where it tilts) angle of body after body.
class Assembler {
 public:
  Assembler(const Rotor& rotor, int refinement) : rotor_(rotor), mesh_(make_mesh(rotor, refinement)) {
    nodes_ = static_cast<Index>(mesh_.nodes.size());
    inner_ = rotor.element == ElementKind::internal_node && rotor.shear.model != ShearModel::none ? 2 : 0;
    size_ = 2 * nodes_ + inner_ * (nodes_ - 1);
    for (const Body& body : rotor.bodies) {
      body_start_.push_back(size_);
      size_ += body.transverse > 0 ? 2 : 1;
    }
  }

  System assemble() {
    system_.nodes = mesh_.nodes;
    system_.vertical = rotor_.vertical;
    for (MatrixXd* m : {&system_.mass, &system_.gyroscopic, &system_.stiffness, &system_.rotating})
      *m = MatrixXd::Zero(size_, size_);
    system_.unbalance = system_.bow = Eigen::VectorXcd::Zero(size_);
    system_.weight = VectorXd::Zero(size_);
    add_shaft();
    add_bow();  // while the stiffness is that of the shaft alone
    add_parts();
    for (const Support& s : rotor_.supports) add_support(s);
    add_actuators();
    add_unbalance();
    observe();
    system_.free = free_motions();
    return std::move(system_);
  }

 private:
  std::vector<Index> coordinates(std::size_t element) const {
    const auto e = static_cast<Index>(element);
    std::vector<Index> at{2 * e, 2 * e + 1, 2 * e + 2, 2 * e + 3};
    for (Index k = 0; k < inner_; ++k) at.push_back(2 * nodes_ + inner_ * e + k);
    return at;
  }

  void add_shaft() {
    for (std::size_t e = 0; e < mesh_.elements.size(); ++e) {
      const MeshElement& part = mesh_.elements[e];
      const Material& material = rotor_.materials[part.material];
      elements_.push_back(make_element(part.shape, material, rotor_.shear, rotor_.element));
      const Element& made = elements_.back();
      const std::vector<Index> at = coordinates(e);
      system_.mass(at, at) += made.mass;
      system_.gyroscopic(at, at) += made.gyroscopic;
      system_.stiffness(at, at) += made.stiffness + rotor_.axial_force * made.geometric;
      system_.rotating(at, at) += material.damping * made.stiffness;
      system_.weight(at) += material.density * area(part.shape) * made.load;
    }
  }
  // Mean area; the weight of a tapered element is even along it.
  static double area(const ElementShape& s) {
    const auto cone = [](double a, double b) { return kPi / 12 * (a * a + a * b + b * b); };
    return cone(s.outer_left, s.outer_right) - cone(s.inner_left, s.inner_right);
  }

  void add_bow() {
    if (rotor_.bow.size() < 2) return;
    std::vector<double> at;
    Eigen::VectorXcd values(static_cast<Index>(rotor_.bow.size()));
    for (const BowPoint& p : rotor_.bow) {
      values[static_cast<Index>(at.size())] = std::polar(p.size, p.angle);
      at.push_back(p.position);
    }
    const BowSpline spline(at, values);
    Eigen::VectorXcd shape = Eigen::VectorXcd::Zero(size_);
    for (Index k = 0; k < nodes_; ++k)
      std::tie(shape[2 * k], shape[2 * k + 1]) = spline.at(mesh_.nodes[static_cast<std::size_t>(k)]);
    system_.bow = system_.stiffness * shape;
  }

  /// The row by which the deflection of a point is read from the coordinates; empty for the ground.
  VectorXd row(const Point& point) const {
    if (point.part == "ground") return VectorXd::Zero(size_);
    if (point.part == "shaft") return VectorXd::Unit(size_, 2 * static_cast<Index>(mesh_.node(point.position)));
    const std::size_t b = body(point.part);
    VectorXd r = VectorXd::Unit(size_, body_start_[b]);
    if (rotor_.bodies[b].transverse > 0) r[body_start_[b] + 1] = point.position - rotor_.bodies[b].position;
    return r;
  }
  VectorXd slope_row(const Point& point) const {
    if (point.part == "shaft") return VectorXd::Unit(size_, 2 * static_cast<Index>(mesh_.node(point.position)) + 1);
    if (point.part != "ground" && rotor_.bodies[body(point.part)].transverse > 0)
      return VectorXd::Unit(size_, body_start_[body(point.part)] + 1);
    return VectorXd::Zero(size_);
  }
  std::size_t body(const std::string& name) const {
    const auto found =
        std::find_if(rotor_.bodies.begin(), rotor_.bodies.end(), [&](const Body& b) { return b.name == name; });
    return static_cast<std::size_t>(found - rotor_.bodies.begin());
  }

  /// Slopes of deflection and angle at a node. Both jump where a disc sits; what moving it does follows from their mean
  /// (as the force on a moving singularity; Eshelby, Phil. Trans. R. Soc. A 244, 1951).
  EndSlopes mean_slopes(std::size_t node) const {
    EndSlopes mean{VectorXd::Zero(size_), VectorXd::Zero(size_)};
    const auto add = [&](std::size_t element, bool right, double part) {
      const std::vector<Index> at = coordinates(element);
      const EndSlopes& end = right ? elements_[element].right : elements_[element].left;
      mean.deflection(at) += part * end.deflection;
      mean.angle(at) += part * end.angle;
    };
    const bool first = node == 0, last = node + 1 == mesh_.nodes.size();
    if (!first) add(node - 1, true, last ? 1 : 0.5);
    if (!last) add(node, false, first ? 1 : 0.5);
    return mean;
  }

  /// By which the hub of a disc deflects and tilts.
  EndSlopes hub(const Disc& d) const {
    EndSlopes at{row({"shaft", d.position}), slope_row({"shaft", d.position})};
    if (d.moved == 0) return at;
    const EndSlopes slopes = mean_slopes(mesh_.node(d.position));
    return {at.deflection + d.moved * slopes.deflection, at.angle + d.moved * slopes.angle};
  }

  void add_parts() {
    for (const Disc& d : rotor_.discs) {
      const auto [deflection, angle] = hub(d);
      const VectorXd centre = deflection + d.offset * angle;
      system_.mass += d.mass * centre * centre.transpose() + d.transverse * angle * angle.transpose();
      system_.gyroscopic += d.polar * angle * angle.transpose();
      system_.weight += d.mass * centre;
    }
    for (std::size_t b = 0; b < rotor_.bodies.size(); ++b) {
      const Index at = body_start_[b];
      system_.mass(at, at) += rotor_.bodies[b].mass;
      system_.weight[at] += rotor_.bodies[b].mass;
      if (rotor_.bodies[b].transverse > 0) system_.mass(at + 1, at + 1) += rotor_.bodies[b].transverse;
    }
    for (const JointDamping& j : rotor_.joints) {
      const VectorXd parting = slope_row({"shaft", j.to}) - slope_row({"shaft", j.from});
      system_.rotating += j.coefficient * parting * parting.transpose();
    }
  }

  void add_support(const Support& s) {
    Attachment a{s.name, row(s.a) - row(s.b), {}, s.law, s.tilt_stiffness, s.tilt_damping};
    if (s.tilt_stiffness != 0 || s.tilt_damping != 0) a.tilt = slope_row(s.a) - slope_row(s.b);
    system_.supports.push_back(std::move(a));
  }

  void add_actuators() {
    system_.actuators = MatrixXd::Zero(static_cast<Index>(rotor_.actuators.size()), size_);
    Index k = 0;
    for (const Actuator& a : rotor_.actuators) {
      const VectorXd felt = row(a.a) - row(a.b);
      system_.actuators.row(k++) = felt.transpose();
      if (a.bias_stiffness == 0) continue;
      const Eigen::Vector2d along(std::cos(a.angle), std::sin(a.angle));
      SupportLaw law;
      law.stiffness = {a.bias_stiffness * along * along.transpose()};
      system_.supports.push_back({"bias of " + a.name, felt, {}, law, 0, 0});
    }
  }

  void add_unbalance() {
    for (const Unbalance& u : rotor_.unbalances) {
      const std::complex<double> size = std::polar(u.size, u.angle);
      const std::size_t first = mesh_.node(u.position), last = mesh_.node(u.end);
      const auto disc =
          std::ranges::find_if(rotor_.discs, [&](const Disc& d) { return mesh_.node(d.position) == first; });
      if (first == last)
        system_.unbalance += size * (disc == rotor_.discs.end() ? row({"shaft", u.position}) : hub(*disc).deflection);
      const double spread = mesh_.nodes[last] - mesh_.nodes[first];
      for (std::size_t e = first; e < last; ++e)
        system_.unbalance(coordinates(e)) += size / spread * elements_[e].load.cast<std::complex<double>>();
    }
  }

  void observe() {
    system_.deflection = system_.slope = MatrixXd::Zero(nodes_, size_);
    system_.bodies = MatrixXd::Zero(static_cast<Index>(body_start_.size()), size_);
    for (Index k = 0; k < nodes_; ++k) system_.deflection(k, 2 * k) = system_.slope(k, 2 * k + 1) = 1;
    for (std::size_t b = 0; b < body_start_.size(); ++b) system_.bodies(static_cast<Index>(b), body_start_[b]) = 1;
  }

  /// Rank of what the supports do to the motions of rigid parts: the shaft moves and tilts, so does each body.
  int free_motions() const {
    constexpr double kRounding = 1e-12;
    const double length = mesh_.nodes.back() - mesh_.nodes.front();
    MatrixXd rigid = MatrixXd::Zero(size_, 2 + size_ - (body_start_.empty() ? size_ : body_start_.front()));
    for (Index k = 0; k < nodes_; ++k) {
      rigid(2 * k, 0) = 1;
      rigid(2 * k, 1) = mesh_.nodes[static_cast<std::size_t>(k)] / length;
      rigid(2 * k + 1, 1) = 1 / length;
    }
    for (Index j = 2; j < rigid.cols(); ++j) rigid(size_ - rigid.cols() + j, j) = 1;
    const Index n = rigid.cols();
    MatrixXd held = MatrixXd::Zero(2 * n, 2 * n);
    for (const Attachment& s : system_.supports) {
      const VectorXd moved = rigid.transpose() * s.row;
      const Eigen::Matrix2d stiffness = s.law.at(0).stiffness;
      for (Index p = 0; p < 2; ++p)
        for (Index q = 0; q < 2; ++q) held.block(p * n, q * n, n, n) += stiffness(p, q) * moved * moved.transpose();
      if (s.tilt.size() == 0) continue;
      const VectorXd tilted = rigid.transpose() * s.tilt;
      for (Index p = 0; p < 2; ++p) held.block(p * n, p * n, n, n) += s.tilt_stiffness * tilted * tilted.transpose();
    }
    return static_cast<int>(2 * n - Eigen::FullPivLU<MatrixXd>(held).setThreshold(kRounding).rank());
  }

  const Rotor& rotor_;
  Mesh mesh_;
  Index nodes_ = 0, inner_ = 0, size_ = 0;
  std::vector<Index> body_start_;
  std::vector<Element> elements_;
  System system_;
};

}  // namespace

System assemble(const Rotor& rotor, int refinement) {
  check(rotor);
  return Assembler(rotor, refinement).assemble();
}

}  // namespace whirl::shaft
