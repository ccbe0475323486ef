#include "whirl/shaft/control/control_json.hpp"

namespace whirl::shaft {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using io::Json;
using io::JsonReader;

namespace {

Json rows(const MatrixXd& m) {
  Json list = Json::array();
  for (Index k = 0; k < m.rows(); ++k) list.push(Json(Eigen::VectorXd(m.row(k).transpose())));
  return list;
}
Json rows(const MatrixXcd& m) {
  return Json::object().set("real", rows(MatrixXd(m.real()))).set("imag", rows(MatrixXd(m.imag())));
}

MatrixXd read_rows(const JsonReader& in) {
  const std::vector<JsonReader> list = in.items();
  MatrixXd m;
  for (std::size_t k = 0; k < list.size(); ++k) {
    const Eigen::VectorXd row = list[k].vector();
    if (k == 0) m.resize(static_cast<Index>(list.size()), row.size());
    if (row.size() != m.cols()) throw list[k].error("every row of a matrix needs as many numbers as the first");
    m.row(static_cast<Index>(k)) = row.transpose();
  }
  return m;
}
MatrixXcd read_complex(const JsonReader& in) {
  const MatrixXd real = read_rows(in.at("real")), imag = read_rows(in.at("imag"));
  if (real.rows() != imag.rows() || real.cols() != imag.cols()) throw in.error("real and imag need the same size");
  MatrixXcd m(real.rows(), real.cols());
  m.real() = real;
  m.imag() = imag;
  return m;
}

Json point(const Point& p) { return Json::object().set("part", p.part).set("position", p.position); }
Point read_point(const JsonReader& in) { return {in.at("part").text(), in.at("position").number()}; }

}  // namespace

Json controller_json(const RotorController& c) {
  Json probes = Json::array(), actuators = Json::array(), gains = Json::array(), synchronous = Json::array();
  for (const Probe& p : c.probes)
    probes.push(Json::object()
                    .set("name", p.name)
                    .set("position", p.position)
                    .set("angle", p.angle)
                    .set("runout", p.runout)
                    .set("runout_angle", p.runout_angle));
  for (const Actuator& a : c.actuators)
    actuators.push(Json::object()
                       .set("name", a.name)
                       .set("on", point(a.a))
                       .set("against", point(a.b))
                       .set("angle", a.angle)
                       .set("force_limit", a.force_limit)
                       .set("slew", a.slew)
                       .set("bias_stiffness", a.bias_stiffness)
                       .set("bandwidth", a.bandwidth));
  for (const ControlGains& g : c.gains)
    gains.push(Json::object()
                   .set("speed", g.speed)
                   .set("advance", rows(g.advance))
                   .set("readings", rows(g.readings))
                   .set("forces", rows(g.forces))
                   .set("feedback", rows(g.feedback)));
  for (const SynchronousGains& g : c.synchronous)
    synchronous.push(Json::object()
                         .set("speed", g.speed)
                         .set("correction", rows(g.correction))
                         .set("relief", rows(g.relief))
                         .set("start", rows(MatrixXcd(g.start)))
                         .set("most", Json(g.most)));
  return io::start_document("whirl.rotor_controller", 1)
      .set("sample_time", c.sample_time)
      .set("probes", std::move(probes))
      .set("actuators", std::move(actuators))
      .set("gains", std::move(gains))
      .set("synchronous", std::move(synchronous))
      .set("adaptation", c.adaptation);
}

RotorController read_controller(const JsonReader& in) {
  in.require_schema("whirl.rotor_controller", 1);
  RotorController c;
  c.sample_time = in.at("sample_time").number();
  const auto later = [](const JsonReader& part, const char* key) {  // files of earlier programs are without it
    return part.has(key) ? part.at(key).number() : 0;
  };
  for (const JsonReader& p : in.at("probes").items())
    c.probes.push_back({p.at("name").text(), p.at("position").number(), p.at("angle").number(), later(p, "runout"),
                        later(p, "runout_angle")});
  for (const JsonReader& a : in.at("actuators").items())
    c.actuators.push_back({a.at("name").text(), read_point(a.at("on")), read_point(a.at("against")),
                           a.at("angle").number(), a.at("force_limit").number(), a.at("slew").number(),
                           a.at("bias_stiffness").number(), later(a, "bandwidth")});
  for (const JsonReader& g : in.at("gains").items())
    c.gains.push_back({g.at("speed").number(), read_rows(g.at("advance")), read_rows(g.at("readings")),
                       read_rows(g.at("forces")), read_rows(g.at("feedback"))});
  for (const JsonReader& g : in.at("synchronous").items())
    c.synchronous.push_back({g.at("speed").number(), read_complex(g.at("correction")), read_complex(g.at("relief")),
                             read_complex(g.at("start")), g.at("most").vector()});
  c.adaptation = in.at("adaptation").number();
  try {
    check(c);
  } catch (const Error& e) {
    throw in.error(e.what());
  }
  return c;
}

void save_rotor_controller(const std::filesystem::path& file, const RotorController& c) {
  io::save_json(file, controller_json(c));
}

RotorController load_rotor_controller(const std::filesystem::path& file) {
  const Json document = io::load_json(file);
  return read_controller(JsonReader(document, file.string()));
}

Json passages_json(const std::vector<ControlledPassage>& passages) {
  Json list = Json::array();
  for (const ControlledPassage& p : passages)
    list.push(Json::object()
                  .set("speed", p.speed)
                  .set("from", p.from)
                  .set("to", p.to)
                  .set("open", p.open)
                  .set("closed", p.closed)
                  .set("force", Json(p.force)));
  return list;
}

Json control_design_json(const ControlDesign& d) {
  Json points = Json::array(), actuators = Json::array();
  for (const Actuator& a : d.controller.actuators) actuators.push(Json(a.name));
  for (const ControlPoint& p : d.points)
    points.push(Json::object()
                    .set("speed", p.speed)
                    .set("open_damping", p.open_damping)
                    .set("closed_damping", p.closed_damping)
                    .set("growth", p.growth)
                    .set("sensitivity", Json(p.sensitivity))
                    .set("turning_force", Json(p.turning_force)));
  Json refused = Json::array();
  for (const ControlRefusal& r : d.refused)
    refused.push(Json::object().set("with", to_string(r.with)).set("speed", r.speed));
  Json document = io::start_document("whirl.rotor_control", 1);
  if (!d.law.empty()) document.set("law", d.law);
  for (const Amount& number : d.numbers) document.set(number.name, number.value);
  return document.set("summary", io::to_json(d.summary))
      .set("sample_time", d.controller.sample_time)
      .set("actuators", std::move(actuators))
      .set("points", std::move(points))
      .set("refused", std::move(refused))
      .set("worst_sensitivity", d.worst_sensitivity)
      .set("force_noise", d.force_noise);
}

}  // namespace whirl::shaft
