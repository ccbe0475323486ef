#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>

#include "whirl/core/recording.hpp"

/// What happens to records between the machine and the file, seeded. Channels x, y (displacement) and beta as
/// testing/machines.hpp makes them.
namespace whirl::testing {

enum class Damage {
  none,
  outliers,  ///< 0.5 % of the samples of x and y, 5 to 20 times the noise-free rms
  nan_gap,   ///< 0.2 s of both axes are NaN
  zero_gap,  ///< 0.2 s of both axes read 0
  clipping,  ///< limits that 10 % of the samples of each axis exceed
  hum50,     ///< 50 Hz, rms 20 % of that of the motion, other phase per axis
  hum60,     ///< 60 Hz
  drift,     ///< linear, once the rms over the record
  ar1,       ///< noise with correlation 0.9 from sample to sample, size as given
  frozen,    ///< x stands still for 0.4 s
  splice,    ///< the last part comes from 0.5 s later
  swapped_axes,
  reversed_axis,      ///< y with the other sign
  reversed_rotation,  ///< angle with the other sign
  jitter,             ///< samples taken up to a quarter of the sample time early or late
  degrees,            ///< angle in degrees where radians are stated
  millimetres,        ///< displacement in mm where m is stated
};
inline constexpr std::array kDamages = {Damage::none,          Damage::outliers,
                                        Damage::nan_gap,       Damage::zero_gap,
                                        Damage::clipping,      Damage::hum50,
                                        Damage::hum60,         Damage::drift,
                                        Damage::ar1,           Damage::frozen,
                                        Damage::splice,        Damage::swapped_axes,
                                        Damage::reversed_axis, Damage::reversed_rotation,
                                        Damage::jitter,        Damage::degrees,
                                        Damage::millimetres};
inline const char* to_string(Damage d) {
  constexpr std::array names = {
      "none",   "outliers", "nan gap",    "zero gap", "clipping",     "hum 50 Hz",     "hum 60 Hz",
      "drift",  "AR(1)",    "frozen",     "splice",   "swapped axes", "reversed axis", "reversed rotation",
      "jitter", "degrees",  "millimetres"};
  return names[static_cast<std::size_t>(d)];
}

namespace damages_detail {

inline Eigen::VectorXd& channel(Recording& r, std::string_view name) {
  for (Channel& c : r.channels) {
    if (c.name == name) return c.samples;
  }
  throw std::invalid_argument("no such channel");
}
inline double rms(const Eigen::VectorXd& v) { return std::sqrt((v.array() - v.mean()).square().mean()); }

inline void clip(Eigen::VectorXd& v, double share) {
  Eigen::VectorXd size = (v.array() - v.mean()).abs().matrix();
  const double mean = v.mean();
  const auto at = static_cast<Eigen::Index>((1 - share) * static_cast<double>(v.size()));
  std::nth_element(size.begin(), size.begin() + at, size.end());
  v = v.cwiseMin(mean + size[at]).cwiseMax(mean - size[at]);
}

/// Values between the samples, third order through four neighbours; `shift` in samples, below 1.
inline Eigen::VectorXd shifted(const Eigen::VectorXd& v, const Eigen::VectorXd& shift) {
  Eigen::VectorXd out = v;
  for (Eigen::Index i = 2; i + 2 < v.size(); ++i) {
    const Eigen::Index k = shift[i] < 0 ? i - 1 : i;
    const double u = shift[i] < 0 ? 1 + shift[i] : shift[i];
    const double a = v[k - 1], b = v[k], c = v[k + 1], d = v[k + 2];
    out[i] = b + 0.5 * u * (c - a + u * (2 * a - 5 * b + 4 * c - d + u * (3 * (b - c) + d - a)));
  }
  return out;
}

}  // namespace damages_detail

/// The record with one damage. `size` scales it (1: as documented).
inline Recording damaged(const Recording& given, Damage damage, unsigned long long seed, double size = 1) {
  using namespace damages_detail;
  Recording r = given;
  Eigen::VectorXd &x = channel(r, "x"), &y = channel(r, "y"), &beta = channel(r, "beta");
  const Eigen::Index n = r.size();
  std::mt19937_64 random(seed * 15485863 + static_cast<unsigned long long>(damage));
  std::normal_distribution<double> normal;
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  const auto samples = [&](double seconds) { return static_cast<Eigen::Index>(std::lround(seconds / r.dt)); };
  const auto place = [&](Eigen::Index length) {
    return static_cast<Eigen::Index>(uniform(0.1, 0.9) * static_cast<double>(n - length));
  };
  const auto hum = [&](double hz) {
    for (Eigen::VectorXd* v : {&x, &y}) {
      const double a = 0.2 * size * std::numbers::sqrt2 * rms(*v), phase = uniform(-3, 3);
      for (Eigen::Index i = 0; i < n; ++i) {
        (*v)[i] += a * std::cos(2 * std::numbers::pi * hz * r.dt * static_cast<double>(i) + phase);
      }
    }
  };
  switch (damage) {
    case Damage::none:
      break;
    case Damage::outliers:
      for (Eigen::VectorXd* v : {&x, &y}) {
        const double sd = rms(*v);
        for (Eigen::Index i = 0; i < n; ++i) {
          if (uniform(0, 1) < 0.005 * size) (*v)[i] += (uniform(-1, 1) < 0 ? -1 : 1) * uniform(5, 20) * sd;
        }
      }
      break;
    case Damage::nan_gap:
    case Damage::zero_gap: {
      const Eigen::Index length = samples(0.2 * size), first = place(length);
      const double value = damage == Damage::zero_gap ? 0.0 : std::numeric_limits<double>::quiet_NaN();
      x.segment(first, length).setConstant(value);
      y.segment(first, length).setConstant(value);
      break;
    }
    case Damage::clipping:
      clip(x, 0.1 * size);
      clip(y, 0.1 * size);
      break;
    case Damage::hum50:
      hum(50);
      break;
    case Damage::hum60:
      hum(60);
      break;
    case Damage::drift:
      for (Eigen::VectorXd* v : {&x, &y}) {
        const double d = size * (uniform(-1, 1) < 0 ? -1 : 1) * rms(*v);
        *v += Eigen::VectorXd::LinSpaced(n, -0.5 * d, 0.5 * d);
      }
      break;
    case Damage::ar1:
      for (Eigen::VectorXd* v : {&x, &y}) {
        const double sd = 0.1 * size * rms(*v), a = 0.9;
        double e = sd * normal(random);
        for (Eigen::Index i = 0; i < n; ++i) {
          (*v)[i] += e;
          e = a * e + std::sqrt(1 - a * a) * sd * normal(random);
        }
      }
      break;
    case Damage::frozen: {
      const Eigen::Index length = samples(0.4 * size), first = place(length);
      x.segment(first, length).setConstant(x[first]);
      break;
    }
    case Damage::splice: {
      const Eigen::Index skip = samples(0.5 * size), at = place(skip);
      for (Channel& c : r.channels) {
        Eigen::VectorXd v(n - skip);
        v << c.samples.head(at), c.samples.tail(n - at - skip);
        c.samples = v;
      }
      break;
    }
    case Damage::swapped_axes:
      x.swap(y);
      break;
    case Damage::reversed_axis:
      y = -y;
      break;
    case Damage::reversed_rotation:
      beta = -beta;
      break;
    case Damage::jitter: {
      Eigen::VectorXd shift(n);
      for (double& s : shift) s = 0.25 * size * uniform(-1, 1);
      x = shifted(x, shift);
      y = shifted(y, shift);
      break;
    }
    case Damage::degrees:
      beta *= 180 / std::numbers::pi;
      break;
    case Damage::millimetres:
      x *= 1e3;
      y *= 1e3;
      break;
  }
  return r;
}

}  // namespace whirl::testing
