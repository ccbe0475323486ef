#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

namespace whirl::regression {

/// One least-squares problem |Theta xi - y|^2 as sums over rows: everything a linear sparse regression needs.
struct GramBlock {
  Eigen::MatrixXd gram;    ///< Theta' Theta, q x q
  Eigen::VectorXd moment;  ///< Theta' y, q
  double energy = 0;       ///< y' y
  double rows = 0;         ///< rows summed

  Eigen::Index terms() const { return moment.size(); }
  /// |Theta xi - y|^2, at least 0.
  double residual(const Eigen::VectorXd& xi) const;
  GramBlock& operator+=(const GramBlock& other);
  GramBlock& operator-=(const GramBlock& other);
};

/// A regression problem: its sums, and the same over contiguous time blocks (cross-validation, bootstrap).
struct Problem {
  GramBlock total;
  std::vector<GramBlock> blocks;  ///< in time order, sum = total; may be empty (then no cross-validation, no bootstrap)
  std::vector<std::string> names;  ///< of the terms, for messages; may be empty
  /// Independent rows for the information criteria; 0: `total.rows`. Filtered or overlapping rows carry fewer.
  double effective_rows = 0;

  double information_rows() const { return effective_rows > 0 ? effective_rows : total.rows; }
};

/// Sums Theta' Theta and Theta' Y over blocks of rows as they come: memory is (q + m)^2 per time block, whatever the
/// number of rows.
class GramAccumulator {
 public:
  /// q candidate terms, m targets; rows are cut into time blocks of `rows_per_block` (0: one block). Beyond 1000 blocks
  /// neighbours are merged and `rows_per_block` doubles, so that memory stays bounded.
  GramAccumulator(Eigen::Index terms, Eigen::Index targets, Eigen::Index rows_per_block = 0);
  /// Adds rows: theta is n x q, y is n x m. A row with a value that is not finite is left out.
  void add(const Eigen::Ref<const Eigen::MatrixXd>& theta, const Eigen::Ref<const Eigen::MatrixXd>& y);
  /// Ends the current time block, e.g. at the end of a trajectory or at a gap.
  void end_block();
  /// Problem of one target.
  Problem problem(Eigen::Index target, std::vector<std::string> names = {}) const;
  Eigen::Index rows() const { return total_rows_; }

 private:
  struct Sums {
    Eigen::MatrixXd m;  // [Theta Y]'[Theta Y], lower triangle
    Eigen::Index rows = 0;
  };
  static constexpr std::size_t kMostBlocks = 1000;
  void merge_pairs();
  Eigen::Index q_, targets_, rows_per_block_, total_rows_ = 0;
  std::vector<Sums> blocks_;
  bool open_ = false;
  Eigen::MatrixXd work_;
};

/// Problem of one target with time blocks of equal size. theta n x q, y n; `blocks` >= 1.
Problem make_problem(const Eigen::Ref<const Eigen::MatrixXd>& theta, const Eigen::Ref<const Eigen::VectorXd>& y,
                     int blocks = 50, std::vector<std::string> names = {});

/// xi = fixed + map * w: linear ties and known coefficients, closed form.
struct Elimination {
  Eigen::MatrixXd map;    ///< q x free
  Eigen::VectorXd fixed;  ///< q
  std::vector<int> free;  ///< w_k is the coefficient xi[free[k]] itself when made by `eliminate`
};
/// General solution of `a` xi = `b` by reduced row echelon form, so that every free unknown is one of the coefficients
/// and stays sparse. Throws Error when the equations contradict each other.
Elimination eliminate(const Eigen::MatrixXd& a, const Eigen::VectorXd& b);
/// The same problem in the free unknowns w.
Problem reduce(const Problem& problem, const Elimination& elimination);
/// Sum of problems over one vector of unknowns, e.g. the reduced problems of tied equations. Each is weighted by
/// `weights[i]` (1 / noise variance of its rows; empty: 1).
Problem stack(const std::vector<Problem>& problems, const std::vector<double>& weights = {});

}  // namespace whirl::regression
