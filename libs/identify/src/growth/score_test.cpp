#include "whirl/identify/score_test.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>

#include "growth/rotor_candidates.hpp"
#include "growth/score.hpp"
#include "output_error/rotor/output_error_parameters.hpp"
#include "output_error/rotor/reading_shift.hpp"
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
                                   own.angle.beta[2 * i], t0 + dt * static_cast<double>(i));
    force[i] = {f.x, f.y};
  }
  return force;
}

/// Springs about the simulated motion: an error n of z is taken for the force stiffness n + turned conj n.
struct Linearised {
  Eigen::VectorXd stiffness;
  Eigen::VectorXcd turned;
};

Linearised linearised(const OutputErrorFit& fit, const OutputErrorRecord& own, const RotorRecord& record) {
  const RotorModel& m = fit.model;
  Linearised l{(m.k1 + own.k1_change + 2 * m.k2 * own.main.cwiseAbs2().array()).matrix(),
               (m.k2 * own.main.array().square() + m.k1_conj).matrix()};
  for (const RotorTerm& term : fit.terms) {
    for (Eigen::Index i = 0; i < own.main.size(); ++i) {
      const Complex z = own.main[i], v = own.main_rate[i];
      const TermForce f = term_force(term, z.real(), z.imag(), v.real(), v.imag(), own.angle.omega[2 * i],
                                     own.angle.beta[2 * i], record.t0 + record.dt * static_cast<double>(i));
      l.stiffness[i] -= 0.5 * term.value * (f.x_x + f.y_y);
      l.turned[i] -= 0.5 * term.value * Complex(f.x_x - f.y_y, f.y_x + f.x_y);
    }
  }
  return l;
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
  Eigen::Index shared = 0;  ///< columns that all records share; four of its own follow for each record
};

/// What the model has already, as columns of WeakSystem::terms and whether times i.
std::vector<std::pair<int, bool>> tied_columns(const OutputErrorOptions& active) {
  std::vector<std::pair<int, bool>> tied = {{0, false}, {1, false}, {2, false}};
  if (active.conj_stiffness) tied.insert(tied.end(), {{5, false}, {5, true}});
  if (active.conj_damping) tied.insert(tied.end(), {{6, false}, {6, true}});
  return tied;
}

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

/// Adds the whitened rows of one record.
class RecordRows {
 public:
  RecordRows(Stacked& into, const RotorRecord& record, std::size_t number, const OutputErrorFit& fit,
             const OutputErrorOptions& active, const ScoreTestOptions& options, const detail::WeakRows& rows,
             bool both_axes)
      : both_(both_axes),
        s_(into),
        record_(record),
        number_(number),
        fit_(fit),
        active_(active),
        options_(options),
        w_(rows),
        own_(fit.records[number]),
        carrier_(rows.carrier()),
        forcing_(rows.forcing()),
        gain_error_(Complex(0, 1) * own_.main.imag()),
        angle_error_(Complex(0, 1) * own_.main.real()),
        skew_error_(Complex(0, 1) * detail::later_rate(own_.main.imag(), 0) / record.dt),
        coupled_error_(record.dt * detail::high_passed_rate(own_.main, detail::high_pass_of(fit.sensor, record.dt))),
        curve_error_(detail::cubes(own_.main)),
        linear_(linearised(fit, own_, record)),
        whiten_(rows.whitener(linear_.stiffness, linear_.turned.cwiseAbs(), fit.model.c + own_.c_change)) {
    if (!whiten_.factorize()) throw Error("score test: the noise covariance is singular");
  }

  void add() {
    active();
    linear_candidates();
    force_candidates();
    nonlinear_candidates();
    s_.top += rows();
  }

 private:
  Eigen::Index rows() const { return 2 * w_.size(); }
  Eigen::VectorXcd own_rows(const Eigen::VectorXcd& error) const {
    return w_.rotor(error, linear_.stiffness, fit_.model.c) +
           w_.apply(0, linear_.turned.cwiseProduct(error.conjugate()));
  }
  /// Whatever the motion is: w^2 e^{2 i beta}, w^2 e^{-2 i beta} and i times these (rotor_terms.hpp).
  Eigen::VectorXcd twice_rows(RotorTermKind kind) const {
    const bool backward = kind >= RotorTermKind::twice_backward_re;
    const bool turned = kind == RotorTermKind::twice_forward_im || kind == RotorTermKind::twice_backward_im;
    Eigen::VectorXcd force = carrier_.cwiseProduct(carrier_);
    if (backward) force = force.conjugate().eval();
    for (Eigen::Index i = 0; i < force.size(); ++i) force[i] *= own_.angle.omega[2 * i] * own_.angle.omega[2 * i];
    return (turned ? Complex(0, 1) : Complex(1, 0)) * w_.apply(0, force);
  }
  Eigen::VectorXcd force_rows(RotorTerm term) const {
    if (is_twice(term.kind)) return twice_rows(term.kind);
    return w_.apply(0, force_along(term, own_, record_.t0, record_.dt));
  }
  Eigen::MatrixXcd whitened(Eigen::MatrixXcd v) const {
    whiten_.solve_lower(v);
    return v / std::sqrt(0.5 * record_.noise_variance());
  }

  void place(Eigen::MatrixXd& into, const detail::WeakSystem& system) const {
    const std::vector<std::pair<int, bool>> tied = tied_columns(active_);
    const Eigen::MatrixXcd t = whitened(system.terms);
    for (std::size_t k = 0; k < tied.size(); ++k) {
      const auto [column, imaginary] = tied[k];
      into.col(static_cast<Eigen::Index>(k)).segment(s_.top, rows()) =
          detail::stack((imaginary ? Complex(0, 1) : Complex(1, 0)) * t.col(column));
    }
    const Eigen::Index first = s_.shared + 4 * static_cast<Eigen::Index>(number_);
    for (int k = 0; k < 4; ++k) {
      into.col(first + k).segment(s_.top, rows()) =
          detail::stack((k % 2 == 1 ? Complex(0, 1) : Complex(1, 0)) * t.col(3 + k / 2));
    }
  }

  void active() {
    const Eigen::VectorXcd measured = detail::unread_by(
        fit_.sensor, (own_.readings.size() ? own_.readings : record_.z) - own_.beside, own_.main, record_.dt);
    const detail::WeakSystem noisy = detail::weak_system(w_, measured, record_.noise_variance(), forcing_);
    place(s_.active, noisy);
    place(s_.instruments, detail::weak_system(w_, own_.main, 0, forcing_));
    Eigen::VectorXcd right = noisy.right;
    if (!options_.forces.empty()) {
      right -= w_.apply(0, options_.forces[number_](Eigen::seqN(Eigen::Index{0}, record_.size(), Eigen::Index{2})));
    }
    s_.right.segment(s_.top, rows()) = detail::stack(whitened(right).col(0));
    // What a probe reads too much is an error of z; columns of motion known without noise serve on both sides.
    auto simulated = static_cast<Eigen::Index>(tied_columns(active_).size());
    const auto simulated_column = [&](const Eigen::VectorXcd& column) {
      const Eigen::VectorXd v = detail::stack(whitened(column).col(0));
      s_.active.col(simulated).segment(s_.top, rows()) = v;
      s_.instruments.col(simulated++).segment(s_.top, rows()) = v;
    };
    for (std::size_t r = 1; r < fit_.records.size(); ++r) {
      const auto of_record = [&](const Eigen::VectorXcd& motion) {
        r == number_ ? simulated_column(w_.apply(0, motion)) : static_cast<void>(++simulated);
      };
      if (!active_.record_k1.empty()) of_record(own_.main);
      if (!active_.record_c.empty()) of_record(own_.main_rate);
    }
    for (const RotorTerm& term : active_.terms) simulated_column(force_rows(term));
    if (active_.sensor_gain) simulated_column(own_rows(gain_error_));
    if (active_.sensor_angle) simulated_column(own_rows(angle_error_));
    if (active_.sensor_skew) simulated_column(own_rows(skew_error_));
    if (active_.sensor_high_pass) simulated_column(own_rows(coupled_error_));
    if (active_.sensor_high_pass_square) simulated_column(own_rows(coupled_twice()));
    if (active_.sensor_cubic) simulated_column(own_rows(curve_error_));
  }

  void candidate(const std::string& term, bool in_model, const std::vector<Eigen::VectorXcd>& columns,
                 bool real = false) {
    const Eigen::Index each = real ? 1 : 2;  // real unknowns for a complex column
    const auto count = static_cast<Eigen::Index>(columns.size());
    if (number_ == 0) s_.candidates.push_back({term, in_model, Eigen::MatrixXd::Zero(s_.right.size(), each * count)});
    Eigen::MatrixXd& c = s_.candidates[next_++].columns;
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::VectorXcd v = whitened(columns[static_cast<std::size_t>(k)]).col(0);
      c.col(each * k).segment(s_.top, rows()) = detail::stack(v);
      if (!real) c.col(each * k + 1).segment(s_.top, rows()) = detail::stack(Complex(0, 1) * v);
    }
  }

  /// Readings that turn forward, and where both axes are measured backward.
  void candidate_pair(const std::string& term, const Eigen::VectorXcd& forward) {
    if (both_) {
      candidate(term, true, {own_rows(forward), own_rows(forward.conjugate())});
    } else {
      candidate(term, true, {own_rows(forward)});
    }
  }

  /// Anisotropy, further modes, decays, delay and runout.
  void linear_candidates() {
    const Eigen::VectorXcd conj = own_.main.conjugate();
    if (both_ && !active_.conj_stiffness) candidate("conj z", true, {w_.apply(0, conj)});
    if (both_ && !active_.conj_damping) candidate("conj z'", true, {w_.apply(1, conj)});
    const Eigen::VectorXcd on_half_grid = options_.modes.empty() ? Eigen::VectorXcd() : half_grid_forcing(own_.angle);
    for (std::size_t k = 0; k < options_.modes.size(); ++k) {
      const ForcedMode& mode = options_.modes[k];
      const Eigen::VectorXcd q =
          rotor::modal_response(mode.omega, mode.zeta, on_half_grid, record_.dt, own_.angle.omega[0]);
      candidate(fmt::format("mode {}", k + 1), true, {own_rows(own_.eps * q)});
    }
    for (std::size_t k = 0; k < options_.decays.size(); ++k) {
      const DecayingMode& mode = options_.decays[k];
      const Complex pole(-mode.zeta * mode.omega, mode.omega * std::sqrt(1 - mode.zeta * mode.zeta));
      const Eigen::VectorXcd plus =
          along([&](Eigen::Index i) { return std::exp(pole * (record_.dt * static_cast<double>(i))); });
      candidate_pair(fmt::format("decay {}", k + 1), plus);
    }
    if (options_.delay && !active_.delay) {
      // d F / d delay: the forcing of an earlier angle.
      const Eigen::VectorXcd late = along([&](Eigen::Index i) {
        const double speed = own_.angle.omega[2 * i];
        return own_.eps * (Complex(0, -speed) * forcing_[i] - 2 * speed * own_.angle.alpha[2 * i] * carrier_[i]);
      });
      candidate("delay", true, {w_.apply(0, late)}, true);
    }
    Eigen::VectorXcd harmonic = carrier_;
    for (int h = 1; h <= options_.runout_harmonics; ++h) {
      if (h > active_.runout_harmonics) candidate_pair(fmt::format("runout {}", h), harmonic);
      harmonic = harmonic.cwiseProduct(carrier_).eval();
    }
  }

  void force_candidates() {
    for (auto term = options_.terms.begin(); term != options_.terms.end();) {
      const RotorTermKind kind = term->kind;
      std::vector<Eigen::VectorXcd> columns;
      for (; term != options_.terms.end() && name_of(term->kind).label == name_of(kind).label; ++term)
        if (!has_term(active_, kind)) columns.push_back(force_rows(*term));
      if (!columns.empty()) candidate(std::string(name_of(kind).label), true, columns, true);
    }
    if (both_ && options_.sensor && !active_.sensor_gain) candidate("sensor gain", true, {own_rows(gain_error_)}, true);
    if (both_ && options_.sensor && !active_.sensor_angle)
      candidate("sensor angle", true, {own_rows(angle_error_)}, true);
    if (both_ && options_.sensor && !active_.sensor_skew)
      candidate("sampling skew", true, {own_rows(skew_error_)}, true);
    if (options_.sensor && !active_.sensor_high_pass)
      candidate(detail::kFirstHighPass, true, {own_rows(coupled_error_)}, true);
    if (active_.sensor_high_pass && !active_.sensor_high_pass_square)
      candidate(detail::kSecondHighPass, true, {own_rows(coupled_twice())}, true);
    if (options_.sensor && !active_.sensor_cubic) candidate("probe curve", true, {own_rows(curve_error_)}, true);
  }

  /// Terms that no model here holds: they name what is missing.
  void nonlinear_candidates() {
    const Eigen::VectorXcd& z = own_.main;
    const Eigen::VectorXcd conj = z.conjugate();
    const Eigen::VectorXcd radius = z.cwiseAbs().cast<Complex>(), square = z.cwiseAbs2().cast<Complex>();
    candidate("|z| z", false, {w_.apply(0, radius.cwiseProduct(z))}, true);
    if (both_) {
      candidate("|z|^2 conj z", false, {w_.apply(0, square.cwiseProduct(conj))});
      candidate("conj(z)^3", false, {w_.apply(0, conj.cwiseProduct(conj).cwiseProduct(conj))});
    }
    candidate("z^2", false, {w_.apply(0, z.cwiseProduct(z))});
    candidate("conj(z)^2", false, {w_.apply(0, conj.cwiseProduct(conj))});
    candidate("|z|^2", false, {w_.apply(0, square)});
  }

  Eigen::VectorXcd coupled_twice() const {
    return record_.dt * record_.dt *
           detail::high_passed_rate(own_.main, detail::high_pass_of(fit_.sensor, record_.dt), true);
  }

  template <class F>
  Eigen::VectorXcd along(F value) const {
    Eigen::VectorXcd v(own_.main.size());
    for (Eigen::Index i = 0; i < v.size(); ++i) v[i] = value(i);
    return v;
  }

  bool both_;  ///< some record shows both axes
  Stacked& s_;
  const RotorRecord& record_;
  std::size_t number_;
  const OutputErrorFit& fit_;
  const OutputErrorOptions& active_;
  const ScoreTestOptions& options_;
  const detail::WeakRows& w_;
  const OutputErrorRecord& own_;
  Eigen::VectorXcd carrier_, forcing_;  ///< e^{i beta}, F
  Eigen::VectorXcd gain_error_, angle_error_, skew_error_, coupled_error_, curve_error_;
  Linearised linear_;
  BandedCholesky<Complex> whiten_;
  std::size_t next_ = 0;
};

/// Instrumental variables: the score of each candidate beside the active columns.
ScoreTest score(const Stacked& s, std::size_t records) {
  const Eigen::Index total = s.right.size(), unknowns = s.active.cols();
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
      candidate.moves = moves_of(stands_for, s.shared, records);
    }
    test.candidates.push_back(std::move(candidate));
  }
  std::sort(test.candidates.begin(), test.candidates.end(),
            [](const ScoreCandidate& p, const ScoreCandidate& q) { return p.score > q.score; });
  return test;
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
  Stacked s;
  s.shared = static_cast<Eigen::Index>(tied_columns(active).size() + active.terms.size()) + active.sensor_gain +
             active.sensor_angle + active.sensor_skew + active.sensor_high_pass + active.sensor_high_pass_square +
             active.sensor_cubic +
             static_cast<Eigen::Index>((records.size() - 1) * (!active.record_k1.empty() + !active.record_c.empty()));
  s.active = Eigen::MatrixXd::Zero(total, s.shared + 4 * static_cast<Eigen::Index>(records.size()));
  s.instruments = s.active;
  s.right.resize(total);
  const bool both_axes = !std::ranges::all_of(records, &RotorRecord::one_axis);
  for (std::size_t r = 0; r < records.size(); ++r) {
    RecordRows(s, records[r], r, fit, active, options, rows[r], both_axes).add();
  }
  return score(s, records.size());
}

}  // namespace whirl::identification
