#include "output_error/rotor/output_error_signals.hpp"

#include <algorithm>
#include <cmath>

#include "whirl/rotor/modal_response.hpp"
#include "whirl/rotor/simulate.hpp"

namespace whirl::identification::detail {
namespace {

constexpr Complex kI{0, 1};

void correct_angle(const RotorRecord& measured, const Eigen::VectorXd& correction, double delay, double drift,
                   AngleSignal& angle) {
  angle = measured.angle;
  if (drift != 0) {  // older by a share of the time
    for (Eigen::Index i = 0; i < angle.beta.size(); ++i) {
      const double late = drift * 0.5 * measured.dt * static_cast<double>(i);
      angle.beta[i] -= late * angle.omega[i] - (0.5 * late * late) * angle.alpha[i];
      angle.omega[i] = (angle.omega[i] - late * angle.alpha[i]) * (1 - drift);
    }
  }
  if (delay != 0) {  // the angle when the displacement was taken
    angle.beta -= delay * angle.omega - (0.5 * delay * delay) * angle.alpha;
    angle.omega -= delay * angle.alpha;
  }
  if (correction.size() == 0) return;
  const Eigen::Index n = angle.beta.size();
  const double horizon = 0.5 * measured.dt * static_cast<double>(n - 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double u = static_cast<double>(i) / static_cast<double>(n - 1);
    double power = 1;  // u^(k - 2) for k >= 2
    for (Eigen::Index j = 0; j < correction.size(); ++j) {
      const double k = static_cast<double>(j + 1), a = correction[j];
      const double first = j == 0 ? 1 : power * u;  // u^(k - 1)
      angle.beta[i] += a * first * u;
      angle.omega[i] += a * k * first / horizon;
      if (j > 0) {
        angle.alpha[i] += a * k * (k - 1) * power / (horizon * horizon);
        power *= u;
      }
    }
  }
}

Turns turns_of(const AngleSignal& angle, const std::vector<RotorTerm>& terms) {
  const auto by = [&](double times) {
    return Eigen::VectorXcd(angle.beta.unaryExpr([times](double b) { return TermPoint::turn_by(times * b); }));
  };
  const bool twice = std::ranges::any_of(terms, [](const RotorTerm& t) { return t.entry->twice_a_turn; });
  return {by(1), twice ? by(2) : Eigen::VectorXcd()};
}

// F and its derivatives by the coefficients of the angle correction, then by the delay.
Eigen::VectorXcd forcing_of(const AngleSignal& a, const Eigen::VectorXcd& turned, int profile_degree, bool delay,
                            bool drift, Eigen::MatrixXcd& profile) {
  const Eigen::Index n = a.beta.size();
  Eigen::VectorXcd f(n);
  profile.resize(n, profile_degree + delay + drift);
  const double horizon = 0.5 * a.dt * static_cast<double>(n - 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double w = a.omega[i];
    const Complex e = turned[i];
    f[i] = e * Complex(w * w, -a.alpha[i]);
    // d F / d a_k = i p F + e (2 w p' - i p''), p = u^k
    const double u = static_cast<double>(i) / static_cast<double>(n - 1);
    double power = 1;
    for (int k = 1; k <= profile_degree; ++k) {
      const double first = k == 1 ? 1 : power * u;
      const double p = first * u, p1 = k * first / horizon;
      const double p2 = k == 1 ? 0 : k * (k - 1) * power / (horizon * horizon);
      profile(i, k - 1) = kI * p * f[i] + e * Complex(2 * w * p1, -p2);
      if (k > 1) power *= u;
    }
    // The third derivative of the angle is left out: it only turns the step, not the solution.
    const Complex late = -kI * w * f[i] - e * Complex(2 * w * a.alpha[i], 0);
    if (delay) profile(i, profile_degree) = late;
    if (drift) profile(i, profile_degree + delay) = 0.5 * a.dt * static_cast<double>(i) * late - 2 * w * w * e;
  }
  return f;
}

void refresh_runout(const OutputErrorRecord& record, int harmonics, Signals& s) {
  s.runout.clear();
  for (int k = 0; k < 2 * harmonics; ++k) {
    const double order = (k % 2 == 0 ? 1 : -1) * (k / 2 + 1);
    Eigen::VectorXcd v(record.angle.samples());
    for (Eigen::Index i = 0; i < v.size(); ++i) v[i] = std::polar(1.0, order * record.angle.beta[2 * i]);
    s.runout.push_back(std::move(v));
  }
}

/// A force that turns about as the angle does, from the half grid to a finer one.
Eigen::VectorXcd refined_force(const Eigen::VectorXcd& force, const AngleSignal& coarse, const AngleSignal& fine,
                               int substeps) {
  if (substeps == 1) return force;
  Eigen::VectorXcd out(fine.beta.size());
  const auto still = [&](Eigen::Index i) { return force[i] * std::polar(1.0, -coarse.beta[i]); };
  for (Eigen::Index i = 0; i < out.size(); ++i) {
    const Eigen::Index from = i / substeps, to = std::min(from + 1, force.size() - 1);
    const double share = static_cast<double>(i % substeps) / substeps;
    out[i] = ((1 - share) * still(from) + share * still(to)) * std::polar(1.0, fine.beta[i]);
  }
  return out;
}

void refresh_modes(const Point& p, std::size_t r, const RotorRecord& measured, int substeps, bool poles, Signals& s) {
  const OutputErrorRecord& record = p.records[r];
  s.modal.clear();
  s.modal_w.clear();
  s.modal_zeta.clear();
  for (std::size_t k = 0; k < p.model.modes.size(); ++k) {
    const ForcedMode& m = p.model.modes[k];
    const double dw = 1e-5 * m.omega, dz = 1e-3 * m.zeta, dt = measured.dt / substeps, start = record.angle.omega[0];
    if (!poles) {
      const Eigen::VectorXcd q = rotor::modal_response(m.omega, m.zeta, s.forcing, dt, start, measured.derivative());
      s.modal.push_back(q(Eigen::seqN(Eigen::Index{0}, record.angle.samples(), Eigen::Index{substeps})));
      continue;
    }
    std::vector<Eigen::VectorXcd> q = rotor::modal_responses({{m.omega, m.zeta},
                                                              {m.omega + dw, m.zeta},
                                                              {m.omega - dw, m.zeta},
                                                              {m.omega, m.zeta + dz},
                                                              {m.omega, m.zeta - dz}},
                                                             s.forcing, dt, start, measured.derivative(), substeps);
    const Complex gamma = record.participation[k];
    s.modal_w.emplace_back(gamma * (q[1] - q[2]) / (2 * dw));
    s.modal_zeta.emplace_back(gamma * (q[3] - q[4]) / (2 * dz));
    s.modal.push_back(std::move(q[0]));
  }
}

void refresh_decays(const Point& p, std::size_t r, const RotorRecord& measured, Signals& s) {
  const OutputErrorRecord& record = p.records[r];
  const Eigen::Index n = measured.size();
  s.decay.clear();
  s.decay_w.clear();
  s.decay_zeta.clear();
  for (std::size_t k = 0; k < p.decays.size(); ++k) {
    const double w = p.decays[k].omega, zeta = p.decays[k].zeta, root = std::sqrt(1 - zeta * zeta);
    const Complex pole(-zeta * w, w * root), by_w(-zeta, root), by_zeta(-w, -w * zeta / root);
    Eigen::VectorXcd plus(n), slope_w(n), slope_zeta(n);
    for (Eigen::Index i = 0; i < n; ++i) {
      const double t = measured.dt * static_cast<double>(i);
      plus[i] = std::exp(pole * t);
      const Complex a = t * record.decay[2 * k] * plus[i], b = t * record.decay[2 * k + 1] * std::conj(plus[i]);
      slope_w[i] = a * by_w + b * std::conj(by_w);
      slope_zeta[i] = a * by_zeta + b * std::conj(by_zeta);
    }
    s.decay.push_back(plus);
    s.decay.emplace_back(plus.conjugate());
    s.decay_w.push_back(std::move(slope_w));
    s.decay_zeta.push_back(std::move(slope_zeta));
  }
}

}  // namespace

void refresh(Point& p, std::size_t r, const RotorRecord& measured, const OutputErrorOptions& options,
             const Eigen::VectorXcd* known, Signals& s) {
  OutputErrorRecord& record = p.records[r];
  const int substeps = steps_of(options);
  const bool first = s.forcing.size() == 0;
  const bool turning = options.clock.profile_degree > 0 || options.clock.delay || options.clock.drift;
  if (first || turning) {
    correct_angle(measured, p.profile[r], p.delay, p.clock_drift, record.angle);
    s.angle = substeps == 1 ? record.angle : rotor::refine(record.angle, substeps);
    s.turns = turns_of(s.angle, options.terms);
    s.forcing = forcing_of(s.angle, s.turns.once, options.clock.profile_degree, options.clock.delay,
                           options.clock.drift, s.profile);
    if (known != nullptr) s.known = refined_force(*known, record.angle, s.angle, substeps);
    refresh_runout(record, options.probes.runout_harmonics, s);
  }
  if (first || turning || options.modes.poles) {
    refresh_modes(p, r, measured, substeps, options.modes.poles, s);
    refresh_decays(p, r, measured, s);
  }
}

}  // namespace whirl::identification::detail
