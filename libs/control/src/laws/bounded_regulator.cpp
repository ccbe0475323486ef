#include <algorithm>
#include <cmath>

#include "whirl/control/laws/mpc.hpp"

namespace whirl::control {

SampledAxis sample_axis(double k1, double c, double h) {
  // Series of the 2 x 2 exponential of F = (0 1; -k1 -c) and of its integral times (0, 1).
  SampledAxis s;
  double t00 = 1, t01 = 0, t10 = 0, t11 = 1;  // F^n h^n / n!
  for (int n = 1; n <= 30; ++n) {
    s.b0 += t01 * h / n;
    s.b1 += t11 * h / n;
    const double n00 = -k1 * t01 * h / n, n01 = (t00 - c * t01) * h / n;
    const double n10 = -k1 * t11 * h / n, n11 = (t10 - c * t11) * h / n;
    t00 = n00, t01 = n01, t10 = n10, t11 = n11;
    s.a00 += t00, s.a01 += t01, s.a10 += t10, s.a11 += t11;
  }
  return s;
}

BoundedRegulator::BoundedRegulator(const SampledAxis& plant, double kp, double kd, int horizon) noexcept
    : plant_(plant), kp_(kp), kd_(kd), horizon_(horizon) {
  const SampledAxis& p = plant_;
  double rx = -kp, rv = -kd;  // -K (A - b K)^k
  for (int k = 0; k < horizon_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    row_x_[i] = rx, row_v_[i] = rv;
    const double through = rx * p.b0 + rv * p.b1;
    const double next = rx * p.a00 + rv * p.a10 - through * kp;
    rv = rx * p.a01 + rv * p.a11 - through * kd;
    rx = next;
  }
}

// Inputs and half the gradient of sum (w + K x)^2 for a given set of inputs at their limits.
void BoundedRegulator::trajectory(double x, double v, const Inputs& low, const Inputs& high, const Bounds& set,
                                  Inputs& w, Inputs& gradient) const noexcept {
  const SampledAxis& p = plant_;
  // Closed loop without limits: A - b K.
  const double f00 = p.a00 - p.b0 * kp_, f01 = p.a01 - p.b0 * kd_, f10 = p.a10 - p.b1 * kp_, f11 = p.a11 - p.b1 * kd_;
  const auto limit = [&](int k) {
    const auto i = static_cast<std::size_t>(k);
    return set[i] == Bound::low ? low[i] : high[i];
  };
  int last = horizon_ - 1;
  while (last >= 0 && set[static_cast<std::size_t>(last)] == Bound::none) --last;
  int first = 0;
  while (first < last && set[static_cast<std::size_t>(first)] != Bound::none) ++first;

  // Cost to go x'S x + 2 q'x, zero behind the last limit. Free inputs are w = -K x + e0 + e1 x + e2 v. Inputs before
  // the first free one are at their limits whatever the cost.
  double s00 = 0, s01 = 0, s11 = 0, q0 = 0, q1 = 0;
  std::array<double, kMaxHorizon> e0, e1, e2;
  for (int k = last; k >= first && first < last; --k) {
    const double sb0 = s00 * p.b0 + s01 * p.b1, sb1 = s01 * p.b0 + s11 * p.b1;
    double n00, n01, n11, m0, m1;
    if (set[static_cast<std::size_t>(k)] == Bound::none) {
      const double den = 1 / (1 + p.b0 * sb0 + p.b1 * sb1);
      const double g0 = f00 * sb0 + f10 * sb1, g1 = f01 * sb0 + f11 * sb1, bq = p.b0 * q0 + p.b1 * q1;
      const auto i = static_cast<std::size_t>(k);
      e0[i] = -bq * den, e1[i] = -g0 * den, e2[i] = -g1 * den;
      const double t00 = s00 * f00 + s01 * f10, t01 = s00 * f01 + s01 * f11;
      const double t10 = s01 * f00 + s11 * f10, t11 = s01 * f01 + s11 * f11;
      n00 = f00 * t00 + f10 * t10 - g0 * g0 * den;
      n01 = f00 * t01 + f10 * t11 - g0 * g1 * den;
      n11 = f01 * t01 + f11 * t11 - g1 * g1 * den;
      m0 = f00 * q0 + f10 * q1 - g0 * bq * den;
      m1 = f01 * q0 + f11 * q1 - g1 * bq * den;
    } else {
      const double u = limit(k);
      n00 = kp_ * kp_ + p.a00 * p.a00 * s00 + 2 * p.a00 * p.a10 * s01 + p.a10 * p.a10 * s11;
      n01 = kp_ * kd_ + p.a00 * p.a01 * s00 + (p.a00 * p.a11 + p.a10 * p.a01) * s01 + p.a10 * p.a11 * s11;
      n11 = kd_ * kd_ + p.a01 * p.a01 * s00 + 2 * p.a01 * p.a11 * s01 + p.a11 * p.a11 * s11;
      m0 = (kp_ + p.a00 * sb0 + p.a10 * sb1) * u + p.a00 * q0 + p.a10 * q1;
      m1 = (kd_ + p.a01 * sb0 + p.a11 * sb1) * u + p.a01 * q0 + p.a11 * q1;
    }
    s00 = n00, s01 = n01, s11 = n11, q0 = m0, q1 = m1;
  }

  std::array<double, kMaxHorizon> e;  // w + K x
  for (int k = 0; k < horizon_; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const double regulator = -kp_ * x - kd_ * v;
    if (set[i] == Bound::none) {
      e[i] = k < last ? e0[i] + e1[i] * x + e2[i] * v : 0;
      w[i] = regulator + e[i];
    } else {
      w[i] = limit(k);
      e[i] = w[i] - regulator;
    }
    const double next = p.a00 * x + p.a01 * v + p.b0 * w[i];
    v = p.a10 * x + p.a11 * v + p.b1 * w[i];
    x = next;
  }
  // Adjoint of the trajectory: independent of the recursion above. Behind the last limit every e is 0.
  for (int k = horizon_ - 1; k > last; --k) gradient[static_cast<std::size_t>(k)] = 0;
  // Two samples at a time: half as long a chain of operations. Rows of A'^2, A'K' and b'A'.
  const double p00 = p.a00 * p.a00 + p.a10 * p.a01, p01 = p.a10 * (p.a00 + p.a11), p10 = p.a01 * (p.a00 + p.a11),
               p11 = p.a01 * p.a10 + p.a11 * p.a11;
  const double k0 = p.a00 * kp_ + p.a10 * kd_, k1 = p.a01 * kp_ + p.a11 * kd_, bk = p.b0 * kp_ + p.b1 * kd_;
  const double c0 = p.b0 * p.a00 + p.b1 * p.a01, c1 = p.b0 * p.a10 + p.b1 * p.a11;
  double l0 = 0, l1 = 0;
  int k = last;
  for (; k > 0; k -= 2) {
    const auto i = static_cast<std::size_t>(k);
    const double here = e[i], before = e[i - 1];
    gradient[i] = here + p.b0 * l0 + p.b1 * l1;
    gradient[i - 1] = before + bk * here + c0 * l0 + c1 * l1;
    const double next = k0 * here + kp_ * before + p00 * l0 + p01 * l1;
    l1 = k1 * here + kd_ * before + p10 * l0 + p11 * l1;
    l0 = next;
  }
  if (k == 0) gradient[0] = e[0] + p.b0 * l0 + p.b1 * l1;
}

BoundedRegulator::Solution BoundedRegulator::solve(double x, double v, const Inputs& low, const Inputs& high,
                                                   Bounds& set) const noexcept {
  constexpr int kPatience = 5;  // block steps without progress before single ones
  Solution out;
  const auto n = static_cast<std::size_t>(horizon_);
  if (std::all_of(set.begin(), set.begin() + horizon_, [](Bound b) { return b == Bound::none; })) {
    bool inside = true;
    for (std::size_t i = 0; i < n; ++i) {
      out.w[i] = row_x_[i] * x + row_v_[i] * v;
      inside = inside && out.w[i] >= low[i] && out.w[i] <= high[i];
    }
    if (inside) {
      out.iterations = 1;
      out.solved = true;
      return out;
    }
  }
  Inputs gradient, feasible;
  int fewest = horizon_ + 1, patience = kPatience;
  bool single = false;
  for (out.iterations = 1; out.iterations <= kMaxIterations; ++out.iterations) {
    trajectory(x, v, low, high, set, out.w, gradient);
    double scale = 0;
    for (int k = 0; k < horizon_; ++k) scale = std::max(scale, std::abs(out.w[static_cast<std::size_t>(k)]));
    const double slack = 1e-12 * scale;
    Bounds next = set;
    int wrong = 0, first = -1, steepest = -1;  // first limit on the way to w, steepest way off a limit
    double step = 1, slope = 0;
    out.residual = 0;
    for (int k = 0; k < horizon_; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const double w = out.w[i], g = gradient[i];
      out.residual = std::max(out.residual, std::abs(w - std::clamp(w - g, low[i], high[i])));
      if (set[i] == Bound::none) {
        if (w < low[i] - slack) next[i] = Bound::low;
        if (w > high[i] + slack) next[i] = Bound::high;
      } else if (set[i] == Bound::low ? g < -slack : g > slack) {
        next[i] = Bound::none;
      }
      if (next[i] == set[i]) continue;
      ++wrong;
      if (!single) continue;
      if (set[i] == Bound::none) {
        const double end = next[i] == Bound::low ? low[i] : high[i];
        const double part = std::clamp((end - feasible[i]) / (w - feasible[i]), 0.0, 1.0);
        if (first < 0 || part < step) step = part, first = k;
      } else if (std::abs(g) > slope) {
        slope = std::abs(g), steepest = k;
      }
    }
    if (wrong == 0) {
      out.solved = true;
      return out;
    }
    if (single) {
      for (int k = 0; k < horizon_; ++k) {
        const auto i = static_cast<std::size_t>(k);
        feasible[i] += step * (out.w[i] - feasible[i]);
      }
      const auto i = static_cast<std::size_t>(first >= 0 ? first : steepest);
      set[i] = next[i];
      if (set[i] != Bound::none) feasible[i] = set[i] == Bound::low ? low[i] : high[i];
    } else if (wrong < fewest || patience > 0) {
      patience = wrong < fewest ? kPatience : patience - 1;
      fewest = std::min(fewest, wrong);
      set = next;
    } else {
      single = true;
      for (int k = 0; k < horizon_; ++k) {
        const auto i = static_cast<std::size_t>(k);
        feasible[i] = std::clamp(out.w[i], low[i], high[i]);
        set[i] = feasible[i] <= low[i] ? Bound::low : feasible[i] >= high[i] ? Bound::high : Bound::none;
      }
    }
  }
  out.iterations = kMaxIterations;
  return out;
}

AxisOutput ModelPredictive::step(const AxisInput& in) noexcept {
  residual = 0;
  iterations = 0;
  const double free = -kp * in.x - kd * in.v;
  if (!(limit > 0)) return {free - in.d, 0};
  const int n = regulator.horizon();
  // Four chains side by side: each holds every fourth sample of the turning disturbance.
  BoundedRegulator::Inputs low, high;
  const double c = std::cos(in.omega * sample_time), s = std::sin(in.omega * sample_time);
  const double c2 = c * c - s * s, s2 = 2 * c * s, c4 = c2 * c2 - s2 * s2, s4 = 2 * c2 * s2;
  std::array<double, 4> d, quarter;
  d[0] = in.d, quarter[0] = in.d_quarter;
  d[1] = c * d[0] + s * quarter[0], quarter[1] = c * quarter[0] - s * d[0];
  d[2] = c2 * d[0] + s2 * quarter[0], quarter[2] = c2 * quarter[0] - s2 * d[0];
  d[3] = c2 * d[1] + s2 * quarter[1], quarter[3] = c2 * quarter[1] - s2 * d[1];
  static_assert(BoundedRegulator::kMaxHorizon % 4 == 0);
  for (int k = 0; k < n; k += 4) {
    for (std::size_t j = 0; j < 4; ++j) {
      const auto i = static_cast<std::size_t>(k) + j;
      low[i] = d[j] - limit;
      high[i] = d[j] + limit;
      const double turned = c4 * d[j] + s4 * quarter[j];
      quarter[j] = c4 * quarter[j] - s4 * d[j];
      d[j] = turned;
    }
  }
  // One sample later the set has moved up by one, and its end goes on.
  std::copy(set.begin() + 1, set.begin() + n, set.begin());
  const BoundedRegulator::Solution best = regulator.solve(in.x, in.v, low, high, set);
  residual = best.residual;
  iterations = best.iterations;
  // Without an answer the clipped regulator, and no guess for the next step.
  if (!best.solved) reset();
  const double w = best.solved ? best.w[0] : free;
  return {std::clamp(w - in.d, -limit, limit), 0};
}

}  // namespace whirl::control
