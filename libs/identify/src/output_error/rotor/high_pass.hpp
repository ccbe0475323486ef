#pragma once
#include <Eigen/Core>
#include <cmath>

/// A high-pass of sampled readings, of the first order y' + a y = z' (AC coupling) or of the second
/// y'' + a y' + b y = z'' (a pickup of velocity and an integrator), exact for motion that is linear between the
/// samples. It begins uncharged, y(0) = z(0).
namespace whirl::identification::detail {

/// Both in units of the sample time. damping: a dt >= 0; spring: b dt^2, 0 for the first order.
struct HighPass {
  double damping = 0, spring = 0;

  bool any() const { return damping > 0; }
};

/// y[i + 1] = keep y[i] + pass (z[i + 1] - z[i]) of the first order, and the derivatives of both by the corner.
struct HighPassStep {
  double keep, pass, keep_rate, pass_rate;

  explicit HighPassStep(double corner) : keep(std::exp(-corner)), keep_rate(-keep) {
    const bool small = corner < 1e-4;
    pass = small ? 1 - corner / 2 + corner * corner / 6 : (1 - keep) / corner;
    pass_rate = small ? -0.5 + corner / 3 : (keep - pass) / corner;
  }
};

/// Free motion of y'' + a y' + b y = 0 over one sample: (y, y' dt) next = [yy yv; vy vv] (y, y' dt).
struct FreeStep {
  double yy, yv, vy, vv;

  explicit FreeStep(const HighPass& h) {
    const double half = 0.5 * h.damping, fall = std::exp(-half), x = half * half - h.spring;
    const double root = std::sqrt(std::abs(x));
    const double even = x < 0 ? std::cos(root) : std::cosh(root);
    const double odd = root < 1e-4 ? 1 + x / 6 : (x < 0 ? std::sin(root) : std::sinh(root)) / root;
    yy = fall * (even + half * odd);
    yv = fall * odd;
    vy = -h.spring * yv;
    vv = fall * (even - half * odd);
  }
};

template <class Scalar>
Eigen::VectorX<Scalar> high_passed_twice(const Eigen::VectorX<Scalar>& z, const HighPass& h) {
  const FreeStep s(h);
  Eigen::VectorX<Scalar> y(z.size());
  Scalar place = z[0], rate = -h.damping * z[0], before = Scalar(0);
  for (Eigen::Index i = 0;; ++i) {
    y[i] = place;
    if (i + 1 == z.size()) return y;
    const Scalar slope = z[i + 1] - z[i], pushed = rate + (slope - before);
    place = s.yy * y[i] + s.yv * pushed;
    rate = s.vy * y[i] + s.vv * pushed;
    before = slope;
  }
}

template <class Derived>
Eigen::VectorX<typename Derived::Scalar> high_passed(const Eigen::MatrixBase<Derived>& z, const HighPass& h) {
  if (h.spring != 0) return high_passed_twice<typename Derived::Scalar>(z, h);
  const HighPassStep s(h.damping);
  Eigen::VectorX<typename Derived::Scalar> y = z;
  for (Eigen::Index i = 1; i < z.size(); ++i) y[i] = s.keep * y[i - 1] + s.pass * (z[i] - z[i - 1]);
  return y;
}

/// The same of every column of `z`, whose samples are in rows: all columns of a row at once.
template <class Rows>
void high_pass_rows(Rows& z, const HighPass& h) {
  using Row = Eigen::Array<double, 1, Eigen::Dynamic>;
  if (z.rows() == 0) return;
  Row before = z.row(0), now;
  if (h.spring == 0) {
    const HighPassStep s(h.damping);
    for (Eigen::Index i = 1; i < z.rows(); ++i) {
      now = z.row(i);
      z.row(i).array() = s.pass * (now - before) + s.keep * z.row(i - 1).array();
      before.swap(now);
    }
    return;
  }
  const FreeStep s(h);
  Row place = before, rate = -h.damping * before, last = Row::Zero(z.cols()), slope, pushed;
  for (Eigen::Index i = 0; i + 1 < z.rows(); ++i) {
    now = z.row(i + 1);
    slope = now - before;
    pushed = rate + (slope - last);
    z.row(i) = place;
    rate = s.vv * pushed + s.vy * place;
    place = s.yv * pushed + s.yy * place;
    last.swap(slope);
    before.swap(now);
  }
  z.row(z.rows() - 1) = place;
}

/// What a charge of 1 at sample 0 adds to `samples` readings; `rate`: a slope of 1 per sample instead, which the second
/// order keeps too.
inline Eigen::VectorXd discharge(Eigen::Index samples, const HighPass& h, bool rate = false) {
  if (h.spring == 0 && !rate)
    return (-h.damping * Eigen::ArrayXd::LinSpaced(samples, 0, static_cast<double>(samples - 1))).exp();
  const FreeStep s(h);
  Eigen::VectorXd y(samples);
  double place = rate ? 0 : 1, slope = rate ? 1 : -h.damping;
  for (Eigen::Index i = 0; i < samples; ++i) {
    y[i] = place;
    place = s.yy * y[i] + s.yv * slope;
    slope = s.vy * y[i] + s.vv * slope;
  }
  return y;
}

/// Derivative of what `of` gives by the damping, or by the spring, of a high-pass.
template <class Of>
auto rate_of(const HighPass& h, bool by_spring, Of of) {
  const double step = by_spring ? 1e-3 * (h.spring + 1e-2 * h.damping * h.damping) + 1e-12 : 1e-3 * h.damping + 1e-9;
  HighPass less = h, more = h;
  (by_spring ? less.spring : less.damping) -= step;
  (by_spring ? more.spring : more.damping) += step;
  return ((of(more) - of(less)) / (2 * step)).eval();
}

/// The derivatives of the readings and of a discharge.
template <class Derived>
Eigen::VectorX<typename Derived::Scalar> high_passed_rate(const Eigen::MatrixBase<Derived>& z, const HighPass& h,
                                                          bool by_spring = false) {
  using Vector = Eigen::VectorX<typename Derived::Scalar>;
  if (by_spring || h.spring != 0) return rate_of(h, by_spring, [&](const HighPass& p) { return high_passed(z, p); });
  const HighPassStep s(h.damping);
  Vector rate(z.size());
  rate[0] = 0;
  typename Derived::Scalar y = z[0];
  for (Eigen::Index i = 1; i < z.size(); ++i) {
    const typename Derived::Scalar dz = z[i] - z[i - 1];
    rate[i] = s.keep * rate[i - 1] + s.keep_rate * y + s.pass_rate * dz;
    y = s.keep * y + s.pass * dz;
  }
  return rate;
}
inline Eigen::VectorXd discharge_rate(Eigen::Index samples, const HighPass& h, bool rate, bool by_spring) {
  if (by_spring || h.spring != 0 || rate)
    return rate_of(h, by_spring, [&](const HighPass& p) { return discharge(samples, p, rate); });
  const Eigen::ArrayXd i = Eigen::ArrayXd::LinSpaced(samples, 0, static_cast<double>(samples - 1));
  return -i * (-h.damping * i).exp();
}

}  // namespace whirl::identification::detail
