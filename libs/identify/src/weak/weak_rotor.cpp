#include "whirl/identify/weak_rotor.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <cmath>

#include "weak/weak_rows.hpp"
#include "whirl/core/error.hpp"

namespace whirl::identification {
namespace {

using detail::Complex;

struct Prepared {
  detail::WeakRows rows;
  Eigen::VectorXcd forcing;
  Eigen::VectorXcd offset_free;
};

// Column of the shared real unknowns of WeakSystem::terms.
struct SharedTerm {
  const char* name;
  int column;
  bool imaginary;  // unknown multiplies i times the column
};

std::vector<SharedTerm> shared_terms(const WeakRotorOptions& o) {
  std::vector<SharedTerm> terms = {{"k1", 0, false}, {"k2", 1, false}, {"c", 2, false}};
  if (o.conj_stiffness) terms.insert(terms.end(), {{"k1_conj_re", 5, false}, {"k1_conj_im", 5, true}});
  if (o.conj_damping) terms.insert(terms.end(), {{"c_conj_re", 6, false}, {"c_conj_im", 6, true}});
  return terms;
}

}  // namespace

WeakRotorFit fit_weak_rotor(const std::vector<RotorRecord>& records, const WeakRotorOptions& options) {
  if (records.empty()) throw Error("records: at least one is needed");
  require_range("passes", options.passes, 1, 50);
  require_range("half_width", options.half_width, 0, 1e6, "s");
  WeakRotorFit fit;
  for (const RotorRecord& r : records) {
    if (r.summary.status == Status::unusable) {
      fit.summary.fail(fmt::format("{}: {}", r.source, r.summary.warnings.back()));
    }
  }
  if (fit.summary.status == Status::unusable) return fit;

  const std::size_t count = records.size();
  std::vector<Prepared> prepared;
  for (const RotorRecord& r : records) {
    const Eigen::Index half = options.half_width > 0 ? static_cast<Eigen::Index>(std::lround(options.half_width / r.dt))
                                                     : detail::default_half_width(r);
    if (half < 8 || 4 * half > r.size()) {
      throw Error::in_field("half_width", fmt::format("{} samples", half), "from 8 samples to a quarter of the record");
    }
    if (prepared.empty()) fit.half_width = static_cast<double>(half) * r.dt;
    prepared.push_back({detail::WeakRows(r, r.angle, half), detail::sample_forcing(r.angle), r.z});
  }

  const std::vector<SharedTerm> shared = shared_terms(options);
  const Eigen::Index n_shared = static_cast<Eigen::Index>(shared.size());
  const Eigen::Index unknowns = n_shared + 4 * static_cast<Eigen::Index>(count);
  for (const SharedTerm& t : shared) fit.names.emplace_back(t.name);
  for (std::size_t r = 0; r < count; ++r) {
    const std::string suffix = r == 0 ? "" : fmt::format("_{}", r + 1);
    for (const char* n : {"eps_re", "eps_im", "d_re", "d_im"}) fit.names.push_back(n + suffix);
  }
  fit.eps.assign(count, 0);
  fit.offset.assign(count, 0);
  RotorModel& m = fit.model;

  for (int pass = 0; pass < options.passes; ++pass) {
    Eigen::Index total = 0;
    for (const Prepared& p : prepared) total += 2 * p.rows.size();
    Eigen::MatrixXd a = Eigen::MatrixXd::Zero(total, unknowns);
    Eigen::VectorXd b(total);
    Eigen::Index top = 0;
    for (std::size_t r = 0; r < count; ++r) {
      Prepared& p = prepared[r];
      const double s2 = records[r].noise_variance();
      p.offset_free = (records[r].z.array() - fit.offset[r]).matrix();
      detail::WeakSystem system = detail::weak_system(p.rows, p.offset_free, s2, p.forcing);
      Eigen::MatrixXcd block(p.rows.size(), 8);
      block << system.terms, system.right;
      if (pass > 0) {
        const Eigen::VectorXd stiffness =
            (m.k1 + 2 * m.k2 * detail::smooth_square(p.offset_free, records[r].dt, s2).array()).matrix();
        BandedCholesky<Complex> whiten = p.rows.whitener(stiffness, m.c);
        if (!whiten.factorize()) {
          fit.summary.fail("the noise covariance of the weak equations is singular");
          return fit;
        }
        whiten.solve_lower(block);
        block /= std::sqrt(0.5 * s2);  // variance of a real and of an imaginary row
      }
      const Eigen::Index n = 2 * p.rows.size();
      for (Eigen::Index k = 0; k < n_shared; ++k) {
        const SharedTerm& t = shared[static_cast<std::size_t>(k)];
        const Complex factor = t.imaginary ? Complex(0, 1) : Complex(1, 0);
        a.col(k).segment(top, n) = detail::stack(factor * block.col(t.column));
      }
      const Eigen::Index own = n_shared + 4 * static_cast<Eigen::Index>(r);
      for (int k = 0; k < 2; ++k) {
        a.col(own + 2 * k).segment(top, n) = detail::stack(block.col(3 + k));
        a.col(own + 2 * k + 1).segment(top, n) = detail::stack(Complex(0, 1) * block.col(3 + k));
      }
      b.segment(top, n) = detail::stack(block.col(7));
      top += n;
    }
    const Eigen::VectorXd scale = (a.colwise().squaredNorm() / static_cast<double>(total)).cwiseSqrt();
    if (!(scale.minCoeff() > 0) || !scale.allFinite() || total <= unknowns) {
      fit.summary.fail("the weak equations are singular: the records do not excite every term");
      return fit;
    }
    const Eigen::MatrixXd scaled = a * scale.cwiseInverse().asDiagonal();
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(scaled);
    const Eigen::MatrixXd upper = qr.matrixQR().topRows(unknowns).triangularView<Eigen::Upper>();
    const Eigen::VectorXd singular = upper.jacobiSvd().singularValues();
    fit.summary.condition_number = singular[0] / singular[unknowns - 1];
    if (!(fit.summary.condition_number < 1e10)) {
      fit.summary.fail(
          fmt::format("the weak equations are singular (condition number {:.1e})", fit.summary.condition_number));
      return fit;
    }
    const Eigen::VectorXd y = qr.solve(b);
    fit.values = y.cwiseQuotient(scale);
    fit.summary.chi_square = (b - scaled * y).squaredNorm() / static_cast<double>(total - unknowns);
    fit.rows = total;
    const Eigen::MatrixXd inverse =
        upper.triangularView<Eigen::Upper>().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(unknowns, unknowns)));
    fit.covariance =
        scale.cwiseInverse().asDiagonal() * (inverse * inverse.transpose()) * scale.cwiseInverse().asDiagonal();

    m.k1 = fit.values[0];
    m.k2 = fit.values[1];
    m.c = fit.values[2];
    for (Eigen::Index k = 3; k < n_shared; ++k) {
      const SharedTerm& t = shared[static_cast<std::size_t>(k)];
      Complex& target = t.column == 5 ? m.k1_conj : m.c_conj;
      target = t.imaginary ? Complex(target.real(), fit.values[k]) : Complex(fit.values[k], target.imag());
    }
    for (std::size_t r = 0; r < count; ++r) {
      const Eigen::Index own = n_shared + 4 * static_cast<Eigen::Index>(r);
      fit.eps[r] = {fit.values[own], fit.values[own + 1]};
      if (m.k1 > 0) fit.offset[r] += Complex(fit.values[own + 2], fit.values[own + 3]) / m.k1;
    }
    if (!(m.k1 > 0)) {
      fit.summary.fail(fmt::format(
          "the fitted stiffness is not positive (k1 = {:.4g} 1/s^2): the data do not follow a rotor", m.k1));
      return fit;
    }
  }
  m.eps = fit.eps[0];
  m.offset = fit.offset[0];
  if (options.passes == 1) fit.summary.chi_square = std::numeric_limits<double>::quiet_NaN();  // not whitened
  return fit;
}

}  // namespace whirl::identification
