#include "whirl/sindy/output_error_rotor.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "output_error_kernel.hpp"
#include "whirl/core/error.hpp"

namespace whirl {
namespace {

using detail::Complex;
constexpr Complex kI{0, 1};

enum class Kind { lane, offset, participation, pole_w, pole_zeta, decay_w, decay_zeta, decay, runout };

struct Parameter {
  std::string name;
  Kind kind;
  int record;      // -1: shared
  int index = 0;   // lane, mode, amplitude
  bool imaginary = false;
};

/// The estimate while it moves; angle corrections are kept as coefficients of (t / horizon)^k, k = 1 ...
struct Point {
  RotorModel model;
  std::vector<OutputErrorRecord> records;
  std::vector<Eigen::VectorXd> profile;
  std::vector<DecayingMode> decays;
  double delay = 0;
};

/// Signals that follow from the angle and the poles of one record.
struct Signals {
  Eigen::VectorXcd forcing;  // half grid
  Eigen::MatrixXcd profile;  // d F / d correction on the half grid
  std::vector<Eigen::VectorXcd> modal, modal_w, modal_zeta;  // q and Gamma dq/dw, Gamma dq/dzeta
  std::vector<Eigen::VectorXcd> decay, decay_w, decay_zeta;  // e^{p t}, e^{conj(p) t} and the derivatives of their sum
  std::vector<Eigen::VectorXcd> runout;
};

void correct_angle(const RotorRecord& measured, const Eigen::VectorXd& correction, double delay, AngleSignal& angle) {
  angle = measured.angle;
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

// F and its derivatives by the coefficients of the angle correction, then by the delay.
Eigen::VectorXcd half_grid_forcing(const AngleSignal& a, int profile_degree, bool delay, Eigen::MatrixXcd& profile) {
  const Eigen::Index n = a.beta.size();
  Eigen::VectorXcd f(n);
  profile.resize(n, profile_degree + (delay ? 1 : 0));
  const double horizon = 0.5 * a.dt * static_cast<double>(n - 1);
  for (Eigen::Index i = 0; i < n; ++i) {
    const double w = a.omega[i];
    const Complex e(std::cos(a.beta[i]), std::sin(a.beta[i]));
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
    if (delay) profile(i, profile_degree) = -kI * w * f[i] - e * Complex(2 * w * a.alpha[i], 0);
  }
  return f;
}

class Problem {
 public:
  Problem(const std::vector<RotorRecord>& records, const OutputErrorOptions& options, std::size_t modes)
      : measured_(records), options_(options) {
    const int n_modes = static_cast<int>(modes);
    if (options.rotor) add_lanes(-1, {{"k1", detail::kK1}, {"k2", detail::kK2}, {"c", detail::kC}});
    if (options.conj_stiffness) add_lanes(-1, {{"k1_conj_re", detail::kConjKRe}, {"k1_conj_im", detail::kConjKIm}});
    if (options.conj_damping) add_lanes(-1, {{"c_conj_re", detail::kConjCRe}, {"c_conj_im", detail::kConjCIm}});
    if (options.delay) parameters_.push_back({"delay", Kind::lane, -1, detail::kProfile + options.profile_degree});
    for (int k = 0; options.poles && k < n_modes; ++k) {
      parameters_.push_back({fmt::format("w_mode{}", k + 1), Kind::pole_w, -1, k});
      parameters_.push_back({fmt::format("zeta_mode{}", k + 1), Kind::pole_zeta, -1, k});
    }
    const int n_decays = static_cast<int>(options.decays.size());
    for (int k = 0; options.poles && k < n_decays; ++k) {
      parameters_.push_back({fmt::format("w_decay{}", k + 1), Kind::decay_w, -1, k});
      parameters_.push_back({fmt::format("zeta_decay{}", k + 1), Kind::decay_zeta, -1, k});
    }
    for (int r = 0; r < static_cast<int>(records.size()); ++r) {
      if (options.unbalance) add_lanes(r, {{"eps_re", detail::kEpsRe}, {"eps_im", detail::kEpsIm}});
      add_lanes(r, {{"x0", detail::kX0}, {"y0", detail::kY0}, {"vx0", detail::kVx0}, {"vy0", detail::kVy0}});
      for (int k = 0; k < options.profile_degree; ++k) {
        parameters_.push_back({name(fmt::format("profile{}", k + 1), r), Kind::lane, r, detail::kProfile + k});
      }
      if (options.offset) add_complex("offset", Kind::offset, r, 0);
      for (int k = 0; options.participation && k < n_modes; ++k) {
        add_complex(fmt::format("mode{}", k + 1), Kind::participation, r, k);
      }
      for (int k = 0; k < 2 * n_decays; ++k) {
        add_complex(fmt::format("decay{}{}", k / 2 + 1, k % 2 == 0 ? "+" : "-"), Kind::decay, r, k);
      }
      for (int k = 0; k < 2 * options.runout_harmonics; ++k) {
        add_complex(fmt::format("runout{}{}", k / 2 + 1, k % 2 == 0 ? "+" : "-"), Kind::runout, r, k);
      }
    }
  }

  const std::vector<Parameter>& parameters() const { return parameters_; }
  Eigen::Index size() const { return static_cast<Eigen::Index>(parameters_.size()); }

  void refresh(Point& p) {
    signals_.resize(measured_.size());
    for (std::size_t r = 0; r < measured_.size(); ++r) {
      OutputErrorRecord& record = p.records[r];
      Signals& s = signals_[r];
      const bool first = s.forcing.size() == 0;
      const bool turning = options_.profile_degree > 0 || options_.delay;
      if (first || turning) {
        correct_angle(measured_[r], p.profile[r], p.delay, record.angle);
        s.forcing = half_grid_forcing(record.angle, options_.profile_degree, options_.delay, s.profile);
        refresh_runout(record, s);
      }
      if (first || turning || options_.poles) {
        refresh_modes(p, r, s);
        refresh_decays(p, r, s);
      }
    }
  }

  /// Cost at p; with `normal` also the normal matrix and gradient. Infinite when the motion diverges.
  double evaluate(Point& p, Eigen::MatrixXd* normal, Eigen::VectorXd* right) {
    refresh(p);
    double cost = 0;
    if (normal != nullptr) {
      normal->setZero(size(), size());
      right->setZero(size());
    }
    for (std::size_t r = 0; r < measured_.size(); ++r) {
      const RotorRecord& m = measured_[r];
      OutputErrorRecord& record = p.records[r];
      const Signals& s = signals_[r];
      detail::Sensitivities sens;
      if (normal != nullptr) {
        sens = detail::main_mode_sensitivities(p.model, record.eps, s.forcing, s.profile, m.dt, record.z0, record.dz0);
        if (!sens.finite) return INFINITY;
        record.main = std::move(sens.z);
      } else {
        record.main = detail::main_mode(p.model, record.eps, s.forcing, m.dt, record.z0, record.dz0);
      }
      record.beside = Eigen::VectorXcd::Constant(m.size(), record.offset);
      for (std::size_t k = 0; k < s.modal.size(); ++k) record.beside += record.participation[k] * s.modal[k];
      for (std::size_t k = 0; k < s.decay.size(); ++k) record.beside += record.decay[k] * s.decay[k];
      for (std::size_t k = 0; k < s.runout.size(); ++k) record.beside += record.runout[k] * s.runout[k];
      const Eigen::Index n = m.size();
      Eigen::VectorXd residual(2 * n);
      residual.head(n) = (m.z - record.main - record.beside).real() / m.noise_x;
      residual.tail(n) = (m.z - record.main - record.beside).imag() / m.noise_y;
      const double squares = residual.squaredNorm();
      if (!std::isfinite(squares)) return INFINITY;
      record.rmse_x = std::sqrt(residual.head(n).squaredNorm() / static_cast<double>(n)) * m.noise_x;
      record.rmse_y = std::sqrt(residual.tail(n).squaredNorm() / static_cast<double>(n)) * m.noise_y;
      cost += squares;
      if (normal != nullptr) accumulate(static_cast<int>(r), s, sens, residual, *normal, *right);
    }
    return cost;
  }

  void move(Point& p, const Eigen::VectorXd& step) const {
    for (Eigen::Index j = 0; j < size(); ++j) {
      const Parameter& q = parameters_[static_cast<std::size_t>(j)];
      const double d = step[j];
      const Complex dc = q.imaginary ? Complex(0, d) : Complex(d, 0);
      const auto k = static_cast<std::size_t>(q.index);
      OutputErrorRecord* r = q.record >= 0 ? &p.records[static_cast<std::size_t>(q.record)] : nullptr;
      switch (q.kind) {
        case Kind::lane: move_lane(p, q, d); break;
        case Kind::offset: r->offset += dc; break;
        case Kind::participation: r->participation[k] += dc; break;
        case Kind::decay: r->decay[k] += dc; break;
        case Kind::runout: r->runout[k] += dc; break;
        // Poles keep their sign: a step may not leave the stable half plane.
        case Kind::pole_w: p.model.modes[k].omega = bounded(p.model.modes[k].omega, d, INFINITY); break;
        case Kind::pole_zeta: p.model.modes[k].zeta = bounded(p.model.modes[k].zeta, d, 0.9); break;
        case Kind::decay_w: p.decays[k].omega = bounded(p.decays[k].omega, d, INFINITY); break;
        case Kind::decay_zeta: p.decays[k].zeta = bounded(p.decays[k].zeta, d, 0.9); break;
      }
    }
  }

  double value(const Point& p, const Parameter& q) const {
    const auto k = static_cast<std::size_t>(q.index);
    const auto part = [&](Complex v) { return q.imaginary ? v.imag() : v.real(); };
    switch (q.kind) {
      case Kind::lane: return lane_value(p, q);
      case Kind::offset: return part(p.records[static_cast<std::size_t>(q.record)].offset);
      case Kind::participation: return part(p.records[static_cast<std::size_t>(q.record)].participation[k]);
      case Kind::decay: return part(p.records[static_cast<std::size_t>(q.record)].decay[k]);
      case Kind::runout: return part(p.records[static_cast<std::size_t>(q.record)].runout[k]);
      case Kind::pole_w: return p.model.modes[k].omega;
      case Kind::pole_zeta: return p.model.modes[k].zeta;
      case Kind::decay_w: return p.decays[k].omega;
      case Kind::decay_zeta: return p.decays[k].zeta;
    }
    return 0;
  }

  /// Main mode at sample 0 from a fit of {1, cos beta, sin beta} to the first samples; at rest when it hardly turns.
  void start_state(Point& p) {
    refresh(p);
    for (std::size_t r = 0; r < measured_.size(); ++r) {
      OutputErrorRecord& record = p.records[r];
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
      const double c = std::cos(beta[0]), s = std::sin(beta[0]), w = record.angle.omega[0];
      record.z0 = {x[1] * c + x[2] * s, y[1] * c + y[2] * s};
      record.dz0 = w * Complex(-x[1] * s + x[2] * c, -y[1] * s + y[2] * c);
    }
  }

 private:
  // Poles stay positive and stable; a step may shrink them by a third at most.
  static double bounded(double value, double change, double most) {
    return std::clamp(value + change, value / 1.5, most);
  }
  static std::string name(const std::string& base, int record) {
    return record <= 0 ? base : fmt::format("{}_{}", base, record + 1);
  }
  void add_lanes(int record, std::initializer_list<std::pair<const char*, int>> lanes) {
    for (const auto& [n, lane] : lanes) parameters_.push_back({name(n, record), Kind::lane, record, lane});
  }
  void add_complex(const std::string& base, Kind kind, int record, int index) {
    parameters_.push_back({name(base + "_re", record), kind, record, index, false});
    parameters_.push_back({name(base + "_im", record), kind, record, index, true});
  }

  void refresh_runout(const OutputErrorRecord& record, Signals& s) const {
    s.runout.clear();
    for (int k = 0; k < 2 * options_.runout_harmonics; ++k) {
      const double order = (k % 2 == 0 ? 1 : -1) * (k / 2 + 1);
      Eigen::VectorXcd v(record.angle.samples());
      for (Eigen::Index i = 0; i < v.size(); ++i) v[i] = std::polar(1.0, order * record.angle.beta[2 * i]);
      s.runout.push_back(std::move(v));
    }
  }

  void refresh_modes(const Point& p, std::size_t r, Signals& s) const {
    const OutputErrorRecord& record = p.records[r];
    s.modal.clear();
    s.modal_w.clear();
    s.modal_zeta.clear();
    for (std::size_t k = 0; k < p.model.modes.size(); ++k) {
      const ForcedMode& m = p.model.modes[k];
      const auto response = [&](double w, double zeta) {
        return detail::modal_response(w, zeta, s.forcing, measured_[r].dt, record.angle.omega[0]);
      };
      s.modal.push_back(response(m.omega, m.zeta));
      if (!options_.poles) continue;
      const double dw = 1e-5 * m.omega, dz = 1e-3 * m.zeta;
      const Complex gamma = record.participation[k];
      s.modal_w.emplace_back(gamma * (response(m.omega + dw, m.zeta) - response(m.omega - dw, m.zeta)) / (2 * dw));
      s.modal_zeta.emplace_back(gamma * (response(m.omega, m.zeta + dz) - response(m.omega, m.zeta - dz)) / (2 * dz));
    }
  }

  void refresh_decays(const Point& p, std::size_t r, Signals& s) const {
    const OutputErrorRecord& record = p.records[r];
    const Eigen::Index n = measured_[r].size();
    s.decay.clear();
    s.decay_w.clear();
    s.decay_zeta.clear();
    for (std::size_t k = 0; k < p.decays.size(); ++k) {
      const double w = p.decays[k].omega, zeta = p.decays[k].zeta, root = std::sqrt(1 - zeta * zeta);
      const Complex pole(-zeta * w, w * root), by_w(-zeta, root), by_zeta(-w, -w * zeta / root);
      Eigen::VectorXcd plus(n), slope_w(n), slope_zeta(n);
      for (Eigen::Index i = 0; i < n; ++i) {
        const double t = measured_[r].dt * static_cast<double>(i);
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

  void accumulate(int r, const Signals& s, const detail::Sensitivities& sens, const Eigen::VectorXd& residual,
                  Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
    const RotorRecord& m = measured_[static_cast<std::size_t>(r)];
    const Eigen::Index n = m.size();
    std::vector<Eigen::Index> global;
    for (Eigen::Index j = 0; j < size(); ++j) {
      const int owner = parameters_[static_cast<std::size_t>(j)].record;
      if (owner < 0 || owner == r) global.push_back(j);
    }
    Eigen::MatrixXd jacobian(2 * n, static_cast<Eigen::Index>(global.size()));
    const Eigen::VectorXcd ones = Eigen::VectorXcd::Ones(n);
    for (std::size_t c = 0; c < global.size(); ++c) {
      const Parameter& q = parameters_[static_cast<std::size_t>(global[c])];
      const auto k = static_cast<std::size_t>(q.index);
      const auto column = static_cast<Eigen::Index>(c);
      if (q.kind == Kind::lane) {
        jacobian.col(column).head(n) = sens.dx.col(q.index) / m.noise_x;
        jacobian.col(column).tail(n) = sens.dy.col(q.index) / m.noise_y;
        continue;
      }
      const Eigen::VectorXcd* g = nullptr;
      switch (q.kind) {
        case Kind::offset: g = &ones; break;
        case Kind::participation: g = &s.modal[k]; break;
        case Kind::pole_w: g = &s.modal_w[k]; break;
        case Kind::pole_zeta: g = &s.modal_zeta[k]; break;
        case Kind::decay_w: g = &s.decay_w[k]; break;
        case Kind::decay_zeta: g = &s.decay_zeta[k]; break;
        case Kind::decay: g = &s.decay[k]; break;
        default: g = &s.runout[k]; break;
      }
      if (q.imaginary) {
        jacobian.col(column).head(n) = -g->imag() / m.noise_x;
        jacobian.col(column).tail(n) = g->real() / m.noise_y;
      } else {
        jacobian.col(column).head(n) = g->real() / m.noise_x;
        jacobian.col(column).tail(n) = g->imag() / m.noise_y;
      }
    }
    Eigen::MatrixXd product = Eigen::MatrixXd::Zero(jacobian.cols(), jacobian.cols());
    product.selfadjointView<Eigen::Lower>().rankUpdate(jacobian.transpose());
    const Eigen::VectorXd gradient = jacobian.transpose() * residual;
    for (std::size_t a = 0; a < global.size(); ++a) {
      right[global[a]] += gradient[static_cast<Eigen::Index>(a)];
      for (std::size_t b = 0; b <= a; ++b) {
        const double v = product(static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b));
        normal(global[a], global[b]) += v;
        if (a != b) normal(global[b], global[a]) += v;
      }
    }
  }

  double& real_lane(Point& p, const Parameter& q) const {
    switch (q.index) {
      case detail::kK1: return p.model.k1;
      case detail::kK2: return p.model.k2;
      case detail::kC: return p.model.c;
      default:
        if (q.record < 0) return p.delay;
        return p.profile[static_cast<std::size_t>(q.record)][q.index - detail::kProfile];
    }
  }
  // Complex number and part that a lane moves; null for the real lanes.
  static std::pair<Complex*, bool> complex_lane(Point& p, const Parameter& q) {
    OutputErrorRecord* r = q.record >= 0 ? &p.records[static_cast<std::size_t>(q.record)] : nullptr;
    switch (q.index) {
      case detail::kEpsRe: return {&r->eps, false};
      case detail::kEpsIm: return {&r->eps, true};
      case detail::kX0: return {&r->z0, false};
      case detail::kY0: return {&r->z0, true};
      case detail::kVx0: return {&r->dz0, false};
      case detail::kVy0: return {&r->dz0, true};
      case detail::kConjKRe: return {&p.model.k1_conj, false};
      case detail::kConjKIm: return {&p.model.k1_conj, true};
      case detail::kConjCRe: return {&p.model.c_conj, false};
      case detail::kConjCIm: return {&p.model.c_conj, true};
      default: return {nullptr, false};
    }
  }
  void move_lane(Point& p, const Parameter& q, double d) const {
    if (const auto [number, imaginary] = complex_lane(p, q); number != nullptr) {
      *number += imaginary ? Complex(0, d) : Complex(d, 0);
    } else {
      real_lane(p, q) += d;
    }
  }
  double lane_value(const Point& p, const Parameter& q) const {
    Point& editable = const_cast<Point&>(p);  // one accessor for reading and moving
    if (const auto [number, imaginary] = complex_lane(editable, q); number != nullptr) {
      return imaginary ? number->imag() : number->real();
    }
    return real_lane(editable, q);
  }

  const std::vector<RotorRecord>& measured_;
  const OutputErrorOptions& options_;
  std::vector<Parameter> parameters_;
  std::vector<Signals> signals_;
};

// Solves the damped, diagonally scaled normal equations; false when they are not positive definite. A parameter without
// effect at this point stays (the pole of a mode whose participation is still zero).
bool solve(const Eigen::MatrixXd& normal, const Eigen::VectorXd& right, double damping, Eigen::VectorXd& step) {
  const Eigen::VectorXd scale = (normal.diagonal().array() > 0).select(normal.diagonal().cwiseSqrt(), 1.0);
  Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  scaled.diagonal() = (normal.diagonal().array() > 0).select(scaled.diagonal(), 1.0);
  scaled.diagonal().array() += damping;
  const Eigen::LLT<Eigen::MatrixXd> llt(scaled);
  if (llt.info() != Eigen::Success) return false;
  step = llt.solve(right.cwiseQuotient(scale)).cwiseQuotient(scale);
  return step.allFinite();
}

}  // namespace

Eigen::Index OutputErrorFit::index(const std::string& name) const {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? -1 : static_cast<Eigen::Index>(at - names.begin());
}

OutputErrorFit fit_output_error_rotor(const std::vector<RotorRecord>& records, const RotorModel& start,
                                      const OutputErrorOptions& options, const std::vector<Complex>& start_eps,
                                      double start_delay) {
  if (records.empty()) throw Error("records: at least one is needed");
  require_range("profile_degree", options.profile_degree, 0, 6);
  require_range("runout_harmonics", options.runout_harmonics, 0, 10);
  require_range("max_iterations", options.max_iterations, 1, 1000);
  require_range("tolerance", options.tolerance, 1e-9, 10);
  if (!start_eps.empty() && start_eps.size() != records.size()) {
    throw Error::in_field("start_eps", fmt::format("{} values", start_eps.size()), "empty or one per record");
  }
  OutputErrorFit fit;
  fit.model = start;
  for (const RotorRecord& r : records) {
    if (r.summary.status == Status::unusable) {
      fit.summary.fail(fmt::format("{}: {}", r.source, r.summary.warnings.back()));
      return fit;
    }
  }

  Problem problem(records, options, start.modes.size());
  Point point;
  point.model = start;
  point.decays = options.decays;
  point.delay = start_delay;
  for (std::size_t r = 0; r < records.size(); ++r) {
    OutputErrorRecord o;
    o.eps = start_eps.empty() ? start.eps : start_eps[r];
    o.offset = start.offset;
    for (const ForcedMode& m : start.modes) {
      // Participations belong to start.eps; with another unbalance they scale with it.
      o.participation.push_back(start.eps == 0.0 ? m.participation : m.participation * (o.eps / start.eps));
    }
    o.decay.assign(2 * options.decays.size(), 0);
    o.runout.assign(2 * static_cast<std::size_t>(options.runout_harmonics), 0);
    point.records.push_back(std::move(o));
    point.profile.emplace_back(Eigen::VectorXd::Zero(options.profile_degree));
  }
  problem.start_state(point);

  Eigen::MatrixXd normal;
  Eigen::VectorXd right, step;
  double cost = problem.evaluate(point, &normal, &right);
  if (!std::isfinite(cost)) {
    fit.summary.fail("the simulation of the starting model diverges");
    return fit;
  }
  Eigen::Index values = 0;
  for (const RotorRecord& r : records) values += 2 * r.size();
  const double freedom = static_cast<double>(values - problem.size());
  double damping = 0;
  bool converged = false;
  for (fit.iterations = 0; fit.iterations < options.max_iterations && !converged;) {
    if (!solve(normal, right, damping, step)) {
      if (damping < 1) {
        damping = std::max(10 * damping, 1e-8);
        continue;
      }
      fit.summary.fail("the output-error equations are singular: some parameter does not act on these records");
      return fit;
    }
    ++fit.iterations;
    const double moved = step.dot(normal * step);  // squared step in standard deviations
    converged = damping < 1e-6 && moved < options.tolerance * options.tolerance * std::max(1.0, cost / freedom) *
                                              static_cast<double>(problem.size());
    Point trial = point;
    problem.move(trial, step);
    if (converged) {
      if (const double c = problem.evaluate(trial, nullptr, nullptr); c <= cost * (1 + 1e-12)) {
        point = std::move(trial);
        cost = c;
      }
      break;
    }
    Eigen::MatrixXd next_normal;
    Eigen::VectorXd next_right;
    const double next = problem.evaluate(trial, &next_normal, &next_right);
    if (next < cost) {
      point = std::move(trial);
      normal = std::move(next_normal);
      right = std::move(next_right);
      cost = next;
      damping = damping < 1e-6 ? 0 : damping * 0.1;
    } else {
      damping = std::max(10 * damping, 1e-4);
      if (damping > 1e8) break;
    }
  }
  fit.summary.chi_square = cost / freedom;
  fit.summary.residual = std::sqrt(cost / static_cast<double>(values));
  if (!converged) fit.summary.warn(fmt::format("output error did not converge in {} steps", fit.iterations));

  if (!(normal.diagonal().minCoeff() > 0)) {
    fit.summary.fail("the output-error equations are singular: some parameter does not act on these records");
    return fit;
  }
  const Eigen::VectorXd scale = normal.diagonal().cwiseSqrt();
  const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * normal * scale.cwiseInverse().asDiagonal();
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
  const double lowest = eigen.eigenvalues()[0], highest = eigen.eigenvalues()[problem.size() - 1];
  fit.summary.condition_number = lowest > 0 ? std::sqrt(highest / lowest) : INFINITY;
  if (!(lowest > 1e-13 * highest)) {
    fit.summary.fail(fmt::format("the output-error equations are singular (condition number {:.1e})",
                                 fit.summary.condition_number));
    return fit;
  }
  fit.covariance = scale.cwiseInverse().asDiagonal() *
                   (eigen.eigenvectors() * eigen.eigenvalues().cwiseInverse().asDiagonal() *
                    eigen.eigenvectors().transpose()) *
                   scale.cwiseInverse().asDiagonal();
  fit.values.resize(problem.size());
  for (const Parameter& q : problem.parameters()) {
    fit.values[static_cast<Eigen::Index>(fit.names.size())] = problem.value(point, q);
    fit.names.push_back(q.name);
  }
  fit.model = point.model;
  fit.model.eps = point.records[0].eps;
  fit.model.offset = point.records[0].offset;
  for (std::size_t k = 0; k < fit.model.modes.size(); ++k) {
    fit.model.modes[k].participation = point.records[0].participation[k];
  }
  fit.decays = point.decays;
  fit.delay = point.delay;
  fit.records = std::move(point.records);
  return fit;
}

}  // namespace whirl
