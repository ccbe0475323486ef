#include "record_vectors.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/modal/transient_runup.hpp"

namespace whirl::balancing {
namespace {

using Complex = std::complex<double>;
using Eigen::Index;
// Percent of a run that modes explain: with one mode so much that a second is not looked for, and so much that the run
// is taken for theirs.
constexpr double kByOne = 98, kExplained = modal::kRunupExplained;
constexpr double kScatter = 1.5;  // what is left may be this many times the scatter from turn to turn

/// Sd of the vectors, from second differences: the run itself is smooth.
double scatter(const Eigen::VectorXcd& z) {
  const Index n = z.size() - 2;
  return n < 1 ? 0 : (z.head(n) - 2 * z.segment(1, n) + z.tail(n)).norm() / std::sqrt(6.0 * static_cast<double>(n));
}

/// Modes of a run of one probe: one, or two where one is not enough.
modal::TransientRunupFit modes_of(const signal::SynchronousCurve& curve, const std::string& what) {
  const modal::RunupResponse run{curve.speed, curve.time, curve.vector};
  const double noise = kScatter * scatter(curve.vector);
  const auto explains = [&](const modal::TransientRunupFit& fit, double percent) {
    return fit.fit_percent >= percent || fit.summary.residual <= noise;
  };
  modal::TransientRunupFit fit = modal::fit_transient_runup(run, {.modes = 1});
  if (fit.modes.empty())
    throw Error(fmt::format("{}: --steady needs a run-up or run-down: {}", what, fit.summary.reason));
  if (explains(fit, kByOne)) return fit;
  modal::TransientRunupFit two = modal::fit_transient_runup(run, {.modes = 2});
  if (two.summary.status != Status::unusable && two.fit_percent > fit.fit_percent) fit = std::move(two);
  if (explains(fit, kExplained)) return fit;
  throw Error(fmt::format(
      "{}: linear modes swept at a constant rate explain {:.0f} % of the run, --steady needs {:.0f} %; make "
      "all runs at one rate, and leave --steady out",
      what, fit.fit_percent, kExplained));
}

Complex steady_vector(const modal::TransientRunupFit& fit, double speed) {
  Complex z = fit.runout;
  for (const modal::RunupMode& m : fit.modes) {
    const double w = m.omega.value;
    z += m.participation * speed * speed / Complex(w * w - speed * speed, 2 * m.zeta.value * w * speed);
  }
  return z;
}

/// Slope of the speed over its square through the revolutions within 1 % of `speed` and one on either side.
double sweep_at(const signal::SynchronousCurve& curve, double speed) {
  Index first = -1, last = -1;
  for (Index k = 0; k < curve.speed.size(); ++k)
    if (speed <= 0 || std::abs(curve.speed[k] - speed) <= 0.01 * speed) {
      if (first < 0) first = k;
      last = k;
    }
  first = std::max<Index>(0, first - 1);
  last = std::min<Index>(curve.speed.size() - 1, last + 1);
  const double mean = 0.5 * (curve.speed[first] + curve.speed[last]), time = curve.time[last] - curve.time[first];
  return time > 0 ? (curve.speed[last] - curve.speed[first]) / time / (mean * mean) : 0;
}

}  // namespace

RecordVectors read_vectors(const std::string& path, const JobFile& file, bool steady) {
  const Recording record = io::read_recording(path, {});
  const std::optional<diagnosis::Rotation> rotation = diagnosis::rotation_of(record);
  if (!rotation) throw Error(path + ": no channel 'key', 'keyphasor', 'tacho' or 'beta' shows a turning shaft");
  std::vector<signal::SynchronousCurve> curves;
  std::vector<modal::TransientRunupFit> fits;
  for (const std::string& probe : file.probes) {
    curves.push_back(diagnosis::order_curve(record, *rotation, probe));
    if (steady) fits.push_back(modes_of(curves.back(), path + ", " + probe));
  }
  RecordVectors found;
  std::vector<double> sweeps;
  for (const double speed : file.stated_speeds) {
    for (std::size_t p = 0; p < curves.size(); ++p) {
      const signal::SynchronousCurve& curve = curves[p];
      Complex sum = 0;
      double n = 0;
      for (Index k = 0; k < curve.speed.size(); ++k)
        if (speed <= 0 || std::abs(curve.speed[k] - speed) <= 0.01 * speed) sum += curve.vector[k], n += 1;
      const double low = curve.speed.minCoeff(), high = curve.speed.maxCoeff();
      const bool there = steady ? speed >= 0.99 * low && speed <= 1.01 * high : n >= 1;
      if (!there)
        throw Error(fmt::format("{}: no revolution within 1 % of {:g} rpm (the record runs at {:.0f} to {:.0f} rpm)",
                                path, speed / kRadPerSecPerRpm, low / kRadPerSecPerRpm, high / kRadPerSecPerRpm));
      found.readings.push_back(steady ? steady_vector(fits[p], speed) : sum / n);
      if (p == 0 && !steady) sweeps.push_back(sweep_at(curve, speed));
    }
  }
  if (!sweeps.empty()) {
    std::nth_element(sweeps.begin(), sweeps.begin() + static_cast<long>(sweeps.size() / 2), sweeps.end());
    found.sweep = sweeps[sweeps.size() / 2];
  }
  return found;
}

}  // namespace whirl::balancing
