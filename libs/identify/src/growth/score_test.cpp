#include "whirl/identify/score_test.hpp"

#include <Eigen/QR>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

#include "output_error/score.hpp"
#include "terms/score_point.hpp"
#include "whirl/core/error.hpp"

namespace whirl::identification {
namespace {

using detail::Complex;

struct Candidate {
  detail::TermId term;
  Eigen::MatrixXd columns;
};

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
  RecordRows(Stacked& into, const detail::ScorePoint& at, std::size_t number)
      : s_(into),
        at_(at),
        number_(number),
        whiten_(
            at.rows.whitener(at.springs.stiffness, at.springs.turned.cwiseAbs(), at.fit.model.c + at.own.c_change)) {
    if (!whiten_.factorize()) throw Error("score test: the noise covariance is singular");
  }

  void add() {
    active();
    for (const TermEntry* entry : term_catalogue()) {
      if (entry->both_axes && !at_.both) continue;
      for (const detail::ScoreColumns& c : candidates(*entry)) candidate({entry, c.place}, c.columns, c.real);
    }
    s_.top += rows();
  }

 private:
  Eigen::Index rows() const { return 2 * at_.rows.size(); }
  Eigen::VectorXcd force_rows(const RotorTerm& term) const {
    Eigen::VectorXcd force(at_.own.main.size());
    for (Eigen::Index i = 0; i < force.size(); ++i) {
      const TermForce f = term_force(term, at_.state(i));
      force[i] = {f.x, f.y};
    }
    return at_.force(force);
  }
  /// What a probe reads too much by the error is an error of z.
  Eigen::VectorXcd probe_rows(const TermEntry& entry) const {
    SensorAxes sound;
    sound.high_pass = at_.fit.sensor.high_pass, sound.high_pass_square = at_.fit.sensor.high_pass_square;
    sound.drift_start = at_.fit.sensor.drift_start;
    return at_.error(entry.reading({sound, at_.own.main, at_.own.main, 0, 0, at_.record.dt, at_.record.t0}));
  }
  /// What the model does not have of an entry.
  std::vector<detail::ScoreColumns> candidates(const TermEntry& entry) const {
    if (entry.columns != nullptr) return entry.columns(at_);
    const OutputErrorOptions& active = at_.active;
    if (entry.sensor != nullptr) {
      const bool open = entry.after != nullptr ? active.estimates(entry.after()) : at_.options.sensor;
      if (!open || active.estimates(entry)) return {};
      return {{0, {probe_rows(entry)}, true}};
    }
    if (std::ranges::any_of(active.terms, [&](const RotorTerm& t) { return t.is(entry); })) return {};
    if (entry.by_reference == nullptr) return force_columns(entry, 0, std::nullopt);
    std::vector<detail::ScoreColumns> of_instants;
    for (std::size_t k = 0; k < at_.options.instants.size(); ++k)
      for (const detail::ScoreColumns& c : force_columns(entry, static_cast<int>(k) + 1, at_.options.instants[k]))
        of_instants.push_back(c);
    return of_instants;
  }
  /// Of the candidate forces that are parts of the entry; `instant`: their reference.
  std::vector<detail::ScoreColumns> force_columns(const TermEntry& entry, int place_of,
                                                  std::optional<double> instant) const {
    detail::ScoreColumns all{.place = place_of, .real = true};
    for (RotorTerm term : at_.options.terms) {
      if (!term.is(entry)) continue;
      term.reference = instant.value_or(term.reference);
      all.columns.push_back(force_rows(term));
    }
    if (all.columns.empty()) return {};
    return {all};
  }
  Eigen::MatrixXcd whitened(Eigen::MatrixXcd v) const {
    whiten_.solve_lower(v);
    return v / std::sqrt(0.5 * at_.record.noise_variance());
  }

  void place(Eigen::MatrixXd& into, const detail::WeakSystem& system) const {
    const std::vector<std::pair<int, bool>> tied = tied_columns(at_.active);
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
    const auto& [fit, own, record] = std::tie(at_.fit, at_.own, at_.record);
    const Eigen::VectorXcd measured = detail::unread_by(
        fit.sensor, (own.readings.size() ? own.readings : record.z) - own.beside, own.main, {record.t0, record.dt});
    const detail::WeakSystem noisy = detail::weak_system(at_.rows, measured, record.noise_variance(), at_.forcing);
    place(s_.active, noisy);
    place(s_.instruments, detail::weak_system(at_.rows, own.main, 0, at_.forcing));
    Eigen::VectorXcd right = noisy.right;
    if (const auto& known = at_.options.forces; !known.empty())
      right -= at_.force(known[number_](Eigen::seqN(Eigen::Index{0}, record.size(), Eigen::Index{2})));
    s_.right.segment(s_.top, rows()) = detail::stack(whitened(right).col(0));
    // Columns of motion known without noise serve on both sides.
    auto simulated = static_cast<Eigen::Index>(tied_columns(at_.active).size());
    const auto simulated_column = [&](const Eigen::VectorXcd& column) {
      const Eigen::VectorXd v = detail::stack(whitened(column).col(0));
      s_.active.col(simulated).segment(s_.top, rows()) = v;
      s_.instruments.col(simulated++).segment(s_.top, rows()) = v;
    };
    for (std::size_t r = 1; r < fit.records.size(); ++r) {
      const auto of_record = [&](const Eigen::VectorXcd& motion) {
        r == number_ ? simulated_column(at_.force(motion)) : static_cast<void>(++simulated);
      };
      if (!at_.active.changes.k1.empty()) of_record(own.main);
      if (!at_.active.changes.c.empty()) of_record(own.main_rate);
    }
    for (const RotorTerm& term : at_.active.terms) simulated_column(force_rows(term));
    for (const TermEntry* entry : term_catalogue())
      if (at_.active.estimates(*entry)) simulated_column(probe_rows(*entry));
  }

  void candidate(const detail::TermId& term, const std::vector<Eigen::VectorXcd>& columns, bool real) {
    const Eigen::Index each = real ? 1 : 2;  // real unknowns for a complex column
    const auto count = static_cast<Eigen::Index>(columns.size());
    if (number_ == 0) s_.candidates.push_back({term, Eigen::MatrixXd::Zero(s_.right.size(), each * count)});
    Eigen::MatrixXd& c = s_.candidates[next_++].columns;
    for (Eigen::Index k = 0; k < count; ++k) {
      const Eigen::VectorXcd v = whitened(columns[static_cast<std::size_t>(k)]).col(0);
      c.col(each * k).segment(s_.top, rows()) = detail::stack(v);
      if (!real) c.col(each * k + 1).segment(s_.top, rows()) = detail::stack(Complex(0, 1) * v);
    }
  }

  Stacked& s_;
  const detail::ScorePoint& at_;
  std::size_t number_;
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
    ScoreCandidate candidate{c.term.entry, c.term.place, e.score};
    candidate.coefficient = e.coefficient;
    if (c.columns.cols() == 1) {
      candidate.value = e.coefficient[0];
      candidate.sd = e.sd;
    }
    candidate.moves = moves_of(projector.solve(c.columns * e.coefficient).cwiseQuotient(scale), s.shared, records);
    test.candidates.push_back(std::move(candidate));
  }
  std::sort(test.candidates.begin(), test.candidates.end(),
            [](const ScoreCandidate& p, const ScoreCandidate& q) { return p.score > q.score; });
  return test;
}

}  // namespace

const ScoreCandidate* ScoreTest::find(const TermEntry& term) const {
  const auto at = std::find_if(candidates.begin(), candidates.end(), [&](const auto& c) { return c.term == &term; });
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
  s.shared =
      static_cast<Eigen::Index>(tied_columns(active).size() + active.terms.size() + active.probes.errors.size()) +
      static_cast<Eigen::Index>((records.size() - 1) * (!active.changes.k1.empty() + !active.changes.c.empty()));
  s.active = Eigen::MatrixXd::Zero(total, s.shared + 4 * static_cast<Eigen::Index>(records.size()));
  s.instruments = s.active;
  s.right.resize(total);
  const bool both_axes = !std::ranges::all_of(records, &RotorRecord::one_axis);
  for (std::size_t r = 0; r < records.size(); ++r) {
    const detail::ScorePoint at(records[r], rows[r], fit, r, active, options, both_axes);
    RecordRows(s, at, r).add();
  }
  return score(s, records.size());
}

}  // namespace whirl::identification
