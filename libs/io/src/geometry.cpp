#include "whirl/io/geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "formats/text_lines.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/io/signals.hpp"
#include "whirl/io/units.hpp"

namespace whirl::io {
namespace {

Geometry from_uff(const std::filesystem::path& path) {
  const UffFile file = read_uff(path);
  Geometry geometry;
  const double length = file.units.size() == 1 && file.units[0].length > 0 ? file.units[0].length : 1;
  std::map<long, std::size_t> at;
  for (const UffNode& node : file.nodes) {
    at[node.label] = geometry.nodes.size();
    geometry.nodes.push_back({std::to_string(node.label), node.position / length});
  }
  const auto join = [&](long a, long b) {
    if (a == 0 || b == 0) return;  // pen up
    if (!at.contains(a) || !at.contains(b)) {
      throw Error::in_file(path.string(), 0,
                           fmt::format("a line joins node {}, which is not in the file", at.contains(a) ? b : a));
    }
    geometry.lines.push_back({at[a], at[b]});
  };
  for (const UffTrace& trace : file.traces) {
    for (std::size_t i = 1; i < trace.nodes.size(); ++i) join(trace.nodes[i - 1], trace.nodes[i]);
  }
  for (const UffElement& element : file.elements) {
    for (std::size_t i = 0; i + 1 < element.nodes.size(); ++i) join(element.nodes[i], element.nodes[i + 1]);
    if (element.nodes.size() > 2) join(element.nodes.back(), element.nodes.front());
  }
  return geometry;
}

Geometry from_toml(const std::filesystem::path& path) {
  const Settings settings = read_settings(path);
  Geometry geometry;
  for (const std::string& key : settings.keys("nodes")) {
    const NameWithUnit split = split_unit(key);
    const std::string name = split.unit != nullptr ? split.name : key;
    const std::vector<double> p = settings.numbers("nodes." + name, Quantity::displacement, {});
    if (p.size() != 3)
      throw settings.error("nodes." + key, "must be a place [x, y, z] with a unit, e.g. 1_mm = [0, 0, 0]");
    geometry.nodes.push_back({name, {p[0], p[1], p[2]}});
  }
  for (const std::string& key : settings.keys("lines")) {
    std::size_t before = Geometry::npos;
    for (const std::string& name : settings.texts("lines." + key, {})) {
      const std::size_t at = geometry.find(name);
      if (at == Geometry::npos) throw settings.error("lines." + key, fmt::format("no node '{}'", name));
      if (before != Geometry::npos) geometry.lines.push_back({before, at});
      before = at;
    }
  }
  settings.finish();
  return geometry;
}

}  // namespace

std::size_t Geometry::find(const std::string& name) const {
  for (std::size_t i = 0; i < nodes.size(); ++i) {
    if (nodes[i].name == name) return i;
  }
  return npos;
}

Geometry read_geometry(const std::filesystem::path& path) {
  const Geometry geometry = file_format(path) == FileFormat::uff ? from_uff(path) : from_toml(path);
  if (geometry.empty()) throw Error::in_file(path.string(), 0, "holds no nodes");
  return geometry;
}

PointDirection point_direction(const std::string& point) {
  PointDirection result{point, Eigen::Vector3d::Zero()};
  const std::size_t colon = point.rfind(':');
  if (colon == std::string::npos || point.size() - colon != 3) return result;
  const int axis = point[colon + 2] - 'X';
  const char sign = point[colon + 1];
  if (axis < 0 || axis > 2 || (sign != '+' && sign != '-')) return result;
  result.node = point.substr(0, colon);
  result.direction[axis] = sign == '+' ? 1 : -1;
  return result;
}

UffFile uff_from_modes(const ModalModel& model, const std::vector<std::string>& points, const Eigen::MatrixXcd& shapes,
                       const Geometry& geometry) {
  UffFile file;
  file.units.push_back({1, "SI: Meter (newton)", 1, 1, 1, 273.15});
  std::map<std::string, long> label;
  long largest = 0;
  const auto own_label = [](const std::string& name) { return std::max(0L, number_of<long>(name).value_or(0)); };
  std::vector<std::string> names;
  for (const Geometry::Node& node : geometry.nodes) names.push_back(node.name);
  for (const std::string& point : points) names.push_back(point_direction(point).node);
  for (const std::string& name : names) largest = std::max(largest, own_label(name));
  for (const std::string& name : names) {
    if (label.contains(name)) continue;
    const long number = own_label(name);
    label[name] = number > 0 ? number : ++largest;
    if (number == 0) file.header.push_back(fmt::format("node {} is '{}'", label[name], name));
  }
  for (const Geometry::Node& node : geometry.nodes) file.nodes.push_back({label[node.name], node.position});
  for (const auto& [a, b] : geometry.lines) {
    UffElement element;
    element.label = static_cast<long>(file.elements.size()) + 1;
    element.type = 21;  // linear beam
    element.nodes = {label[geometry.nodes[a].name], label[geometry.nodes[b].name]};
    file.traces.push_back({"line", element.nodes});
    file.elements.push_back(std::move(element));
  }
  std::vector<long> nodes;
  for (const std::string& point : points) {
    const long at = label[point_direction(point).node];
    if (std::find(nodes.begin(), nodes.end(), at) == nodes.end()) nodes.push_back(at);
  }
  for (std::size_t k = 0; k < model.modes.size(); ++k) {
    const Mode& mode = model.modes[k];
    UffShape shape;
    shape.id[0] =
        fmt::format("mode {} at {:.8g} Hz, damping ratio {:.6g}", k + 1, mode.frequency.value, mode.damping.value);
    shape.analysis = 3;
    shape.complex = true;
    shape.integers = {1, static_cast<long>(k) + 1};
    shape.reals = {mode.pole.real(), mode.pole.imag(), 1, 0, 1, 0};
    shape.nodes = nodes;
    shape.value = Eigen::MatrixXcd::Zero(static_cast<Eigen::Index>(nodes.size()), 3);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const PointDirection at = point_direction(points[i]);
      const auto row = std::find(nodes.begin(), nodes.end(), label[at.node]) - nodes.begin();
      const Eigen::Vector3d direction = at.direction.norm() > 0 ? at.direction : Eigen::Vector3d::UnitZ();
      shape.value.row(row) +=
          (shapes(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(k)) * direction.cast<std::complex<double>>())
              .transpose();
    }
    file.shapes.push_back(std::move(shape));
  }
  return file;
}

}  // namespace whirl::io
