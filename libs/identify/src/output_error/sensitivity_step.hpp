#pragma once
#include <Eigen/Core>
#include <array>
#include <vector>

#include "whirl/core/wide_registers.hpp"

namespace whirl::identification::detail {

/// Step of the sensitivities s' = J s + f of an initial-value problem by Runge and Kutta's method of fourth order, with
/// J and f at its four stages. The stages of the states do not need s: a caller fills them first.
class SensitivityStep {
 public:
  /// Of the Jacobian by the states, where it is not always zero.
  struct Entry {
    Eigen::Index row, column;
  };
  struct Stage {
    std::vector<double> jacobian;  ///< by the entries
    Eigen::MatrixXd forcing;       ///< rows() of the unknowns that act by themselves, a column per state
  };

  SensitivityStep() = default;
  /// `forced`: unknowns, the first of all, that act by themselves; those after them act through the start alone.
  SensitivityStep(Eigen::Index states, Eigen::Index forced, const std::vector<Entry>& jacobian);
  Stage& stage(int k) { return stages_[static_cast<std::size_t>(k)]; }
  /// Rows of `s` for so many unknowns: whole registers.
  static Eigen::Index rows(Eigen::Index unknowns) {
    return (unknowns + kRegisterWidth - 1) / kRegisterWidth * kRegisterWidth;
  }
  /// `s`: a row per unknown and zeros up to rows(), a column per state.
  void advance(double h, Eigen::MatrixXd& s);

 private:
  static constexpr int kTogether = 2;  // registers
  struct Lane {
    Register v;
  };
  static_assert(alignof(Lane) == sizeof(Register));
  struct Product {
    std::size_t column, entry;
  };
  template <int Registers>
  void advance_lanes(double h, Eigen::Index lane, Eigen::Index rows, double* all);

  std::array<Stage, 4> stages_;
  std::vector<Product> products_;  // row by row
  std::vector<std::size_t> row_ends_;
  std::vector<Lane> work_;
};

}  // namespace whirl::identification::detail
