#include "whirl/pages/rotor_runs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <optional>
#include <random>

#include "whirl/core/error.hpp"
#include "whirl/diagnosis/rotation.hpp"
#include "whirl/io/units.hpp"
#include "whirl/shaft/centrifuge/accelerometers.hpp"
#include "whirl/shaft/reduction.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;

std::string channel_of(const Recording& record, const std::string& name) {
  for (const std::string& channel : {name, column_name(name)})
    if (record.has(channel)) return channel;
  return "";
}

shaft::OrderRun run_of(const Recording& record, const std::vector<std::string>& channels, const std::string& name,
                       int most_blocks) {
  const std::optional<diagnosis::Rotation> rotation = diagnosis::rotation_of(record);
  if (!rotation)
    throw Error(record.source + ": no channel 'key', 'keyphasor', 'tacho' or 'beta' shows a turning shaft");
  return shaft::order_run(record, rotation->first, rotation->angle, channels, name, most_blocks);
}

/// The sensors that the record has a channel of, or those named.
std::vector<shaft::CentrifugeSensor> record_sensors(const shaft::RotorJob& job, const Recording& record,
                                                    const std::vector<std::string>& wanted,
                                                    std::vector<std::string>& channels) {
  std::vector<shaft::CentrifugeSensor> used;
  std::string known;
  for (const shaft::CentrifugeSensor& s : shaft::centrifuge_sensors(job.rotor, job.centrifuge)) {
    known += (known.empty() ? "" : ", ") + s.name;
    if (!wanted.empty() && std::ranges::find(wanted, s.name) == wanted.end()) continue;
    const std::string channel = channel_of(record, s.name);
    if (channel.empty()) continue;
    const Quantity quantity = s.accelerometer ? Quantity::acceleration : Quantity::displacement;
    if (record.at(channel).quantity != quantity)
      throw Error(fmt::format("{}: channel '{}' is a {}; '{}' of the rotor file reads a {}", record.source, channel,
                              to_string(record.at(channel).quantity), s.name, to_string(quantity)));
    used.push_back(s);
    channels.push_back(channel);
  }
  for (const std::string& name : wanted)
    if (std::ranges::find(used, name, &shaft::CentrifugeSensor::name) == used.end())
      throw Error::in_field("--sensor", name, "one of the rotor file with a channel in the record: " + known);
  if (used.empty())
    throw Error(fmt::format("{}: no channel of a sensor of the rotor file ({})", record.source,
                            known.empty() ? "it has no [[accelerometer]] and no [[probe]]" : known));
  return used;
}

void add_noise(Recording& record, double noise_db, std::uint64_t seed) {
  if (!(noise_db > 0)) return;
  std::mt19937_64 random(seed);
  for (Channel& c : record.channels) {
    if (c.quantity == Quantity::angle || c.quantity == Quantity::force) continue;
    const double rms = std::sqrt(c.samples.squaredNorm() / static_cast<double>(c.samples.size()));
    std::normal_distribution<double> noise(0, rms * std::pow(10, -noise_db / 20));
    for (double& value : c.samples) value += noise(random);
  }
}

Recording recorded(const RotorRecord& r, const std::vector<shaft::Accelerometer>& accelerometers,
                   const std::vector<shaft::Actuator>& forces, double dt, const std::string& source) {
  Recording record;
  record.dt = dt;
  record.source = source;
  for (const RotorPlace& p : r.places) {
    const std::string name = column_name(p.name);
    const Eigen::VectorXd x = r.run.x.row(p.node).transpose(), y = r.run.y.row(p.node).transpose();
    if (p.probe) {
      Eigen::VectorXd reading = std::cos(p.probe->angle) * x + std::sin(p.probe->angle) * y;
      for (Index k = 0; k < reading.size(); ++k) reading[k] += p.probe->runout_at(r.run.angle[k]);
      record.add(name, Quantity::displacement, std::move(reading));
    } else {
      record.add(name + "_x", Quantity::displacement, x);
      record.add(name + "_y", Quantity::displacement, y);
    }
  }
  if (!accelerometers.empty()) {
    const Eigen::MatrixXd readings = shaft::accelerometer_readings(r.run, accelerometers);
    for (std::size_t k = 0; k < accelerometers.size(); ++k)
      record.add(column_name(accelerometers[k].name), Quantity::acceleration,
                 readings.row(static_cast<Index>(k)).transpose());
  }
  for (Index k = 0; k < r.run.forces.rows(); ++k)
    record.add("force_" + column_name(forces[static_cast<std::size_t>(k)].name), Quantity::force,
               r.run.forces.row(k).transpose());
  record.add("beta", Quantity::angle, r.run.angle);
  return record;
}

/// The run; with a controller also the one without it, where it is stable, and the passages of both.
void run_with(const shaft::Rotor& rotor, const shaft::System& system, const SimulatedRun& o, RotorRecord& out) {
  shaft::RunOptions run = o.run;
  if (o.controller) run.control = shaft::sampled_forces(rotor, system, *o.controller, o.probe_noise, o.seed);
  const double low = std::min(run.from, run.to), high = std::max(run.from, run.to);
  if (o.controller)
    if (const auto threshold = shaft::stability_threshold(system, low, high)) out.unstable = threshold->speed;
  // Without control there is no steady response to begin with.
  run.from_rest = out.unstable && *out.unstable <= run.from;
  out.run = shaft::simulate_run(system, run);
  if (!o.controller) return;
  const auto& gains = o.controller->gains;
  if (low < gains.front().speed * (1 - 1e-9) || high > gains.back().speed * (1 + 1e-9))
    out.summary.warn("the run leaves the speeds that the controller was designed for: beyond them its gains are held");
  std::vector<Index> nodes;
  for (const shaft::Probe& p : rotor.probes) nodes.push_back(system.node_at(p.position));
  for (const shaft::Disc& d : rotor.discs) nodes.push_back(system.node_at(d.position));
  if (out.unstable) {
    out.passages = shaft::passages(system, nullptr, out.run, nodes);
    return;
  }
  const shaft::RotorRun open = shaft::simulate_run(system, o.run);
  out.passages = shaft::passages(system, &open, out.run, nodes);
}

}  // namespace

std::string column_name(std::string text) {
  for (char& c : text)
    if (std::isalnum(static_cast<unsigned char>(c)) == 0) c = '_';
  return text;
}

shaft::OrderRun probe_run(const Recording& record, const shaft::Rotor& rotor, const std::string& name) {
  std::vector<std::string> channels;
  for (const shaft::Probe& p : rotor.probes) {
    channels.push_back(channel_of(record, p.name));
    if (!channels.back().empty()) {
      if (const Channel& c = record.at(channels.back()); c.quantity != Quantity::displacement)
        throw Error(record.source + ": " + io::quantity_problem(c.name, c.quantity, Quantity::displacement));
      continue;
    }
    std::string known;
    for (const Channel& c : record.channels) known += (known.empty() ? "" : ", ") + c.name;
    throw Error(fmt::format("{}: no channel '{}' of the [[probe]] of that name; the record has {}", record.source,
                            column_name(p.name), known));
  }
  constexpr int kMostBlocks = 300;
  return run_of(record, channels, name, kMostBlocks);
}

SensorRun sensor_run(const Recording& record, const shaft::RotorJob& job, const std::vector<std::string>& wanted) {
  constexpr int kMostBlocks = 1000;
  std::vector<std::string> channels;
  std::vector<shaft::CentrifugeSensor> sensors = record_sensors(job, record, wanted, channels);
  return {run_of(record, channels, record.source, kMostBlocks), std::move(sensors)};
}

RotorRecord simulated_record(const shaft::RotorJob& job, const SimulatedRun& o, const std::string& source) {
  constexpr double kReduced = 0.01, kStepped = 1e-3;  // errors above these are worth a warning
  const std::vector<shaft::Accelerometer>& accelerometers = job.centrifuge.accelerometers;
  const shaft::System full = shaft::assemble_with(job.rotor, accelerometers);
  RotorRecord out;
  out.places = rotor_places(job.rotor, full);
  if (out.places.empty()) throw Error(source + ": no [[probe]] and no [[disc]]: nothing to look at");
  out.coordinates = out.all_coordinates = full.size();
  if (o.full) {
    run_with(job.rotor, full, o, out);
  } else {
    const shaft::Reduction reduced =
        shaft::reduce(full, {.modes = o.modes, .static_shapes = true, .highest = std::max(o.run.from, o.run.to)});
    out.coordinates = reduced.system.size();
    out.reduction_error = reduced.worst_error;
    out.reduction_speed = reduced.worst_speed;
    if (reduced.worst_error > kReduced)
      out.summary.warn("the reduced model differs from the full one by more than 1 %: raise --modes or use --full");
    run_with(job.rotor, reduced.system, o, out);
  }
  // No rotor moves by its own length: such a run says only that it diverges.
  const double largest = std::max(out.run.x.cwiseAbs().maxCoeff(), out.run.y.cwiseAbs().maxCoeff());
  if (!out.run.x.allFinite() || !(largest < job.rotor.length()))
    out.summary.fail("the motion grows without bound: the rotor is unstable in this range");
  if (out.run.step_error > kStepped) out.summary.warn("the time steps are too long for this motion: raise --rate-hz");
  for (const RotorPlace& p : out.places) out.peaks.push_back(shaft::run_peak(out.run, p.node));
  out.record = recorded(out, accelerometers, o.controller ? o.controller->actuators : std::vector<shaft::Actuator>{},
                        o.run.sample_time, source);
  add_noise(out.record, o.noise_db, o.seed);
  return out;
}

}  // namespace whirl::pages
