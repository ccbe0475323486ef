#include "fractions.hpp"

#include <cmath>

namespace whirl::modal {

using Eigen::ArrayXd;
using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Complex = std::complex<double>;

std::vector<Roots> roots_of(const Band& band, const Poles& poles, const ResidualTerms& terms) {
  std::vector<Roots> roots;
  for (const Complex p : poles) roots.push_back({p - band.decay, (terms.hysteretic ? -p : std::conj(p)) - band.decay});
  return roots;
}

Pairing pairing_of(const ResidualTerms& terms, bool derivative) {
  if (!terms.hysteretic) return {1, -1};
  return derivative ? Pairing{1, 1} : Pairing{-1, -1};
}

void fill_fractions(const Band& band, const std::vector<Roots>& roots, Index first, Index n, bool squares,
                    Eigen::Ref<MatrixXd> rows) {
  const ArrayXd w = band.omega.segment(first, n).array();
  const Index per_pole = squares ? 4 : 2, half = per_pole * static_cast<Index>(roots.size());
  for (std::size_t k = 0; k < roots.size(); ++k) {
    const Index column = per_pole * static_cast<Index>(k);
    for (const Index at : {column, column + 1}) {
      const Complex root = at == column ? roots[k].first : roots[k].second;
      const double re = -root.real();
      const ArrayXd d = w - root.imag();
      const ArrayXd inverse = (d.square() + re * re).inverse();
      rows.col(at).head(n) = (re * inverse).matrix();
      rows.col(half + at).head(n) = (-d * inverse).matrix();
      if (!squares) continue;
      const ArrayXd ur = rows.col(at).head(n).array(), ui = rows.col(half + at).head(n).array();
      rows.col(at + 2).head(n) = (ur.square() - ui.square()).matrix();
      rows.col(half + at + 2).head(n) = (2 * ur * ui).matrix();
    }
  }
}

MatrixXcd residual_terms(const Band& band, const ResidualTerms& terms, Index first, Index n) {
  const double top = band.omega[band.lines() - 1];
  MatrixXcd columns(n, Index{terms.lower} + Index{terms.upper} + Index{terms.slope});
  for (Index i = 0; i < n; ++i) {
    const Complex s = Complex(band.decay, band.omega[first + i]) / top;
    Index column = 0;
    if (terms.lower) columns(i, column++) = 1.0 / (s * s);
    if (terms.upper) columns(i, column++) = 1.0;
    if (terms.slope) columns(i, column++) = s * s;
  }
  return columns;
}

Eigen::VectorXcd motion_factor(const Band& band, Index first, Index n) {
  Eigen::VectorXcd factor = Eigen::VectorXcd::Ones(n);
  for (Index i = 0; i < n; ++i) {
    for (int d = 0; d < band.power; ++d) factor[i] *= Complex(band.decay, band.omega[first + i]);
  }
  return factor;
}

}  // namespace whirl::modal
