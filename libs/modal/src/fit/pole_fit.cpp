// Variable projection. With columns Phi (pole pairs and residual terms) and their pole derivatives Psi, everything the
// Gauss-Newton step needs follows from the Gram matrix of [Phi Psi] and its products with the data.
//
// The Gram matrix of the pole columns costs O(poles x lines), not O(poles^2 x lines): on s = decay + j w the conjugate
// of 1/(s - x) is -1/(s' - a), s' = j w, a = -x* (x, y shifted by the decay), and partial fractions split every
// product,
//
//   1/((s'-a)(s'-b)) = [1/(s'-a) - 1/(s'-b)]/(a-b),
//
// so that all entries follow from F_m(x) = sum_lines W |s|^2d/(s'-x)^m, m = 1, 2. Columns for which that difference
// would cancel (poles far closer to the axis than to the nearest line) and the residual terms are summed as they are.
#include "pole_fit.hpp"

#include <cmath>

#include "fractions.hpp"
#include "whirl/core/decompositions.hpp"
#include "work.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

struct Normal {
  MatrixXd gram;  ///< of all columns
  MatrixXd data;  ///< columns^T data, one column per channel of the group
};

// Real columns are Re and Im parts of c = sum of +-fractions; `Products` are sums over lines of W conj(fraction) y.
class NormalEquations {
 public:
  NormalEquations(const Band& band, const Poles& poles, const ResidualTerms& terms, bool derivatives)
      : band_(band),
        terms_(terms),
        derivatives_(derivatives),
        roots_(roots_of(band, poles, terms)),
        n_(static_cast<Index>(poles.size())),
        per_pole_(derivatives ? 4 : 2) {
    const double step = band.lines() > 1 ? band.omega[1] - band.omega[0] : 1;
    for (Index k = 0; k < n_; ++k) {
      const Complex p = roots_[static_cast<std::size_t>(k)].first;
      const Index nearest =
          std::clamp(static_cast<Index>(std::lround((p.imag() - band.omega[0]) / step)), Index{0}, band.lines() - 1);
      if (std::abs(p.imag() - band.omega[nearest]) > 30 * -p.real()) direct_.push_back(k);
    }
    terms_count_ = Index{terms.lower} + Index{terms.upper} + Index{terms.slope};
    direct_count_ = terms_count_ + per_pole_ * static_cast<Index>(direct_.size());
  }

  Index linear() const { return 2 * n_ + terms_.count(); }
  double half_width(Index k) const { return -roots_[static_cast<std::size_t>(k)].first.real(); }

  // One Normal per group of channels: [c, c + group) share the weights of c, up to a factor.
  std::vector<Normal> accumulate(Index group) const {
    const Index groups = band_.channels() / group;
    // Right-hand sides of one group: data of its channels, the summed-as-they-are columns, and the weights (real).
    const Index sides = group + direct_count_ + 1;
    const Index fractions = per_pole_ * n_;
    MatrixXd rows(kSlice, 2 * fractions), y(kSlice, 2 * sides * groups);
    MatrixXd products = MatrixXd::Zero(2 * fractions, 2 * sides * groups);
    std::vector<MatrixXcd> direct(static_cast<std::size_t>(groups),
                                  MatrixXcd::Zero(direct_count_, group + direct_count_));
    for (Index first = 0; first < band_.lines(); first += kSlice) {
      const Index n = std::min(kSlice, band_.lines() - first);
      fill_fractions(band_, roots_, first, n, derivatives_, rows);
      const Eigen::VectorXcd factor = motion_factor(band_, first, n);
      MatrixXcd plain(n, direct_count_);
      plain.leftCols(terms_count_) = residual_terms(band_, terms_, first, n);
      for (std::size_t k = 0; k < direct_.size(); ++k) {
        for (Index f = 0; f < per_pole_; ++f) {
          const Index column = terms_count_ + per_pole_ * static_cast<Index>(k) + f;
          plain.col(column).real() = rows.col(per_pole_ * direct_[k] + f).head(n);
          plain.col(column).imag() = rows.col(fractions + per_pole_ * direct_[k] + f).head(n);
        }
      }
      for (Index g = 0; g < groups; ++g) {
        const VectorXd w2 = band_.weight.col(g * group).segment(first, n).cwiseAbs2();
        const VectorXd strength = w2.cwiseProduct(factor.cwiseAbs2());
        MatrixXcd side(n, group + direct_count_);
        for (Index c = 0; c < group; ++c) {
          const Index channel = g * group + c;
          const double scale = band_.weight(first, channel) / band_.weight(first, g * group);
          side.col(c) =
              scale * band_.h.col(channel).segment(first, n).cwiseProduct(factor.conjugate()).cwiseProduct(w2);
        }
        side.rightCols(direct_count_) = strength.asDiagonal() * plain;
        direct[static_cast<std::size_t>(g)].noalias() += plain.adjoint() * side;
        const Index at = 2 * sides * g;
        y.block(0, at, n, sides - 1) = side.real();
        y.col(at + sides - 1).head(n) = strength;
        y.block(0, at + sides, n, sides - 1) = side.imag();
        y.col(at + 2 * sides - 1).head(n).setZero();
      }
      products.noalias() += rows.topRows(n).transpose() * y.topRows(n);
    }
    std::vector<Normal> result;
    for (Index g = 0; g < groups; ++g) {
      const auto block = [&](Index imaginary_row, Index imaginary_side) {
        return products.block(imaginary_row * fractions, 2 * sides * g + imaginary_side * sides, fractions, sides);
      };
      MatrixXcd p(fractions, sides);  // sum of conj(fraction) y
      p.real() = block(0, 0) + block(1, 1);
      p.imag() = block(0, 1) - block(1, 0);
      result.push_back(assemble(p, direct[static_cast<std::size_t>(g)], group));
    }
    return result;
  }

 private:
  // Products with the two real columns of a pair, from those with conj(u) and conj(v).
  static void put_pair(Eigen::Ref<MatrixXd> to, Pairing pairing, const Eigen::RowVectorXcd& u,
                       const Eigen::RowVectorXcd& v) {
    to.row(0) = (u + pairing.alpha * v).real();
    to.row(1) = (u + pairing.beta * v).imag();
  }

  Normal assemble(const MatrixXcd& p, const MatrixXcd& direct, Index group) const {
    const Index pairs = derivatives_ ? 2 * n_ : n_;  // pole pairs, then derivative pairs
    const Index tail = terms_.count(), m = linear();
    Normal normal{MatrixXd::Zero(2 * pairs + tail, 2 * pairs + tail), MatrixXd(2 * pairs + tail, group)};
    const auto row_of = [&](Index pair) { return pair < n_ ? 2 * pair : m + 2 * (pair - n_); };
    const auto fraction_of = [&](Index pair) { return pair < n_ ? per_pole_ * pair : per_pole_ * (pair - n_) + 2; };
    const auto scale_of = [&](Index pair) {
      return pair < n_ ? 1.0 : half_width(pair - n_);
    };  // per half width of change
    const Index step = terms_.complex ? 2 : 1;

    // Products with data and with the residual terms.
    for (Index pair = 0; pair < pairs; ++pair) {
      const Index f = fraction_of(pair), row = row_of(pair);
      const Eigen::RowVectorXcd u = scale_of(pair) * p.row(f), v = scale_of(pair) * p.row(f + 1);
      MatrixXd two(2, p.cols());
      const Pairing pairing = pairing_of(terms_, pair >= n_);
      put_pair(two, pairing, u, v);
      normal.data.middleRows(row, 2) = two.leftCols(group);
      MatrixXd turned(2, p.cols());  // with j y instead of y
      put_pair(turned, pairing, kJ * u, kJ * v);
      for (Index t = 0; t < terms_count_; ++t) {
        for (Index i = 0; i < step; ++i) {
          const auto& source = i == 0 ? two : turned;
          normal.gram.block<2, 1>(row, 2 * n_ + step * t + i) = source.col(group + t);
          normal.gram.block<1, 2>(2 * n_ + step * t + i, row) = source.col(group + t).transpose();
        }
      }
    }
    for (Index t = 0; t < terms_count_; ++t) {
      for (Index i = 0; i < step; ++i) {
        const Complex turn = i == 0 ? Complex(1) : -kJ;  // conj(j)
        normal.data.row(2 * n_ + step * t + i) = (turn * direct.row(t).head(group)).real();
        for (Index other = 0; other < terms_count_; ++other) {
          const Complex product = turn * direct(t, group + other);
          normal.gram(2 * n_ + step * t + i, 2 * n_ + step * other) = product.real();
          if (terms_.complex) normal.gram(2 * n_ + step * t + i, 2 * n_ + step * other + 1) = (kJ * product).real();
        }
      }
    }

    // Pole columns among each other, by partial fractions, or as summed.
    std::vector<Index> direct_at(static_cast<std::size_t>(n_), -1);
    for (std::size_t k = 0; k < direct_.size(); ++k) {
      direct_at[static_cast<std::size_t>(direct_[k])] = terms_count_ + per_pole_ * static_cast<Index>(k);
    }
    const Eigen::VectorXcd f = p.col(p.cols() - 1).conjugate();  // F_m at the poles and their conjugates
    for (Index k = 0; k < n_; ++k) {
      for (Index l = 0; l <= k; ++l) {
        MatrixXcd sums(per_pole_, per_pole_);  // of conj(fraction of k) fraction of l
        const Index dk = direct_at[static_cast<std::size_t>(k)], dl = direct_at[static_cast<std::size_t>(l)];
        if (dl >= 0) {
          sums = p.block(per_pole_ * k, group + dl, per_pole_, per_pole_);
        } else if (dk >= 0) {
          sums = p.block(per_pole_ * l, group + dk, per_pole_, per_pole_).adjoint();
        } else {
          sums = split(k, l, f);
        }
        for (Index a = 0; a < per_pole_ / 2; ++a) {
          for (Index b = 0; b < per_pole_ / 2; ++b) {
            const Complex uu = sums(2 * a, 2 * b), uv = sums(2 * a, 2 * b + 1), vu = sums(2 * a + 1, 2 * b),
                          vv = sums(2 * a + 1, 2 * b + 1);
            const Pairing ka = pairing_of(terms_, a > 0), lb = pairing_of(terms_, b > 0);
            const auto sum = [&](double left, double right) { return uu + right * uv + left * vu + left * right * vv; };
            Eigen::Matrix2d block;
            block << sum(ka.alpha, lb.alpha).real(), -sum(ka.alpha, lb.beta).imag(), sum(ka.beta, lb.alpha).imag(),
                sum(ka.beta, lb.beta).real();
            block *= scale_of(k + a * n_) * scale_of(l + b * n_);
            normal.gram.block<2, 2>(row_of(k + a * n_), row_of(l + b * n_)) = block;
            normal.gram.block<2, 2>(row_of(l + b * n_), row_of(k + a * n_)) = block.transpose();
          }
        }
      }
    }
    return normal;
  }

  MatrixXcd split(Index k, Index l, const Eigen::VectorXcd& f) const {
    MatrixXcd sums(per_pole_, per_pole_);
    for (Index i = 0; i < 2; ++i) {
      for (Index j = 0; j < 2; ++j) {
        const Roots &rk = roots_[static_cast<std::size_t>(k)], &rl = roots_[static_cast<std::size_t>(l)];
        const Complex a = -std::conj(i == 0 ? rk.first : rk.second), b = j == 0 ? rl.first : rl.second;
        const Complex d = 1.0 / (a - b);
        const Complex fa = -std::conj(f[per_pole_ * k + i]), fb = f[per_pole_ * l + j];
        const Complex difference = (fa - fb) * d;
        sums(i, j) = -difference;
        if (!derivatives_) continue;
        const Complex fa2 = std::conj(f[per_pole_ * k + i + 2]), fb2 = f[per_pole_ * l + j + 2];
        sums(i, j + 2) = -(difference - fb2) * d;
        sums(i + 2, j) = (fa2 - difference) * d;
        sums(i + 2, j + 2) = (fa2 + fb2 - 2.0 * difference) * d * d;
      }
    }
    return sums;
  }

  const Band& band_;
  const ResidualTerms& terms_;
  bool derivatives_;
  std::vector<Roots> roots_;
  Index n_, per_pole_, terms_count_ = 0, direct_count_ = 0;
  std::vector<Index> direct_;  ///< poles whose products are summed as they are
};

}  // namespace

namespace {

// Fractions on all lines, their products with the data, and the dense algebra per group of channels.
double operations_of(const Band& band, double poles, double columns, double group, bool with_jacobian) {
  const double lines = static_cast<double>(band.lines()), channels = static_cast<double>(band.channels());
  const double fractions = poles * (with_jacobian ? 4 : 2), groups = channels / group;
  const double products = 8 * fractions * lines * (group + 1) * groups, fill = 20 * fractions * lines;
  const double dense = groups * (columns * columns * columns + (with_jacobian ? 8 * columns * poles * poles : 0));
  return products + fill + dense + (with_jacobian ? 16 * channels * poles * poles : 0);
}

}  // namespace

PoleFit fit_poles(const Band& band, const Poles& poles, const ResidualTerms& terms, bool with_jacobian) {
  const NormalEquations equations(band, poles, terms, with_jacobian);
  const auto n = static_cast<Index>(poles.size());
  const Index m = equations.linear();
  PoleFit fit;
  fit.residues.resize(m, band.channels());
  fit.cost.resize(band.channels());
  fit.rise = VectorXd::Zero(n);
  if (with_jacobian) {
    fit.jtj = MatrixXd::Zero(2 * n, 2 * n);
    fit.jtr = VectorXd::Zero(2 * n);
    fit.projection.reserve(static_cast<std::size_t>(band.channels()));
    fit.channel_information = fit.channel_score = MatrixXd::Zero(2 * n, band.channels());
  }
  const Index group = band.common_weight ? band.channels() : 1;
  WorkLimit::add(
      operations_of(band, static_cast<double>(n), static_cast<double>(m), static_cast<double>(group), with_jacobian));
  const std::vector<Normal> normals = equations.accumulate(group);
  for (Index first = 0; first < band.channels(); first += group) {
    const Normal& normal = normals[static_cast<std::size_t>(first / group)];
    // Columns scaled to unit length; the small ridge only matters when poles coincide.
    const VectorXd scale = normal.gram.diagonal().head(m).cwiseMax(1e-300).cwiseSqrt().cwiseInverse();
    MatrixXd g11 = scale.asDiagonal() * normal.gram.topLeftCorner(m, m) * scale.asDiagonal();
    g11.diagonal().array() += 1e-13;
    const Eigen::LLT<MatrixXd> factor(g11);
    const MatrixXd x = scale.asDiagonal() * factor.solve(scale.asDiagonal() * normal.data.topRows(m));
    const MatrixXd inverse = factor.solve(MatrixXd::Identity(m, m));

    MatrixXd schur, psi_r;
    if (with_jacobian && n > 0) {
      const MatrixXd g12 = scale.asDiagonal() * normal.gram.topRightCorner(m, 2 * n);
      const MatrixXd solved = factor.solve(g12);
      schur = normal.gram.bottomRightCorner(2 * n, 2 * n) - g12.transpose() * solved;
      fit.projection.push_back(scale.asDiagonal() * solved);
      psi_r = normal.data.bottomRows(2 * n) - normal.gram.bottomLeftCorner(2 * n, m) * x;
    }
    for (Index c = 0; c < group; ++c) {
      const Index channel = first + c;
      // Data of this channel entered as (its weight) * h, columns as (first weight): residues refer to h itself.
      const double factor_c = band.weight(0, channel) / band.weight(0, first);
      fit.residues.col(channel) = x.col(c) / factor_c;
      fit.cost[channel] = band.h.col(channel).cwiseAbs2().dot(band.weight.col(channel).cwiseAbs2()) -
                          normal.data.col(c).head(m).dot(x.col(c));
      for (Index k = 0; k < n; ++k) {
        const Eigen::Vector2d a = x.col(c).segment<2>(2 * k).cwiseQuotient(scale.segment<2>(2 * k));
        fit.rise[k] += a.dot(inverse.block<2, 2>(2 * k, 2 * k).inverse() * a);
      }
      if (!with_jacobian) continue;
      // dh/dRe p = a psi1 + b psi2, dh/dIm p = a psi2 - b psi1 for the residue a + j b.
      const auto rotate = [&](Index k) {
        Eigen::Matrix2d r;
        const double a = x(2 * k, c), b = x(2 * k + 1, c);
        r << a, -b, b, a;
        return r;
      };
      for (Index k = 0; k < n; ++k) {
        const Eigen::Matrix2d rk = rotate(k);
        const Eigen::Vector2d score = rk.transpose() * psi_r.col(c).segment<2>(2 * k);
        fit.jtr.segment<2>(2 * k) += score;
        fit.channel_score.col(channel).segment<2>(2 * k) = score / equations.half_width(k);
        fit.channel_information.col(channel).segment<2>(2 * k) =
            (rk.transpose() * schur.block<2, 2>(2 * k, 2 * k) * rk).diagonal() / std::pow(equations.half_width(k), 2);
        for (Index l = 0; l <= k; ++l) {
          fit.jtj.block<2, 2>(2 * k, 2 * l) += rk.transpose() * schur.block<2, 2>(2 * k, 2 * l) * rotate(l);
        }
      }
    }
  }
  if (with_jacobian) {
    fit.jtj.triangularView<Eigen::StrictlyUpper>() = fit.jtj.transpose();
    // Back from half widths to rad/s.
    VectorXd unit(2 * n);
    for (Index k = 0; k < n; ++k) unit.segment<2>(2 * k).setConstant(1 / equations.half_width(k));
    fit.jtj = unit.asDiagonal() * fit.jtj * unit.asDiagonal();
    fit.jtr = unit.asDiagonal() * fit.jtr;
  }
  return fit;
}

Eigen::MatrixXcd residual_of(const Band& band, const Poles& poles, const ResidualTerms& terms, const PoleFit& fit) {
  const std::vector<Roots> roots = roots_of(band, poles, terms);
  const Pairing pairing = pairing_of(terms, false);
  const auto n = static_cast<Index>(poles.size());
  const Index count = fit.residues.rows() - 2 * n, step = terms.complex ? 2 : 1;
  MatrixXcd residual = band.h;
  MatrixXd rows(kSlice, 4 * n);
  // Of u and v: a + j b and its partner, a, b being two rows of the residues.
  MatrixXd factors(4 * n, 2 * band.channels());
  for (Index k = 0; k < n; ++k) {
    for (Index c = 0; c < band.channels(); ++c) {
      const double a = fit.residues(2 * k, c), b = fit.residues(2 * k + 1, c);
      const double a2 = pairing.alpha * a, b2 = pairing.beta * b;
      factors(2 * k, c) = a, factors(2 * k + 1, c) = a2;
      factors(2 * n + 2 * k, c) = -b, factors(2 * n + 2 * k + 1, c) = -b2;
      factors(2 * k, band.channels() + c) = b, factors(2 * k + 1, band.channels() + c) = b2;
      factors(2 * n + 2 * k, band.channels() + c) = a, factors(2 * n + 2 * k + 1, band.channels() + c) = a2;
    }
  }
  MatrixXcd tail(count / step, band.channels());
  for (Index t = 0; t < tail.rows(); ++t) {
    tail.row(t) = fit.residues.row(2 * n + step * t).cast<Complex>();
    if (terms.complex) tail.row(t) += kJ * fit.residues.row(2 * n + step * t + 1);
  }
  for (Index first = 0; first < band.lines(); first += kSlice) {
    const Index lines = std::min(kSlice, band.lines() - first);
    fill_fractions(band, roots, first, lines, false, rows);
    const MatrixXd parts = rows.topRows(lines) * factors;
    MatrixXcd model = residual_terms(band, terms, first, lines) * tail;
    model.real() += parts.leftCols(band.channels());
    model.imag() += parts.rightCols(band.channels());
    residual.middleRows(first, lines) -= motion_factor(band, first, lines).asDiagonal() * model;
  }
  return residual;
}

}  // namespace whirl::modal
