#include "output_error/rotor/residual_filter.hpp"

#include <Eigen/QR>
#include <cmath>
#include <numbers>

namespace whirl::identification::detail {
namespace {

Eigen::ArrayXd weights(const Eigen::ArrayXd& used, Eigen::Index reach, Eigen::Index n) {
  if (used.size() == 0 && reach == 0) return {};
  Eigen::ArrayXd w = used.size() ? used : Eigen::ArrayXd::Ones(n);
  w.head(reach).setZero();
  for (Eigen::Index i = 0; i < n && used.size(); ++i) {
    if (used[i] == 0) w.segment(i, std::min(reach + 1, n - i)).setZero();
  }
  return w;
}

/// Hum: two amplitudes and their slow change (the frequency is known to a part of 1 / duration); drift: a cubic.
Eigen::MatrixXd columns_beside(const RotorRecord& r) {
  const Eigen::Index n = r.size();
  Eigen::MatrixXd base(n, 4 * static_cast<Eigen::Index>(r.hum.size()) + (r.drift ? 3 : 0));
  const Eigen::ArrayXd s = Eigen::ArrayXd::LinSpaced(n, -1, 1);
  Eigen::Index column = 0;
  for (const double hz : r.hum) {
    const Eigen::ArrayXd phase =
        Eigen::ArrayXd::LinSpaced(n, 0, 2 * std::numbers::pi * hz * r.dt * static_cast<double>(n - 1));
    base.col(column++) = phase.cos();
    base.col(column++) = phase.sin();
    base.col(column++) = s * phase.cos();
    base.col(column++) = s * phase.sin();
  }
  if (r.drift) {
    base.col(column++) = s;
    base.col(column++) = s.square() - 1.0 / 3;
    base.col(column++) = s.cube() - 0.6 * s;
  }
  return base;
}

bool is_censored(const RotorRecord& r) {
  return (r.clipped_x || r.clipped_y) && r.colour.size() == 0 && r.hum.empty() && !r.drift;
}

/// Usable samples, of a clipped axis all sound ones.
Eigen::ArrayXd likelihood(const RotorRecord& r, const std::optional<Clipped>& clipped, const Eigen::ArrayXd& usable) {
  return weights(clipped && is_censored(r) ? clipped->sound : usable, r.colour.size(), r.size());
}

/// Square root of -2 log P, P = Phi(a), and its derivative by -a.
struct TailResidual {
  double size, slope;
};
TailResidual tail_residual(double a) {
  constexpr double kFar = -30;  // Phi underflows below -38
  const double p = a > kFar ? 0.5 * std::erfc(-a / std::numbers::sqrt2) : 0;
  const double log_p = a > 5      ? std::log1p(-0.5 * std::erfc(a / std::numbers::sqrt2))
                       : a > kFar ? std::log(p)
                                  : -0.5 * a * a - std::log(-a * std::sqrt(2 * std::numbers::pi)) - 1 / (a * a);
  const double size = std::sqrt(-2 * log_p);
  const double hazard =
      a > kFar ? std::exp(-0.5 * a * a) / (std::sqrt(2 * std::numbers::pi) * p) : -a - 1 / a + 2 / (a * a * a);
  return {size, size > 0 ? hazard / size : 0};
}

double at_limits(const Clipped& c) {
  return (c.sound * ((c.readings.array() >= c.high) || (c.readings.array() <= c.low)).cast<double>()).sum();
}

/// One clipped axis.
void censor_axis(const Clipped& c, double sd, Eigen::Ref<const Eigen::VectorXd> model,
                 Eigen::Ref<Eigen::VectorXd> residual, Eigen::Ref<Eigen::ArrayXd> slope) {
  for (Eigen::Index i = 0; i < model.size(); ++i) {
    slope[i] = c.sound[i];
    if (c.sound[i] == 0) continue;
    const bool high = c.readings[i] >= c.high;
    if (!high && c.readings[i] > c.low) {
      residual[i] = c.readings[i] - model[i];
      continue;
    }
    const TailResidual t = tail_residual((high ? model[i] - c.high : c.low - model[i]) / sd);
    residual[i] = (high ? sd : -sd) * t.size;
    slope[i] = t.slope;
  }
}

}  // namespace

ResidualFilter::ResidualFilter(const RotorRecord& r)
    : n_(r.size()),
      censored_(is_censored(r)),
      sd_x_(r.noise_x / std::sqrt(r.noise_power())),
      sd_y_(r.noise_y / std::sqrt(r.noise_power())),
      values_(2 * static_cast<double>(r.size())),
      colour_(r.colour),
      used_x_(r.usable_x),
      used_y_(r.usable_y),
      weight_x_(likelihood(r, r.clipped_x, r.usable_x)),
      weight_y_(likelihood(r, r.clipped_y, r.usable_y)),
      base_(columns_beside(r)) {
  if (weight_x_.size()) values_ = weight_x_.sum() + weight_y_.sum();
  // A reading at its limit says little.
  for (const auto* c : {&r.clipped_x, &r.clipped_y}) {
    if (censored_ && *c) values_ -= at_limits(**c);
  }
  if (base_.cols() == 0) return;
  values_ -= (r.one_axis() ? 1 : 2) * static_cast<double>(base_.cols());
  for (const bool x : {true, false}) {
    if (r.axes == (x ? Axes::y : Axes::x)) continue;
    Eigen::MatrixXd white = base_;
    for (Eigen::Index k = 0; k < white.cols(); ++k) whiten(white.col(k), x ? sd_x_ : sd_y_, x ? weight_x_ : weight_y_);
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(white);
    (x ? q_x_ : q_y_) = qr.householderQ() * Eigen::MatrixXd::Identity(n_, white.cols());
    (x ? r_x_ : r_y_) = qr.matrixQR().topRows(white.cols()).triangularView<Eigen::Upper>();
  }
}

void ResidualFilter::whiten(Eigen::Ref<Eigen::VectorXd> v, double sd, const Eigen::ArrayXd& weight) const {
  v /= sd;
  for (Eigen::Index i = n_ - 1; colour_.size() > 0 && i >= colour_.size(); --i) {
    for (Eigen::Index k = 0; k < colour_.size(); ++k) v[i] -= colour_[k] * v[i - 1 - k];
  }
  if (weight.size()) v.array() *= weight;
}

Eigen::ArrayXd ResidualFilter::censor(const RotorRecord& record, const Eigen::VectorXcd& model,
                                      Eigen::VectorXd& residual) const {
  Eigen::ArrayXd slope = Eigen::ArrayXd::Ones(2 * n_);
  if (record.clipped_x) censor_axis(*record.clipped_x, sd_x_, model.real(), residual.head(n_), slope.head(n_));
  if (record.clipped_y) censor_axis(*record.clipped_y, sd_y_, model.imag(), residual.tail(n_), slope.tail(n_));
  return slope;
}

void ResidualFilter::apply(Eigen::Ref<Eigen::MatrixXd> columns) const {
  for (Eigen::Index k = 0; k < columns.cols(); ++k) {
    whiten(columns.col(k).head(n_), sd_x_, weight_x_);
    whiten(columns.col(k).tail(n_), sd_y_, weight_y_);
  }
  if (base_.cols() == 0) return;
  if (q_x_.size()) columns.topRows(n_) -= q_x_ * (q_x_.transpose() * columns.topRows(n_)).eval();
  if (q_y_.size()) columns.bottomRows(n_) -= q_y_ * (q_y_.transpose() * columns.bottomRows(n_)).eval();
}

Eigen::VectorXcd ResidualFilter::beside(const Eigen::VectorXd& residual) const {
  Eigen::VectorXcd out = Eigen::VectorXcd::Zero(n_);
  for (const bool x : {true, false}) {
    if ((x ? q_x_ : q_y_).size() == 0) continue;
    Eigen::VectorXd v = x ? residual.head(n_) : residual.tail(n_);
    whiten(v, x ? sd_x_ : sd_y_, x ? weight_x_ : weight_y_);
    const Eigen::VectorXd amplitude =
        (x ? r_x_ : r_y_).triangularView<Eigen::Upper>().solve((x ? q_x_ : q_y_).transpose() * v);
    if (x) {
      out.real() = base_ * amplitude;
    } else {
      out.imag() = base_ * amplitude;
    }
  }
  return out;
}

}  // namespace whirl::identification::detail
