#include "centrifuge/sensor_model.hpp"

#include <cmath>

#include "synchronous_solution.hpp"
#include "whirl/core/error.hpp"
#include "whirl/shaft/centrifuge/accelerometers.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/reduction.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;

namespace {

constexpr int kCentrifugeModes = 8;

/// A body on the ground by a support that is no observer.
bool is_mount(const Support& s) { return s.a.part != "shaft" && s.b.part == "ground"; }

}  // namespace

std::vector<CentrifugeSensor> centrifuge_sensors(const Rotor& rotor, const CentrifugeSetup& setup) {
  std::vector<CentrifugeSensor> list;
  for (std::size_t k = 0; k < setup.accelerometers.size(); ++k) list.push_back({setup.accelerometers[k].name, true, k});
  for (std::size_t k = 0; k < rotor.probes.size(); ++k) list.push_back({rotor.probes[k].name, false, k});
  return list;
}

CentrifugeDraw draw_centrifuge(const CentrifugeSetup& setup, std::size_t sensors, std::mt19937_64& random) {
  std::uniform_real_distribution<double> even(-1, 1);
  const CentrifugeTolerance& t = setup.tolerance;
  CentrifugeDraw draw;
  draw.stiffness = 1 + t.mount_stiffness * even(random);
  draw.damping = 1 + t.mount_damping * even(random);
  draw.load = setup.load * 0.5 * (1 + even(random));
  for (std::size_t k = 0; k < sensors; ++k) {
    const double gain = 1 + t.sensor_gain * even(random);
    draw.sensor.push_back(std::polar(gain, t.sensor_angle * even(random)));
  }
  return draw;
}

CentrifugeModel::CentrifugeModel(const Rotor& rotor, const CentrifugeSetup& setup,
                                 std::vector<CentrifugeSensor> sensors)
    : rotor_(rotor), setup_(setup), sensors_(std::move(sensors)) {
  if (!setup.given()) throw Error("the rotor file has no [centrifuge]: plane_mm, radius_mm, allowed_gram are needed");
  if (sensors_.empty())
    throw Error(
        "no sensor: the rotor file needs an [[accelerometer]] or a [[probe]], the record a channel of its name");
  rotor_.unbalances = {{setup.plane, setup.plane, 1, 0}};
  rotor_.bow.clear();
  observers_ = rotor_.supports.size();
  for (const CentrifugeSensor& s : sensors_) {
    if (s.index >= (s.accelerometer ? setup.accelerometers.size() : rotor.probes.size()))
      throw Error::in_field("sensor", s.name, "one of the rotor file");
    if (!s.accelerometer) {
      rotor_.supports.push_back(observer(s.name, {"shaft", rotor.probes[s.index].position}));
      continue;
    }
    const Accelerometer& a = setup.accelerometers[s.index];
    rotor_.supports.push_back(observer(s.name, {a.body, a.position}));
    rotor_.supports.push_back(observer(s.name + " tilt", {a.body, a.position + kTiltArm}));
  }
  System full = system({.load = 0.5 * setup.load, .sensor = {}});
  full.weight.setZero();
  basis_ = reduce(full, {.modes = kCentrifugeModes, .static_shapes = true, .highest = 0, .speeds = 0}).basis;
}

System CentrifugeModel::system(const CentrifugeDraw& draw) const {
  Rotor r = rotor_;
  // Tubes are a ring at the buckets.
  const double polar = draw.load * setup_.radius * setup_.radius;
  if (draw.load > 0) r.discs.push_back({"load", setup_.plane, draw.load, polar / 2, polar, 0});
  for (Support& s : r.supports) {
    if (!is_mount(s)) continue;
    for (Eigen::Matrix2d& k : s.law.stiffness) k *= draw.stiffness;
    for (Eigen::Matrix2d& c : s.law.damping) c *= draw.damping;
  }
  return assemble(r);
}

MatrixXcd CentrifugeModel::readings(const CentrifugeDraw& draw, const std::vector<double>& speeds,
                                    const std::vector<double>& rates) const {
  const System small = project(system(draw), basis_);
  const Index r = small.size();
  MatrixXcd z(static_cast<Index>(sensors_.size()), static_cast<Index>(speeds.size()));
  for (std::size_t k = 0; k < speeds.size(); ++k) {
    const double speed = speeds[k];
    Eigen::VectorXcd q = synchronous_solution(small, speed);
    if (!rates.empty()) q *= std::complex<double>(1, -rates[k] / (speed * speed));
    std::size_t at = observers_;
    for (std::size_t s = 0; s < sensors_.size(); ++s) {
      const double angle = sensors_[s].accelerometer ? setup_.accelerometers[sensors_[s].index].angle
                                                     : rotor_.probes[sensors_[s].index].angle;
      const auto along = [&](const Eigen::VectorXd& row) {
        return std::cos(angle) * row.dot(q.head(r)) + std::sin(angle) * row.dot(q.tail(r));
      };
      const std::complex<double> motion = along(small.supports[at].row);
      std::complex<double> reading = motion;
      if (sensors_[s].accelerometer) {
        const std::complex<double> tilt = (along(small.supports[at + 1].row) - motion) / kTiltArm;
        reading = -speed * speed * motion - kGravity * tilt;
      }
      at += sensors_[s].accelerometer ? 2 : 1;
      z(static_cast<Index>(s), static_cast<Index>(k)) = draw.sensor.empty() ? reading : draw.sensor[s] * reading;
    }
  }
  return z;
}

std::vector<double> CentrifugeModel::forward_criticals(double highest) const {
  std::vector<double> list;
  for (const Critical& c : criticals(system({.load = 0.5 * setup_.load, .sensor = {}}), highest))
    if (c.direction > 0) list.push_back(c.speed);
  return list;
}

}  // namespace whirl::shaft
