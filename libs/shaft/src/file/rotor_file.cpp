#include "whirl/shaft/rotor_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "centrifuge/centrifuge_file.hpp"
#include "fit/fit_file.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/shaft/response.hpp"

namespace whirl::shaft {
namespace {

using io::Settings;
using Q = Quantity;

constexpr double kLargest = 1e300;

/// A unit of a quantity that only rotors have.
struct RotorUnit {
  std::string_view suffix;
  double factor;

  /// As in a sentence: the first underscore is "per".
  std::string text() const {
    std::string words(suffix);
    if (const auto at = words.find('_'); at != words.npos) words[at] = '/';
    return words;
  }
};
constexpr RotorUnit kModulus[] = {{"GPa", 1e9}, {"MPa", 1e6}, {"Pa", 1}};
constexpr RotorUnit kDensity[] = {{"kg_m3", 1}, {"gram_cm3", 1e3}};
constexpr RotorUnit kUnbalance[] = {{"gmm", 1e-6}, {"kgm", 1}};
constexpr RotorUnit kSlew[] = {{"N_s", 1}, {"kN_s", 1e3}};
constexpr RotorUnit kTiltStiffness[] = {{"Nm_rad", 1}};
constexpr RotorUnit kTiltDamping[] = {{"Nms_rad", 1}};

class RotorReader {
 public:
  explicit RotorReader(const Settings& settings) : s_(settings) {}

  RotorJob read() {
    rotor_.name = s_.text("rotor.name", "");
    rotor_.vertical = s_.flag("rotor.vertical", false);
    rotor_.not_trusted = s_.text("rotor.not_trusted", "", {"model_error", "work_limit"});
    rotor_.element = s_.text("rotor.element", "internal-node", {"internal-node", "usual"}) == "usual"
                         ? ElementKind::usual
                         : ElementKind::internal_node;
    rotor_.elements = static_cast<int>(s_.integer("rotor.elements", rotor_.elements, 1, 1000));
    rotor_.axial_force = s_.number("rotor.axial_force", Q::force, 0);
    read_shear();
    read_materials();
    read_sections();
    read_discs();
    for (std::size_t k = 0; k < s_.count("body"); ++k) {
      const std::string at = fmt::format("body[{}].", k);
      rotor_.bodies.push_back({s_.text(at + "name", ""), s_.require_number(at + "position", Q::displacement),
                               s_.require_number(at + "mass", Q::mass, 1e-9),
                               s_.number(at + "transverse", Q::moment_of_inertia, 0, 0)});
      const std::string& name = rotor_.bodies.back().name;
      if (name.empty() || name == "shaft" || name == "ground")
        throw s_.error(at + "name", "a body needs a name of its own");
    }
    read_supports();
    read_excitation();
    read_actuators();
    FitSetup fit = read_fit_setup(s_, rotor_);
    CentrifugeSetup centrifuge = read_centrifuge(s_, rotor_);
    s_.finish();
    check(rotor_);
    check_sag();
    return {std::move(rotor_), std::move(fit), std::move(centrifuge)};
  }

 private:
  /// No rotor sags by its own length: a diameter or a length is in another unit than the key says.
  void check_sag() const {
    if (rotor_.vertical) return;
    const System system = assemble(rotor_);
    const double length = system.nodes.back() - system.nodes.front();
    const Sag sag = static_sag(system);
    if (sag.y.size() > 0 && sag.y.cwiseAbs().maxCoeff() > length)
      throw s_.error("section[0]",
                     fmt::format("the shaft of {:.3g} m sags by {:.3g} m under its own weight: is a length "
                                 "in mm given as m? A vertical shaft needs vertical = true",
                                 length, sag.y.cwiseAbs().maxCoeff()));
  }

  /// `table.name_SUFFIX`; at most one of the suffixes.
  std::optional<double> find(const std::string& path, std::span<const RotorUnit> units, double low, double high) const {
    std::optional<double> value;
    std::string allowed;
    for (const RotorUnit& u : units) {
      const std::string key = fmt::format("{}_{}", path, u.suffix);
      allowed += fmt::format("{}{}", allowed.empty() ? "" : ", ", u.suffix);
      const auto found = s_.find_number(key, Q::dimensionless);
      if (!found) continue;
      if (value) throw s_.error(key, "is given twice");
      if (!(*found * u.factor >= low && *found * u.factor <= high))
        throw s_.error(key, fmt::format("must be between {:g} and {:g} {}", low / u.factor, high / u.factor, u.text()));
      value = *found * u.factor;
    }
    if (!value && s_.find_number(path, Q::dimensionless))
      throw s_.error(path, fmt::format("has no unit; write {}_{} (allowed units: {})", path.substr(path.rfind('.') + 1),
                                       units.front().suffix, allowed));
    return value;
  }

  double position(const std::string& path) const {
    return s_.require_number(path, Q::displacement, 0, rotor_.length() * (1 + 1e-9));
  }
  std::optional<double> find_position(const std::string& path) const {
    if (!s_.find_number(path, Q::displacement)) return std::nullopt;
    return position(path);
  }

  void read_shear() {
    const std::string model = s_.text("rotor.shear", "hutchinson", {"hutchinson", "cowper", "none"});
    rotor_.shear.model = model == "none"     ? ShearModel::none
                         : model == "cowper" ? ShearModel::cowper
                                             : ShearModel::hutchinson;
    if (!s_.find_number("rotor.shear_coefficient", Q::dimensionless)) return;
    if (s_.has("rotor.shear"))
      throw s_.error("rotor.shear_coefficient", "a number and the name of a rule (shear) exclude each other");
    rotor_.shear = {ShearModel::number, s_.number("rotor.shear_coefficient", Q::dimensionless, 0, 1e-3, 1)};
  }

  void read_materials() {
    if (s_.count("material") > 0) rotor_.materials.clear();
    for (std::size_t k = 0; k < s_.count("material"); ++k) {
      const std::string at = fmt::format("material[{}].", k);
      Material m;
      m.name = s_.text(at + "name", fmt::format("{}", k + 1));
      m.youngs_modulus = find(at + "youngs_modulus", kModulus, 1, kLargest).value_or(m.youngs_modulus);
      m.density = find(at + "density", kDensity, 0, 1e6).value_or(m.density);
      m.damping = s_.number(at + "damping_time", Q::time, 0, 0, 1);
      const double poisson = s_.number(at + "poisson_ratio", Q::dimensionless, 0.3, 0, 0.5);
      const auto shear = find(at + "shear_modulus", kModulus, m.youngs_modulus / 3, m.youngs_modulus / 2);
      if (shear && s_.has(at + "poisson_ratio"))
        throw s_.error(at + "poisson_ratio", "it follows from youngs_modulus and shear_modulus: give one of the two");
      m.shear_modulus = shear.value_or(m.youngs_modulus / (2 * (1 + poisson)));
      rotor_.materials.push_back(m);
    }
  }

  std::size_t material(const std::string& path) const {
    const std::string name = s_.text(path, rotor_.materials.front().name);
    std::string known;
    for (std::size_t k = 0; k < rotor_.materials.size(); ++k) {
      if (rotor_.materials[k].name == name) return k;
      known += (k > 0 ? ", " : "") + rotor_.materials[k].name;
    }
    throw s_.error(path, "must be the name of a [[material]]: " + known);
  }

  void read_sections() {
    if (s_.count("section") == 0) throw Error(s_.source() + ": no [[section]]: the shaft needs at least one");
    for (std::size_t k = 0; k < s_.count("section"); ++k) {
      const std::string at = fmt::format("section[{}].", k);
      Section c;
      c.length = s_.require_number(at + "length", Q::displacement, 1e-9);
      c.outer = s_.require_number(at + "outer", Q::displacement, 1e-9);
      c.outer_end = s_.number(at + "outer_end", Q::displacement, c.outer, 1e-9);
      c.inner = s_.number(at + "inner", Q::displacement, 0, 0, c.outer * (1 - 1e-6));
      c.inner_end = s_.number(at + "inner_end", Q::displacement, std::min(c.inner, c.outer_end * (1 - 1e-6)), 0,
                              c.outer_end * (1 - 1e-6));
      c.material = material(at + "material");
      c.elements = static_cast<int>(s_.integer(at + "elements", 0, 0, 1000));
      rotor_.sections.push_back(c);
    }
  }

  void read_discs() {
    for (std::size_t k = 0; k < s_.count("disc"); ++k) {
      const std::string at = fmt::format("disc[{}].", k);
      Disc d;
      if (s_.find_number(at + "mass", Q::mass)) {
        if (s_.has(at + "thickness"))
          throw s_.error(at + "mass", "a disc has mass, transverse and polar, or outer, bore and thickness");
        d.mass = s_.require_number(at + "mass", Q::mass, 0);
        d.transverse = s_.number(at + "transverse", Q::moment_of_inertia, 0, 0);
        d.polar = s_.number(at + "polar", Q::moment_of_inertia, 0, 0, 2 * d.transverse * (1 + 1e-9));
      } else {
        const double outer = s_.require_number(at + "outer", Q::displacement, 1e-9);
        const double bore = s_.number(at + "bore", Q::displacement, 0, 0, outer);
        const Material& m = rotor_.materials[material(at + "material")];
        d = cylinder(m.density, outer, bore, s_.require_number(at + "thickness", Q::displacement, 1e-9));
      }
      d.name = s_.text(at + "name", fmt::format("disc {}", k + 1));
      d.position = position(at + "position");
      d.offset = s_.number(at + "offset", Q::displacement, 0);
      rotor_.discs.push_back(d);
    }
  }

  /// Coefficients of one kind: `name` for both directions, or name_x, name_y; name_xy, name_yx across. Arrays where the
  /// support has speeds.
  std::vector<Eigen::Matrix2d> coefficients(const std::string& at, const char* name, Q quantity,
                                            std::size_t speeds) const {
    std::vector<Eigen::Matrix2d> table(std::max<std::size_t>(1, speeds), Eigen::Matrix2d::Zero());
    const auto put = [&](const std::string& key, std::initializer_list<std::pair<int, int>> places) {
      std::vector<double> values;
      if (speeds == 0) {
        if (const auto v = s_.find_number(at + key, quantity)) values = {*v};
      } else {
        values = s_.numbers(at + key, quantity, {});
      }
      if (values.empty()) return false;
      if (values.size() != table.size())
        throw s_.error(at + key, fmt::format("one value a speed is needed, {}", table.size()));
      for (std::size_t k = 0; k < values.size(); ++k)
        for (const auto& [i, j] : places) table[k](i, j) = values[k];
      return true;
    };
    const std::string base = name;
    const bool both = put(base, {{0, 0}, {1, 1}}), x = put(base + "_x", {{0, 0}}), y = put(base + "_y", {{1, 1}});
    if (both && (x || y))
      throw Error(fmt::format("{}: {}{}: one value for both axes, or one each", s_.source(), at, name));
    if (x != y) throw Error(fmt::format("{}: {}{}: {}_x and {}_y are needed both", s_.source(), at, name, name, name));
    put(base + "_xy", {{0, 1}});
    put(base + "_yx", {{1, 0}});
    return table;
  }

  void read_law(const std::string& at, Support& support) const {
    SupportLaw& law = support.law;
    law.speeds = s_.numbers(at + "speed", Q::angular_velocity, {});
    if (std::adjacent_find(law.speeds.begin(), law.speeds.end(), std::greater_equal<>()) != law.speeds.end())
      throw s_.error(at + "speed", "speeds must ascend");
    law.stiffness = coefficients(at, "stiffness", Q::stiffness, law.speeds.size());
    law.damping = coefficients(at, "damping", Q::damping, law.speeds.size());
    law.mass = coefficients(at, "mass", Q::mass, law.speeds.size());
    support.tilt_stiffness = find(at + "tilt_stiffness", kTiltStiffness, 0, kLargest).value_or(0);
    support.tilt_damping = find(at + "tilt_damping", kTiltDamping, 0, kLargest).value_or(0);
  }

  void read_supports() {
    for (std::size_t k = 0; k < s_.count("bearing"); ++k) {
      const std::string at = fmt::format("bearing[{}].", k);
      const double z = position(at + "position");
      Support b{
          s_.text(at + "name", fmt::format("bearing {}", k + 1)), {"shaft", z}, {part(at + "on", "ground"), z}, {}};
      read_law(at, b);
      rotor_.supports.push_back(std::move(b));
    }
    for (std::size_t k = 0; k < s_.count("mount"); ++k) {
      const std::string at = fmt::format("mount[{}].", k);
      const double z = s_.require_number(at + "position", Q::displacement);
      Support m{s_.text(at + "name", fmt::format("mount {}", k + 1)), {part(at + "body", ""), z}, {"ground", z}, {}};
      read_law(at, m);
      rotor_.supports.push_back(std::move(m));
    }
    for (std::size_t k = 0; k < s_.count("spring"); ++k) {
      const std::string at = fmt::format("spring[{}].", k);
      Support p{s_.text(at + "name", fmt::format("spring {}", k + 1)), end(at + "from"), end(at + "to"), {}};
      read_law(at, p);
      rotor_.supports.push_back(std::move(p));
    }
  }
  Point end(const std::string& key) const {
    const std::string on = part(key, "shaft");
    const std::string place = key + "_position";
    if (on == "shaft") return {on, position(place)};
    return {on, s_.number(place, Q::displacement, 0)};
  }
  std::string part(const std::string& path, std::string_view fallback) const {
    const std::string name = s_.text(path, fallback);
    std::string known = "shaft, ground";
    if (name == "shaft" || name == "ground") return name;
    for (const Body& b : rotor_.bodies) {
      if (b.name == name) return name;
      known += ", " + b.name;
    }
    if (name.empty()) throw Error(fmt::format("{}: no key '{}': the name of a [[body]]", s_.source(), path));
    throw s_.error(path, "must be one of " + known);
  }

  void read_excitation() {
    for (std::size_t k = 0; k < s_.count("joint"); ++k) {
      const std::string at = fmt::format("joint[{}].", k);
      rotor_.joints.push_back(
          {position(at + "from"), position(at + "to"), find(at + "damping", kTiltDamping, 0, kLargest).value_or(0)});
    }
    for (std::size_t k = 0; k < s_.count("unbalance"); ++k) {
      const std::string at = fmt::format("unbalance[{}].", k);
      Unbalance u;
      u.position = position(at + "position");
      u.end = find_position(at + "end").value_or(u.position);
      if (u.end < u.position) throw s_.error(at + "end", "must not be left of position");
      u.angle = s_.number(at + "angle", Q::angle, 0);
      if (const auto size = find(at + "size", kUnbalance, 0, kLargest))
        u.size = *size;
      else
        u.size = s_.require_number(at + "mass", Q::mass, 0) * s_.require_number(at + "radius", Q::displacement, 0);
      rotor_.unbalances.push_back(u);
    }
    for (std::size_t k = 0; k < s_.count("bow"); ++k) {
      const std::string at = fmt::format("bow[{}].", k);
      rotor_.bow.push_back({position(at + "position"), s_.require_number(at + "size", Q::displacement),
                            s_.number(at + "angle", Q::angle, 0)});
    }
    for (std::size_t k = 0; k < s_.count("probe"); ++k) {
      const std::string at = fmt::format("probe[{}].", k);
      rotor_.probes.push_back({s_.text(at + "name", fmt::format("probe {}", k + 1)), position(at + "position"),
                               s_.number(at + "angle", Q::angle, 0), s_.number(at + "runout", Q::displacement, 0, 0),
                               s_.number(at + "runout_angle", Q::angle, 0)});
    }
  }

  void read_actuators() {
    for (std::size_t k = 0; k < s_.count("actuator"); ++k) {
      const std::string at = fmt::format("actuator[{}].", k);
      Actuator a;
      a.name = s_.text(at + "name", fmt::format("actuator {}", k + 1));
      for (const Actuator& other : rotor_.actuators)
        if (other.name == a.name) throw s_.error(at + "name", "two actuators have this name: each needs its own");
      a.a.part = part(at + "on", "shaft");
      a.b.part = part(at + "against", "ground");
      if (a.a.part == "ground") throw s_.error(at + "on", "must be the shaft or a [[body]]: the ground does not move");
      if (a.a.part == a.b.part) throw s_.error(at + "against", "must be another part than the one pushed");
      const bool shaft = a.a.part == "shaft" || a.b.part == "shaft";
      a.a.position = a.b.position =
          shaft ? position(at + "position") : s_.require_number(at + "position", Q::displacement);
      a.angle = s_.number(at + "angle", Q::angle, 0);
      a.force_limit = s_.require_number(at + "force_limit", Q::force, 1e-12);
      a.slew = find(at + "slew", kSlew, 0, kLargest).value_or(0);
      a.bias_stiffness = s_.number(at + "bias_stiffness", Q::stiffness, 0, -kLargest, 0);
      a.bandwidth = kTwoPi * s_.number(at + "bandwidth", Q::frequency, 0, 0);
      rotor_.actuators.push_back(std::move(a));
    }
  }

  const Settings& s_;
  Rotor rotor_;
};

}  // namespace

RotorJob read_rotor_job(const std::filesystem::path& file) {
  const Settings settings = io::read_settings(file);
  return RotorReader(settings).read();
}

Rotor read_rotor(const std::filesystem::path& file) { return read_rotor_job(file).rotor; }

RotorJob parse_rotor_job(std::string_view text, std::string_view name) {
  const Settings settings = io::parse_settings(text, name);
  return RotorReader(settings).read();
}

Rotor parse_rotor(std::string_view text, std::string_view name) { return parse_rotor_job(text, name).rotor; }

}  // namespace whirl::shaft
