#include "whirl/modal/transient_runup.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "whirl/core/angles.hpp"
#include "whirl/core/decompositions.hpp"
#include "whirl/core/distributions.hpp"
#include "whirl/core/error.hpp"
#include "whirl/core/least_squares.hpp"
#include "whirl/rotor/modal_response.hpp"
#include "whirl/signal/noise.hpp"

namespace whirl::modal {
namespace {

using Complex = std::complex<double>;

/// The sweep on a fine grid, and where the revolutions lie on it.
class Sweep {
 public:
  Sweep(double omega0, double alpha, const Eigen::VectorXd& time, double fastest, RunupModel model)
      : omega0_(omega0), alpha_(alpha), model_(model), time_(time) {
    // Twenty samples per period of the fastest mode or speed.
    dt_ = kTwoPi / (20 * fastest);
    const double end = time[time.size() - 1];
    samples_ = static_cast<Eigen::Index>(std::ceil(end / dt_)) + 2;
    forcing_.resize(2 * samples_ - 1);
    carrier_.resize(samples_);
    for (Eigen::Index i = 0; i < forcing_.size(); ++i) {
      const double t = 0.5 * dt_ * static_cast<double>(i), w = omega0 + alpha * t;
      const Complex e = std::polar(1.0, t * (omega0 + 0.5 * alpha * t));
      forcing_[i] = e * Complex(w * w, -alpha);
      if (i % 2 == 0) carrier_[i / 2] = std::conj(e);
    }
  }

  double speed(Eigen::Index i) const { return omega0_ + alpha_ * dt_ * static_cast<double>(i); }
  Eigen::Index samples() const { return samples_; }

  /// Q of a mode on the fine grid.
  Eigen::VectorXcd fine(double w, double zeta) const {
    if (model_ == RunupModel::transient) {
      return rotor::modal_response(w, zeta, forcing_, dt_, omega0_).cwiseProduct(carrier_);
    }
    Eigen::VectorXcd q(samples_);
    for (Eigen::Index i = 0; i < samples_; ++i) {
      const double s = speed(i);
      q[i] = s * s / Complex(w * w - s * s, 2 * zeta * w * s);
    }
    return q;
  }
  /// Q at the revolutions: the envelope is smooth, so between fine samples it is taken linear.
  Eigen::VectorXcd at_revolutions(const Eigen::VectorXcd& fine_grid) const {
    Eigen::VectorXcd q(time_.size());
    for (Eigen::Index k = 0; k < q.size(); ++k) {
      const double x = time_[k] / dt_;
      const auto i = std::min(static_cast<Eigen::Index>(x), samples_ - 2);
      const double u = x - static_cast<double>(i);
      q[k] = (1 - u) * fine_grid[i] + u * fine_grid[i + 1];
    }
    return q;
  }

 private:
  double omega0_, alpha_, dt_ = 0;
  RunupModel model_;
  Eigen::VectorXd time_;
  Eigen::Index samples_ = 0;
  Eigen::VectorXcd forcing_, carrier_;
};

/// Best Gamma_k and runout for given Q_k, and what they leave.
struct Projection {
  Eigen::VectorXcd coefficients;  // Gamma_1 .., runout
  Eigen::VectorXcd residual;
};
Projection project(const std::vector<Eigen::VectorXcd>& q, const Eigen::VectorXcd& z) {
  Eigen::MatrixXcd a(z.size(), static_cast<Eigen::Index>(q.size()) + 1);
  for (std::size_t k = 0; k < q.size(); ++k) a.col(static_cast<Eigen::Index>(k)) = q[k];
  a.col(a.cols() - 1).setOnes();
  const Eigen::HouseholderQR<Eigen::MatrixXcd> qr(a);
  Projection p;
  p.coefficients = qr.solve(z);
  p.residual = z - a * p.coefficients;
  return p;
}

/// Speeds of local maxima of |z| that stand out from the minima beside them by `prominence`; parabola through the top.
std::vector<double> maxima(const Eigen::VectorXd& speed, const Eigen::VectorXcd& z, double prominence) {
  std::vector<double> found;
  const Eigen::VectorXd a = z.cwiseAbs();
  double valley = a[0];
  Eigen::Index top = 0;
  bool rising = true;
  for (Eigen::Index i = 1; i < a.size(); ++i) {
    if (rising) {
      if (a[i] > a[top]) top = i;
      if (a[top] - a[i] > prominence) {
        if (top > 0 && a[top] - valley > prominence) {
          const double l = a[top - 1], m = a[top], r = a[top + 1], bend = l - 2 * m + r;
          const double shift = bend < 0 ? 0.5 * (l - r) / bend : 0;
          found.push_back(speed[top] + shift * 0.5 * (speed[top + 1] - speed[top - 1]));
        }
        rising = false;
        valley = a[i];
      }
    } else {
      valley = std::min(valley, a[i]);
      if (a[i] - valley > prominence) {
        rising = true;
        top = i;
      }
    }
  }
  return found;
}

/// Peak and the maxima passed after it, in the order of the run.
void split_peak(const Eigen::VectorXd& speed, const Eigen::VectorXcd& z, double prominence, double& peak,
                std::vector<double>& beats) {
  Eigen::Index top = 0;
  z.cwiseAbs().maxCoeff(&top);
  peak = speed[top];
  bool after = false;
  double nearest = INFINITY;
  const std::vector<double> all = maxima(speed, z, prominence);
  std::size_t at = all.size();
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (std::abs(all[k] - speed[top]) < nearest) {
      nearest = std::abs(all[k] - speed[top]);
      at = k;
    }
  }
  for (std::size_t k = 0; k < all.size(); ++k) {
    if (after) beats.push_back(all[k]);
    if (k == at) {
      peak = all[k];
      after = true;
    }
  }
}

double half_power(const Eigen::VectorXd& speed, const Eigen::VectorXcd& z) {
  const Eigen::VectorXd a = z.cwiseAbs();
  Eigen::Index top = 0;
  const double level = a.maxCoeff(&top) * std::sqrt(0.5);
  const auto cross = [&](Eigen::Index step) -> double {
    for (Eigen::Index i = top; i + step >= 0 && i + step < a.size(); i += step) {
      if (a[i + step] < level) return speed[i] + (speed[i + step] - speed[i]) * (a[i] - level) / (a[i] - a[i + step]);
    }
    return NAN;
  };
  const double width = std::abs(cross(1) - cross(-1));
  return std::isfinite(width) && width > 0 ? std::abs(speed[top]) / width : 0.0;
}

void check(const RunupResponse& run, const TransientRunupOptions& o) {
  if (run.omega.size() != run.vector.size() || (run.time.size() != 0 && run.time.size() != run.omega.size())) {
    throw Error(fmt::format("run-up: {} speeds, {} vectors and {} times: must be equally many", run.omega.size(),
                            run.vector.size(), run.time.size()));
  }
  if (!run.omega.allFinite() || !run.vector.allFinite() || !run.time.allFinite()) {
    throw Error("run-up: contains values that are not finite");
  }
  require_range("modes", o.modes, 1, 2);
  require_range("zeta_low", o.zeta_low, 1e-5, 0.5);
  require_range("zeta_high", o.zeta_high, o.zeta_low, 0.9);
}

/// Times of the revolutions from zero, by the speed where none are given.
Eigen::VectorXd times_of(const RunupResponse& run) {
  const Eigen::Index n = run.omega.size();
  Eigen::VectorXd time = run.time;
  if (time.size() == 0) {
    time = Eigen::VectorXd::Zero(n);
    for (Eigen::Index k = 1; k < n; ++k) time[k] = time[k - 1] + 2 * kTwoPi / (run.omega[k] + run.omega[k - 1]);
  }
  time.array() -= time[0];
  return time;
}

/// omega0 + alpha t through the speeds; warns where they leave it.
void fit_speed(const RunupResponse& run, const Eigen::VectorXd& time, TransientRunupFit& fit) {
  Eigen::MatrixXd line(time.size(), 2);
  line << Eigen::VectorXd::Ones(time.size()), time;
  const Eigen::Vector2d speed_line = line.householderQr().solve(run.omega);
  fit.omega0 = speed_line[0];
  fit.alpha = speed_line[1];
  const double departure = (line * speed_line - run.omega).cwiseAbs().maxCoeff() / run.omega.maxCoeff();
  if (departure > 0.01) {
    fit.summary.warn(
        fmt::format("the speed leaves its straight line by {:.1f} %: the beats are placed wrongly", 100 * departure));
  }
}

Eigen::VectorXd stacked(const Eigen::VectorXcd& v) {
  Eigen::VectorXd s(2 * v.size());
  s << v.real(), v.imag();
  return s;
}

/// Search for the frequencies and damping ratios that, with complex amplitudes and runout projected out, leave least.
class Search {
 public:
  struct Found {
    Eigen::VectorXd p;       ///< log w, log zeta of each mode
    Eigen::MatrixXd normal;  ///< J^T J at the last linearisation
    double square = INFINITY;
  };

  Search(const RunupResponse& run, const Sweep& sweep, const TransientRunupOptions& options, double low, double high)
      : run_(run), sweep_(sweep), options_(options), low_(low), high_(high) {}

  Found run() {
    make_cells();
    std::vector<Start> starts = options_.modes == 1 ? single_starts() : pair_starts();
    constexpr std::size_t kStarts = 12;
    const auto kept = static_cast<std::ptrdiff_t>(std::min(kStarts, starts.size()));
    std::partial_sort(starts.begin(), starts.begin() + kept, starts.end(),
                      [](const Start& a, const Start& b) { return a.first < b.first; });
    Found best;
    for (std::ptrdiff_t s = 0; s < kept; ++s) {
      Found found = refine(starts[static_cast<std::size_t>(s)].second);
      if (found.square < best.square) best = std::move(found);
    }
    return best;
  }

  // The problem of `descend`: (log w, log zeta) with the projected residual.
  void linearise(Eigen::VectorXd& p, SquareSum& sum) const {
    const Eigen::VectorXd r = stacked(projected(p).residual);
    const Eigen::MatrixXd j = jacobian(p);
    sum = {r.squaredNorm(), j.transpose() * j, -j.transpose() * r};
  }
  void last(Eigen::VectorXd& p, SquareSum& sum) const { sum.cost = projected(p).residual.squaredNorm(); }
  Eigen::VectorXd moved(const Eigen::VectorXd& p, const Eigen::VectorXd& step) const {
    Eigen::VectorXd next = p + step;
    clamp(next);
    return next;
  }
  bool small(const SquareSum& sum, const Eigen::VectorXd&, double decrease) const { return decrease < 1e-9 * sum.cost; }

  Projection projected(const Eigen::VectorXd& p) const {
    std::vector<Eigen::VectorXcd> q;
    for (Eigen::Index k = 0; k < p.size(); k += 2) q.push_back(column(std::exp(p[k]), std::exp(p[k + 1])));
    return project(q, run_.vector);
  }

  static constexpr int kFrequencies = 48, kDampings = 6, kCells = kFrequencies * kDampings;

 private:
  struct Cell {
    double w, zeta;
    Eigen::VectorXcd q;
  };
  using Start = std::pair<double, std::vector<std::size_t>>;  ///< what is left, and the cells

  Eigen::VectorXcd column(double w, double zeta) const { return sweep_.at_revolutions(sweep_.fine(w, zeta)); }

  // The steady model needs a quarter of the smallest half-power width to show every valley; Gauss-Newton bridges that.
  void make_cells() {
    for (int i = 0; i < kFrequencies; ++i) {
      for (int j = 0; j < kDampings; ++j) {
        const double w = low_ + (high_ - low_) * (i + 0.5) / kFrequencies;
        const double zeta = options_.zeta_low * std::pow(options_.zeta_high / options_.zeta_low, (j + 0.5) / kDampings);
        cells_.push_back({w, zeta, column(w, zeta)});
      }
    }
  }

  std::vector<Start> single_starts() const {
    std::vector<Start> starts;
    for (std::size_t a = 0; a < cells_.size(); ++a) {
      starts.push_back({project({cells_[a].q}, run_.vector).residual.squaredNorm(), {a}});
    }
    return starts;
  }

  // Pairs through inner products: with centred columns the runout drops out and a 2 x 2 system is left.
  std::vector<Start> pair_starts() const {
    const Eigen::VectorXcd centred = (run_.vector.array() - run_.vector.mean()).matrix();
    std::vector<Eigen::VectorXcd> q;
    std::vector<Complex> with_z;
    for (const Cell& c : cells_) {
      q.emplace_back((c.q.array() - c.q.mean()).matrix());
      with_z.push_back(q.back().dot(centred));
    }
    std::vector<Start> starts;
    const double total = centred.squaredNorm();
    for (std::size_t a = 0; a < cells_.size(); ++a) {
      for (std::size_t b = a + 1; b < cells_.size(); ++b) {
        if (cells_[a].w == cells_[b].w) continue;
        const double aa = q[a].squaredNorm(), bb = q[b].squaredNorm();
        const Complex ab = q[a].dot(q[b]);
        const double det = aa * bb - std::norm(ab);
        if (det < 1e-6 * aa * bb) continue;
        const double explained = (bb * std::norm(with_z[a]) + aa * std::norm(with_z[b]) -
                                  2 * std::real(std::conj(with_z[a]) * ab * with_z[b])) /
                                 det;
        starts.push_back({total - explained, {a, b}});
      }
    }
    return starts;
  }

  // Derivatives of the projected residual by differences.
  Eigen::MatrixXd jacobian(const Eigen::VectorXd& p) const {
    Eigen::MatrixXd j(2 * run_.vector.size(), p.size());
    for (Eigen::Index k = 0; k < p.size(); ++k) {
      const double h = k % 2 == 0 ? 1e-5 : 1e-3;
      Eigen::VectorXd up = p, down = p;
      up[k] += h;
      down[k] -= h;
      j.col(k) = (stacked(projected(up).residual) - stacked(projected(down).residual)) / (2 * h);
    }
    return j;
  }

  void clamp(Eigen::VectorXd& p) const {
    for (Eigen::Index k = 0; k < p.size(); k += 2) {
      p[k] = std::clamp(p[k], std::log(low_), std::log(high_));
      p[k + 1] = std::clamp(p[k + 1], std::log(options_.zeta_low), std::log(options_.zeta_high));
    }
  }

  Found refine(const std::vector<std::size_t>& start) const {
    Found at;
    at.p.resize(2 * options_.modes);
    for (int k = 0; k < options_.modes; ++k) {
      const Cell& c = cells_[start[static_cast<std::size_t>(k)]];
      at.p[2 * k] = std::log(c.w);
      at.p[2 * k + 1] = std::log(c.zeta);
    }
    SquareSum sum;
    linearise(at.p, sum);
    descend(*this, at.p, sum, 60);
    at.square = sum.cost;
    at.normal = std::move(sum.normal);
    return at;
  }

  const RunupResponse& run_;
  const Sweep& sweep_;
  const TransientRunupOptions& options_;
  double low_, high_;
  std::vector<Cell> cells_;
};

/// Modes with their intervals, in order of frequency; returns the response between the revolutions.
Eigen::VectorXcd state_modes(const Search::Found& found, const Projection& projection, const Sweep& sweep,
                             const TransientRunupOptions& options, double low, double high, TransientRunupFit& fit) {
  const Eigen::Index size = found.p.size(), n = projection.residual.size();
  const double variance = found.square / static_cast<double>(2 * n - 2 * size - 2);
  const Eigen::MatrixXd covariance =
      variance * found.normal.ldlt().solve(Eigen::MatrixXd(Eigen::MatrixXd::Identity(size, size)));
  Eigen::VectorXcd fine = Eigen::VectorXcd::Constant(sweep.samples(), fit.runout);
  for (int k = 0; k < options.modes; ++k) {
    const double w = std::exp(found.p[2 * k]), zeta = std::exp(found.p[2 * k + 1]);
    fit.modes.push_back({Estimate::from_sd(w, w * std::sqrt(covariance(2 * k, 2 * k))),
                         Estimate::from_sd(zeta, zeta * std::sqrt(covariance(2 * k + 1, 2 * k + 1))),
                         projection.coefficients[k]});
    fine += projection.coefficients[k] * sweep.fine(w, zeta);
    if (w < 1.001 * low || w > 0.999 * high || zeta < 1.01 * options.zeta_low || zeta > 0.99 * options.zeta_high) {
      fit.summary.warn(
          fmt::format("mode {} lies at the edge of the search ({:.4g} rad/s, zeta {:.3g})", k + 1, w, zeta));
    }
  }
  std::sort(fit.modes.begin(), fit.modes.end(),
            [](const RunupMode& a, const RunupMode& b) { return a.omega.value < b.omega.value; });
  return fine;
}

/// Whether the modes are more than chance finds in the cells of the search, and what is left more than noise. A model
/// error may lie along one parameter as a whole: it moves it by up to the norm of what is left over the slope there.
void judge(const Search::Found& found, const Eigen::VectorXcd& z, int modes, TransientRunupFit& fit) {
  constexpr double kChance = 1e-3, kBeyondNoise = 2, kMostF = 1e6;
  const double cells = modes == 1 ? Search::kCells : 0.5 * Search::kCells * Search::kCells;
  const double parameters = 4 * modes, freedom = 2 * static_cast<double>(z.size()) - 2 - parameters;
  const double explained = (z.array() - z.mean()).matrix().squaredNorm() - found.square;
  const double f = std::min(explained / parameters / std::max(found.square / freedom, 1e-300), kMostF);
  if (cells * fisher_f_tail(parameters, freedom, std::max(f, 0.0)) > kChance)
    return fit.summary.fail(fmt::format(
        "the modes explain {:.1f} % of the vectors, no more than chance: no mode is found", fit.fit_percent));
  const double noise = std::hypot(signal::noise_sd(z.real()), signal::noise_sd(z.imag()));
  if (fit.fit_percent >= kRunupExplained || fit.summary.residual < kBeyondNoise * noise) return;
  const std::string said =
      fmt::format("the modes explain {:.1f} % of the vectors, less than {:g} %, and leave more than noise",
                  fit.fit_percent, kRunupExplained);
  const Eigen::MatrixXd inverse = found.normal.inverse();
  for (Eigen::Index k = 0; k < found.p.size(); k += 2) {
    const double moved = std::sqrt(found.square * inverse(k, k)), zeta = std::exp(found.p[k + 1]);
    if (!(moved < zeta))
      return fit.summary.fail(fmt::format(
          "{}: an error of this size moves the mode at {:.0f} rpm by up to {:.2g} %, more than its half-power width of "
          "{:.2g} %",
          said, std::exp(found.p[k]) / kRadPerSecPerRpm, 100 * moved, 100 * zeta));
  }
  fit.summary.warn(said +
                   ": their errors are larger than the standard deviations stated; another number of modes, or "
                   "stiffness that depends on the amplitude (whirl identify)");
}

}  // namespace

TransientRunupFit fit_transient_runup(const RunupResponse& run, const TransientRunupOptions& options) {
  check(run, options);
  TransientRunupFit fit;
  const Eigen::Index n = run.omega.size();
  if (n < 20) {
    fit.summary.fail(fmt::format("the run has {} revolutions; at least 20 are needed", n));
    return fit;
  }
  const double slowest = run.omega.minCoeff(), fastest = run.omega.maxCoeff();
  if (!(slowest > 0) || fastest < 1.1 * slowest) {
    fit.summary.fail("the speed changes by less than 10 %: a run through a critical speed is needed");
    return fit;
  }
  const Eigen::VectorXd time = times_of(run);
  fit_speed(run, time, fit);

  const double low = options.omega_low > 0 ? options.omega_low : slowest;
  const double high = options.omega_high > 0 ? options.omega_high : fastest;
  require_range("omega_high", high, low, 1e7, "rad/s");
  const Sweep sweep(fit.omega0, fit.alpha, time, std::max(fastest, high), options.model);
  Search search(run, sweep, options, low, high);
  const Search::Found found = search.run();

  const Projection p = search.projected(found.p);
  fit.simulated = run.vector - p.residual;
  fit.runout = p.coefficients[options.modes];
  fit.fit_percent = 100 * (1 - p.residual.norm() / (run.vector.array() - run.vector.mean()).matrix().norm());
  fit.summary.residual = std::sqrt(found.square / static_cast<double>(n));
  const Eigen::VectorXcd fine = state_modes(found, p, sweep, options, low, high, fit);
  const auto fine_speed = Eigen::VectorXd::NullaryExpr(fine.size(), [&](Eigen::Index i) { return sweep.speed(i); });
  const double top = run.vector.cwiseAbs().maxCoeff();
  split_peak(fine_speed, fine, 0.002 * top, fit.peak_speed, fit.beats);
  split_peak(run.omega, run.vector, 0.01 * top, fit.peak_speed_measured, fit.beats_measured);
  fit.amplification = half_power(run.omega, run.vector);
  judge(found, run.vector, options.modes, fit);
  fit.summary.trust = fmt::format(
      "Frequencies and damping hold for this run at {:.3g} rad/s^2{}; one probe and one run do not fix two modes "
      "uniquely.",
      fit.alpha, options.model == RunupModel::steady ? ", taken as infinitely slow" : "");
  return fit;
}

void judge_phase(const RunupResponse& run, const TransientRunupOptions& options, TransientRunupFit& fit) {
  if (fit.fit_percent >= kRunupExplained || fit.modes.empty()) return;
  RunupResponse other = run;
  other.vector = run.vector.conjugate();
  const double percent = fit_transient_runup(other, options).fit_percent;
  if (100 - fit.fit_percent < kLeftOver * (100 - percent)) return;
  fit.summary.fail(fmt::format(
      "with the phases turned around the modes explain {:.1f} % instead of {:.1f} %: lags are read as leads, or leads "
      "as lags (a column phase_deg is read as leads; --phase lag, or a column phase_lag_deg, says the other)",
      percent, fit.fit_percent));
}

}  // namespace whirl::modal
