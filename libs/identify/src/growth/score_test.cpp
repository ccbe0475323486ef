#include "whirl/identify/score_test.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "growth/score.hpp"
#include "output_error/rotor/output_error_parameters.hpp"
#include "weak/weak_rows.hpp"
#include "whirl/core/error.hpp"
#include "whirl/rotor/modal_response.hpp"

namespace whirl::identification {
namespace {

using detail::Complex;

struct Candidate {
  std::string term;
  bool in_model;
  Eigen::MatrixXd columns;
};

/// Force of a term with coefficient 1 along the simulated motion.
Eigen::VectorXcd force_along(RotorTerm term, const OutputErrorRecord& own, double t0, double dt) {
  Eigen::VectorXcd force(own.main.size());
  for (Eigen::Index i = 0; i < force.size(); ++i) {
    const Complex z = own.main[i], v = own.main_rate[i];
    const TermForce f = term_force(term, z.real(), z.imag(), v.real(), v.imag(), own.angle.omega[2 * i],
                                   t0 + dt * static_cast<double>(i));
    force[i] = {f.x, f.y};
  }
  return force;
}

bool has_term(const OutputErrorOptions& active, RotorTermKind kind) {
  return std::any_of(active.terms.begin(), active.terms.end(), [&](const RotorTerm& t) { return t.kind == kind; });
}

/// Rows of all records, stacked as they come.
struct Stacked {
  Eigen::MatrixXd active, instruments;
  Eigen::VectorXd right;
  std::vector<Candidate> candidates;
  Eigen::Index top = 0;
};

Eigen::VectorXcd half_grid_forcing(const AngleSignal& a) {
  Eigen::VectorXcd f(a.beta.size());
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    f[i] = std::polar(1.0, a.beta[i]) * Complex(a.omega[i] * a.omega[i], -a.alpha[i]);
  }
  return f;
}

/// ScoreCandidate::moves of a column that the active ones follow with the coefficients `stands_for`.
Eigen::VectorXd moves_of(const Eigen::VectorXd& stands_for, Eigen::Index shared, std::size_t records) {
  const auto n = static_cast<Eigen::Index>(records);
  Eigen::VectorXd moves(3 + 2 * n);
  moves.head(3) = -stands_for.head(3);
  for (Eigen::Index r = 0; r < n; ++r) moves.segment(3 + 2 * r, 2) = -stands_for.segment(shared + 4 * r, 2);
  return moves;
}

}  // namespace

const ScoreCandidate* ScoreTest::find(const std::string& term) const {
  const auto at = std::find_if(candidates.begin(), candidates.end(), [&](const auto& c) { return c.term == term; });
  return at == candidates.end() ? nullptr : &*at;
}

ScoreTest score_rotor_terms(const std::vector<RotorRecord>& records, const OutputErrorFit& fit,
                            const OutputErrorOptions& active, const ScoreTestOptions& options) {
  if (records.size() != fit.records.size() || records.empty()) {
    throw Error("score test: needs the records of the output-error fit");
  }
  std::vector<detail::WeakRows> rows;
  Eigen::Index total = 0;
  for (std::size_t r = 0; r < records.size(); ++r) {
    const Eigen::Index half = options.half_width > 0
                                  ? static_cast<Eigen::Index>(std::lround(options.half_width / records[r].dt))
                                  : detail::default_half_width(records[r]);
    rows.emplace_back(records[r], fit.records[r].angle, half);
    total += 2 * rows.back().size();
  }
  // Active real columns: (column of WeakSystem::terms, times i); the last four of each record are its own.
  std::vector<std::pair<int, bool>> shared = {{0, false}, {1, false}, {2, false}};
  if (active.conj_stiffness) shared.insert(shared.end(), {{5, false}, {5, true}});
  if (active.conj_damping) shared.insert(shared.end(), {{6, false}, {6, true}});
  const auto n_simulated = static_cast<Eigen::Index>(active.terms.size()) + active.sensor_gain + active.sensor_angle;
  const auto n_tied = static_cast<Eigen::Index>(shared.size());
  const Eigen::Index n_shared = n_tied + n_simulated;
  const Eigen::Index unknowns = n_shared + 4 * static_cast<Eigen::Index>(records.size());

  Stacked s;
  s.active = Eigen::MatrixXd::Zero(total, unknowns);
  s.instruments = s.active;
  s.right.resize(total);
  const RotorModel& m = fit.model;
  for (std::size_t r = 0; r < records.size(); ++r) {
    const OutputErrorRecord& own = fit.records[r];
    const detail::WeakRows& w = rows[r];
    const Eigen::Index n = 2 * w.size();
    const double s2 = records[r].noise_variance();
    const Eigen::VectorXcd forcing = detail::sample_forcing(own.angle);
    const Eigen::VectorXcd measured =
        detail::unread_by(fit.sensor, (own.readings.size() ? own.readings : records[r].z) - own.beside);
    const Eigen::VectorXd stiffness = (m.k1 + 2 * m.k2 * own.main.cwiseAbs2().array()).matrix();
    BandedCholesky<Complex> whiten = w.whitener(stiffness, m.c);
    if (!whiten.factorize()) throw Error("score test: the noise covariance is singular");
    const auto whitened = [&](Eigen::MatrixXcd v) {
      whiten.solve_lower(v);
      return Eigen::MatrixXcd(v / std::sqrt(0.5 * s2));
    };
    const auto place = [&](Eigen::MatrixXd& into, const detail::WeakSystem& system) {
      const Eigen::MatrixXcd t = whitened(system.terms);
      for (Eigen::Index k = 0; k < n_tied; ++k) {
        const auto [column, imaginary] = shared[static_cast<std::size_t>(k)];
        into.col(k).segment(s.top, n) = detail::stack((imaginary ? Complex(0, 1) : Complex(1, 0)) * t.col(column));
      }
      const Eigen::Index first = n_shared + 4 * static_cast<Eigen::Index>(r);
      for (int k = 0; k < 4; ++k) {
        into.col(first + k).segment(s.top, n) =
            detail::stack((k % 2 == 1 ? Complex(0, 1) : Complex(1, 0)) * t.col(3 + k / 2));
      }
    };
    const detail::WeakSystem noisy = detail::weak_system(w, measured, s2, forcing);
    place(s.active, noisy);
    place(s.instruments, detail::weak_system(w, own.main, 0, forcing));
    Eigen::VectorXcd right = noisy.right;
    if (!options.forces.empty()) {
      right -= w.apply(0, options.forces[r](Eigen::seqN(Eigen::Index{0}, records[r].size(), Eigen::Index{2})));
    }
    s.right.segment(s.top, n) = detail::stack(whitened(right).col(0));
    // What a probe reads too much is an error of z; columns of motion known without noise serve on both sides.
    const Eigen::VectorXcd gain_error = Complex(0, 1) * own.main.imag(), angle_error = Complex(0, 1) * own.main.real();
    Eigen::Index simulated = n_tied;
    const auto simulated_column = [&](const Eigen::VectorXcd& column) {
      const Eigen::VectorXd v = detail::stack(whitened(column).col(0));
      s.active.col(simulated).segment(s.top, n) = v;
      s.instruments.col(simulated++).segment(s.top, n) = v;
    };
    for (const RotorTerm& term : active.terms) {
      simulated_column(w.apply(0, force_along(term, own, records[r].t0, records[r].dt)));
    }
    if (active.sensor_gain) simulated_column(w.rotor(gain_error, stiffness, m.c));
    if (active.sensor_angle) simulated_column(w.rotor(angle_error, stiffness, m.c));

    std::size_t next = 0;
    const auto candidate = [&](const std::string& term, bool in_model, const std::vector<Eigen::VectorXcd>& columns,
                               bool real = false) {
      const Eigen::Index each = real ? 1 : 2;  // real unknowns for a complex column
      const auto count = static_cast<Eigen::Index>(columns.size());
      if (r == 0) s.candidates.push_back({term, in_model, Eigen::MatrixXd::Zero(total, each * count)});
      Eigen::MatrixXd& c = s.candidates[next++].columns;
      for (Eigen::Index k = 0; k < count; ++k) {
        const Eigen::VectorXcd v = whitened(columns[static_cast<std::size_t>(k)]).col(0);
        c.col(each * k).segment(s.top, n) = detail::stack(v);
        if (!real) c.col(each * k + 1).segment(s.top, n) = detail::stack(Complex(0, 1) * v);
      }
    };
    const Eigen::VectorXcd& z = own.main;
    const Eigen::VectorXcd conj = z.conjugate();
    const Eigen::VectorXcd radius = z.cwiseAbs().cast<Complex>();
    if (!active.conj_stiffness) candidate("conj z", true, {w.apply(0, conj)});
    if (!active.conj_damping) candidate("conj z'", true, {w.apply(1, conj)});
    const Eigen::VectorXcd on_half_grid = half_grid_forcing(own.angle);
    for (std::size_t k = 0; k < options.modes.size(); ++k) {
      const ForcedMode& mode = options.modes[k];
      const Eigen::VectorXcd q =
          rotor::modal_response(mode.omega, mode.zeta, on_half_grid, records[r].dt, own.angle.omega[0]);
      candidate(fmt::format("mode {}", k + 1), true, {w.rotor(own.eps * q, stiffness, m.c)});
    }
    for (std::size_t k = 0; k < options.decays.size(); ++k) {
      const DecayingMode& mode = options.decays[k];
      const Complex pole(-mode.zeta * mode.omega, mode.omega * std::sqrt(1 - mode.zeta * mode.zeta));
      Eigen::VectorXcd plus(z.size());
      for (Eigen::Index i = 0; i < z.size(); ++i) plus[i] = std::exp(pole * (records[r].dt * static_cast<double>(i)));
      const Eigen::VectorXcd minus = plus.conjugate();
      candidate(fmt::format("decay {}", k + 1), true, {w.rotor(plus, stiffness, m.c), w.rotor(minus, stiffness, m.c)});
    }
    if (options.delay && !active.delay) {
      // d F / d delay: the forcing of an earlier angle.
      Eigen::VectorXcd late(z.size());
      for (Eigen::Index i = 0; i < z.size(); ++i) {
        const double speed = own.angle.omega[2 * i];
        late[i] = own.eps * (Complex(0, -speed) * forcing[i] -
                             std::polar(2 * speed * own.angle.alpha[2 * i], own.angle.beta[2 * i]));
      }
      candidate("delay", true, {w.apply(0, late)}, true);
    }
    for (int h = 1; h <= options.runout_harmonics; ++h) {
      if (h <= active.runout_harmonics) continue;
      Eigen::VectorXcd carrier(z.size());
      for (Eigen::Index i = 0; i < z.size(); ++i) carrier[i] = std::polar(1.0, h * own.angle.beta[2 * i]);
      candidate(fmt::format("runout {}", h), true,
                {w.rotor(carrier, stiffness, m.c), w.rotor(carrier.conjugate(), stiffness, m.c)});
    }
    for (const RotorTerm& term : options.terms) {
      if (has_term(active, term.kind)) continue;
      candidate(std::string(name_of(term.kind).label), true,
                {w.apply(0, force_along(term, own, records[r].t0, records[r].dt))}, true);
    }
    if (options.sensor && !active.sensor_gain)
      candidate("sensor gain", true, {w.rotor(gain_error, stiffness, m.c)}, true);
    if (options.sensor && !active.sensor_angle)
      candidate("sensor angle", true, {w.rotor(angle_error, stiffness, m.c)}, true);
    candidate("|z| z", false, {w.apply(0, radius.cwiseProduct(z))}, true);
    candidate("|z|^2 conj z", false, {w.apply(0, z.cwiseAbs2().cast<Complex>().cwiseProduct(conj))});
    candidate("conj(z)^3", false, {w.apply(0, conj.cwiseProduct(conj).cwiseProduct(conj))});
    candidate("z^2", false, {w.apply(0, z.cwiseProduct(z))});
    candidate("conj(z)^2", false, {w.apply(0, conj.cwiseProduct(conj))});
    candidate("|z|^2", false, {w.apply(0, z.cwiseAbs2().cast<Complex>())});
    s.top += n;
  }

  const Eigen::VectorXd scale = s.active.colwise().norm().cwiseMax(1e-300);
  const Eigen::MatrixXd a = s.active * scale.cwiseInverse().asDiagonal();
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(a);
  const double freedom = static_cast<double>(total - unknowns);
  ScoreTest test;
  test.chi_square = (s.right - a * qr.solve(s.right)).squaredNorm() / freedom;
  const Eigen::MatrixXd upper = qr.matrixQR().topRows(unknowns).triangularView<Eigen::Upper>();
  const Eigen::VectorXd singular = upper.jacobiSvd().singularValues();
  test.condition_number = singular[0] / singular[unknowns - 1];

  const Eigen::MatrixXd z = s.instruments * scale.cwiseInverse().asDiagonal();
  const Eigen::VectorXd w = (z.transpose() * a).colPivHouseholderQr().solve(z.transpose() * s.right);
  const Eigen::VectorXd residual = s.right - a * w;
  const double variance = residual.squaredNorm() / freedom;
  const Eigen::HouseholderQR<Eigen::MatrixXd> projector(z);
  const Eigen::MatrixXd thin = projector.householderQ() * Eigen::MatrixXd::Identity(total, unknowns);
  for (const Candidate& c : s.candidates) {
    const detail::Evidence e = detail::evidence(detail::remainder(thin, c.columns, residual), variance);
    if (!(e.score > 0)) continue;
    ScoreCandidate candidate{c.term, e.score, c.in_model};
    if (c.columns.cols() == 1) {
      candidate.value = e.coefficient[0];
      candidate.sd = e.sd;
      const Eigen::VectorXd stands_for = projector.solve(c.columns.col(0)).cwiseQuotient(scale);
      candidate.moves = moves_of(stands_for, n_shared, records.size());
    }
    test.candidates.push_back(std::move(candidate));
  }
  std::sort(test.candidates.begin(), test.candidates.end(),
            [](const ScoreCandidate& p, const ScoreCandidate& q) { return p.score > q.score; });
  return test;
}

}  // namespace whirl::identification
