// Phase and frequency of a tone by a two-state Kalman smoother. The frequency is a random walk: over a step its
// variance grows by q dt, which with the phase gives the covariance q [dt^3/3, dt^2/2; dt^2/2, dt].
#include "phase_track.hpp"

#include <algorithm>
#include <cmath>
#include <complex>
#include <vector>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/signal/fft.hpp"

namespace whirl::modal {
namespace {

using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::VectorXcd;
using Eigen::VectorXd;

struct PhaseModel {
  Matrix2d step, growth;
  double dt;

  PhaseModel(double q, double dt_) : dt(dt_) {
    step << 1, dt, 0, 1;
    growth << dt * dt * dt / 3, dt * dt / 2, dt * dt / 2, dt;
    growth *= q;
  }
};

// `measured(i, predicted phase)`: the phase that sample i shows, near the one predicted.
template <class Measured>
PhaseTrack run_smoother(const VectorXd& variance, const PhaseModel& model, Vector2d state, const Matrix2d& start,
                        const Measured& measured) {
  const Index n = variance.size();
  std::vector<Vector2d> before, after;
  std::vector<Matrix2d> before_p, after_p;
  Matrix2d p = start;
  PhaseTrack track{VectorXd(n), VectorXd(n), 0};
  for (Index i = 0; i < n; ++i) {
    if (i > 0) {
      state = model.step * state;
      p = (model.step * p * model.step.transpose() + model.growth).eval();
    }
    before.push_back(state);
    before_p.push_back(p);
    const double innovation = measured(i, state[0]) - state[0], s = p(0, 0) + variance[i];
    const Vector2d gain = p.col(0) / s;
    track.length += std::log(s) + innovation * innovation / s;
    state += gain * innovation;
    p -= (gain * p.row(0)).eval();
    after.push_back(state);
    after_p.push_back(p);
  }
  Vector2d smooth = after.back();
  for (Index i = n - 1; i >= 0; --i) {
    if (i + 1 < n) {
      const auto k = static_cast<std::size_t>(i);
      const Matrix2d gain = after_p[k] * model.step.transpose() * before_p[k + 1].inverse();
      smooth = after[k] + gain * (smooth - before[k + 1]);
    }
    track.phase[i] = smooth[0];
    track.rate[i] = smooth[1];
  }
  return track;
}

// Sizes of the walk that are tried: the frequency moves by its whole reach in 0.3 to 3000 samples' time.
constexpr double kSizes[] = {1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1};

Matrix2d open_start(double reach) {
  Matrix2d p = Matrix2d::Zero();
  p.diagonal() << 4.0, reach * reach;
  return p;
}

double start_rate(const VectorXcd& z, double dt) {
  const Index n = std::max<Index>(16, z.size() / 10);
  VectorXcd padded = VectorXcd::Zero(signal::fast_fft_length(4 * n));
  padded.head(std::min(n, z.size())) = z.head(std::min(n, z.size()));
  Index at = 0;
  signal::fft(padded).cwiseAbs2().maxCoeff(&at);
  if (2 * at > padded.size()) at -= padded.size();
  return 2 * kPi * static_cast<double>(at) / (static_cast<double>(padded.size()) * dt);
}

}  // namespace

PhaseTrack track_phase(const VectorXcd& z, double noise, double dt, double reach) {
  PhaseTrack best;
  const Vector2d start(std::arg(z[0]), start_rate(z, dt));
  Matrix2d open = open_start(reach);
  open(1, 1) = std::pow(2 * kPi / (0.1 * dt * static_cast<double>(z.size())), 2);
  const VectorXd even = VectorXd::Constant(z.size(), noise / 2);
  double best_cost = INFINITY;
  for (const double size : kSizes) {
    const PhaseModel model(size * reach * reach / dt, dt);
    // The extended filter finds the path, on which each sample is then a phase of its own.
    const auto found = [&](Index i, double phase) {
      return phase + std::clamp((z[i] * std::polar(1.0, -phase)).imag(), -1.5, 1.5);
    };
    PhaseTrack track = run_smoother(even, model, start, open, found);
    for (int round = 0; round < 4; ++round) {
      const VectorXd path = track.phase;
      const auto about = [&](Index i, double) {
        return path[i] + std::clamp((z[i] * std::polar(1.0, -path[i])).imag(), -1.5, 1.5);
      };
      track = run_smoother(even, model, start, open, about);
    }
    // The increments see what is across the path; what is along it costs as much, so that slips of a cycle do not pay.
    double along = 0;
    for (Index i = 0; i < z.size(); ++i) along += std::pow((z[i] * std::polar(1.0, -track.phase[i])).real() - 1, 2);
    const double cost = track.length + 2 * along / noise;
    if (cost < best_cost) {
      best_cost = cost;
      best = std::move(track);
    }
  }
  return best;
}

PhaseTrack smooth_phase(const PhaseTrack& path, const VectorXd& off, const VectorXd& noise, double dt, double reach) {
  PhaseTrack best;
  best.length = INFINITY;
  const Vector2d start(path.phase[0], path.rate[0]);
  for (const double size : kSizes) {
    const PhaseModel model(size * reach * reach / dt, dt);
    PhaseTrack track =
        run_smoother(noise, model, start, open_start(reach), [&](Index i, double) { return path.phase[i] + off[i]; });
    if (track.length < best.length) best = std::move(track);
  }
  return best;
}

namespace {

struct Place {
  Index first;
  double part, step;
};

Place place_of(const PhaseTrack& track, double dt, double at) {
  const double x = std::clamp(at / dt, 0.0, static_cast<double>(track.phase.size() - 1));
  const Index first = std::min(track.phase.size() - 2, static_cast<Index>(x));
  return {first, x - static_cast<double>(first), dt};
}

}  // namespace

double phase_at(const PhaseTrack& track, double dt, double at) {
  const auto [i, x, h] = place_of(track, dt, at);
  const double a = track.phase[i], b = track.phase[i + 1], da = h * track.rate[i], db = h * track.rate[i + 1];
  return a + x * (da + x * (3 * (b - a) - 2 * da - db + x * (2 * (a - b) + da + db)));
}

double rate_at(const PhaseTrack& track, double dt, double at) {
  const auto [i, x, h] = place_of(track, dt, at);
  return track.rate[i] + x * (track.rate[i + 1] - track.rate[i]);
}

}  // namespace whirl::modal
