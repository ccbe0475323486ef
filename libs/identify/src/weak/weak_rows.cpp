#include "weak/weak_rows.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numbers>

#include "whirl/core/wide_registers.hpp"

namespace whirl::identification::detail {
namespace {
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
  cos_.resize(beta.size());
  sin_.resize(beta.size());
  for (Eigen::Index i = 0; i < beta.size(); ++i) {
    cos_[i] = std::cos(beta[i]);
    sin_[i] = std::sin(beta[i]);
  }

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

WeakRows::Parts WeakRows::turned(const Eigen::VectorXcd& v) const {
  const Eigen::ArrayXd re = v.real(), im = v.imag();
  Parts d(v.size(), 4);
  d.col(0) = re * cos_ + im * sin_;
  d.col(1) = im * cos_ - re * sin_;
  d.col(2) = re * cos_ - im * sin_;
  d.col(3) = im * cos_ + re * sin_;
  return d;
}

/// d times re + i s im, s = -1 for the forward rows and 1 for the backward ones; an empty `re` is 0.
static WeakRows::Parts weighted(const WeakRows::Parts& d, const Eigen::ArrayXd& re, const Eigen::ArrayXd& im) {
  WeakRows::Parts w(d.rows(), 4);
  w.col(0) = im * d.col(1).array();
  w.col(1) = -im * d.col(0).array();
  w.col(2) = -im * d.col(3).array();
  w.col(3) = im * d.col(2).array();
  if (re.size() > 0) w.array() += d.array().colwise() * re;
  return w;
}

/// Products of the four columns of d from row `first` on with the window.
static void inner_products(const Eigen::VectorXd& window, const WeakRows::Parts& d, Eigen::Index first,
                           std::array<double, 4>& sum) {
  Register sums[4] = {};
  const Eigen::Index n = window.size();
  Eigen::Index k = 0;
  for (; k + kRegisterWidth <= n; k += kRegisterWidth) {
    Register weight;
    std::memcpy(&weight, window.data() + k, sizeof weight);
#pragma GCC unroll 4
    for (Eigen::Index c = 0; c < 4; ++c) {
      Register part;
      std::memcpy(&part, d.data() + c * d.rows() + first + k, sizeof part);
      sums[c] += weight * part;
    }
  }
  for (std::size_t c = 0; c < 4; ++c) {
    sum[c] = 0;
    for (int j = 0; j < kRegisterWidth; ++j) sum[c] += sums[c][j];
    for (Eigen::Index j = k; j < n; ++j) sum[c] += window[j] * d(first + j, static_cast<Eigen::Index>(c));
  }
}

void WeakRows::add_sums(const Eigen::VectorXd& window, const Parts& d, Eigen::VectorXcd& into) const {
  on_wide_registers([&] {
    for (std::size_t r = 0; r < rows_.size(); ++r) {
      if (rows_[r].backward) continue;  // of the forward row before
      const auto at = static_cast<Eigen::Index>(r);
      std::array<double, 4> sum;
      inner_products(window, d, rows_[r].first, sum);
      into[at] += Complex(sum[0], sum[1]);
      if (r + 1 < rows_.size() && rows_[r + 1].backward) into[at + 1] += Complex(sum[2], sum[3]);
    }
  });
}

Eigen::VectorXcd WeakRows::apply(int k, const Eigen::VectorXcd& v) const {
  // psi_t = (phi_t - i s w phi) E,  psi_tt = (phi_tt - 2 i s w phi_t - (w^2 + i s w') phi) E,  E = e^{-i s beta}
  Eigen::VectorXcd result = Eigen::VectorXcd::Zero(size());
  const Parts d = turned(v);
  add_sums(k == 0 ? phi_ : k == 1 ? phi_t_ : phi_tt_, d, result);
  if (k == 1) add_sums(phi_, weighted(d, {}, omega_), result);
  if (k == 2) {
    add_sums(phi_t_, weighted(d, {}, 2 * omega_), result);
    add_sums(phi_, weighted(d, -omega_.square(), alpha_), result);
  }
  return result;
}

Eigen::VectorXcd WeakRows::rotor(const Eigen::VectorXcd& v, const Eigen::VectorXd& stiffness, double c) const {
  Eigen::VectorXcd result = Eigen::VectorXcd::Zero(size());
  const Parts d = turned(v);
  add_sums(phi_tt_ - c * phi_t_, d, result);
  add_sums(phi_t_, weighted(d, {}, 2 * omega_), result);
  add_sums(phi_, weighted(d, stiffness.array() - omega_.square(), alpha_ - c * omega_), result);
  return result;
}

Eigen::VectorXcd WeakRows::carrier() const {
  Eigen::VectorXcd e(cos_.size());
  e.real() = cos_;
  e.imag() = sin_;
  return e;
}

Eigen::VectorXcd WeakRows::forcing() const {
  Eigen::VectorXcd f(cos_.size());
  f.real() = omega_.square() * cos_ + alpha_ * sin_;
  f.imag() = omega_.square() * sin_ - alpha_ * cos_;
  return f;
}

namespace {

/// What an error of z does to the row of a centre, per sample and without its factor e^{-+ i beta} (of the backward row
/// it is the conjugate): of n, real and imaginary part, and in size of conj n; then the same times e^{-2 i beta}. Real
/// columns, because products of real numbers are what a processor does many of at once.
enum NoiseColumn { kRe, kIm, kConj, kTurnedRe, kTurnedIm, kConjTurnedRe, kConjTurnedIm, kNoiseColumns };
using NoiseColumns = Eigen::Matrix<double, Eigen::Dynamic, kNoiseColumns>;

/// Sums over the samples that two centres share, the last of a and the first of b: of l_b conj(l_a) and of
/// e^{-2 i beta} l_b l_a, with what conj n adds.
struct Overlap {
  Complex same, cross;
};
Overlap overlap(const NoiseColumns& a, const NoiseColumns& b, Eigen::Index common) {
  double same_re = 0, same_im = 0, cross_re = 0, cross_im = 0;
  on_wide_registers([&] {
    Register sums[4] = {};
    Eigen::Index k = 0;
    const Eigen::Index behind = a.rows() - common;
    const auto at = [&](const NoiseColumns& of, NoiseColumn column, Eigen::Index row, Register& to) {
      std::memcpy(&to, of.data() + column * of.rows() + row, sizeof to);
    };
    for (; k + kRegisterWidth <= common; k += kRegisterWidth) {
      Register re, im, conj, b_re, b_im, b_conj, turned_re, turned_im, conj_turned_re, conj_turned_im;
      at(a, kRe, behind + k, re);
      at(a, kIm, behind + k, im);
      at(a, kConj, behind + k, conj);
      at(b, kRe, k, b_re);
      at(b, kIm, k, b_im);
      at(b, kConj, k, b_conj);
      at(b, kTurnedRe, k, turned_re);
      at(b, kTurnedIm, k, turned_im);
      at(b, kConjTurnedRe, k, conj_turned_re);
      at(b, kConjTurnedIm, k, conj_turned_im);
      sums[0] += re * b_re + im * b_im + conj * b_conj;
      sums[1] += re * b_im - im * b_re;
      sums[2] += re * turned_re - im * turned_im + conj * conj_turned_re;
      sums[3] += re * turned_im + im * turned_re + conj * conj_turned_im;
    }
    for (int j = 0; j < kRegisterWidth; ++j) {
      same_re += sums[0][j];
      same_im += sums[1][j];
      cross_re += sums[2][j];
      cross_im += sums[3][j];
    }
    for (; k < common; ++k) {
      const double re = a(behind + k, kRe), im = a(behind + k, kIm), conj = a(behind + k, kConj);
      same_re += re * b(k, kRe) + im * b(k, kIm) + conj * b(k, kConj);
      same_im += re * b(k, kIm) - im * b(k, kRe);
      cross_re += re * b(k, kTurnedRe) - im * b(k, kTurnedIm) + conj * b(k, kConjTurnedRe);
      cross_im += re * b(k, kTurnedIm) + im * b(k, kTurnedRe) + conj * b(k, kConjTurnedIm);
    }
  });
  return {{same_re, same_im}, {cross_re, cross_im}};
}

}  // namespace

BandedCholesky<Complex> WeakRows::whitener(const Eigen::VectorXd& stiffness, const Eigen::VectorXd& turned_stiffness,
                                           double c) const {
  const Eigen::Index length = phi_.size();
  const Eigen::Index reach = 2 * half_;  // windows further apart do not overlap
  std::vector<NoiseColumns> noise;       // per centre
  std::vector<std::size_t> first_row;    // per centre
  const Eigen::ArrayXd turn_re = cos_.square() - sin_.square(), turn_im = -2 * sin_ * cos_;
  const Eigen::ArrayXd spring = stiffness, turned_spring = turned_stiffness;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (rows_[r].backward) continue;
    const auto part = [&](const Eigen::ArrayXd& samples) { return samples.segment(rows_[r].first, length); };
    const auto w = part(omega_), re = part(turn_re), im = part(turn_im);
    NoiseColumns v(length, kNoiseColumns);
    v.col(kRe) = phi_tt_.array() - c * phi_t_.array() + (part(spring) - w.square()) * phi_.array();
    v.col(kIm) = -2 * w * phi_t_.array() + (c * w - part(alpha_)) * phi_.array();
    v.col(kConj) = part(turned_spring) * phi_.array();
    if (noise_.size()) v.leftCols<3>().array().colwise() *= part(noise_);
    v.col(kTurnedRe) = v.col(kRe).array() * re - v.col(kIm).array() * im;
    v.col(kTurnedIm) = v.col(kRe).array() * im + v.col(kIm).array() * re;
    v.col(kConjTurnedRe) = v.col(kConj).array() * re;
    v.col(kConjTurnedIm) = v.col(kConj).array() * im;
    noise.push_back(std::move(v));
    first_row.push_back(r);
  }
  first_row.push_back(rows_.size());
  const Eigen::Index neighbours = (reach - 1) / step_;
  const Eigen::Index width = std::min(2 * neighbours + 1, size() - 1);
  BandedCholesky<Complex> factor(size(), width);
  for (std::size_t a = 0; a < noise.size(); ++a) {
    for (std::size_t b = a; b < noise.size(); ++b) {
      const Eigen::Index shift = rows_[first_row[b]].first - rows_[first_row[a]].first;
      if (shift >= reach) break;
      const auto [same, cross] = overlap(noise[a], noise[b], length - shift);
      for (std::size_t row = first_row[b]; row < first_row[b + 1]; ++row) {
        for (std::size_t column = first_row[a]; column < std::min(row + 1, first_row[a + 1]); ++column) {
          const Complex value = rows_[row].backward == rows_[column].backward ? same : cross;
          factor.band(static_cast<Eigen::Index>(row - column), static_cast<Eigen::Index>(column)) =
              rows_[row].backward ? std::conj(value) : value;
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
  constexpr Eigen::Index kBlock = 1024;  // stays in the first cache
  for (Eigen::Index at = 0; at < n; at += kBlock) {
    auto block = smooth.segment(at, std::min(kBlock, n - at));
    for (Eigen::Index k = 0; k <= 2 * reach; ++k) block += kernel[k] * padded.segment(at + k, block.size());
  }
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
