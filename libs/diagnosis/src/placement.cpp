#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/correction.hpp"

namespace whirl::diagnosis {
namespace {

using Eigen::Index;

struct Hole {
  int plane = 0;
  double angle = 0;
  double piece = 0, most = 0;
  double mass = 0;

  double rounded(double m) const {
    double r = piece > 0 ? piece * std::round(m / piece) : m;
    if (most > 0) r = std::min(r, piece > 0 ? piece * std::floor(most / piece * (1 + 1e-12)) : most);
    return std::max(r, 0.0);
  }
};

/// The vector on the two neighbouring holes (of one plane) between which it points.
void split(std::vector<Hole>& holes, std::size_t first, std::size_t count, std::complex<double> w) {
  if (count == 1) {
    holes[first].mass = holes[first].rounded((w * std::polar(1.0, -holes[first].angle)).real());
    return;
  }
  const auto ahead = [&](double from, double to) { return std::fmod(std::fmod(to - from, kTwoPi) + kTwoPi, kTwoPi); };
  std::size_t low = first, high = first;
  for (std::size_t k = first; k < first + count; ++k) {
    if (ahead(holes[k].angle, std::arg(w)) < ahead(holes[low].angle, std::arg(w))) low = k;
    if (ahead(std::arg(w), holes[k].angle) < ahead(std::arg(w), holes[high].angle)) high = k;
  }
  const double span = ahead(holes[low].angle, holes[high].angle), part = ahead(holes[low].angle, std::arg(w));
  if (low == high || span >= std::numbers::pi * (1 - 1e-9)) {
    holes[low].mass = holes[low].rounded(std::abs(w) * std::max(0.0, std::cos(part)));
    if (low != high) holes[high].mass = holes[high].rounded(std::abs(w) * std::max(0.0, std::cos(span - part)));
    return;
  }
  holes[high].mass = holes[high].rounded(std::abs(w) * std::sin(part) / std::sin(span));
  holes[low].mass = holes[low].rounded(std::abs(w) * std::sin(span - part) / std::sin(span));
}

/// Coordinate and exchange search over the pieces.
class HoleSearch {
 public:
  HoleSearch(const CorrectionProblem& problem, Criterion criterion, std::vector<Hole>& holes)
      : problem_(problem), criterion_(criterion), holes_(holes) {
    weight_ = problem.weight.size() > 0 ? problem.weight : Eigen::VectorXd::Ones(problem.rows());
    residual_ = problem.vibration;
    for (const Hole& h : holes_) residual_ += effect(h) * h.mass;
  }
  void run() {
    double best = value(residual_);
    for (int sweep = 0; sweep < 200; ++sweep) {
      const double before = best;
      for (std::size_t i = 0; i < holes_.size(); ++i) {
        for (const double step : {1.0, -1.0}) {
          while (change(i, step, best)) continue;
          for (std::size_t j = 0; j < holes_.size(); ++j) {
            if (j == i) continue;
            for (const double other : {1.0, -1.0}) change_two(i, step, j, other, best);
          }
        }
      }
      if (best >= before * (1 - 1e-12)) break;
    }
  }

 private:
  Eigen::VectorXcd effect(const Hole& h) const { return problem_.influence.col(h.plane) * std::polar(1.0, h.angle); }
  double value(const Eigen::VectorXcd& r) const {
    const Eigen::VectorXd s = r.cwiseAbs().cwiseProduct(weight_);
    return criterion_ == Criterion::least_squares ? s.norm() : s.maxCoeff();
  }
  bool allowed(const Hole& h, double step) const {
    const double m = h.mass + step * h.piece;
    return h.piece > 0 && m > -1e-9 * h.piece && (h.most <= 0 || m <= h.most * (1 + 1e-12));
  }
  bool change(std::size_t i, double step, double& best) {
    Hole& h = holes_[i];
    if (!allowed(h, step)) return false;
    const Eigen::VectorXcd r = residual_ + effect(h) * (step * h.piece);
    return accept(r, best) && (h.mass += step * h.piece, true);
  }
  void change_two(std::size_t i, double a, std::size_t j, double b, double& best) {
    if (!allowed(holes_[i], a) || !allowed(holes_[j], b)) return;
    const Eigen::VectorXcd r =
        residual_ + effect(holes_[i]) * (a * holes_[i].piece) + effect(holes_[j]) * (b * holes_[j].piece);
    if (!accept(r, best)) return;
    holes_[i].mass += a * holes_[i].piece;
    holes_[j].mass += b * holes_[j].piece;
  }
  bool accept(const Eigen::VectorXcd& r, double& best) {
    const double f = value(r);
    if (!(f < best * (1 - 1e-12))) return false;
    best = f;
    residual_ = r;
    return true;
  }

  const CorrectionProblem& problem_;
  Criterion criterion_;
  std::vector<Hole>& holes_;
  Eigen::VectorXd weight_;
  Eigen::VectorXcd residual_;
};

}  // namespace

Placement place_masses(const CorrectionProblem& problem, Criterion criterion, const Eigen::VectorXcd& masses,
                       const std::vector<Places>& places) {
  problem.check();
  if (masses.size() != problem.planes() || static_cast<Index>(places.size()) != problem.planes())
    throw Error(fmt::format("placing masses: {} masses and {} sets of places for {} planes", masses.size(),
                            places.size(), problem.planes()));
  std::vector<Hole> holes;
  for (Index p = 0; p < problem.planes(); ++p) {
    const Places& place = places[static_cast<std::size_t>(p)];
    require_range(fmt::format("piece of plane {}", p + 1), place.piece, 0, 1e9);
    require_range(fmt::format("largest mass in a hole of plane {}", p + 1), place.most, 0, 1e9);
    const std::size_t first = holes.size();
    for (const double angle : place.angles) {
      require_range(fmt::format("hole of plane {}", p + 1), angle, -1e6, 1e6, "rad");
      holes.push_back({static_cast<int>(p), angle, place.piece, place.most, 0});
    }
    // Any angle is free: one place at the vector's own angle.
    if (place.angles.empty()) holes.push_back({static_cast<int>(p), std::arg(masses[p]), place.piece, place.most, 0});
    split(holes, first, holes.size() - first, masses[p]);
  }
  HoleSearch(problem, criterion, holes).run();
  Placement result;
  result.sum = Eigen::VectorXcd::Zero(problem.planes());
  for (const Hole& h : holes) {
    if (h.mass <= 0) continue;
    result.masses.push_back({h.plane, h.angle, h.mass});
    result.sum[h.plane] += std::polar(h.mass, h.angle);
  }
  result.residual = problem.residual(result.sum);
  result.objective = objective(problem, criterion, result.sum);
  return result;
}

}  // namespace whirl::diagnosis
