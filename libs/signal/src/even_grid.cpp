#include "whirl/signal/even_grid.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/signal/derivative.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::signal {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Second derivatives at the knots of the natural cubic spline through (t, x): Thomas algorithm.
VectorXd knot_curvatures(const VectorXd& t, const VectorXd& x) {
  const Index n = t.size();
  VectorXd second = VectorXd::Zero(n), upper = VectorXd::Zero(n), right = VectorXd::Zero(n);
  for (Index i = 1; i + 1 < n; ++i) {
    const double before = t[i] - t[i - 1], after = t[i + 1] - t[i];
    const double pivot = 2 * (before + after) - before * upper[i - 1];
    upper[i] = after / pivot;
    right[i] = (6 * ((x[i + 1] - x[i]) / after - (x[i] - x[i - 1]) / before) - before * right[i - 1]) / pivot;
  }
  for (Index i = n - 2; i > 0; --i) second[i] = right[i] - upper[i] * second[i + 1];
  return second;
}

/// A piece of a cubic spline of length h, at share b of it.
double on_piece(double h, double b, double x0, double x1, double second0, double second1) {
  const double a = 1 - b;
  return a * x0 + b * x1 + h * h / 6 * ((a * a * a - a) * second0 + (b * b * b - b) * second1);
}

VectorXd read_off_spline(const VectorXd& t, const VectorXd& x, const VectorXd& at) {
  const VectorXd second = knot_curvatures(t, x);
  VectorXd out(at.size());
  Index i = 0;
  for (Index k = 0; k < at.size(); ++k) {
    while (i + 2 < t.size() && t[i + 1] <= at[k]) ++i;
    const double h = t[i + 1] - t[i];
    out[k] = on_piece(h, (at[k] - t[i]) / h, x[i], x[i + 1], second[i], second[i + 1]);
  }
  return out;
}

VectorXd hold_last(const VectorXd& t, const VectorXd& x, const VectorXd& at) {
  VectorXd out(at.size());
  Index i = 0;
  for (Index k = 0; k < at.size(); ++k) {
    while (i + 1 < t.size() && t[i + 1] <= at[k]) ++i;
    out[k] = x[i];
  }
  return out;
}

/// Readings of less than half a step together, at the mean of their times: no curve is led through the noise of two.
std::pair<VectorXd, VectorXd> apart(const VectorXd& t, const VectorXd& x, double step) {
  VectorXd times(t.size()), values(t.size());
  Index n = 0;
  for (Index first = 0; first < t.size(); ++n) {
    Index last = first + 1;
    while (last < t.size() && t[last] - t[first] < 0.5 * step) ++last;
    times[n] = t.segment(first, last - first).mean();
    values[n] = x.segment(first, last - first).mean();
    first = last;
  }
  return {times.head(n), values.head(n)};
}

/// Still in most steps, and elsewhere by more than counts of a converter.
bool jumps(const VectorXd& x) {
  constexpr double kJump = 0.02;  // of the range
  const Index steps = x.size() - 1;
  const Eigen::ArrayXd moves = (x.tail(steps) - x.head(steps)).array().abs();
  const Index moving = (moves > 0).count();
  return 2 * moving < steps && moves.sum() >= kJump * static_cast<double>(moving) * (x.maxCoeff() - x.minCoeff());
}

/// To which of `rows` instants every reading is moved: in their order, each to a free one where one is near.
std::vector<Index> nearest_free(const VectorXd& places, Index rows) {
  constexpr double kFarthest = 2;  // steps
  std::vector<Index> to;
  Index last = -1;
  for (const double place : places) {
    Index k = std::max<Index>(last + 1, std::lround(place));
    if (static_cast<double>(k) - place > kFarthest) k = last;
    last = std::clamp<Index>(k, 0, rows - 1);
    to.push_back(last);
  }
  return to;
}

/// Readings `x` at `places` (in steps of the grid) moved along the curve that is smooth in `grid`, samples of about
/// them.
VectorXd moved(const VectorXd& places, const VectorXd& x, const std::vector<Index>& to, const VectorXd& grid,
               double noise) {
  const SmoothedSignal curve = smoothing_spline_for_noise(grid, 1, noise);
  VectorXd sum = VectorXd::Zero(grid.size()), count = sum;
  for (Index i = 0; i < x.size(); ++i) {
    const Index piece = std::clamp<Index>(static_cast<Index>(std::floor(places[i])), 0, grid.size() - 2);
    sum[to[static_cast<std::size_t>(i)]] +=
        x[i] - on_piece(1, places[i] - static_cast<double>(piece), curve.value[piece], curve.value[piece + 1],
                        curve.second[piece], curve.second[piece + 1]);
    count[to[static_cast<std::size_t>(i)]] += 1;
  }
  return curve.value + (sum.array() / count.array().max(1)).matrix();
}

void check_times(const VectorXd& t, double step) {
  const Index n = t.size();
  if (n < 2) throw Error("an even grid needs two readings at least");
  if (!(step > 0)) throw Error::in_field("step of the grid", fmt::format("{}", step), "above 0");
  if (!((t.tail(n - 1) - t.head(n - 1)).array() > 0).all()) throw Error("times of the readings must increase");
}

/// The same where all instants lie within the times.
VectorXd inside(const VectorXd& t, const VectorXd& x, const VectorXd& at, double step) {
  constexpr Index kFewest = 32;
  constexpr double kNoise = 1e-4;
  if (jumps(x)) return hold_last(t, x, at);
  VectorXd grid = read_off_spline(t, x, at);
  const double spread = std::sqrt((x.array() - x.mean()).square().mean());
  if (std::min(grid.size(), x.size()) < kFewest || !(noise_sd(grid) > kNoise * spread)) return grid;
  const auto [times, values] = apart(t, x, step);
  if (times.size() > 1) grid = read_off_spline(times, values, at);
  const VectorXd places = (t.array() - at[0]) / step;
  const std::vector<Index> to = nearest_free(places, at.size());
  // The curve through the readings has less noise than they: once more with the noise that they have.
  for (int pass = 0; pass < 2; ++pass) grid = moved(places, x, to, grid, noise_sd(grid));
  return grid;
}

}  // namespace

double even_step(const Eigen::Ref<const VectorXd>& t, double step) {
  constexpr double kEmpty = 0.05, kMost = 2;
  check_times(t, step);
  for (double factor = 1; factor < kMost; factor *= 1.1) {
    const VectorXd places = (t.array() - t[0]) / (factor * step);
    const auto rows = static_cast<Index>(std::floor(places[t.size() - 1])) + 1;
    const std::vector<Index> to = nearest_free(places, rows);
    Index empty = rows - 1;
    for (std::size_t i = 1; i < to.size(); ++i) empty -= to[i] != to[i - 1];
    if (static_cast<double>(empty) <= kEmpty * static_cast<double>(rows)) return factor * step;
  }
  return kMost * step;
}

VectorXd onto_even_grid(const Eigen::Ref<const VectorXd>& t, const Eigen::Ref<const VectorXd>& x, double start,
                        double step, Index rows) {
  check_times(t, step);
  const Index n = t.size();
  if (n != x.size()) throw Error("an even grid needs as many times as readings");
  constexpr double kRounding = 1e-9;  // steps
  VectorXd out = VectorXd::Constant(rows, std::numeric_limits<double>::quiet_NaN());
  const auto first = std::max<Index>(0, static_cast<Index>(std::ceil((t[0] - start) / step - kRounding)));
  const auto last = std::min<Index>(rows - 1, static_cast<Index>(std::floor((t[n - 1] - start) / step + kRounding)));
  if (last < first) return out;
  const VectorXd at =
      start +
      step * VectorXd::LinSpaced(last - first + 1, static_cast<double>(first), static_cast<double>(last)).array();
  out.segment(first, last - first + 1) = inside(t, x, at, step);
  return out;
}

}  // namespace whirl::signal
