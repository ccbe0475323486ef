#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/response/decay.hpp"

namespace whirl::response {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kEvidence = 4;  ///< standard deviations that a nonlinear term must have
constexpr double kPoor = 2, kWrong = 100;
/// What windows with a quadratic chirp and fall, and averaging over a period, leave of frequency and rate: seen on
/// simulated decays with cubic stiffness and quadratic damping at 20 dB to no noise.
constexpr double kFrequencyError = 1e-4, kRateError = 0.01;
constexpr double kNoDecay = 0.5;  ///< scatter of the damping, in parts of its mean, above which nothing decays

/// Weighted least squares y = X b in the columns that the data ask for.
struct Regression {
  VectorXd value, sd;   ///< by column; 0 and NaN for columns left out
  MatrixXd covariance;  ///< of the columns for a scatter of 1; 0 for columns left out
  double square = 0;    ///< weighted sum of squares
  double freedom = 0;
};

Regression solve(const MatrixXd& x, const VectorXd& y, const std::vector<Index>& used) {
  MatrixXd part(x.rows(), static_cast<Index>(used.size()));
  for (std::size_t k = 0; k < used.size(); ++k) part.col(static_cast<Index>(k)) = x.col(used[k]);
  const VectorXd scale = part.colwise().norm().cwiseMax(1e-300);
  const MatrixXd z = part * scale.cwiseInverse().asDiagonal();
  const VectorXd b = z.colPivHouseholderQr().solve(y);
  const MatrixXd inverse = MatrixXd(z.transpose() * z).ldlt().solve(MatrixXd(MatrixXd::Identity(z.cols(), z.cols())));
  Regression r;
  r.value = VectorXd::Zero(x.cols());
  r.sd = VectorXd::Constant(x.cols(), std::nan(""));
  r.covariance = MatrixXd::Zero(x.cols(), x.cols());
  for (std::size_t i = 0; i < used.size(); ++i) {
    for (std::size_t j = 0; j < used.size(); ++j) {
      const auto a = static_cast<Index>(i), c = static_cast<Index>(j);
      r.covariance(used[i], used[j]) = inverse(a, c) / (scale[a] * scale[c]);
    }
  }
  r.square = (y - z * b).squaredNorm();
  r.freedom = static_cast<double>(x.rows()) - static_cast<double>(used.size());
  for (std::size_t k = 0; k < used.size(); ++k) {
    const auto i = static_cast<Index>(k);
    r.value[used[k]] = b[i] / scale[i];
    r.sd[used[k]] = std::sqrt(std::max(inverse(i, i), 0.0)) / scale[i];
  }
  return r;
}

/// The first `fixed` columns always; the others one by one while the best has kEvidence standard deviations, counted
/// with the scatter that is left.
Regression select(const MatrixXd& x, const VectorXd& y, Index fixed, double least_variance) {
  std::vector<Index> used;
  for (Index k = 0; k < fixed; ++k) used.push_back(k);
  Regression best = solve(x, y, used);
  for (bool grown = true; grown && static_cast<Index>(used.size()) + 1 < x.rows();) {
    grown = false;
    Index add = -1;
    double strength = kEvidence;
    for (Index k = fixed; k < x.cols(); ++k) {
      if (std::find(used.begin(), used.end(), k) != used.end()) continue;
      std::vector<Index> more = used;
      more.push_back(k);
      const Regression r = solve(x, y, more);
      const double scatter = std::sqrt(std::max(r.square / std::max(r.freedom, 1.0), least_variance));
      const double t = std::abs(r.value[k]) / (r.sd[k] * scatter);
      if (t > strength) strength = t, add = k;
    }
    if (add >= 0) {
      used.push_back(add);
      best = solve(x, y, used);
      grown = true;
    }
  }
  return best;
}

/// Of rows `x`, `y` over standard deviations `sd`. `spread` is the standard deviation that the points have beyond their
/// own, as a part of `size`: with it the scatter is as it should be (Mandel and Paule, Anal. Chem. 42, 1970,
/// 1194-1197). Without it the few most exact points would decide, and the curve miss the others by what the model
/// lacks.
struct Balanced {
  Regression fit;
  double square = 0, freedom = 1;  ///< of the fit by the points' own standard deviations
  double spread = 0;
};

Balanced balanced(const MatrixXd& x, const VectorXd& y, const VectorXd& sd, const VectorXd& size) {
  const auto with = [&](double spread) {
    const VectorXd weight = (sd.array().square() + (spread * size.array()).square()).rsqrt();
    return select(weight.asDiagonal() * x, weight.asDiagonal() * y, 1, 1);
  };
  Balanced out;
  out.fit = with(0);
  out.square = out.fit.square;
  out.freedom = out.fit.freedom;
  if (!(out.square > kPoor * out.freedom)) return out;
  double low = 1e-8, high = 10;
  for (int k = 0; k < 50; ++k) {
    const double middle = std::sqrt(low * high);
    const Regression r = with(middle);
    (r.square > r.freedom ? low : high) = middle;
  }
  out.spread = high;
  out.fit = with(high);
  return out;
}

Estimate estimate(const Regression& r, Index column, double factor) {
  if (std::isnan(r.sd[column])) return {0, std::nan(""), 0, 0};
  return Estimate::from_sd(r.value[column], factor * r.sd[column]);
}

/// Of the first harmonic alone, squared.
double first_harmonic(const NonlinearMode& m, double a2) {
  return m.k1.value + 0.75 * m.k3.value * a2 + 0.625 * m.k5.value * a2 * a2;
}

/// Third harmonic over the first, in phase with it: (9 w^2 - k1 - 3/2 k3 a^2) a3 = k3 a^3 / 4.
double third_harmonic(const NonlinearMode& m, double a) {
  const double a2 = a * a, pull = 9 * first_harmonic(m, a2) - m.k1.value - 1.5 * m.k3.value * a2;
  return pull > 0 ? 0.25 * m.k3.value * a2 / pull : 0;
}

/// What the third harmonic adds to the square of the frequency.
double stiffening(const NonlinearMode& m, double a) { return 0.75 * m.k3.value * a * a * third_harmonic(m, a); }

/// What a window adds to the square of the frequency in its middle: the frequency bends as the amplitude falls by
/// e^{-delta t}, and the straight line through it lies off by a 40th of its second derivative times the length squared.
double bending(const NonlinearMode& m, const DecayPoint& p) {
  const double a2 = p.amplitude * p.amplitude, fall = p.rate * p.length;
  return (0.75 * m.k3.value * a2 * 4 + 0.625 * m.k5.value * a2 * a2 * 16) * fall * fall / 40;
}

/// What an amplitude loses to the terms c, q and f, each over that of its value: the loss takes the energy
/// E = k1 A^2/2 + k3 A^4/4 + k5 A^6/6 at the turning point A = a + a3, and a3 grows with the cube of a.
Eigen::RowVector3d losses(const NonlinearMode& m, double a) {
  const double e = third_harmonic(m, a), top = a * (1 + e), t2 = top * top,
               w2 = first_harmonic(m, a * a) + stiffening(m, a);
  const double slope = (m.k1.value + m.k3.value * t2 + m.k5.value * t2 * t2) * (1 + e) * (1 + 3 * e);
  const double w = std::sqrt(std::max(w2, 0.0));
  if (!(slope > 0) || !(w > 0)) return Eigen::RowVector3d(1, 0, 0);
  return w2 / slope *
         Eigen::RowVector3d(1, 8 / (3 * kPi) * w * a * (1 - 1.8 * e), a > 0 ? 4 / kPi * (1 + e) / (w * a) : 0);
}

void judge(NonlinearMode& mode) {
  mode.summary.chi_square = mode.chi_square;
  if (mode.chi_square > kWrong)
    mode.summary.fail(
        fmt::format("the points scatter {:.0f} times as much about one mode's curves as they should: more "
                    "than one mode, or a motion that is still driven",
                    std::sqrt(mode.chi_square)));
  else if (mode.chi_square > kPoor)
    mode.summary.warn(fmt::format(
        "model error: chi-square {:.2f} (1 when the model fits); beyond their noise the points lie {:.2g} % "
        "of the frequency and {:.2g} % of the damping off the curves, and the intervals hold that",
        mode.chi_square, 100 * mode.frequency_spread, 100 * mode.rate_spread));
  if (mode.rate_spread > kNoDecay)
    mode.summary.fail(
        fmt::format("the damping scatters by {:.0f} % of its mean beyond the noise: no free decay of one mode",
                    100 * mode.rate_spread));
  if (!(mode.k1.value > 0)) mode.summary.fail("the stiffness at small amplitude is not positive");
  const double low = mode.rate(mode.lowest), high = mode.rate(mode.highest);
  if (low < 0 || high < 0) mode.summary.warn("the damping is negative at some amplitude of the data");
  mode.summary.trust =
      fmt::format("one mode at amplitudes from {:.3g} to {:.3g}; beyond is extrapolation", mode.lowest, mode.highest);
}

void set_range(NonlinearMode& mode, double amplitude) {
  mode.lowest = mode.lowest == 0 ? amplitude : std::min(mode.lowest, amplitude);
  mode.highest = std::max(mode.highest, amplitude);
}

}  // namespace

double NonlinearMode::frequency(double a) const {
  const double w2 = first_harmonic(*this, a * a) + stiffening(*this, a);
  return w2 >= 0 ? std::sqrt(w2) : std::nan("");
}

double NonlinearMode::rate(double a) const {
  return 0.5 * losses(*this, a).dot(Eigen::RowVector3d(c.value, q.value, f.value));
}

IdentifiedModel NonlinearMode::model() const {
  IdentifiedModel m;
  m.method = "decay";
  m.states = {"x", "v"};
  m.inputs = {"u"};
  const auto minus = [](const Estimate& e) { return Estimate{-e.value, e.sd, -e.high, -e.low}; };
  Equation force{"v'", {}};
  for (const auto& [term, e, unit] : {std::tuple{"x", &k1, "1/s^2"},
                                      {"x^3", &k3, "1/(m^2 s^2)"},
                                      {"x^5", &k5, "1/(m^4 s^2)"},
                                      {"v", &c, "1/s"},
                                      {"abs(v)*v", &q, "1/m"},
                                      {"sgn(v)", &f, "m/s^2"}})
    if (e->value != 0) force.terms.push_back({term, minus(*e), unit});
  force.terms.push_back({"u", {1, 0, 1, 1}, "1"});
  m.equations = {{"x'", {{"v", {1, 0, 1, 1}, "1"}}}, force};
  std::vector<Index> kept;
  const std::array<std::pair<const char*, const Estimate*>, 6> all{
      {{"k1", &k1}, {"k_cubic", &k3}, {"k_quintic", &k5}, {"c", &c}, {"c_quadratic", &q}, {"friction", &f}}};
  for (std::size_t i = 0; i < all.size(); ++i) {
    if (all[i].second->value == 0) continue;
    m.parameters.emplace_back(all[i].first, *all[i].second);
    kept.push_back(static_cast<Index>(i));
  }
  for (const Index i : kept)
    for (const Index j : kept) m.parameter_covariance.push_back(covariance(i, j));
  m.summary = summary;
  return m;
}

NonlinearMode fit_decay(const DecayCurve& curve) {
  const auto n = static_cast<Index>(curve.points.size());
  if (n < 6) throw Error("decay: six windows at least are needed");
  MatrixXd stiffness(n, 3), damping(n, 3);
  VectorXd square(n), fall(n), square_sd(n), fall_sd(n);
  NonlinearMode mode;
  for (Index k = 0; k < n; ++k) {
    const DecayPoint& p = curve.points[static_cast<std::size_t>(k)];
    if (!(p.frequency_sd > 0) || !(p.rate_sd > 0)) throw Error("decay: a window has no scatter: is the record exact?");
    const double a = p.amplitude, w = p.frequency;
    stiffness.row(k) = Eigen::RowVector3d(1, 0.75 * a * a, 0.625 * a * a * a * a);
    square[k] = w * w + p.rate * p.rate;
    square_sd[k] = 2 * w * std::hypot(p.frequency_sd, kFrequencyError * w);
    fall[k] = 2 * p.rate;
    fall_sd[k] = 2 * std::hypot(p.rate_sd, kRateError * p.rate);
    set_range(mode, a);
  }
  // What the third harmonic and the windows add follows from the stiffness found.
  Balanced stiff;
  for (int pass = 0; pass < 3; ++pass) {
    VectorXd first = square;
    for (Index k = 0; k < n && pass > 0; ++k) {
      const DecayPoint& p = curve.points[static_cast<std::size_t>(k)];
      first[k] -= stiffening(mode, p.amplitude) + bending(mode, p);
    }
    stiff = balanced(stiffness, first, square_sd, square);
    mode.k1.value = stiff.fit.value[0];
    mode.k3.value = stiff.fit.value[1];
    mode.k5.value = stiff.fit.value[2];
  }
  const Regression& s = stiff.fit;
  for (Index k = 0; k < n; ++k) damping.row(k) = losses(mode, curve.points[static_cast<std::size_t>(k)].amplitude);
  const Balanced damp = balanced(damping, fall, fall_sd, VectorXd::Constant(n, fall.cwiseAbs().mean()));
  const Regression& d = damp.fit;
  mode.chi_square = (stiff.square + damp.square) / (stiff.freedom + damp.freedom);
  mode.frequency_spread = stiff.spread / 2;
  mode.rate_spread = damp.spread;
  const double of_s = std::sqrt(std::max(1.0, s.square / s.freedom)),
               of_d = std::sqrt(std::max(1.0, d.square / d.freedom));
  mode.k1 = estimate(s, 0, of_s);
  mode.k3 = estimate(s, 1, of_s);
  mode.k5 = estimate(s, 2, of_s);
  mode.c = estimate(d, 0, of_d);
  mode.q = estimate(d, 1, of_d);
  mode.f = estimate(d, 2, of_d);
  mode.covariance.topLeftCorner<3, 3>() = of_s * of_s * s.covariance;
  mode.covariance.bottomRightCorner<3, 3>() = of_d * of_d * d.covariance;
  judge(mode);
  return mode;
}

NonlinearMode fit_steady(const std::vector<SteadyPoint>& points, Estimate& gain) {
  const auto n = static_cast<Index>(points.size());
  if (n < 8) throw Error(fmt::format("steady sine: {} points, at least eight are needed", n));
  NonlinearMode mode;
  // Columns k1, c, g, k3, k5, q, f; rows: real and imaginary part of the balance over exp(i phase of x).
  MatrixXd x = MatrixXd::Zero(2 * n, 7);
  VectorXd y = VectorXd::Zero(2 * n), weight = VectorXd::Ones(2 * n);
  for (Index k = 0; k < n; ++k) {
    const SteadyPoint& p = points[static_cast<std::size_t>(k)];
    if (!(p.omega > 0) || !(p.amplitude > 0) || !std::isfinite(p.phase) || !(p.force > 0))
      throw Error(fmt::format("steady sine: point {}: speed, amplitude and force must be > 0", k + 1));
    const double a = p.amplitude, w = p.omega;
    // A sweep adds (2 i w + c) X' + i chirp X + X'' to the balance, X' / X = growth + i drift.
    x.row(2 * k) << a, p.growth * a, -p.force * std::cos(p.phase), 0.75 * a * a * a, 0.625 * std::pow(a, 5), 0, 0;
    y[2 * k] = (w * w + 2 * w * p.drift - p.curvature.real()) * a;
    y[2 * k + 1] = -(2 * w * p.growth + p.chirp + p.curvature.imag()) * a;
    x.row(2 * k + 1) << 0, (w + p.drift) * a, p.force * std::sin(p.phase), 0, 0, 8 / (3 * kPi) * w * w * a * a, 4 / kPi;
    set_range(mode, a);
  }
  // What an error of amplitude or phase by one part of the amplitude does to the balance: the slope there times a.
  Regression r;
  for (int pass = 0; pass < 4; ++pass) {
    VectorXd first = y;  // without what the third harmonic adds
    for (Index k = 0; k < n && pass > 0; ++k) {
      const double a = points[static_cast<std::size_t>(k)].amplitude;
      first[2 * k] -= stiffening(mode, a) * a;
    }
    r = select(weight.asDiagonal() * x, weight.asDiagonal() * first, 3, 0);
    mode.k1.value = r.value[0];
    mode.k3.value = r.value[3];
    mode.k5.value = r.value[4];
    for (Index k = 0; k < n; ++k) {
      const SteadyPoint& p = points[static_cast<std::size_t>(k)];
      const double a = p.amplitude, w = p.omega;
      const double radial = r.value[0] + 2.25 * r.value[3] * a * a + 3.125 * r.value[4] * std::pow(a, 4) - w * w;
      const double around = r.value[0] + 0.75 * r.value[3] * a * a + 0.625 * r.value[4] * std::pow(a, 4) - w * w;
      const double loss = w * (r.value[1] + 8 / (3 * kPi) * r.value[5] * w * a);
      weight[2 * k] = 1 / (a * std::hypot(radial, loss) + 1e-300);
      weight[2 * k + 1] = 1 / (a * std::hypot(around, loss) + 1e-300);
    }
  }
  const double sd = std::sqrt(r.square / r.freedom);
  mode.k1 = estimate(r, 0, sd);
  mode.c = estimate(r, 1, sd);
  gain = estimate(r, 2, sd);
  mode.k3 = estimate(r, 3, sd);
  mode.k5 = estimate(r, 4, sd);
  mode.q = estimate(r, 5, sd);
  mode.f = estimate(r, 6, sd);
  const std::array<Index, 6> columns{0, 3, 4, 1, 5, 6};  // of k1, k3, k5, c, q, f
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j < 6; ++j)
      mode.covariance(static_cast<Index>(i), static_cast<Index>(j)) = sd * sd * r.covariance(columns[i], columns[j]);
  }
  mode.chi_square = std::nan("");  // the scatter of the points is their noise: nothing else tells it
  judge(mode);
  mode.summary.residual = sd;
  // Phases of the other sign leave the balance as it is but for the sign of all that is lost.
  if (mode.rate(mode.lowest) < 0 && mode.rate(mode.highest) < 0)
    mode.summary.fail(
        "the damping is negative at all amplitudes: read as leads the phases have the mode give energy, read as lags "
        "the "
        "same points have a positive damping (a column phase_lag_deg, or --phase lag)");
  if (sd > 0.1)
    mode.summary.warn(
        fmt::format("the points scatter by {:.0f} % of their amplitude about one mode: more than one mode, "
                    "or phases of another convention",
                    100 * sd));
  return mode;
}

}  // namespace whirl::response
