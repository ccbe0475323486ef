#include <cmath>
#include <numbers>

#include "fit/fit_model.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Complex = std::complex<double>;

/// Values of the internal unknowns.
VectorXd internal_values(const RotorFit& fit, const ParameterSet& set) {
  VectorXd t(set.size());
  for (Index k = 0; k < t.size(); ++k) {
    const auto i = static_cast<std::size_t>(k);
    t[k] = set.all[i].internal(fit.unknowns[i].estimate.value);
  }
  return t;
}

/// The fitted rotor seen by two probes, x and y, at a station.
struct StationModel {
  FitModel model;
  VectorXd t;

  StationModel(const RotorFit& fit, double position)
      : model(probed(fit.model->drawn(), position), fit.model->parameters(), fit.model->trials(),
              internal_values(fit, fit.model->parameters()), fit.model->modes()),
        t(internal_values(fit, fit.model->parameters())) {}

  static Rotor probed(Rotor rotor, double position) {
    rotor.probes = {{"x", position, 0}, {"y", position, std::numbers::pi / 2}};
    return rotor;
  }

  /// Motion and its slopes over all unknowns.
  VectorXcd motion(double speed, MatrixXcd& slopes) const {
    const ParameterSet& set = model.parameters();
    const SteadyPoint point = model.steady(speed);
    const VectorXcd sizes = model.sizes(t, "");
    slopes = MatrixXcd::Zero(2, set.size());
    slopes.leftCols(set.structural) = model.steady_slopes(speed, point, sizes);
    for (Index j = 0; j < set.stations + set.bows; ++j) {
      const Index at = set.unbalance + 2 * j;
      const double scale = set.all[static_cast<std::size_t>(at)].scale;
      slopes.col(at) = scale * point.readings.col(j);
      slopes.col(at + 1) = Complex(0, scale) * point.readings.col(j);
    }
    return point.readings * sizes;
  }
};

/// Half width of the amplitude's 95 % interval.
double amplitude_half(Complex z, const Eigen::RowVectorXcd& slopes, const Eigen::MatrixXd& covariance) {
  const Complex along = std::abs(z) > 0 ? std::conj(z) / std::abs(z) : Complex(1);
  const VectorXd g = (along * slopes).real().transpose();
  return 1.959964 * std::sqrt(std::max(0.0, g.dot(covariance * g)));
}

}  // namespace

VirtualProbe virtual_probe(const RotorFit& fit, double position, const std::vector<double>& speeds) {
  const StationModel station(fit, position);
  const auto n = static_cast<Index>(speeds.size());
  VirtualProbe v{position, speeds, VectorXcd(n), VectorXcd(n), VectorXd(n), VectorXd(n)};
  MatrixXcd slopes;
  for (Index k = 0; k < n; ++k) {
    const VectorXcd z = station.motion(speeds[static_cast<std::size_t>(k)], slopes);
    v.x[k] = z[0];
    v.y[k] = z[1];
    v.x_half[k] = amplitude_half(z[0], slopes.row(0), fit.covariance);
    v.y_half[k] = amplitude_half(z[1], slopes.row(1), fit.covariance);
  }
  return v;
}

VirtualForce virtual_force(const RotorFit& fit, std::size_t support, const std::vector<double>& speeds) {
  const Support& s = fit.model->drawn().supports.at(support);
  const StationModel station(fit, s.a.position);
  const ParameterSet& set = station.model.parameters();
  const auto n = static_cast<Index>(speeds.size());
  VirtualForce v{s.name, speeds, VectorXcd(n), VectorXcd(n), VectorXd(n), VectorXd(n)};
  MatrixXcd slopes;
  for (Index k = 0; k < n; ++k) {
    const double speed = speeds[static_cast<std::size_t>(k)];
    const VectorXcd z = station.motion(speed, slopes);
    const SupportLaw::Values law = station.model.support_law(support).at(speed);
    const Eigen::Matrix2cd dynamic = law.stiffness + Complex(0, speed) * law.damping - speed * speed * law.mass;
    const VectorXcd force = -dynamic * z;
    MatrixXcd force_slopes = -dynamic * slopes;
    for (Index p = 0; p < set.structural; ++p) {
      const Parameter& q = set.all[static_cast<std::size_t>(p)];
      const bool stiffness = q.kind == UnknownKind::stiffness;
      if (q.index != support || (!stiffness && q.kind != UnknownKind::damping)) continue;
      const double size = (q.logarithmic ? q.value(station.t[p]) : q.scale) * set.shape(q, s.law, speed);
      const Complex factor = stiffness ? Complex(size) : Complex(0, speed * size);
      force_slopes(q.row, p) -= factor * z[q.column];
      if (set.axes_alike && q.row == q.column) force_slopes(1, p) -= factor * z[1];
    }
    v.x[k] = force[0];
    v.y[k] = force[1];
    v.x_half[k] = amplitude_half(force[0], force_slopes.row(0), fit.covariance);
    v.y_half[k] = amplitude_half(force[1], force_slopes.row(1), fit.covariance);
  }
  return v;
}

}  // namespace whirl::shaft
