#include "weak/weak_rows.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace whirl::identification::detail {
namespace {
constexpr Complex kI{0, 1};
constexpr Eigen::Index kOverlap = 4;  // centres every half / 4 samples

Eigen::VectorXd samples_of(const Eigen::VectorXd& half_grid) {
  return half_grid(Eigen::seq(Eigen::Index{0}, half_grid.size() - 1, Eigen::Index{2}));
}
}  // namespace

WeakRows::WeakRows(const RotorRecord& record, const AngleSignal& angle, Eigen::Index half)
    : half_(half), step_(std::max<Eigen::Index>(1, half / kOverlap)), dt_(angle.dt) {
  const double width = static_cast<double>(half) * dt_;
  const Eigen::ArrayXd s = Eigen::ArrayXd::LinSpaced(2 * half + 1, -1, 1);
  const Eigen::ArrayXd p = 1 - s.square();
  phi_ = p.pow(6) * dt_;
  phi_t_ = -12 * s * p.pow(5) * (dt_ / width);
  phi_tt_ = (-12 * p.pow(5) + 120 * s.square() * p.pow(4)) * (dt_ / (width * width));

  omega_ = samples_of(angle.omega);
  alpha_ = samples_of(angle.alpha);
  const Eigen::VectorXd beta = samples_of(angle.beta);
  demodulate_.resize(beta.size());
  for (Eigen::Index i = 0; i < beta.size(); ++i) demodulate_[i] = {std::cos(beta[i]), -std::sin(beta[i])};

  // Near standstill both rows of a centre coincide: the backward one would only add a singular covariance.
  const double slow = 2.0 / width;
  Eigen::ArrayXd used = Eigen::ArrayXd::Ones(beta.size());
  if (record.usable_x.size()) used = (record.one_axis() ? 1.0 : 0.5) * (record.usable_x + record.usable_y);
  if (record.usable_x.size() || record.colour.size()) {
    const double total = record.noise_power();
    noise_ = used.sqrt();
    for (Eigen::Index i = 0; i < noise_.size(); ++i) noise_[i] *= std::sqrt(record.noise_gain(omega_[i]) / total);
  }
  const Eigen::ArrayXd inside = phi_.array().square() / phi_.squaredNorm();
  for (Eigen::Index first = 0; first + 2 * half < beta.size(); first += step_) {
    if ((inside * used.segment(first, 2 * half + 1)).sum() < 0.5) continue;
    const bool fast = std::abs(omega_[first + half]) > slow;
    if (record.one_axis()) {  // nothing tells which way it whirls; near standstill not even the frequency does
      if (fast) rows_.push_back({first, false});
      continue;
    }
    rows_.push_back({first, false});
    if (fast) rows_.push_back({first, true});
  }
}

// Sum over each window of (bend phi_tt + phi_t * slope + phi * level) e^{-i s beta} v, slope and level per sample;
// empty weights are left out.
void WeakRows::add_rows(bool backward, const Eigen::VectorXcd& v, bool bend, const Eigen::VectorXcd& slope,
                        const Eigen::VectorXcd& level, Eigen::VectorXcd& into) const {
  const Eigen::Index n = v.size(), length = phi_.size();
  const Eigen::VectorXcd d = backward ? Eigen::VectorXcd(v.cwiseProduct(demodulate_.conjugate()))
                                      : Eigen::VectorXcd(v.cwiseProduct(demodulate_));
  struct Part {  // real and imaginary part apart, so that the products are real
    const Eigen::VectorXd* window;
    Eigen::MatrixX2d samples;
  };
  std::vector<Part> parts;
  const auto add = [&](const Eigen::VectorXd& window, const Eigen::VectorXcd& weighted) {
    Part& p = parts.emplace_back(Part{&window, Eigen::MatrixX2d(n, 2)});
    p.samples.col(0) = weighted.real();
    p.samples.col(1) = weighted.imag();
  };
  if (bend) add(phi_tt_, d);
  if (slope.size() > 0) add(phi_t_, slope.cwiseProduct(d));
  if (level.size() > 0) add(phi_, level.cwiseProduct(d));
  for (Eigen::Index r = 0; r < size(); ++r) {
    const Row& row = rows_[static_cast<std::size_t>(r)];
    if (row.backward != backward) continue;
    double re = 0, im = 0;
    for (const Part& p : parts) {
      re += p.window->dot(p.samples.col(0).segment(row.first, length));
      im += p.window->dot(p.samples.col(1).segment(row.first, length));
    }
    into[r] = {re, im};
  }
}

Eigen::VectorXcd WeakRows::apply(int k, const Eigen::VectorXcd& v) const {
  // psi_t = (phi_t - i s w phi) E,  psi_tt = (phi_tt - 2 i s w phi_t - (w^2 + i s w') phi) E,  E = e^{-i s beta}
  Eigen::VectorXcd result(size());
  for (const bool backward : {false, true}) {
    const Complex turn = backward ? kI : -kI;  // -i s
    const Eigen::VectorXcd ones = Eigen::VectorXcd::Ones(v.size());
    if (k == 0) {
      add_rows(backward, v, false, {}, ones, result);
    } else if (k == 1) {
      add_rows(backward, v, false, ones, turn * omega_, result);
    } else {
      add_rows(backward, v, true, 2.0 * turn * omega_, turn * alpha_ - omega_.cwiseAbs2(), result);
    }
  }
  return result;
}

Eigen::VectorXcd WeakRows::rotor(const Eigen::VectorXcd& v, const Eigen::VectorXd& stiffness, double c) const {
  Eigen::VectorXcd result(size());
  for (const bool backward : {false, true}) {
    const Complex turn = backward ? kI : -kI;
    add_rows(backward, v, true, (2.0 * turn * omega_.array() - c).matrix(),
             turn * (alpha_ - c * omega_) + stiffness - omega_.cwiseAbs2(), result);
  }
  return result;
}

BandedCholesky<Complex> WeakRows::whitener(const Eigen::VectorXd& stiffness, const Eigen::VectorXd& turned,
                                           double c) const {
  const Eigen::Index length = phi_.size();
  const Eigen::Index reach = 2 * half_;  // windows further apart do not overlap
  // Row of L without its factor e^{-+ i beta}; of the backward row it is the conjugate.
  std::vector<Eigen::VectorXcd> l, l_turned;  // per centre; turned: times e^{-2 i beta}
  std::vector<Eigen::VectorXd> q;             // of conj n, in size
  std::vector<Eigen::VectorXcd> q_turned;
  std::vector<std::size_t> centre;  // of each row
  std::vector<Eigen::Index> first;  // sample, per centre
  const Eigen::VectorXcd turn = demodulate_.cwiseProduct(demodulate_);
  for (const Row& row : rows_) {
    if (!row.backward) {
      const auto w = omega_.segment(row.first, length).array();
      Eigen::VectorXcd v(length);
      v.real() = phi_tt_.array() - c * phi_t_.array() +
                 (stiffness.segment(row.first, length).array() - w.square()) * phi_.array();
      v.imag() = -2 * w * phi_t_.array() + (c * w - alpha_.segment(row.first, length).array()) * phi_.array();
      Eigen::VectorXd conj = turned.segment(row.first, length).cwiseProduct(phi_);
      if (noise_.size()) {
        v.array() *= noise_.segment(row.first, length).array();
        conj.array() *= noise_.segment(row.first, length).array();
      }
      q_turned.emplace_back(conj.cwiseProduct(turn.segment(row.first, length)));
      q.push_back(std::move(conj));
      l_turned.emplace_back(v.cwiseProduct(turn.segment(row.first, length)));
      l.push_back(std::move(v));
      first.push_back(row.first);
    }
    centre.push_back(l.size() - 1);
  }
  const Eigen::Index neighbours = (reach - 1) / step_;
  const Eigen::Index width = std::min(2 * neighbours + 1, size() - 1);
  BandedCholesky<Complex> factor(size(), width);
  // Sums for each pair of centres a <= b: forward-forward and forward-backward.
  std::size_t row_of = 0;
  std::vector<std::size_t> first_row(l.size());
  for (std::size_t a = 0; a < l.size(); ++a) {
    first_row[a] = row_of;
    while (row_of < centre.size() && centre[row_of] == a) ++row_of;
  }
  for (std::size_t a = 0; a < l.size(); ++a) {
    for (std::size_t b = a; b < l.size() && first[b] - first[a] < reach; ++b) {
      const Eigen::Index shift = first[b] - first[a], common = length - shift;
      // sum l_b conj(l_a) and sum e^{-2ib} l_b l_a, with what conj n adds
      const Complex same = l[a].tail(common).dot(l[b].head(common)) + q[a].tail(common).dot(q[b].head(common));
      const Complex cross = (l_turned[b].head(common).transpose() * l[a].tail(common))(0) +
                            (q_turned[b].head(common).transpose() * q[a].tail(common).cast<Complex>())(0);
      const std::size_t rows_a = (a + 1 < l.size() ? first_row[a + 1] : centre.size()) - first_row[a];
      const std::size_t rows_b = (b + 1 < l.size() ? first_row[b + 1] : centre.size()) - first_row[b];
      for (std::size_t i = 0; i < rows_b; ++i) {
        for (std::size_t j = 0; j < rows_a; ++j) {
          const std::size_t row = first_row[b] + i, column = first_row[a] + j;
          if (row < column) continue;
          const Complex value = i == j ? (i == 0 ? same : std::conj(same)) : (i == 0 ? cross : std::conj(cross));
          factor.band(static_cast<Eigen::Index>(row - column), static_cast<Eigen::Index>(column)) = value;
        }
      }
    }
  }
  factor.band.row(0).array() += 1e-10 * factor.band.row(0).real().mean();
  return factor;
}

WeakSystem weak_system(const WeakRows& rows, const Eigen::VectorXcd& z, double noise_variance,
                       const Eigen::VectorXcd& forcing) {
  WeakSystem s;
  s.terms.resize(rows.size(), 7);
  const Eigen::VectorXcd cubic = (z.cwiseAbs2().array() - 2 * noise_variance).matrix().cwiseProduct(z);
  s.terms.col(0) = -rows.apply(0, z);
  s.terms.col(1) = -rows.apply(0, cubic);
  s.terms.col(2) = rows.apply(1, z);
  s.terms.col(3) = rows.apply(0, forcing);
  s.terms.col(4) = rows.apply(0, Eigen::VectorXcd::Ones(z.size()));
  s.terms.col(5) = -rows.apply(0, z.conjugate());
  s.terms.col(6) = rows.apply(1, z.conjugate());
  s.right = rows.apply(2, z);
  return s;
}

Eigen::VectorXcd sample_forcing(const AngleSignal& angle) {
  Eigen::VectorXcd f(angle.samples());
  for (Eigen::Index i = 0; i < f.size(); ++i) {
    const double w = angle.omega[2 * i];
    f[i] = std::polar(1.0, angle.beta[2 * i]) * Complex(w * w, -angle.alpha[2 * i]);
  }
  return f;
}

Eigen::VectorXd stack(const Eigen::VectorXcd& v) {
  Eigen::VectorXd s(2 * v.size());
  s << v.real(), v.imag();
  return s;
}

Eigen::VectorXd smooth_square(const Eigen::VectorXcd& z, double dt, double noise_variance) {
  const double sd = 0.02 / dt;  // samples
  const Eigen::Index reach = std::max<Eigen::Index>(1, static_cast<Eigen::Index>(3 * sd));
  Eigen::ArrayXd kernel =
      Eigen::ArrayXd::LinSpaced(2 * reach + 1, -static_cast<double>(reach), static_cast<double>(reach));
  kernel = (-0.5 * (kernel / sd).square()).exp();
  kernel /= kernel.sum();
  const Eigen::Index n = z.size();
  Eigen::VectorXd padded(n + 2 * reach);
  padded.segment(reach, n) = (z.cwiseAbs2().array() - noise_variance).matrix();
  padded.head(reach).setConstant(padded[reach]);
  padded.tail(reach).setConstant(padded[reach + n - 1]);
  Eigen::VectorXd smooth = Eigen::VectorXd::Zero(n);
  for (Eigen::Index k = 0; k <= 2 * reach; ++k) smooth += kernel[k] * padded.segment(k, n);
  return smooth.cwiseMax(0.0);
}

Eigen::Index default_half_width(const RotorRecord& record) {
  const Complex mean = record.z.mean();
  const Eigen::VectorXcd z = (record.z.array() - mean).matrix();
  Eigen::Index peak = 0;
  smooth_square(z, record.dt, 0).maxCoeff(&peak);
  const double speed = std::max(std::abs(record.angle.omega[2 * peak]), 0.1 * record.speed_high());
  const double width = 1.8 * 2 * std::numbers::pi / speed;
  return std::clamp(static_cast<Eigen::Index>(std::lround(width / record.dt)), Eigen::Index{12}, record.size() / 20);
}

}  // namespace whirl::identification::detail
