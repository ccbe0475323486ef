#include "problem/one_axis.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <complex>

#include "whirl/signal/envelope.hpp"

namespace whirl::identification::detail {
namespace {

Eigen::VectorXd seen_axis(const RotorRecord& r) {
  if (r.axes == Axes::y) return r.z.imag();
  return r.z.real();
}

}  // namespace

Axes measured_axes(const Recording& recording, const RotorRecordOptions& options, Summary& summary) {
  const bool x = recording.has(options.x), y = recording.has(options.y);
  if (!options.one_axis || x == y) return Axes::both;
  summary.warn(fmt::format("there is no channel {}: the rotor is identified from {} alone, as one whose axes are alike",
                           x ? options.y : options.x, x ? options.x : options.y));
  return x ? Axes::x : Axes::y;
}

void fill_unseen_axis(RotorRecord& r) {
  if (!r.one_axis()) return;
  const bool x = r.axes == Axes::x;
  const Eigen::VectorXd seen = seen_axis(r);
  const double mean = seen.mean();
  const Eigen::VectorXcd analytic = signal::analytic_signal((seen.array() - mean).matrix());
  // Forward whirl: y follows x by a quarter turn of the rotation, whichever way that is.
  const double turn = r.angle.beta[r.angle.beta.size() - 1] >= r.angle.beta[0] ? 1 : -1;
  if (x) {
    r.z.imag() = turn * analytic.imag();
  } else {
    r.z.real() = -turn * analytic.imag();
  }
  Eigen::ArrayXd& measured = x ? r.usable_x : r.usable_y;
  if (measured.size() == 0) measured = Eigen::ArrayXd::Ones(r.size());
  (x ? r.usable_y : r.usable_x) = Eigen::ArrayXd::Zero(r.size());
}

UnseenStart unseen_start(const RotorRecord& r) {
  const bool x = r.axes == Axes::x;
  const Eigen::Index n = std::min<Eigen::Index>(100, r.size());
  const Eigen::VectorXd all = seen_axis(r);
  const Eigen::VectorXd seen = all.head(n), beta = r.angle.beta(Eigen::seqN(Eigen::Index{0}, n, Eigen::Index{2}));
  const double spread = std::sqrt((all.array() - all.mean()).square().mean());
  const double speed = r.angle.omega[0], fast = std::max(r.speed_high(), std::abs(speed));
  UnseenStart start;
  double size = std::max(1e-3 * spread, std::abs(seen.mean() - all.mean()));
  for (int k = 0; k < r.derivative(); ++k) size /= 0.5 * fast;  // at half the top speed, as a displacement
  if (std::abs(beta[n - 1] - beta[0]) >= 2.0) {
    Eigen::MatrixXd base(n, 3);
    base << Eigen::VectorXd::Ones(n), beta.array().cos().matrix(), beta.array().sin().matrix();
    const Eigen::Vector3d a = base.colPivHouseholderQr().solve(seen);
    // x = Re(A e^{i beta}), or y = Im(A e^{i beta}).
    const std::complex<double> amplitude = x ? std::complex<double>(a[1], -a[2]) : std::complex<double>(a[2], a[1]);
    std::complex<double> z = amplitude * std::polar(1.0, beta[0]);
    for (int k = 0; k < r.derivative(); ++k) z /= std::complex<double>(0, speed);
    start.place = x ? z.imag() : z.real();
    start.rate = speed * (x ? z.real() : -z.imag());
    size = std::max(size, std::abs(z));
  }
  start.place_sd = size;
  start.rate_sd = fast * size;
  return start;
}

}  // namespace whirl::identification::detail
