#include "weak/weak_equations.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <Eigen/SVD>

namespace whirl::identification::detail {

WeakUnknowns::WeakUnknowns(bool conj_stiffness, bool conj_damping, bool runout,
                           const std::optional<RotorTerm>& whirl_force, std::size_t records)
    : columns_({{"k1", 0, false}, {"k2", 1, false}, {"c", 2, false}}), each_(runout ? 6 : 4), records_(records) {
  if (conj_stiffness) columns_.insert(columns_.end(), {{"k1_conj_re", 5, false}, {"k1_conj_im", 5, true}});
  if (conj_damping) columns_.insert(columns_.end(), {{"c_conj_re", 6, false}, {"c_conj_im", 6, true}});
  if (whirl_force) columns_.push_back({whirl_force->parameter().data(), kWhirlForce, false});
}

std::vector<std::string> WeakUnknowns::names() const {
  std::vector<std::string> names;
  for (const Column& c : columns_) names.emplace_back(c.name);
  for (std::size_t r = 0; r < records_; ++r) {
    const std::string suffix = r == 0 ? "" : fmt::format("_{}", r + 1);
    const char* all[] = {"eps_re", "eps_im", "d_re", "d_im", "runout_force_re", "runout_force_im"};
    for (Eigen::Index k = 0; k < each_; ++k) names.push_back(all[k] + suffix);
  }
  return names;
}

void WeakUnknowns::place(const Eigen::MatrixXcd& terms, std::size_t r, Eigen::Index top, Eigen::MatrixXd& into) const {
  const Eigen::Index n = 2 * terms.rows();
  const auto put = [&](Eigen::Index column, int term, bool imaginary) {
    into.col(column).segment(top, n) = stack((imaginary ? Complex(0, 1) : Complex(1, 0)) * terms.col(term));
  };
  for (Eigen::Index k = 0; k < shared(); ++k) {
    const Column& c = columns_[static_cast<std::size_t>(k)];
    put(k, c.term, c.imaginary);
  }
  constexpr int kOwn[] = {3, 4, kRunout};
  for (int k = 0; k < each_; ++k) put(own(r) + k, kOwn[k / 2], k % 2 == 1);
}

void WeakUnknowns::set_shared(const Eigen::VectorXd& values, RotorModel& m) const {
  m.k1 = values[0];
  m.k2 = values[1];
  m.c = values[2];
  for (Eigen::Index k = 3; k < shared(); ++k) {
    const Column& c = columns_[static_cast<std::size_t>(k)];
    if (c.term == kWhirlForce) continue;
    Complex& target = c.term == 5 ? m.k1_conj : m.c_conj;
    target = c.imaginary ? Complex(target.real(), values[k]) : Complex(values[k], target.imag());
  }
}

WeakSolution solve_weak(const Eigen::MatrixXd& rows, const Eigen::VectorXd& right) {
  WeakSolution s;
  const Eigen::Index total = rows.rows(), unknowns = rows.cols();
  s.scale = (rows.colwise().squaredNorm() / static_cast<double>(total)).cwiseSqrt();
  s.singular = !(s.scale.minCoeff() > 0) || !s.scale.allFinite() || total <= unknowns;
  if (s.singular) return s;
  const Eigen::MatrixXd scaled = rows * s.scale.cwiseInverse().asDiagonal();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(scaled);
  const Eigen::MatrixXd upper = qr.matrixQR().topRows(unknowns).triangularView<Eigen::Upper>();
  const Eigen::VectorXd singular = upper.jacobiSvd().singularValues();
  s.condition_number = singular[0] / singular[unknowns - 1];
  const Eigen::VectorXd y = qr.solve(right);
  s.values = y.cwiseQuotient(s.scale);
  s.chi_square = (right - scaled * y).squaredNorm() / static_cast<double>(total - unknowns);
  const Eigen::MatrixXd inverse =
      upper.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(unknowns, unknowns)));
  s.covariance =
      s.scale.cwiseInverse().asDiagonal() * (inverse * inverse.transpose()) * s.scale.cwiseInverse().asDiagonal();
  return s;
}

}  // namespace whirl::identification::detail
