#pragma once
#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "weak/weak_rows.hpp"
#include "whirl/core/rotor_model.hpp"
#include "whirl/identify/rotor_terms.hpp"

namespace whirl::identification::detail {

/// Real unknowns of the rotor's weak equations over several records: first those that all records share, then eps, d
/// and if asked for the force of the runout (real, imaginary part) of each record.
class WeakUnknowns {
 public:
  WeakUnknowns(bool conj_stiffness, bool conj_damping, bool runout, const std::optional<RotorTerm>& whirl_force,
               std::size_t records);

  Eigen::Index size() const { return own(records_); }
  Eigen::Index shared() const { return static_cast<Eigen::Index>(columns_.size()); }
  /// First of those of record r.
  Eigen::Index own(std::size_t r) const { return shared() + each_ * static_cast<Eigen::Index>(r); }
  std::vector<std::string> names() const;
  /// Real rows of WeakSystem::terms of record r, with further columns for the whirl force (kWhirlForce) and the runout
  /// (kRunout), into rows `top` and below.
  void place(const Eigen::MatrixXcd& terms, std::size_t r, Eigen::Index top, Eigen::MatrixXd& into) const;
  static constexpr int kWhirlForce = 7, kRunout = 8;
  /// k1, k2, c and the conjugate terms; the whirl force stays last of the shared.
  void set_shared(const Eigen::VectorXd& values, RotorModel& model) const;

 private:
  struct Column {
    const char* name;
    int term;        // column of WeakSystem::terms
    bool imaginary;  // the unknown multiplies i times the column
  };
  std::vector<Column> columns_;
  Eigen::Index each_;  // of a record
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
