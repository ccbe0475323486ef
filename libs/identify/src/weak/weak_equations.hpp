#pragma once
#include <Eigen/Core>
#include <string>
#include <vector>

#include "weak/weak_rows.hpp"
#include "whirl/core/rotor_model.hpp"

namespace whirl::identification::detail {

/// Real unknowns of the rotor's weak equations over several records: first those that all records share, then eps and
/// d (real, imaginary part) of each record.
class WeakUnknowns {
 public:
  /// `more_shared`: columns beside those of WeakSystem, after them.
  WeakUnknowns(bool conj_stiffness, bool conj_damping, Eigen::Index more_shared, std::size_t records);

  Eigen::Index size() const { return shared() + 4 * static_cast<Eigen::Index>(records_); }
  Eigen::Index shared() const { return tied() + more_; }
  /// Of these, columns of WeakSystem.
  Eigen::Index tied() const { return static_cast<Eigen::Index>(columns_.size()); }
  /// First of the four of record r.
  Eigen::Index own(std::size_t r) const { return shared() + 4 * static_cast<Eigen::Index>(r); }
  std::vector<std::string> names() const;
  /// Real rows of WeakSystem::terms of record r into rows `top` and below.
  void place(const Eigen::MatrixXcd& terms, std::size_t r, Eigen::Index top, Eigen::MatrixXd& into) const;
  /// k1, k2, c and the conjugate terms.
  void set_shared(const Eigen::VectorXd& values, RotorModel& model) const;

 private:
  struct Column {
    const char* name;
    int term;        // column of WeakSystem::terms
    bool imaginary;  // the unknown multiplies i times the column
  };
  std::vector<Column> columns_;
  Eigen::Index more_;
  std::size_t records_;
};

/// Least squares of whitened real rows in columns of rms 1.
struct WeakSolution {
  Eigen::VectorXd values, scale;  ///< scale: rms of the columns
  Eigen::MatrixXd covariance;
  double chi_square = 0, condition_number = 0;
  bool singular = false;  ///< a column vanishes or there are too few rows; the rest is then empty
};
WeakSolution solve_weak(const Eigen::MatrixXd& rows, const Eigen::VectorXd& right);

}  // namespace whirl::identification::detail
