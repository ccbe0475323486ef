#pragma once
#include "whirl/shaft/fit/fit.hpp"
#include "whirl/testing/shaft/shaft_rig.hpp"

namespace whirl::testing {

/// How far the machine is from its drawing, relative or m; drawn evenly within these.
struct GeometryErrors {
  double young = 0, diameter = 0, disc_position = 0, disc_mass = 0;
};
struct PopulationOptions {
  bool second_critical = true;  ///< the runs pass it
  bool linear = false;          ///< bearings change over speed
  GeometryErrors errors = {};
  double start_stiffness = 2, start_damping = 4;  ///< factors by which the file's coefficients are off at most
  double duration = 48;                           ///< of each run, s
  double noise_db = 30;
  bool trial = true;       ///< a second run, with a trial mass
  bool symmetric = false;  ///< alike in x and y and about its middle, where its only disc is; no material damping
};

/// A machine, its drawing with starts for what is unknown, and its records: a run-up, and one with a trial mass.
struct RotorCase {
  ShaftRig rig;
  shaft::Rotor drawing;
  std::vector<shaft::Trial> trials;
  std::vector<Recording> records;
  std::vector<std::string> names{"up", "trial"};
  double top = 0;  ///< rad/s
};

/// Two discs on a shaft in two bearings, two probes at each: 1.3 to 1.7 m by 45 to 55 mm, bearings of 0.6 to 2.1 MN/m
/// with 0.7 to 1 between their axes and 200 to 800 N s/m, gains within 5 %, runout to 5 um.
inline RotorCase make_rotor_case(unsigned seed, const PopulationOptions& o) {
  std::mt19937_64 random(7919ull * seed + 17);
  const auto even = [&](double low, double high) { return std::uniform_real_distribution<double>(low, high)(random); };
  const double pi = std::numbers::pi;
  RotorCase c;
  ShaftRig& rig = c.rig;
  rig.length = even(1.3, 1.7);
  rig.diameter = even(0.045, 0.055);
  rig.damping_time = even(0.5e-5, 1.5e-5);
  const auto disc = [&](double position, double outer) {
    const double bore = rig.diameter, thick = 0.07, mass = rig.density * pi / 4 * (outer * outer - bore * bore) * thick;
    const double polar = mass * (outer * outer + bore * bore) / 8;
    rig.discs.push_back({position, mass, polar / 2 + mass * thick * thick / 12, polar});
  };
  disc(rig.length * even(0.28, 0.38), even(0.26, 0.30));
  disc(rig.length * even(0.60, 0.72), even(0.32, 0.37));
  for (const double z : {0.0, rig.length}) {
    RigBearing b;
    b.position = z;
    b.kx = (z == 0 ? 1.0e6 : 1.3e6) * even(0.6, 1.6);
    b.ky = b.kx * even(0.7, 1.0);
    b.cx = 400 * even(0.5, 2);
    b.cy = b.cx * even(0.7, 1.3);
    if (o.linear) {
      b.kx1 = b.kx * even(0.05, 0.2);
      b.ky1 = b.ky * even(0.05, 0.2);
      b.cx1 = b.cx * even(-0.3, -0.1);
      b.cy1 = b.cy * even(-0.3, -0.1);
    }
    rig.bearings.push_back(b);
  }
  if (o.symmetric) {
    rig.damping_time = 0;
    rig.discs.pop_back();
    rig.discs[0].position = rig.length / 2;
    rig.bearings[1] = rig.bearings[0];
    rig.bearings[1].position = rig.length;
    for (RigBearing& b : rig.bearings) b.ky = b.kx, b.cy = b.cx, b.ky1 = b.kx1, b.cy1 = b.cx1;
  }
  for (const RigDisc& d : rig.discs) rig.masses.push_back({d.position, even(4e-5, 1e-4), even(-pi, pi)});
  for (const auto& [name, z, a] :
       {std::tuple{"A x", 0.0, 0.0}, {"A y", 0.0, pi / 2}, {"B x", rig.length, 0.0}, {"B y", rig.length, pi / 2}})
    rig.probes.push_back(
        {name, z, a, std::polar(even(0.95, 1.05), even(-0.01, 0.01)), std::polar(even(0, 5e-6), even(-pi, pi))});
  // The drawing says what the machine was meant to be.
  shaft::Rotor& r = c.drawing;
  r.materials = {{"steel", rig.young, rig.shear, rig.density, 0}};
  r.shear.model = shaft::ShearModel::cowper;
  r.sections = {{rig.length, rig.diameter, rig.diameter, 0, 0, 0, 0}};
  for (std::size_t k = 0; k < rig.discs.size(); ++k) {
    const RigDisc& d = rig.discs[k];
    r.discs.push_back({"disc " + std::to_string(k + 1), d.position, d.mass, d.transverse, d.polar, 0});
    r.unbalances.push_back({d.position, d.position, 0, 0});
  }
  const auto off = [&](double factor) { return std::exp(even(-1, 1) * std::log(factor)); };
  for (const RigBearing& b : rig.bearings) {
    const double s = o.start_stiffness, d = o.start_damping;
    const Eigen::Matrix2d k = Eigen::Vector2d(b.kx * off(s), b.ky * off(s)).asDiagonal();
    const Eigen::Matrix2d damping = Eigen::Vector2d(b.cx * off(d), b.cy * off(d)).asDiagonal();
    r.supports.push_back(
        {b.position == 0 ? "A" : "B", {"shaft", b.position}, {"ground", b.position}, {{}, {k}, {damping}, {}}});
  }
  for (const RigProbe& p : rig.probes) r.probes.push_back({p.name, p.position, p.angle});
  // The machine as it was made.
  const double young = 1 + even(-1, 1) * o.errors.young;
  rig.young *= young;
  rig.shear *= young;
  rig.diameter *= 1 + even(-1, 1) * o.errors.diameter;
  for (std::size_t k = 0; k < rig.discs.size(); ++k) {
    RigDisc& d = rig.discs[k];
    d.position += even(-1, 1) * o.errors.disc_position;
    rig.masses[k].position = d.position;
    const double mass = 1 + even(-1, 1) * o.errors.disc_mass;
    d.mass *= mass;
    d.transverse *= mass;
    d.polar *= mass;
  }
  const std::vector<double> criticals = ShaftRigModel(rig).criticals();
  c.top = (o.second_critical ? 1.35 * criticals.at(1) : 1.6 * criticals.at(0));
  if (!o.second_critical && !o.symmetric) c.top = std::min(c.top, 0.6 * criticals.at(1));
  rig.lowest = 20;
  rig.highest = c.top;
  const ShaftRigModel model(rig);
  if (o.trial) c.trials = {{"trial", r.discs[0].position, 1e-4, 0}};
  for (unsigned k = 0; k < (o.trial ? 2u : 1u); ++k) {
    RigRun run;
    run.from = 20;
    run.to = c.top;
    run.duration = o.duration;
    run.noise_db = o.noise_db;
    run.seed = 2 * seed + k + 1;
    if (k == 1) run.added = {{rig.discs[0].position, 1e-4, 0}};
    c.records.push_back(model.run(run));
  }
  return c;
}

/// Vectors of the records of a case by its exact angle.
inline std::vector<shaft::OrderRun> order_runs(const RotorCase& c) {
  std::vector<std::string> channels;
  for (const RigProbe& p : c.rig.probes) channels.push_back(p.name);
  std::vector<shaft::OrderRun> runs;
  for (std::size_t k = 0; k < c.records.size(); ++k)
    runs.push_back(shaft::order_run(c.records[k], 0, c.records[k]["beta"], channels, c.names[k]));
  return runs;
}

}  // namespace whirl::testing
