#include "output_error/output_error_problem.hpp"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

namespace whirl::identification::detail {

double OutputErrorProblem::evaluate(Point& p, Eigen::MatrixXd* normal, Eigen::VectorXd* right) {
  refresh_all(p);
  double cost = 0;
  if (normal != nullptr) {
    normal->setZero(size(), size());
    right->setZero(size());
  }
  for (std::size_t r = 0; r < measured_.size(); ++r) {
    const RotorRecord& m = measured_[r];
    OutputErrorRecord& record = p.records[r];
    const Signals& s = signals_[r];
    const TermForces forces{p.terms, record.angle.omega, m.t0};
    Sensitivities sens;
    if (normal != nullptr) {
      sens = main_mode_sensitivities(p.model, record.eps, s.forcing, s.profile, forces, m.dt, record.z0, record.dz0);
      if (!sens.finite) return INFINITY;
    } else {
      sens.motion = main_mode(p.model, record.eps, s.forcing, forces, m.dt, record.z0, record.dz0);
    }
    record.main = std::move(sens.motion.z);
    record.main_rate = std::move(sens.motion.v);
    record.beside = Eigen::VectorXcd::Constant(m.size(), record.offset);
    for (std::size_t k = 0; k < s.modal.size(); ++k) record.beside += record.participation[k] * s.modal[k];
    for (std::size_t k = 0; k < s.decay.size(); ++k) record.beside += record.decay[k] * s.decay[k];
    for (std::size_t k = 0; k < s.runout.size(); ++k) record.beside += record.runout[k] * s.runout[k];
    const Eigen::Index n = m.size();
    Eigen::VectorXd residual(2 * n);
    const Eigen::VectorXcd error = m.z - read_by(p.sensor, record.main) - record.beside;
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
      record.readings = m.z;
      record.readings.real().array() -= (1 - filter.used_x()) * residual.head(n).array();
      record.readings.imag().array() -= (1 - filter.used_y()) * residual.tail(n).array();
      residual.head(n).array() *= filter.used_x();
      residual.tail(n).array() *= filter.used_y();
    }
    const double used_x = filter.masks() ? filter.used_x().sum() : static_cast<double>(n);
    const double used_y = filter.masks() ? filter.used_y().sum() : static_cast<double>(n);
    record.rmse_x = std::sqrt(residual.head(n).squaredNorm() / used_x);
    record.rmse_y = std::sqrt(residual.tail(n).squaredNorm() / used_y);
    filter.apply(residual);
    const double squares = residual.squaredNorm();
    if (!std::isfinite(squares)) return INFINITY;
    cost += squares;
    if (normal != nullptr) accumulate(p, static_cast<int>(r), sens, residual, *normal, *right);
  }
  return cost;
}

void OutputErrorProblem::start_state(Point& p) {
  refresh_all(p);
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

void OutputErrorProblem::accumulate(const Point& p, int r, const Sensitivities& sens, const Eigen::VectorXd& residual,
                                    Eigen::MatrixXd& normal, Eigen::VectorXd& right) const {
  const Signals& s = signals_[static_cast<std::size_t>(r)];
  const Eigen::VectorXcd& motion = p.records[static_cast<std::size_t>(r)].main;
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
    if (q.kind == Kind::lane || q.kind == Kind::term) {
      const Eigen::Index lane = q.kind == Kind::lane ? q.index : kProfile + s.profile.cols() + q.index;
      jacobian.col(column).head(n) = sens.dx.col(lane);
      jacobian.col(column).tail(n) = ((1 + p.sensor.gain) * sens.dy.col(lane) + p.sensor.angle * sens.dx.col(lane));
      continue;
    }
    if (q.kind == Kind::sensor_gain || q.kind == Kind::sensor_angle) {
      jacobian.col(column).head(n).setZero();
      if (q.kind == Kind::sensor_gain) {
        jacobian.col(column).tail(n) = motion.imag();
      } else {
        jacobian.col(column).tail(n) = motion.real();
      }
      continue;
    }
    const Eigen::VectorXcd* g = nullptr;
    switch (q.kind) {
      case Kind::offset:
        g = &ones;
        break;
      case Kind::participation:
        g = &s.modal[k];
        break;
      case Kind::pole_w:
        g = &s.modal_w[k];
        break;
      case Kind::pole_zeta:
        g = &s.modal_zeta[k];
        break;
      case Kind::decay_w:
        g = &s.decay_w[k];
        break;
      case Kind::decay_zeta:
        g = &s.decay_zeta[k];
        break;
      case Kind::decay:
        g = &s.decay[k];
        break;
      default:
        g = &s.runout[k];
        break;
    }
    if (q.imaginary) {
      jacobian.col(column).head(n) = -g->imag();
      jacobian.col(column).tail(n) = g->real();
    } else {
      jacobian.col(column).head(n) = g->real();
      jacobian.col(column).tail(n) = g->imag();
    }
  }
  filters_[static_cast<std::size_t>(r)].apply(jacobian);
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

}  // namespace whirl::identification::detail
