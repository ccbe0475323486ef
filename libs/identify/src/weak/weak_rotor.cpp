#include "whirl/identify/weak_rotor.hpp"

#include <fmt/format.h>

#include <cmath>

#include "weak/weak_equations.hpp"
#include "whirl/core/error.hpp"

namespace whirl::identification {
namespace {

using detail::Complex;

struct Prepared {
  const RotorRecord& record;
  detail::WeakRows rows;
  Eigen::VectorXcd forcing, turning;  // e^{i beta}, where its runout is sought
};

std::vector<Prepared> prepare(const std::vector<RotorRecord>& records, const WeakRotorOptions& options,
                              double& half_width) {
  std::vector<Prepared> prepared;
  for (const RotorRecord& r : records) {
    const Eigen::Index half = options.half_width > 0 ? static_cast<Eigen::Index>(std::lround(options.half_width / r.dt))
                                                     : detail::default_half_width(r);
    if (half < 8 || 4 * half > r.size()) {
      throw Error::in_field("half_width", fmt::format("{} samples", half), "from 8 samples to a quarter of the record");
    }
    if (prepared.empty()) half_width = static_cast<double>(half) * r.dt;
    prepared.push_back({r, detail::WeakRows(r, r.angle, half), {}, {}});
    prepared.back().forcing = prepared.back().rows.forcing();
    if (options.runout) prepared.back().turning = prepared.back().rows.carrier();
  }
  return prepared;
}

/// A linear force with coefficient 1 in the weak equations: -d z' + s z with d and s of the angle's instants.
Eigen::VectorXcd force_rows(const Prepared& p, const Eigen::VectorXcd& z, const RotorTerm& term) {
  Eigen::VectorXcd along(z.size());
  double damping = 0;
  for (Eigen::Index i = 0; i < z.size(); ++i) {
    const TermForce f = term_force(term, {.w = p.record.angle.omega[2 * i], .beta = p.record.angle.beta[2 * i]});
    along[i] = Complex(f.x_x, f.y_x) * z[i];
    damping = -f.x_vx;
  }
  return damping * p.rows.apply(1, z) + p.rows.apply(0, along);
}

/// Rows of one record, those of a whirl force and of its runout if sought, right-hand side last: with `model` whitened
/// by the noise that it lets through. False when that covariance is singular.
bool rows_of(const Prepared& p, Complex offset, Complex runout, const std::optional<RotorTerm>& whirl_force,
             const RotorModel* model, Eigen::MatrixXcd& block) {
  const double s2 = p.record.noise_variance();
  Eigen::VectorXcd z = (p.record.z.array() - offset).matrix();
  if (p.turning.size() > 0) z -= runout * p.turning;
  const detail::WeakSystem system = detail::weak_system(p.rows, z, s2, p.forcing);
  block.setZero(p.rows.size(), p.turning.size() > 0 ? 10 : whirl_force ? 9 : 8);
  block.leftCols(7) = system.terms;
  if (whirl_force) block.col(detail::WeakUnknowns::kWhirlForce) = force_rows(p, z, *whirl_force);
  if (p.turning.size() > 0) block.col(detail::WeakUnknowns::kRunout) = p.rows.apply(0, p.turning);
  block.rightCols(1) = system.right;
  if (model == nullptr) return true;
  const Eigen::VectorXd cubic = model->k2 * detail::smooth_square(z, p.record.dt, s2);
  BandedCholesky<Complex> whiten = p.rows.whitener((model->k1 + 2 * cubic.array()).matrix(), cubic, model->c);
  if (!whiten.factorize()) return false;
  whiten.solve_lower(block);
  block /= std::sqrt(0.5 * s2);  // variance of a real and of an imaginary row
  return true;
}

/// One pass of generalised least squares about the model of the pass before;
/// why it fails, or nothing.
std::string pass(const std::vector<Prepared>& prepared, const detail::WeakUnknowns& unknowns,
                 const std::optional<RotorTerm>& whirl_force, bool whitened, WeakRotorFit& fit) {
  Eigen::Index total = 0;
  for (const Prepared& p : prepared) total += 2 * p.rows.size();
  Eigen::MatrixXd a = Eigen::MatrixXd::Zero(total, unknowns.size());
  Eigen::VectorXd b(total);
  Eigen::Index top = 0;
  for (std::size_t r = 0; r < prepared.size(); ++r) {
    Eigen::MatrixXcd block;
    if (!rows_of(prepared[r], fit.offset[r], fit.runout[r], whirl_force, whitened ? &fit.model : nullptr, block)) {
      return "the noise covariance of the weak equations is singular";
    }
    unknowns.place(block, r, top, a);
    b.segment(top, 2 * block.rows()) = detail::stack(block.rightCols(1).col(0));
    top += 2 * block.rows();
  }
  detail::WeakSolution s = detail::solve_weak(a, b);
  if (s.singular)
    return "the weak equations are singular: the records do not excite every "
           "term";
  fit.summary.condition_number = s.condition_number;
  if (!(s.condition_number < 1e10)) {
    return fmt::format("the weak equations are singular (condition number {:.1e})", s.condition_number);
  }
  fit.values = std::move(s.values);
  fit.covariance = std::move(s.covariance);
  fit.summary.chi_square = s.chi_square;
  fit.rows = total;
  unknowns.set_shared(fit.values, fit.model);
  if (whirl_force) {
    fit.terms = {*whirl_force};
    fit.terms[0].value = fit.values[unknowns.shared() - 1];
  }
  const double k1 = fit.model.k1;
  for (std::size_t r = 0; r < prepared.size(); ++r) {
    const Eigen::Index own = unknowns.own(r);
    fit.eps[r] = {fit.values[own], fit.values[own + 1]};
    if (!(k1 > 0)) continue;
    fit.offset[r] += Complex(fit.values[own + 2], fit.values[own + 3]) / k1;
    if (prepared[r].turning.size() > 0) fit.runout[r] += Complex(fit.values[own + 4], fit.values[own + 5]) / k1;
  }
  if (k1 > 0) return "";
  return fmt::format(
      "the fitted stiffness is not positive (k1 = {:.4g} "
      "1/s^2): the data do not follow a rotor",
      k1);
}

}  // namespace

WeakRotorFit fit_weak_rotor(const std::vector<RotorRecord>& records, const WeakRotorOptions& options) {
  if (records.empty()) throw Error("records: at least one is needed");
  require_range("passes", options.passes, 1, 50);
  require_range("half_width", options.half_width, 0, 1e6, "s");
  WeakRotorFit fit;
  for (const RotorRecord& r : records) {
    if (r.summary.status == Status::unusable) {
      fit.summary.fail(fmt::format("{}: {}", r.source, r.summary.reason));
    }
  }
  if (fit.summary.status == Status::unusable) return fit;

  const std::vector<Prepared> prepared = prepare(records, options, fit.half_width);
  const detail::WeakUnknowns unknowns(options.conj_stiffness, options.conj_damping, options.runout, options.whirl_force,
                                      records.size());
  fit.names = unknowns.names();
  fit.eps.assign(records.size(), 0);
  fit.offset.assign(records.size(), 0);
  fit.runout.assign(records.size(), 0);
  for (int k = 0; k < options.passes; ++k) {
    if (const std::string why = pass(prepared, unknowns, options.whirl_force, k > 0, fit); !why.empty()) {
      fit.summary.fail(why);
      return fit;
    }
  }
  fit.model.eps = fit.eps[0];
  fit.model.offset = fit.offset[0];
  if (options.passes == 1) fit.summary.chi_square = std::numeric_limits<double>::quiet_NaN();  // not whitened
  return fit;
}

}  // namespace whirl::identification
