#pragma once
#include <complex>
#include <vector>

#include "whirl/core/decompositions.hpp"

namespace whirl::shaft {

/// A pole with its vectors in state space (q, q').
struct StatePair {
  std::complex<double> pole;
  Eigen::VectorXcd right, left;  ///< left' right = 1, without conjugation
};

inline std::complex<double> product(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) {
  return (a.transpose() * b).value();
}

/// Poles so near to each other that any combination of their modes is one: of a rotor alike in x and y without a
/// gyroscopic moment. An eigenvalue solver then turns their vectors as its rounding happens to fall.
inline bool equal_poles(std::complex<double> a, std::complex<double> b) { return std::abs(a - b) < 1e-6 * std::abs(a); }

/// Modes of equal poles, by their place in a list; mostly one.
class ModeGroup {
 public:
  explicit ModeGroup(std::size_t first) : members_{first} {}
  std::size_t size() const { return members_.size(); }
  void add(std::size_t member) { members_.push_back(member); }
  std::size_t first() const { return members_[0]; }
  /// Product of both overlaps of an earlier mode with the space of the group: 1 where it lies in it.
  std::complex<double> overlap(const std::vector<StatePair>& all, const StatePair& earlier) const;
  /// Its modes, turned within their space so that they change least from `earlier` ones, at most as many; then those
  /// that continue none. As one, each has the mean of the poles.
  std::vector<StatePair> continued(const std::vector<StatePair>& all, const std::vector<StatePair>& earlier) const;
  /// Its modes turned so that `weight` (left' weight right) becomes diagonal.
  std::vector<StatePair> along(const std::vector<StatePair>& all, const Eigen::VectorXd& weight) const;

 private:
  Eigen::MatrixXcd right(const std::vector<StatePair>& all) const;
  Eigen::MatrixXcd left(const std::vector<StatePair>& all) const;
  /// right times the inverse of `turn`, `turn` times left'.
  std::vector<StatePair> turned(const std::vector<StatePair>& all, const Eigen::MatrixXcd& turn) const;
  std::vector<std::size_t> members_;
};

std::vector<ModeGroup> groups_of(const std::vector<StatePair>& modes);

/// Turns modes of equal poles into ones along x and along y: what differs between the axes then moves no shape. The
/// coordinates are those of x, those of y, and their rates.
void make_planar(std::vector<StatePair>& modes);

}  // namespace whirl::shaft
