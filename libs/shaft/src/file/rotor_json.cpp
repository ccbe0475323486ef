#include "whirl/shaft/rotor_json.hpp"

namespace whirl::shaft {

using io::Json;

namespace {

Json mode_json(const Mode& m) {
  return Json::object()
      .set("pole", io::to_json(m.pole))
      .set("frequency", m.frequency())
      .set("damping", m.damping())
      .set("direction", m.direction);
}

Json critical_json(double speed, double frequency, double direction) {
  return Json::object().set("speed", speed).set("frequency", frequency).set("direction", direction);
}

}  // namespace

Json import_json(const ImportedRotor& imported, const Summary& summary) {
  const Rotor& r = imported.rotor;
  return io::start_document("whirl.rotor_import", 1)
      .set("summary", io::to_json(summary))
      .set("length", r.length())
      .set("mass", r.mass())
      .set("polar_inertia", r.polar_inertia())
      .set("sections", static_cast<long>(r.sections.size()))
      .set("discs", static_cast<long>(r.discs.size()))
      .set("bodies", static_cast<long>(r.bodies.size()))
      .set("supports", static_cast<long>(r.supports.size()));
}

Json threshold_json(const std::optional<Threshold>& threshold) {
  return threshold ? critical_json(threshold->speed, threshold->frequency, threshold->direction) : Json();
}

Json modes_json(const System& system, double speed, const std::vector<Mode>& modes, const Sag& sag,
                const MeshCheck& mesh) {
  Json list = Json::array();
  for (const Mode& m : modes) {
    Json one = mode_json(m);
    Json x = Json::array(), y = Json::array();
    for (const auto z : m.x) x.push(io::to_json(z));
    for (const auto z : m.y) y.push(io::to_json(z));
    list.push(one.set("x", std::move(x)).set("y", std::move(y)));
  }
  Json supports = Json::array();
  for (std::size_t k = 0; k < sag.reactions.size(); ++k)
    supports.push(Json::object()
                      .set("name", system.supports[k].name)
                      .set("force_x", sag.reactions[k].x())
                      .set("force_y", sag.reactions[k].y()));
  return io::start_document("whirl.rotor_modes", 1)
      .set("speed", speed)
      .set("positions", system.nodes)
      .set("modes", std::move(list))
      .set("sag", Json(sag.y))
      .set("supports", std::move(supports))
      .set("mesh_errors", mesh.error);
}

Json campbell_json(const std::vector<CampbellPoint>& points) {
  Json list = Json::array();
  for (const CampbellPoint& p : points) {
    Json modes = Json::array();
    for (const Mode& m : p.modes) modes.push(mode_json(m));
    list.push(Json::object().set("speed", p.speed).set("modes", std::move(modes)));
  }
  return io::start_document("whirl.rotor_campbell", 1).set("points", std::move(list));
}

Json criticals_json(const std::vector<Critical>& criticals, double spin_per_whirl,
                    const std::optional<Threshold>& threshold, double highest) {
  Json list = Json::array();
  for (const Critical& c : criticals) list.push(critical_json(c.speed, c.frequency, c.direction));
  Json document = io::start_document("whirl.rotor_criticals", 1)
                      .set("spin_per_whirl", spin_per_whirl)
                      .set("highest", highest)
                      .set("criticals", std::move(list));
  document.set("unstable_from", threshold_json(threshold));
  return document;
}

Json response_json(const std::vector<Reading>& readings) {
  Json list = Json::array();
  for (const Reading& r : readings) {
    Json peaks = Json::array();
    for (const Peak& p : r.peaks)
      peaks.push(
          Json::object().set("speed", p.speed).set("amplitude", p.amplitude).set("amplification", p.amplification));
    list.push(Json::object()
                  .set("name", r.name)
                  .set("position", r.position)
                  .set("angle", r.angle)
                  .set("peaks", std::move(peaks)));
  }
  return io::start_document("whirl.rotor_response", 1).set("readings", std::move(list));
}

Json run_json(const RotorRun& run, const std::vector<std::string>& stations, const std::vector<RunPeak>& peaks,
              double reduction_error) {
  Json list = Json::array();
  for (std::size_t k = 0; k < peaks.size(); ++k)
    list.push(Json::object()
                  .set("name", stations[k])
                  .set("peak", peaks[k].size)
                  .set("speed", peaks[k].speed)
                  .set("time", peaks[k].time));
  return io::start_document("whirl.rotor_run", 1)
      .set("stations", std::move(list))
      .set("step", run.step)
      .set("step_error", run.step_error)
      .set("reduction_error", reduction_error);
}

}  // namespace whirl::shaft
