#include "whirl/pages/modal_page.hpp"

#include <algorithm>
#include <cmath>

#include "modal_page_text.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/json.hpp"
#include "whirl/modal/residues.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
constexpr Index kMostPoints = 1200;  // of a curve

io::Json pair(double a, double b) { return io::Json(std::vector<double>{a, b}); }

// Lines to draw: the largest of the sum of magnitudes in every stretch, so that no peak is lost.
std::vector<Index> lines_to_draw(const FrequencyResponse& frf, const ModalModel& model, Eigen::VectorXd& sum) {
  sum = Eigen::VectorXd::Zero(frf.frequency.size());
  for (const FrfChannel& channel : frf.channels) sum += channel.value.cwiseAbs();
  std::vector<Index> inside;
  for (Index i = 0; i < frf.frequency.size(); ++i) {
    if (frf.frequency[i] >= model.band_low && frf.frequency[i] <= model.band_high) inside.push_back(i);
  }
  const std::size_t stride = std::max<std::size_t>(1, inside.size() / kMostPoints);
  std::vector<Index> drawn;
  for (std::size_t i = 0; i < inside.size(); i += stride) {
    const auto end = inside.begin() + static_cast<std::ptrdiff_t>(std::min(inside.size(), i + stride));
    drawn.push_back(*std::max_element(inside.begin() + static_cast<std::ptrdiff_t>(i), end,
                                      [&](Index a, Index b) { return sum[a] < sum[b]; }));
  }
  return drawn;
}

io::Json picked(const Eigen::VectorXd& v, const std::vector<Index>& lines) {
  std::vector<double> out;
  for (const Index i : lines) out.push_back(v[i]);
  return io::Json(out);
}

io::Json channels_of(const FrequencyResponse& frf, const ModalModel& model, const std::vector<Index>& lines) {
  io::Json channels = io::Json::array();
  for (std::size_t c = 0; c < frf.channels.size(); ++c) {
    const FrfChannel& channel = frf.channels[c];
    const Eigen::VectorXcd fitted =
        modal::synthesise(model, static_cast<Index>(c), frf.frequency, frf.kind, frf.window_decay);
    const Eigen::VectorXcd left = channel.value - fitted;
    double squares = 0, all = 0;
    for (Index i = 0; i < frf.frequency.size(); ++i) {
      if (frf.frequency[i] < model.band_low || frf.frequency[i] > model.band_high) continue;
      squares += std::norm(left[i]);
      all += std::norm(channel.value[i]);
    }
    io::Json entry = io::Json::object();
    entry.set("name", channel.response + " / " + channel.reference);
    entry.set("measured", picked(channel.value.cwiseAbs(), lines));
    entry.set("fitted", picked(fitted.cwiseAbs(), lines));
    entry.set("residual", picked(left.cwiseAbs(), lines));
    entry.set("error", all > 0 ? std::sqrt(squares / all) : 0.0);
    channels.push(std::move(entry));
  }
  return channels;
}

// Nodes that move: those of the geometry, or the points side by side.
struct Wire {
  std::vector<Eigen::Vector3d> nodes;
  std::vector<std::array<std::size_t, 2>> lines;
  std::vector<std::size_t> at;  ///< node of each point
  std::vector<Eigen::Vector3d> direction;
};

Wire wire_of(const modal::ModeShapes& shapes, const io::Geometry& geometry) {
  Wire wire;
  for (const io::Geometry::Node& node : geometry.nodes) wire.nodes.push_back(node.position);
  wire.lines = geometry.lines;
  std::vector<std::string> names;
  for (const io::Geometry::Node& node : geometry.nodes) names.push_back(node.name);
  for (const std::string& point : shapes.points) {
    const io::PointDirection where = io::point_direction(point);
    auto found = std::find(names.begin(), names.end(), where.node);
    if (found == names.end()) {
      if (!geometry.empty()) throw Error("point '" + point + "' has no node '" + where.node + "' in the geometry");
      if (!names.empty()) wire.lines.push_back({names.size() - 1, names.size()});
      wire.nodes.emplace_back(static_cast<double>(names.size()), 0, 0);
      names.push_back(where.node);
      found = names.end() - 1;
    }
    wire.at.push_back(static_cast<std::size_t>(found - names.begin()));
    wire.direction.push_back(where.direction.norm() > 0 ? where.direction : Eigen::Vector3d::UnitZ());
  }
  return wire;
}

io::Json motion_of(const Wire& wire, const Eigen::VectorXcd& shape) {
  std::vector<std::vector<double>> motion(wire.nodes.size(), std::vector<double>(6, 0.0));
  for (std::size_t i = 0; i < wire.at.size(); ++i) {
    for (std::size_t k = 0; k < 3; ++k) {
      motion[wire.at[i]][2 * k] += shape[static_cast<Index>(i)].real() * wire.direction[i][static_cast<Index>(k)];
      motion[wire.at[i]][2 * k + 1] += shape[static_cast<Index>(i)].imag() * wire.direction[i][static_cast<Index>(k)];
    }
  }
  io::Json list = io::Json::array();
  for (const auto& node : motion) list.push(io::Json(node));
  return list;
}

// Turned so that the largest component is real: residues carry the phase of the reference.
Eigen::VectorXcd turned(const Eigen::VectorXcd& shape) {
  Index largest = 0;
  const double size = shape.cwiseAbs().maxCoeff(&largest);
  return size > 0 ? Eigen::VectorXcd(shape * std::conj(shape[largest]) / (size * size)) : shape;
}

void set_modes(io::Json& data, const ModalModel& model, const modal::ModeShapes& shapes, const Wire& wire) {
  io::Json modes = io::Json::array(), matrix = io::Json::array(), chosen = io::Json::array();
  std::vector<Index> inside;
  for (std::size_t k = 0; k < model.modes.size(); ++k) {
    const double f = model.modes[k].frequency.value;
    if (f >= model.band_low && f <= model.band_high) inside.push_back(static_cast<Index>(k));
  }
  for (const Index k : inside) {
    const Mode& mode = model.modes[static_cast<std::size_t>(k)];
    const Eigen::VectorXcd shape = turned(shapes.value.col(k));
    const modal::ModeComplexity complexity = modal::mode_complexity(shape);
    io::Json parts = io::Json::array(), row = io::Json::array();
    for (const std::complex<double> c : shape) parts.push(pair(c.real(), c.imag()));
    for (const Index other : inside) row.push(modal::mac(shapes.value.col(k), shapes.value.col(other)));
    modes.push(io::Json::object()
                   .set("f", mode.frequency.value)
                   .set("z", mode.damping.value)
                   .set("mpc", complexity.mpc)
                   .set("mpd", complexity.mpd)
                   .set("shape", std::move(parts))
                   .set("motion", motion_of(wire, shape)));
    matrix.push(std::move(row));
    chosen.push(mode.frequency.value);
  }
  data.set("modes", std::move(modes)).set("mac", std::move(matrix)).set("chosen", std::move(chosen));
}

}  // namespace

std::string modal_page(const FrequencyResponse& frf, const ModalModel& model, const modal::ModeShapes& shapes,
                       const modal::StabilisationDiagram& diagram, const io::Geometry& geometry,
                       const std::string& command) {
  io::Json data = io::Json::object();
  Eigen::VectorXd sum;
  const std::vector<Index> lines = lines_to_draw(frf, model, sum);
  data.set("summary", model.summary.trust).set("command", command);
  data.set("unit", frf.kind == FrfKind::receptance ? "m/N" : frf.kind == FrfKind::mobility ? "m/(s N)" : "m/(s² N)");
  data.set("band", pair(model.band_low, model.band_high));
  data.set("f", picked(frf.frequency, lines)).set("sum", picked(sum, lines));
  io::Json poles = io::Json::array();
  for (const modal::StabilisationPole& pole : diagram.poles) {
    if (pole.frequency() < model.band_low || pole.frequency() > model.band_high) continue;
    poles.push(io::Json(std::vector<double>{static_cast<double>(pole.order), pole.frequency(), pole.damping(),
                                            pole.stable() ? 1.0 : 0.0}));
  }
  data.set("poles", std::move(poles)).set("channels", channels_of(frf, model, lines));
  const Wire wire = wire_of(shapes, geometry);
  io::Json nodes = io::Json::array(), joints = io::Json::array();
  for (const Eigen::Vector3d& p : wire.nodes) nodes.push(io::Json(std::vector<double>{p[0], p[1], p[2]}));
  for (const auto& [a, b] : wire.lines) joints.push(pair(static_cast<double>(a), static_cast<double>(b)));
  data.set("points", shapes.points).set("nodes", std::move(nodes)).set("lines", std::move(joints));
  set_modes(data, model, shapes, wire);
  std::string text = data.dump();
  // A name must not close the script.
  for (std::size_t at = text.find("</"); at != std::string::npos; at = text.find("</", at + 3))
    text.insert(at + 1, "\\");
  return kModalPageHead + text + kModalPageTail;
}

}  // namespace whirl::pages
