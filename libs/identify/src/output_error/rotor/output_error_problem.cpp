#include "output_error/rotor/output_error_problem.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <tuple>

#include "output_error/rotor/reading_shift.hpp"
#include "problem/one_axis.hpp"
#include "whirl/core/gram.hpp"

namespace whirl::identification::detail {
namespace {

/// Derivative of the readings by a parameter that enters them beside the motion.
const Eigen::VectorXcd& beside(const Signals& s, const Parameter& q, const Eigen::VectorXcd& ones) {
  const auto k = static_cast<std::size_t>(q.index);
  switch (q.kind) {
    case Kind::participation:
      return s.modal[k];
    case Kind::pole_w:
      return s.modal_w[k];
    case Kind::pole_zeta:
      return s.modal_zeta[k];
    case Kind::decay_w:
      return s.decay_w[k];
    case Kind::decay_zeta:
      return s.decay_zeta[k];
    case Kind::decay:
      return s.decay[k];
    case Kind::runout:
      return s.runout[k];
    default:
      return ones;
  }
}

/// The rotor as this record has it.
RotorModel model_of(const Point& p, const OutputErrorRecord& record) {
  RotorModel m = p.model;
  m.k1 += record.k1_change;
  m.c += record.c_change;
  return m;
}

/// Place and velocity at sample 0 of a motion of at least the frequency w: a cubic over a third of a period.
std::pair<Complex, Complex> start_of_curve(const Eigen::VectorXcd& z, double dt, double w) {
  constexpr double kShare = 1.0 / 3;
  constexpr Eigen::Index kLeast = 8;
  double turned = 0;
  for (Eigen::Index i = 1; i < z.size(); ++i) turned += std::arg(z[i] * std::conj(z[i - 1]));
  w = std::max(w, std::abs(turned) / (dt * static_cast<double>(z.size() - 1)));
  const auto third = static_cast<Eigen::Index>(kShare * 2 * std::numbers::pi / (w * dt));
  const Eigen::Index n = std::clamp(third, std::min(kLeast, z.size()), z.size());
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(n, 0, 1);
  Eigen::MatrixXd base(n, 4);
  base << Eigen::VectorXd::Ones(n), t.matrix(), t.square().matrix(), t.cube().matrix();
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(base);
  const Eigen::Vector4d x = qr.solve(z.head(n).real()), y = qr.solve(z.head(n).imag());
  return {Complex(x[0], y[0]), Complex(x[1], y[1]) / (dt * static_cast<double>(n - 1))};
}

}  // namespace

void OutputErrorProblem::expect_unseen_starts() {
  for (std::size_t j = 0; j < parameters_.size(); ++j) {
    const Parameter& q = parameters_[j];
    if (q.kind != Kind::lane || q.record < 0) continue;
    const RotorRecord& m = measured_[static_cast<std::size_t>(q.record)];
    const bool place = q.index == (m.axes == Axes::x ? kY0 : kX0), rate = q.index == (m.axes == Axes::x ? kVy0 : kVx0);
    if (!m.one_axis() || (!place && !rate)) continue;
    const UnseenStart s = unseen_start(m);
    expected_.push_back({static_cast<Eigen::Index>(j), place ? s.place : s.rate, place ? s.place_sd : s.rate_sd});
  }
}

void OutputErrorProblem::linearise(Point& p, SquareSum& sum) {
  refresh_all(p);
  sum.cost = 0;
  sum.normal.setZero(size(), size());
  sum.gradient.setZero(size());
  for (std::size_t r = 0; r < measured_.size(); ++r) {
    OutputErrorRecord& record = p.records[r];
    main_mode_sensitivities(model_of(p, record), record.eps, signals_[r].forcing, signals_[r].profile,
                            forces(p, r, signals_[r]), grid(r), record.z0, record.dz0, motion_);
    if (!motion_.finite) {
      sum.cost = INFINITY;
      return;
    }
    if (measured_[r].derivative() > 0) record.main_read = motion_.motion.read(measured_[r].derivative());
    record.main.swap(motion_.motion.z);
    record.main_rate.swap(motion_.motion.v);
    const Eigen::VectorXd left = residual(p, r, record);
    std::vector<Eigen::Index> unknowns;
    for (Eigen::Index j = 0; j < size(); ++j) {
      const int owner = parameters_[static_cast<std::size_t>(j)].record;
      if (owner < 0 || owner == static_cast<int>(r)) unknowns.push_back(j);
    }
    jacobian(p, r, unknowns);
    SquareSum run{left.squaredNorm(), Eigen::MatrixXd::Zero(slopes_.cols(), slopes_.cols()),
                  slopes_.transpose() * left};
    add_gram(slopes_, run.normal);
    add_run(run, unknowns, sum);
    if (!std::isfinite(sum.cost)) return;
  }
  for (const Expected& e : expected_) {
    const double off = (e.value - value(p, parameters_[static_cast<std::size_t>(e.parameter)])) / e.sd;
    sum.cost += off * off;
    sum.normal(e.parameter, e.parameter) += 1 / (e.sd * e.sd);
    sum.gradient[e.parameter] += off / e.sd;
  }
}

void OutputErrorProblem::last(Point& p, SquareSum& sum) {
  refresh_all(p);
  sum.cost = 0;
  for (std::size_t r = 0; r < measured_.size(); ++r) {
    OutputErrorRecord& record = p.records[r];
    MainMotion motion = main_mode(model_of(p, record), record.eps, signals_[r].forcing, forces(p, r, signals_[r]),
                                  grid(r), record.z0, record.dz0);
    if (measured_[r].derivative() > 0) record.main_read = motion.read(measured_[r].derivative());
    record.main = std::move(motion.z);
    record.main_rate = std::move(motion.v);
    sum.cost += residual(p, r, record).squaredNorm();
  }
  for (const Expected& e : expected_) {
    const double off = (e.value - value(p, parameters_[static_cast<std::size_t>(e.parameter)])) / e.sd;
    sum.cost += off * off;
  }
}

int OutputErrorProblem::substeps_needed(Point p, double chi_square) const {
  constexpr double kShare = 0.25;
  constexpr int kMost = 16;
  OutputErrorOptions options = options_;
  options.solver.substeps = 2;
  double squares = 0, values = 0;
  for (std::size_t r = 0; r < measured_.size(); ++r) {
    const OutputErrorRecord& record = p.records[r];
    const Eigen::VectorXcd single = record.as_read();
    Signals s;
    refresh(p, r, measured_[r], options, known_force(r), s);
    const MainMotion twice =
        main_mode(model_of(p, record), record.eps, s.forcing, forces(p, r, s),
                  {measured_[r].dt, options.solver.substeps, measured_[r].derivative()}, record.z0, record.dz0);
    values += measured_[r].readings();
    squares += (single - twice.read(measured_[r].derivative())).squaredNorm() / (0.5 * measured_[r].noise_variance());
  }
  if (!std::isfinite(squares)) return 1;
  // Where the model leaves more than the noise, its intervals are as much wider; the error of these steps is no such.
  squares /= std::max(1.0, chi_square - 2 * squares / values);
  // The error of RK4 falls with the fourth power of the step.
  return std::clamp(static_cast<int>(std::ceil(std::sqrt(std::sqrt(std::sqrt(squares) / kShare)))), 1, kMost);
}

Point OutputErrorProblem::moved(const Point& p, const Eigen::VectorXd& step) const {
  Point next = p;
  for (Eigen::Index j = 0; j < size(); ++j) move(next, parameters_[static_cast<std::size_t>(j)], step[j]);
  return next;
}

/// Whitened residual of a record whose motion is simulated; also what is beside it, readings filled in, and errors.
Eigen::VectorXd OutputErrorProblem::residual(const Point& p, std::size_t r, OutputErrorRecord& record) {
  const RotorRecord& m = measured_[r];
  const Signals& s = signals_[r];
  record.beside = Eigen::VectorXcd::Constant(m.size(), record.offset);
  for (std::size_t k = 0; k < s.modal.size(); ++k) record.beside += record.participation[k] * s.modal[k];
  for (std::size_t k = 0; k < s.decay.size(); ++k) record.beside += record.decay[k] * s.decay[k];
  for (std::size_t k = 0; k < s.runout.size(); ++k) record.beside += record.runout[k] * s.runout[k];
  const Eigen::Index n = m.size();
  const HighPass corner = high_pass_of(p.sensor, m.dt);
  if (record.charge != 0.0) record.beside += record.charge * discharge(n, corner);
  if (record.charge_rate != 0.0) record.beside += record.charge_rate * discharge(n, corner, true);
  Eigen::VectorXd residual(2 * n);
  const Eigen::VectorXcd model = read_by(p.sensor, record.as_read(), {m.t0, m.dt}) + record.beside, error = m.z - model;
  residual.head(n) = error.real();
  residual.tail(n) = error.imag();
  const ResidualFilter& filter = filters_[r];
  if (filter.has_beside()) {
    const Eigen::VectorXcd more = filter.beside(residual);
    residual.head(n) -= more.real();
    residual.tail(n) -= more.imag();
    record.beside += more;
  }
  if (filter.masks()) {
    // Of one axis a forward whirl shows half: its residual counts twice beside the simulated other one.
    const double twice = m.one_axis() ? 2 : 1;
    record.readings = m.z;
    record.readings.real().array() -= (1 - twice * filter.used_x()) * residual.head(n).array();
    record.readings.imag().array() -= (1 - twice * filter.used_y()) * residual.tail(n).array();
    residual.head(n).array() *= filter.used_x();
    residual.tail(n).array() *= filter.used_y();
  }
  const double used_x = filter.masks() ? filter.used_x().sum() : static_cast<double>(n);
  const double used_y = filter.masks() ? filter.used_y().sum() : static_cast<double>(n);
  record.rmse_x = std::sqrt(residual.head(n).squaredNorm() / std::max(used_x, 1.0));
  record.rmse_y = std::sqrt(residual.tail(n).squaredNorm() / std::max(used_y, 1.0));
  if (filter.censors()) likelihood_slope_ = filter.censor(m, model, residual);
  filter.apply(residual);
  return residual;
}

void OutputErrorProblem::start_state(Point& p) {
  constexpr double kFar = 4;  // of what turns with the angle, times the noise
  refresh_all(p);
  for (std::size_t r = 0; r < measured_.size(); ++r) {
    OutputErrorRecord& record = p.records[r];
    if (measured_[r].derivative() > 0) {
      const RotorModel m = model_of(p, record);
      const double w = record.angle.omega[0];
      record.z0 = record.eps * signals_[r].forcing[0] / Complex(m.k1 - w * w, m.c * w);
      record.dz0 = Complex(0, w) * record.z0;
      continue;
    }
    const Eigen::Index n = std::min<Eigen::Index>(100, measured_[r].size());
    const Eigen::VectorXd beta = record.angle.beta(Eigen::seqN(Eigen::Index{0}, n, Eigen::Index{2}));
    Eigen::VectorXcd z = (measured_[r].z.head(n).array() - record.offset).matrix();
    for (std::size_t k = 0; k < signals_[r].modal.size(); ++k) {
      z -= record.participation[k] * signals_[r].modal[k].head(n);
    }
    if (std::abs(beta[n - 1] - beta[0]) < 2.0) {
      record.z0 = z.head(std::min<Eigen::Index>(20, n)).mean();
      record.dz0 = 0;
      continue;
    }
    Eigen::MatrixXd base(n, 3);
    base << Eigen::VectorXd::Ones(n), beta.array().cos().matrix(), beta.array().sin().matrix();
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(base);
    const Eigen::Vector3d x = qr.solve(z.real()), y = qr.solve(z.imag());
    const double left = (z.real() - base * x).squaredNorm() + (z.imag() - base * y).squaredNorm();
    if (left > kFar * static_cast<double>(n) * measured_[r].noise_variance()) {  // it does not turn with the angle
      std::tie(record.z0, record.dz0) = start_of_curve(z, measured_[r].dt, p.model.natural_frequency());
      continue;
    }
    const double c = std::cos(beta[0]), s = std::sin(beta[0]), w = record.angle.omega[0];
    record.z0 = {x[1] * c + x[2] * s, y[1] * c + y[2] * s};
    record.dz0 = w * Complex(-x[1] * s + x[2] * c, -y[1] * s + y[2] * c);
  }
  for (const Expected& e : expected_) {
    const Parameter& q = parameters_[static_cast<std::size_t>(e.parameter)];
    move(p, q, e.value - value(p, q));
  }
}

/// Whitened derivatives of the readings of record r, x above y, into slopes_.
void OutputErrorProblem::jacobian(const Point& p, std::size_t r, const std::vector<Eigen::Index>& unknowns) {
  const Signals& s = signals_[r];
  const double dt = measured_[r].dt;
  const HighPass corner = high_pass_of(p.sensor, dt);
  const Eigen::VectorXcd& main = p.records[r].as_read();
  const Instants instants{measured_[r].t0, dt};
  const Eigen::VectorXcd z = probe_signal(p.sensor, main, instants);
  const Lean own = lean(p.sensor);
  const Eigen::Index n = z.size();
  const Eigen::VectorXcd ones = Eigen::VectorXcd::Ones(n);
  slopes_.resize(2 * n, static_cast<Eigen::Index>(unknowns.size()));
  std::vector<std::pair<Eigen::Index, Eigen::Index>> integrated;  // column, lane
  for (std::size_t c = 0; c < unknowns.size(); ++c) {
    const Parameter& q = parameters_[static_cast<std::size_t>(unknowns[c])];
    const auto column = static_cast<Eigen::Index>(c);
    auto x = slopes_.col(column).head(n), y = slopes_.col(column).tail(n);
    if (q.kind == Kind::lane || q.kind == Kind::term) {
      integrated.emplace_back(column, q.kind == Kind::lane ? q.index : kProfile + s.profile.cols() + q.index);
    } else if (q.kind == Kind::reference) {
      const Eigen::Index first = kProfile + s.profile.cols() + static_cast<Eigen::Index>(p.terms.size());
      integrated.emplace_back(column, first + reference_lanes(p.terms)[static_cast<std::size_t>(q.index)]);
    } else if (q.kind == Kind::sensor) {
      const OutputErrorRecord& record = p.records[r];
      const Eigen::VectorXcd g =
          q.sensor->reading({p.sensor, main, z, record.charge, record.charge_rate, dt, instants.t0});
      x = g.real();
      y = g.imag();
    } else if (q.kind == Kind::charge) {
      (q.imaginary ? x : y).setZero();
      (q.imaginary ? y : x) = discharge(n, corner, q.index == 1);
    } else {
      const Eigen::VectorXcd& g = beside(s, q, ones);
      if (q.imaginary) {
        x = -g.imag();
        y = g.real();
      } else {
        x = g.real();
        y = g.imag();
      }
    }
  }
  // The lanes of a sample lie together: turned in blocks that fit the first cache.
  constexpr Eigen::Index kBlock = 128;
  if (p.sensor.cubic != 0) {
    const Eigen::ArrayXd steep_x = 1 + 3 * p.sensor.cubic * main.real().array().square();
    const Eigen::ArrayXd steep_y = 1 + 3 * p.sensor.cubic * main.imag().array().square();
    for (const auto& [column, lane] : integrated) {
      motion_.dx.col(lane).array() *= steep_x;
      motion_.dy.col(lane).array() *= steep_y;
    }
  }
  if (p.sensor.gain_drift != 0) {
    const Eigen::ArrayXd gain = drifted_gain(p.sensor, n, instants);
    for (const auto& [column, lane] : integrated) {
      motion_.dx.col(lane).array() *= gain;
      motion_.dy.col(lane).array() *= gain;
    }
  }
  if (corner.any()) {
    high_pass_rows(motion_.dx, corner);
    high_pass_rows(motion_.dy, corner);
  }
  for (Eigen::Index at = 0; at < n; at += kBlock) {
    const Eigen::Index rows = std::min(kBlock, n - at);
    for (const auto& [column, lane] : integrated) {
      const auto dx = motion_.dx.col(lane).segment(at, rows), dy = motion_.dy.col(lane).segment(at, rows);
      slopes_.col(column).segment(at, rows) = dx;
      slopes_.col(column).segment(n + at, rows) = own.y * dy + own.x * dx;
    }
  }
  if (p.sensor.skew != 0) {
    for (const auto& [column, lane] : integrated) {
      slopes_.col(column).tail(n) = later(slopes_.col(column).tail(n), p.sensor.skew / dt);
    }
  }
  if (filters_[r].censors()) slopes_.array().colwise() *= likelihood_slope_;
  filters_[r].apply(slopes_);
}

}  // namespace whirl::identification::detail
