#pragma once
#include <complex>
#include <vector>

#include "pole_fit.hpp"

namespace whirl::modal {

constexpr Eigen::Index kSlice = 256;  ///< lines worked on at a time
constexpr std::complex<double> kJ(0, 1);

/// The two roots of every pole, shifted by the window's decay: p and p* of a viscous mode, p and -p of a hysteretic
/// one.
struct Roots {
  std::complex<double> first, second;
};
std::vector<Roots> roots_of(const Band& band, const Poles& poles, const ResidualTerms& terms);

/// A residue a + j b has the real columns u + alpha v and j (u + beta v), u and v being the fractions of both roots or,
/// as derivatives by the pole, their squares.
struct Pairing {
  double alpha, beta;
};
Pairing pairing_of(const ResidualTerms& terms, bool derivative);

/// 1/(s'-p), 1/(s'-q) and with derivatives their squares, as real and imaginary columns: re of all, then im of all.
void fill_fractions(const Band& band, const std::vector<Roots>& roots, Eigen::Index first, Eigen::Index n, bool squares,
                    Eigen::Ref<Eigen::MatrixXd> rows);

/// Residual terms as complex columns, without s^d. Frequencies relative to the end of the band keep them comparable.
Eigen::MatrixXcd residual_terms(const Band& band, const ResidualTerms& terms, Eigen::Index first, Eigen::Index n);

/// s^d on lines [first, first + n).
Eigen::VectorXcd motion_factor(const Band& band, Eigen::Index first, Eigen::Index n);

}  // namespace whirl::modal
