#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "fit/evidence.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kHalfWidth = 1.959964;
constexpr double kOpen = 200;      // half width that stands for none
constexpr double kNamed = 0.85;    // of a direction's square must be named
constexpr std::size_t kTerms = 3;  // by at most so many words
constexpr std::size_t kMost = 4;   // directions

/// Directions with a name: a unit vector, or a plane of two for a complex unknown.
struct Named {
  std::string name;
  MatrixXd basis;
};

class Names {
 public:
  Names(const ParameterSet& set, const VectorXd& t, const VectorXd& units) : set_(set), t_(t), units_(units) {}

  std::vector<Named> all() {
    add_common("unbalance scale", "unbalance angle", set_.unbalance, set_.stations);
    add_common("common gain", "common gain angle", set_.gain, set_.probes);
    add_kind("stiffness of all supports", UnknownKind::stiffness);
    add_kind("damping of all supports", UnknownKind::damping);
    for (Index k = 0; k < set_.size(); ++k) {
      const Parameter& p = set_.all[static_cast<std::size_t>(k)];
      if (k < set_.structural) {
        named_.push_back({p.name, VectorXd::Unit(set_.size(), k)});
      } else if (p.part == 0) {
        MatrixXd plane = MatrixXd::Zero(set_.size(), 2);
        plane(k, 0) = plane(k + 1, 1) = 1;
        named_.push_back({p.name.substr(0, p.name.rfind(" (")), plane});
      }
    }
    return std::move(named_);
  }

 private:
  /// All of a kind of complex unknown by one factor, and by one angle.
  void add_common(const char* scale, const char* angle, Index first, Index count) {
    if (count == 0) return;
    VectorXd along = VectorXd::Zero(set_.size()), across = along;
    for (Index k = 0; k < count; ++k) {
      const Index at = first + 2 * k;
      const std::complex<double> v = set_.complex_value(t_, at);
      const double unit = units_[at] / set_.all[static_cast<std::size_t>(at)].scale;
      along[at] = unit * v.real();
      along[at + 1] = unit * v.imag();
      across[at] = -unit * v.imag();
      across[at + 1] = unit * v.real();
    }
    if (along.norm() == 0) return;
    named_.push_back({scale, along.normalized()});
    named_.push_back({angle, across.normalized()});
  }
  void add_kind(const char* name, UnknownKind kind) {
    VectorXd v = VectorXd::Zero(set_.size());
    for (Index k = 0; k < set_.structural; ++k) {
      const Parameter& p = set_.all[static_cast<std::size_t>(k)];
      if (p.kind == kind && p.logarithmic) v[k] = 1;
    }
    if (v.sum() > 1) named_.push_back({name, v.normalized()});
  }

  const ParameterSet& set_;
  const VectorXd &t_, &units_;
  std::vector<Named> named_;
};

/// The names that make up most of a direction, the largest first.
WeakDirection described(VectorXd v, double half_width, const std::vector<Named>& names) {
  WeakDirection d;
  d.half_width = half_width;
  double left = 1;
  while (left > 1 - kNamed && d.shares.size() < kTerms) {
    const Named* best = nullptr;
    double most = 0;
    for (const Named& n : names) {
      const double part = (n.basis.transpose() * v).norm();
      if (part > most * (1 + 1e-9)) {
        most = part;
        best = &n;
      }
    }
    if (best == nullptr || most < 0.1) break;
    d.shares.push_back({best->name, most});
    v -= best->basis * (best->basis.transpose() * v);
    left = v.squaredNorm();
  }
  for (const WeakDirection::Share& s : d.shares) d.words += (d.words.empty() ? "" : " against ") + s.name;
  return d;
}

}  // namespace

VectorXd relative_units(const FitProblem& problem, const VectorXd& t) {
  const ParameterSet& set = problem.model().parameters();
  VectorXd units(set.size());
  double unbalance = 0, bow = 0;
  for (Index k = 0; k < set.stations; ++k)
    unbalance = std::max(unbalance, std::abs(set.complex_value(t, set.unbalance + 2 * k)));
  for (Index k = 0; k < set.bows; ++k) bow = std::max(bow, std::abs(set.complex_value(t, set.bow + 2 * k)));
  const auto over = [](double scale, double size) { return scale / std::max(std::abs(size), 1e-9 * scale); };
  double middle = 1;
  for (Index k = 0; k < set.size(); ++k) {
    const Parameter& p = set.all[static_cast<std::size_t>(k)];
    const double value = p.value(t[k]);
    switch (p.kind) {
      case UnknownKind::stiffness:
      case UnknownKind::damping:
        if (p.row == p.column && p.part == 0) middle = value;
        units[k] = p.logarithmic ? 1 : p.row != p.column ? 1 : p.part == 0 ? over(p.scale, value) : 0;
        if (units[k] == 0) units[k] = over(p.scale, p.name.find("change") != std::string::npos ? middle : value);
        break;
      case UnknownKind::material_damping:
      case UnknownKind::joint_damping:
        units[k] = over(p.scale, value);
        break;
      case UnknownKind::disc_position:
        units[k] = p.scale / problem.model().drawn().length();
        break;
      case UnknownKind::unbalance:
        units[k] = over(p.scale, unbalance);
        break;
      case UnknownKind::bow:
        units[k] = over(p.scale, bow);
        break;
      case UnknownKind::runout: {
        double rms = 0, count = 0;
        for (const OrderRun& run : problem.runs()) {
          rms += run.vectors.row(static_cast<Index>(p.index)).squaredNorm();
          count += static_cast<double>(run.blocks());
        }
        units[k] = over(p.scale, std::sqrt(rms / std::max(count, 1.0)));
        break;
      }
      default:
        units[k] = 1;
    }
  }
  return units;
}

MatrixXd open_information(const ParameterSet& set, const MatrixXd& records, const VectorXd& units) {
  MatrixXd information = records;
  for (Index k = 0; k < set.size(); ++k) {
    const Parameter& p = set.all[static_cast<std::size_t>(k)];
    if (is_tolerance(p.kind)) information(k, k) += 1 / (p.prior_sd * p.prior_sd);
    const double open = kHalfWidth * units[k] / kOpen;
    information(k, k) += open * open;
  }
  return information;
}

std::vector<WeakDirection> weak_directions(const ParameterSet& set, const VectorXd& t, const MatrixXd& information,
                                           const VectorXd& units) {
  const VectorXd per_unit = units.cwiseInverse();
  const MatrixXd relative = per_unit.asDiagonal() * information * per_unit.asDiagonal();
  const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(relative);
  const std::vector<Named> names = Names(set, t, units).all();
  std::vector<WeakDirection> list;
  for (Index k = 0; k < set.size() && list.size() < kMost; ++k) {
    const double half = kHalfWidth / std::sqrt(std::max(eigen.eigenvalues()[k], 1e-300));
    if (half <= kIdentifiable) break;
    list.push_back(described(eigen.eigenvectors().col(k), half, names));
  }
  return list;
}

}  // namespace whirl::shaft
