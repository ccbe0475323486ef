#pragma once
#include <Eigen/Core>
#include <cmath>

/// AC coupling: a first-order high-pass y' = z' - a y of sampled readings, exact for motion that is linear between the
/// samples. It begins uncharged, y(0) = z(0). `corner`: a times the sample time, >= 0.
namespace whirl::identification::detail {

/// y[i + 1] = keep y[i] + pass (z[i + 1] - z[i]), and the derivatives of both by the corner.
struct HighPassStep {
  double keep, pass, keep_rate, pass_rate;

  explicit HighPassStep(double corner) : keep(std::exp(-corner)), keep_rate(-keep) {
    const bool small = corner < 1e-4;
    pass = small ? 1 - corner / 2 + corner * corner / 6 : (1 - keep) / corner;
    pass_rate = small ? -0.5 + corner / 3 : (keep - pass) / corner;
  }
};

template <class Derived>
Eigen::VectorX<typename Derived::Scalar> high_passed(const Eigen::MatrixBase<Derived>& z, double corner) {
  const HighPassStep s(corner);
  Eigen::VectorX<typename Derived::Scalar> y = z;
  for (Eigen::Index i = 1; i < z.size(); ++i) y[i] = s.keep * y[i - 1] + s.pass * (z[i] - z[i - 1]);
  return y;
}

/// Its derivative by `corner`.
template <class Derived>
Eigen::VectorX<typename Derived::Scalar> high_passed_rate(const Eigen::MatrixBase<Derived>& z, double corner) {
  const HighPassStep s(corner);
  Eigen::VectorX<typename Derived::Scalar> rate(z.size());
  rate[0] = 0;
  typename Derived::Scalar y = z[0];
  for (Eigen::Index i = 1; i < z.size(); ++i) {
    const typename Derived::Scalar dz = z[i] - z[i - 1];
    rate[i] = s.keep * rate[i - 1] + s.keep_rate * y + s.pass_rate * dz;
    y = s.keep * y + s.pass * dz;
  }
  return rate;
}

/// What a charge of 1 at sample 0 adds to `samples` readings, and its derivative by `corner`.
inline Eigen::VectorXd discharge(Eigen::Index samples, double corner) {
  return (-corner * Eigen::ArrayXd::LinSpaced(samples, 0, static_cast<double>(samples - 1))).exp();
}
inline Eigen::VectorXd discharge_rate(Eigen::Index samples, double corner) {
  const Eigen::ArrayXd i = Eigen::ArrayXd::LinSpaced(samples, 0, static_cast<double>(samples - 1));
  return -i * (-corner * i).exp();
}

}  // namespace whirl::identification::detail
