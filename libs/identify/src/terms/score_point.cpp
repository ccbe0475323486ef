#include "terms/score_point.hpp"

namespace whirl::identification::detail {
namespace {

TermPoint state_at(const OutputErrorRecord& own, const RotorRecord& record, Eigen::Index i) {
  const Complex z = own.main[i], v = own.main_rate[i];
  return {z.real(),
          z.imag(),
          v.real(),
          v.imag(),
          own.angle.omega[2 * i],
          own.angle.beta[2 * i],
          record.t0 + record.dt * static_cast<double>(i),
          own.angle.alpha[2 * i]};
}

Linearised linearised(const OutputErrorFit& fit, const OutputErrorRecord& own, const RotorRecord& record) {
  const RotorModel& m = fit.model;
  Linearised l{(m.k1 + own.k1_change + 2 * m.k2 * own.main.cwiseAbs2().array()).matrix(),
               (m.k2 * own.main.array().square() + m.k1_conj).matrix()};
  for (const RotorTerm& term : fit.terms) {
    for (Eigen::Index i = 0; i < own.main.size(); ++i) {
      const TermForce f = term_force(term, state_at(own, record, i));
      l.stiffness[i] -= 0.5 * term.value * (f.x_x + f.y_y);
      l.turned[i] -= 0.5 * term.value * Complex(f.x_x - f.y_y, f.y_x + f.x_y);
    }
  }
  return l;
}

}  // namespace

ScorePoint::ScorePoint(const RotorRecord& of, const WeakRows& weak, const OutputErrorFit& from, std::size_t number,
                       const OutputErrorOptions& taken, const ScoreTestOptions& asked, bool both_axes)
    : record(of),
      rows(weak),
      fit(from),
      own(from.records[number]),
      active(taken),
      options(asked),
      both(both_axes),
      carrier(weak.carrier()),
      forcing(weak.forcing()),
      springs(linearised(from, own, of)) {}

Eigen::VectorXcd ScorePoint::error(const Eigen::VectorXcd& along) const {
  return rows.rotor(along, springs.stiffness, fit.model.c) +
         rows.apply(0, springs.turned.cwiseProduct(along.conjugate()));
}

TermPoint ScorePoint::state(Eigen::Index sample) const { return state_at(own, record, sample); }

Eigen::VectorXcd ScorePoint::late() const {
  Eigen::VectorXcd out(own.main.size());
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const double speed = own.angle.omega[2 * i];
    out[i] = own.eps * (Complex(0, -speed) * forcing[i] - 2 * speed * own.angle.alpha[2 * i] * carrier[i]);
  }
  return out;
}

std::vector<Eigen::VectorXcd> ScorePoint::both_ways(const Eigen::VectorXcd& forward) const {
  if (!both) return {error(forward)};
  return {error(forward), error(forward.conjugate())};
}

}  // namespace whirl::identification::detail
