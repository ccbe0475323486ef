#pragma once
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include "whirl/core/decompositions.hpp"
#include "whirl/diagnosis/influence.hpp"

namespace whirl::testing {

/// A machine that comes back from each start in another state, and the runs of a fitter on it. Nothing here is taken
/// from the estimator: vectors are sums of modes, the state of each run is drawn, the fitter errs by a drawn slip.
struct UnrepeatableJobOptions {
  int planes = 1, probes = 2, runs = 6;  ///< fewer probes than planes: read at two speeds
  double unrepeatable = 0;               ///< rms of what the state of a run adds, over the rms reading as found
  double noise = 0.01;                   ///< sd of one reading per component, over the rms reading as found
  double drift = 0;                      ///< change over the job, over the rms reading as found
  bool slip = false;                     ///< one run is not as written
  bool phases = true;                    ///< false: the angles of the readings are lost, every reading is its length
};

struct UnrepeatableJob {
  diagnosis::BalancingJob job;
  Eigen::MatrixXcd influence;  ///< true, of the machine in its mean state
  Eigen::VectorXcd vibration;  ///< true, mean state, at the time of the last run, without masses
  int wrong = -1;              ///< run with the slip
  std::string slip;            ///< words that its name must hold
  double slip_size = 0;        ///< rms of what the slip changes, over the rms reading as found
  bool visible = false;        ///< the other runs tell every plane, and one run more than that: the slip can be seen
};

namespace unrepeatable {

using Complex = std::complex<double>;

struct Draw {
  explicit Draw(unsigned seed) : engine(seed) {}
  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(engine); }
  int whole(int low, int high) { return std::uniform_int_distribution<int>(low, high)(engine); }
  Complex circular() { return {normal(engine), normal(engine)}; }  ///< sd 1 per component
  Complex direction() { return std::polar(1.0, uniform(0, 2 * std::numbers::pi)); }
  std::mt19937_64 engine;
  std::normal_distribution<double> normal;
};

inline double rms(const Eigen::VectorXcd& v) { return v.norm() / std::sqrt(static_cast<double>(v.size())); }

/// Two modes: gain from place x to place y at a speed.
struct Shaft {
  explicit Shaft(Draw& draw) {
    for (int k = 0; k < 2; ++k) {
      const double ratio = k == 0 ? draw.uniform(0.5, 1.6) : draw.uniform(0.2, 0.7), damping = draw.uniform(0.02, 0.08);
      for (const int s : {0, 1}) {
        const double r = s == 0 ? ratio : 1.3 * ratio;
        amplification[s][k] = r * r / Complex(1 - r * r, 2 * damping * r);
      }
      slope[k] = draw.uniform(-0.6, 0.6);
    }
  }
  double shape(int k, double x) const {
    return k == 0 ? 1 + slope[0] * (x - 0.5) : 2 * (x - 0.5) + slope[1] * (x - 0.3);
  }
  Complex gain(int speed, double x, double y) const {
    return amplification[speed][0] * shape(0, x) * shape(0, y) + amplification[speed][1] * shape(1, x) * shape(1, y);
  }
  Complex amplification[2][2];
  double slope[2] = {};
};

/// Masses of the runs: as found, a trial of each plane, as found again, trials nearly repeated, others.
inline std::vector<Eigen::VectorXcd> schedule(Draw& draw, const UnrepeatableJobOptions& o,
                                              const Eigen::VectorXd& size) {
  const Eigen::VectorXcd none = Eigen::VectorXcd::Zero(o.planes);
  std::vector<Eigen::VectorXcd> masses = {none};
  const auto on = [&](int p, Complex w) {
    Eigen::VectorXcd m = none;
    m[p] = w * size[p];
    return m;
  };
  for (int p = 0; p < o.planes; ++p) masses.push_back(on(p, draw.direction()));
  std::vector<Eigen::VectorXcd> more = {none};
  const int first = draw.whole(1, o.planes);
  more.push_back(masses[static_cast<std::size_t>(first)] * draw.uniform(0.975, 1.025) *
                 std::polar(1.0, draw.uniform(-0.08, 0.08)));
  while (static_cast<int>(masses.size() + more.size()) < o.runs) {
    Eigen::VectorXcd m = none;
    for (int p = 0; p < o.planes; ++p)
      m[p] = size[p] * draw.uniform(0.4, 1.2) * draw.direction() * (draw.whole(0, 3) > 0 ? 1.0 : 0.0);
    more.push_back(m);
  }
  std::shuffle(more.begin(), more.end(), draw.engine);
  for (const Eigen::VectorXcd& m : more)
    if (static_cast<int>(masses.size()) < o.runs) masses.push_back(m);
  return masses;
}

/// What a run's state adds to the vectors: an unbalance that moved, another response, or each probe by itself.
inline Eigen::VectorXcd state(Draw& draw, int kind, const Eigen::MatrixXcd& places, const Eigen::VectorXcd& undisturbed,
                              double level, double unrepeatable) {
  if (kind == 1) return undisturbed * (unrepeatable / std::numbers::sqrt2 * draw.circular());
  Eigen::VectorXcd added(undisturbed.size());
  if (kind == 2) {
    for (Complex& a : added) a = draw.circular() * (level * unrepeatable / std::numbers::sqrt2);
    return added;
  }
  Eigen::VectorXcd moved(places.cols());
  for (Complex& m : moved) m = draw.circular();
  const double usual = places.norm() * std::numbers::sqrt2 / std::sqrt(static_cast<double>(added.size()));
  return places * moved * (level * unrepeatable / usual);
}

/// What was really on the rotor (masses) or read (readings) of a run with a slip of this kind; empty text: no such.
inline std::string slipped(Draw& draw, int kind, const std::vector<Eigen::VectorXcd>& written, std::size_t run,
                           Eigen::VectorXcd& masses) {
  Eigen::Index p = 0;
  if (masses.cwiseAbs().maxCoeff(&p) <= 0 && kind != 4 && kind != 6) return "";
  switch (kind) {
    case 0:
      masses.setZero();
      return "carried no";
    case 1:
      masses = -masses;
      return "opposite side";
    case 2:
      if (masses.size() < 2) return "";
      std::reverse(masses.begin(), masses.end());
      return "was on plane";
    case 3:
      masses *= 2;
      return "twice the mass";
    case 4:
      if (written[run - 1].norm() <= 0) return "";
      masses += written[run - 1];
      return "still on the rotor";
    case 5:
      return "other sign";
    case 6:
      return "180 deg off";
    default:
      masses[p] *= Complex(0, draw.whole(0, 1) == 0 ? 1 : -1);
      return "90 deg from";
  }
}

inline bool told_by_others(const std::vector<Eigen::VectorXcd>& masses, int run) {
  Eigen::MatrixXcd x(static_cast<Eigen::Index>(masses.size()) - 1, masses.front().size() + 1);
  Eigen::Index n = 0;
  for (std::size_t r = 0; r < masses.size(); ++r)
    if (static_cast<int>(r) != run) x.row(n++) << Complex(1), masses[r].transpose();
  const Eigen::VectorXd size = x.jacobiSvd().singularValues();
  return x.rows() > x.cols() && size[size.size() - 1] > 0.02 * size[0];
}

}  // namespace unrepeatable

inline UnrepeatableJob unrepeatable_job(const UnrepeatableJobOptions& o, unsigned seed) {
  using namespace unrepeatable;
  Draw draw(seed);
  const Shaft shaft(draw);
  UnrepeatableJob result;
  diagnosis::BalancingJob& job = result.job;
  const int rows = o.probes * (o.probes < o.planes ? 2 : 1);
  result.influence.resize(rows, o.planes);
  constexpr int kPlaces = 4;
  Eigen::MatrixXcd places(rows, kPlaces);  // where unbalance sits and moves
  Eigen::VectorXd plane_at(o.planes);
  for (int p = 0; p < o.planes; ++p) {
    job.planes.push_back("P" + std::to_string(p + 1));
    plane_at[p] = o.planes == 1 ? draw.uniform(0.25, 0.75) : p == 0 ? draw.uniform(0.05, 0.3) : draw.uniform(0.7, 0.95);
  }
  Eigen::VectorXcd unbalance(kPlaces);
  for (Complex& u : unbalance) u = draw.circular();
  Eigen::VectorXd probe_at(o.probes);
  for (int m = 0; m < o.probes; ++m) probe_at[m] = (m + draw.uniform(0.2, 0.8)) / o.probes;
  for (int m = 0; m < rows; ++m) {
    const int speed = m / o.probes;
    const double x = probe_at[m % o.probes];
    job.rows.push_back("probe " + std::to_string(m % o.probes + 1) + " at speed " + std::to_string(speed + 1));
    job.speed.push_back(speed);
    for (int p = 0; p < o.planes; ++p) result.influence(m, p) = shaft.gain(speed, x, plane_at[p]);
    for (int k = 0; k < kPlaces; ++k) places(m, k) = shaft.gain(speed, x, (k + 0.5) / kPlaces);
  }
  result.vibration = places * unbalance;
  const double level = rms(result.vibration);
  Eigen::VectorXd size(o.planes);
  for (int p = 0; p < o.planes; ++p) size[p] = draw.uniform(0.4, 0.9) * level / rms(result.influence.col(p));
  const std::vector<Eigen::VectorXcd> masses = schedule(draw, o, size);
  const int kind = draw.whole(0, 2);
  Eigen::VectorXcd warmed(rows);
  for (Complex& w : warmed) w = o.drift * level * draw.direction();
  // A slip that changes the readings by a tenth of the level: a smaller one is no matter.
  std::vector<Eigen::VectorXcd> real = masses;
  int slip = -1, probe = -1;
  while (o.slip && result.wrong < 0) {
    const std::size_t run = static_cast<std::size_t>(draw.whole(1, o.runs - 1));
    slip = draw.whole(0, 7);
    real = masses;
    result.slip = slipped(draw, slip, masses, run, real[run]);
    if (result.slip.empty()) continue;
    const Eigen::VectorXcd before = result.vibration + result.influence * masses[run];
    Eigen::VectorXcd after = result.vibration + result.influence * real[run];
    if (slip == 5) after = before.conjugate();
    if (slip == 6) {
      probe = draw.whole(0, o.probes - 1);
      for (int m = probe; m < rows; m += o.probes) after[m] = -before[m];
    }
    result.slip_size = rms(after - before) / level;
    if (result.slip_size > 0.1) result.wrong = static_cast<int>(run);
  }
  result.visible = result.wrong >= 0 && told_by_others(masses, result.wrong);
  for (std::size_t r = 0; r < masses.size(); ++r) {
    const double late = static_cast<double>(r) / static_cast<double>(masses.size() - 1);
    Eigen::VectorXcd v = result.vibration + warmed * late + result.influence * real[r];
    v += state(draw, kind, places, v, level, o.unrepeatable);
    for (Complex& z : v) z += draw.circular() * (o.noise * level);
    if (static_cast<int>(r) == result.wrong && slip == 5) v = v.conjugate().eval();
    for (int m = probe; static_cast<int>(r) == result.wrong && slip == 6 && m < rows; m += o.probes) v[m] = -v[m];
    if (!o.phases) v = v.cwiseAbs().cast<Complex>().eval();
    job.runs.push_back({"run " + std::to_string(r + 1), static_cast<double>(r), masses[r], v});
  }
  result.vibration += warmed;
  return result;
}

}  // namespace whirl::testing
