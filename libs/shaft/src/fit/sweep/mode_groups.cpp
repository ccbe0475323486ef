#include "fit/sweep/mode_groups.hpp"

#include <cmath>

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Complex = std::complex<double>;

MatrixXcd inverse_of(const MatrixXcd& a) { return Eigen::PartialPivLU<MatrixXcd>(a).inverse(); }

/// Square root of a matrix near the unit matrix: Newton's iteration from there, which converges quadratically.
MatrixXcd root(const MatrixXcd& a) {
  MatrixXcd x = MatrixXcd::Identity(a.rows(), a.cols());
  for (int k = 0; k < 8; ++k) x = 0.5 * (x + a * inverse_of(x));
  return x;
}

}  // namespace

MatrixXcd ModeGroup::right(const std::vector<StatePair>& all) const {
  MatrixXcd out(all[members_[0]].right.size(), static_cast<Index>(size()));
  for (std::size_t j = 0; j < size(); ++j) out.col(static_cast<Index>(j)) = all[members_[j]].right;
  return out;
}

MatrixXcd ModeGroup::left(const std::vector<StatePair>& all) const {
  MatrixXcd out(all[members_[0]].left.size(), static_cast<Index>(size()));
  for (std::size_t j = 0; j < size(); ++j) out.col(static_cast<Index>(j)) = all[members_[j]].left;
  return out;
}

Complex ModeGroup::overlap(const std::vector<StatePair>& all, const StatePair& earlier) const {
  Complex sum = 0;
  for (const std::size_t m : members_) sum += product(earlier.left, all[m].right) * product(all[m].left, earlier.right);
  return sum;
}

std::vector<StatePair> ModeGroup::turned(const std::vector<StatePair>& all, const MatrixXcd& turn) const {
  const MatrixXcd r = right(all) * inverse_of(turn), l = left(all) * turn.transpose();
  std::vector<StatePair> out;
  Complex pole = 0;
  for (const std::size_t m : members_) pole += all[m].pole / static_cast<double>(size());
  for (std::size_t j = 0; j < size(); ++j) {
    const auto column = static_cast<Index>(j);
    out.push_back({pole, r.col(column), l.col(column)});
  }
  return out;
}

std::vector<StatePair> ModeGroup::continued(const std::vector<StatePair>& all,
                                            const std::vector<StatePair>& earlier) const {
  const auto size = static_cast<Index>(this->size()), known = static_cast<Index>(earlier.size());
  // Half of what either product shows: the shapes then turn without change along themselves to third order of the step.
  MatrixXcd forth = MatrixXcd::Identity(size, size), back = forth;
  const MatrixXcd r = right(all), l = left(all);
  for (Index i = 0; i < known; ++i) {
    const StatePair& e = earlier[static_cast<std::size_t>(i)];
    forth.row(i) = e.left.transpose() * r;
    back.col(i) = l.transpose() * e.right;
  }
  MatrixXcd turn(size, size);
  if (size == 1) {
    turn(0, 0) = std::sqrt(forth(0, 0) / back(0, 0));
    if ((std::conj(turn(0, 0)) * forth(0, 0)).real() < 0) turn = -turn;
  } else {
    turn = inverse_of(back) * root(back * forth);
  }
  if (known == 0 || (known < size && !turn.allFinite())) turn.setIdentity(size, size);
  return turned(all, turn);
}

std::vector<StatePair> ModeGroup::along(const std::vector<StatePair>& all, const VectorXd& weight) const {
  const MatrixXcd inside = left(all).transpose() * weight.asDiagonal() * right(all);
  const Eigen::ComplexEigenSolver<MatrixXcd> solver(inside);
  return turned(all, inverse_of(solver.eigenvectors()));
}

std::vector<ModeGroup> groups_of(const std::vector<StatePair>& modes) {
  std::vector<ModeGroup> groups;
  for (std::size_t j = 0; j < modes.size(); ++j) {
    bool found = false;
    for (ModeGroup& g : groups) {
      found = equal_poles(modes[g.first()].pole, modes[j].pole);
      if (found) g.add(j);
      if (found) break;
    }
    if (!found) groups.emplace_back(j);
  }
  return groups;
}

void make_planar(std::vector<StatePair>& modes) {
  if (modes.empty()) return;
  const Index n = modes[0].right.size() / 4;
  VectorXd along_x = VectorXd::Zero(4 * n);
  along_x.head(n).setOnes();
  along_x.segment(2 * n, n).setOnes();
  std::vector<StatePair> out;
  for (const ModeGroup& g : groups_of(modes)) {
    if (g.size() == 1) {
      out.push_back(modes[g.first()]);
      continue;
    }
    for (StatePair& p : g.along(modes, along_x)) out.push_back(std::move(p));
  }
  modes = std::move(out);
}

}  // namespace whirl::shaft
