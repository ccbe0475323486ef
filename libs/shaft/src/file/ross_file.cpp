#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>

#include "whirl/core/error.hpp"
#include "whirl/io/settings.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

using io::Settings;

constexpr double kSame = 1e-9;  // relative, of lengths that a program wrote twice
constexpr double kSoft = 1e-4;  // of the bending stiffness inside: a layer below it moves a frequency by half of that

bool same(double a, double b) { return std::abs(a - b) <= kSame * std::max(std::abs(a), std::abs(b)); }

/// An element of the shaft as ROSS has it; several with one number lie around each other.
struct Layer {
  std::string table;
  double length, inner, inner_end, outer, outer_end;
  Material material;

  double bending() const { return material.youngs_modulus * (std::pow(outer, 4) - std::pow(inner, 4)); }
};

/// Tables "Class_tag" of SI numbers; a node's number is `n`.
class RossReader {
 public:
  explicit RossReader(const std::filesystem::path& file) : s_(io::read_settings(file)) {
    out_.rotor.name = file.stem().string();
    out_.rotor.materials.clear();
    out_.rotor.element = ElementKind::usual;
  }

  ImportedRotor read() {
    sort_tables();
    for (const std::string& table : tables_["ShaftElement"]) read_layer(table);
    join_layers();
    for (const std::string& table : tables_["DiskElement"]) read_disc(table);
    for (const std::string& table : tables_["PointMass"]) read_mass(table);
    // First those that place a mass.
    for (const bool linked : {true, false})
      for (const std::string& table : tables_["bearing"])
        if (s_.has(table + ".n_link") == linked) read_bearing(table);
    for (std::size_t k = 0; k < out_.rotor.bodies.size(); ++k)
      if (!placed_.contains(k))
        throw s_.error(tables_["PointMass"][k] + ".n", "no bearing holds this mass: its place on the shaft is open");
    check(out_.rotor);
    return std::move(out_);
  }

 private:
  void sort_tables() {
    const std::vector<std::string> all = s_.tables();
    if (std::ranges::none_of(all, [](const std::string& table) { return table.starts_with("ShaftElement"); }))
      throw Error(s_.source() + ": no table [\"ShaftElement_...\"]: must be TOML that Rotor.save() of ROSS wrote");
    const std::set<std::string> names(all.begin(), all.end());
    for (const std::string& table : all) {
      if (table.empty() || table == "parameters") continue;
      bool inside = false;
      for (std::size_t dot = table.find('.'); dot != table.npos && !inside; dot = table.find('.', dot + 1))
        inside = names.contains(table.substr(0, dot));
      if (inside) continue;  // material, gas, further arguments of the element around it
      std::string kind = table.substr(0, table.find('_'));
      if (kind.ends_with("6DoF")) kind.resize(kind.size() - 4);
      const bool known = kind == "ShaftElement" || kind == "DiskElement" || kind == "PointMass";
      if (!known && s_.keys(table).empty()) continue;
      if (!known && !s_.has(table + ".kxx"))
        throw Error(fmt::format(
            "{}: [{}]: a rotor file has no such element (known: ShaftElement, DiskElement, PointMass and what has kxx)",
            s_.source(), table));
      tables_[known ? kind : "bearing"].push_back(table);
    }
  }

  double number(const std::string& table, const char* key, double low, double high = 1e300) const {
    return s_.require_number(table + "." + key, Quantity::dimensionless, low, high);
  }
  void must_be_zero(const std::string& table, const char* key) const {
    if (s_.number(table + "." + key, Quantity::dimensionless, 0) != 0)
      throw s_.error(table + "." + key, "must be 0: a rotor file cannot hold it");
  }
  /// Throws for a key that nothing here has read: what it means would be lost.
  void only(const std::string& table, std::initializer_list<std::string_view> known) const {
    for (const std::string& key : s_.keys(table))
      if (std::ranges::find(known, key) == known.end())
        throw s_.error(table + "." + key, "is not known here, and would be lost");
  }
  long node(const std::string& table, const char* key = "n") const {
    const long n = s_.integer(table + "." + key, -1, 0, 100000);
    if (n < 0) throw Error(fmt::format("{}: no key '{}' in [{}]", s_.source(), key, table));
    return n;
  }
  std::string name_of(const std::string& table) const {
    return s_.text(table + ".tag", table.substr(table.find('_') + 1));
  }

  Material material(const std::string& table) const {
    Material m;
    const std::string at = table + ".material";
    m.name = s_.text(at + ".name", "material");
    m.density = number(at, "rho", 0, 1e6);
    m.youngs_modulus = number(at, "E", 1);
    m.shear_modulus = number(at, "G_s", 1);
    return m;
  }
  /// Its place in the rotor's list.
  std::size_t kept(const std::string& table, Material m) {
    number(table + ".material", "G_s", m.youngs_modulus / 3, m.youngs_modulus / 2);
    std::vector<Material>& all = out_.rotor.materials;
    for (std::size_t k = 0; k < all.size(); ++k)
      if (alike(all[k], m)) return k;
    for (const Material& other : all)
      if (other.name == m.name) m.name += fmt::format(" {}", all.size() + 1);
    all.push_back(m);
    return all.size() - 1;
  }
  static bool alike(const Material& a, const Material& b) {
    return a.density == b.density && a.youngs_modulus == b.youngs_modulus && a.shear_modulus == b.shear_modulus;
  }

  void read_layer(const std::string& table) {
    only(table, {"L", "idl", "odl", "idr", "odr", "n", "axial_force", "torque", "shear_effects", "rotary_inertia",
                 "gyroscopic", "shear_method_calc", "tag", "alpha", "beta"});
    for (const char* key : {"torque", "alpha", "beta"}) must_be_zero(table, key);
    for (const char* key : {"rotary_inertia", "gyroscopic"})
      if (!s_.flag(table + "." + key, true))
        throw s_.error(table + "." + key, "must be true: a rotor file always has it");
    const std::string method = s_.text(table + ".shear_method_calc", "cowper", {"cowper", "hutchinson"});
    const ShearModel shear = !s_.flag(table + ".shear_effects", true) ? ShearModel::none
                             : method == "cowper"                     ? ShearModel::cowper
                                                                      : ShearModel::hutchinson;
    const double axial = s_.number(table + ".axial_force", Quantity::dimensionless, 0);
    if (layers_.empty()) {
      out_.rotor.shear.model = shear;
      out_.rotor.axial_force = axial;
    } else if (shear != out_.rotor.shear.model) {
      throw s_.error(table + (shear == ShearModel::none ? ".shear_effects" : ".shear_method_calc"),
                     "must be that of the first element: a rotor file has one rule of shear");
    } else if (axial != out_.rotor.axial_force) {
      throw s_.error(table + ".axial_force", "must be that of the first element: a rotor file has one axial force");
    }
    const double outer = number(table, "odl", 1e-9), outer_end = number(table, "odr", 1e-9);
    layers_[node(table)].push_back({table, number(table, "L", 1e-9), number(table, "idl", 0, outer),
                                    number(table, "idr", 0, outer_end), outer, outer_end, material(table)});
  }

  void join_layers() {
    nodes_.push_back(0);
    for (auto& [n, layers] : layers_) {
      if (n != static_cast<long>(nodes_.size()) - 1)
        throw s_.error(layers.front().table + ".n",
                       fmt::format("no shaft element has the number {}", nodes_.size() - 1));
      std::ranges::sort(layers, {}, &Layer::inner);
      const Section section = join(layers);
      std::vector<Section>& all = out_.rotor.sections;
      if (!all.empty() && goes_on(all.back(), section)) {
        all.back().length += section.length;
        ++all.back().elements;
      } else {
        all.push_back(section);
      }
      nodes_.push_back(nodes_.back() + section.length);
    }
    if (joined_) out_.remarks.push_back("layers of the shaft are one section each; ROSS adds their shear stiffness");
    if (sleeves_ > 0)
      out_.remarks.push_back(fmt::format("{} layers without stiffness are discs of their mass", sleeves_));
  }
  /// Layers of one material that touch have the stiffness and mass of one section; one that is too soft to bear
  /// anything is a disc of its mass.
  Section join(const std::vector<Layer>& layers) {
    const Layer& first = layers.front();
    Section section{
        first.length, first.outer, first.outer_end, first.inner, first.inner_end, kept(first.table, first.material), 1};
    for (std::size_t k = 1; k < layers.size(); ++k) {
      const Layer& out = layers[k];
      if (!same(first.length, out.length)) throw s_.error(out.table + ".L", "must be the length of the layer inside");
      if (out.bending() < kSoft * first.bending()) {
        add_sleeve(out);
        continue;
      }
      if (!same(section.outer, out.inner) || !same(section.outer_end, out.inner_end))
        throw s_.error(out.table + ".idl", "must touch the layer inside along its whole length");
      if (!alike(first.material, out.material))
        throw s_.error(out.table + ".material.E", "must be the material of the layer inside: a section has one");
      section.outer = out.outer;
      section.outer_end = out.outer_end;
      joined_ = true;
    }
    return section;
  }
  void add_sleeve(const Layer& l) {
    if (!same(l.outer, l.outer_end) || !same(l.inner, l.inner_end))
      throw s_.error(l.table + ".odr", "must be as odl: a layer without stiffness is a cylinder here");
    Disc d = cylinder(l.material.density, l.outer, l.inner, l.length);
    d.name = name_of(l.table);
    d.position = nodes_.back() + l.length / 2;
    out_.rotor.discs.push_back(d);
    ++sleeves_;
  }
  /// A cylinder that another element of the same length and kind continues.
  static bool goes_on(const Section& a, const Section& b) {
    return a.material == b.material && same(a.length / a.elements, b.length) && same(a.outer, a.outer_end) &&
           same(a.inner, a.inner_end) && same(a.outer, b.outer) && same(a.outer, b.outer_end) &&
           same(a.inner, b.inner) && same(a.inner, b.inner_end);
  }

  bool on_shaft(long n) const { return n < static_cast<long>(nodes_.size()); }
  double place(long n) const { return nodes_[static_cast<std::size_t>(n)]; }

  void read_disc(const std::string& table) {
    only(table, {"n", "m", "Id", "Ip", "tag", "scale_factor", "color"});
    const long n = node(table);
    if (!on_shaft(n))
      throw s_.error(table + ".n", fmt::format("must be a node of the shaft: 0 to {}", nodes_.size() - 1));
    out_.rotor.discs.push_back(
        {name_of(table), place(n), number(table, "m", 0), number(table, "Id", 0), number(table, "Ip", 0)});
  }

  /// A mass beside the shaft is a body that does not tilt; its place is that of the bearing that holds it.
  void read_mass(const std::string& table) {
    only(table, {"n", "m", "mx", "my", "mz", "tag", "color"});
    const bool both = s_.has(table + ".mx");
    const double mass = both ? number(table, "mx", 0) : number(table, "m", 0);
    if (both && number(table, "my", 0) != mass)
      throw s_.error(table + ".my", "must be as mx: a body has one mass for both directions");
    const long n = node(table);
    if (on_shaft(n)) {
      out_.rotor.discs.push_back({name_of(table), place(n), mass, 0, 0});
      return;
    }
    if (bodies_.contains(n)) throw s_.error(table + ".n", "another PointMass has this number: write one of their sum");
    bodies_[n] = out_.rotor.bodies.size();
    out_.rotor.bodies.push_back({name_of(table), 0, mass, 0});
  }

  /// A point that a bearing holds: of the shaft, or of a body, which then stands at `position`.
  Point point(const std::string& table, const char* key, std::optional<double> position) {
    const long n = node(table, key);
    if (on_shaft(n)) return {"shaft", place(n)};
    const auto found = bodies_.find(n);
    if (found == bodies_.end())
      throw s_.error(
          table + "." + key,
          fmt::format("must be a node of the shaft (0 to {}) or the number of a PointMass", nodes_.size() - 1));
    Body& body = out_.rotor.bodies[found->second];
    if (position) {
      body.position = *position;
      placed_.insert(found->second);
    }
    return {body.name, body.position};
  }

  Eigen::Matrix2d coefficients(const std::string& table, char kind, std::size_t at, std::size_t count) const {
    Eigen::Matrix2d m = Eigen::Matrix2d::Zero();
    constexpr const char* kAxes[2][2] = {{"xx", "xy"}, {"yx", "yy"}};
    for (int i = 0; i < 2; ++i)
      for (int j = 0; j < 2; ++j) {
        const std::string path = fmt::format("{}.{}{}", table, kind, kAxes[i][j]);
        const std::vector<double> all = s_.numbers(path, Quantity::dimensionless, std::vector<double>(count, 0.0));
        if (all.size() != count)
          throw s_.error(path, fmt::format("has {} values, must have {} as kxx", all.size(), count));
        m(i, j) = all[at];
      }
    return m;
  }

  void read_bearing(const std::string& table) {
    Support s;
    s.name = name_of(table);
    s.a = point(table, "n", std::nullopt);
    s.b = s_.has(table + ".n_link") ? point(table, "n_link", s.a.position) : Point{"ground", s.a.position};
    if (s_.has(table + ".n_link") && node(table) == node(table, "n_link"))
      throw s_.error(table + ".n_link", "must be another node than n");
    if (!s_.has(table + ".kyy")) throw s_.error(table + ".kxx", "without kyy: a file that ROSS saved has both");
    const std::size_t count = s_.numbers(table + ".kxx", Quantity::dimensionless, {}).size();
    s.law.speeds = s_.numbers(table + ".frequency", Quantity::dimensionless, {});
    if (count == 0 || (count > 1 && s.law.speeds.size() != count))
      throw s_.error(table + ".kxx", fmt::format("has {} values, must have one, or one for each of the {} of frequency",
                                                 count, s.law.speeds.size()));
    if (count == 1) s.law.speeds.clear();
    for (std::size_t k = 0; k < count; ++k) {
      s.law.stiffness.push_back(coefficients(table, 'k', k, count));
      s.law.damping.push_back(coefficients(table, 'c', k, count));
      s.law.mass.push_back(coefficients(table, 'm', k, count));
    }
    for (const char* axial : {"kzz", "czz", "mzz"})
      for (const double value : s_.numbers(table + "." + axial, Quantity::dimensionless, {}))
        if (value != 0 && axial_.insert(table).second)
          out_.remarks.push_back(s.name + ": its axial coefficients are left out; a rotor moves across its shaft");
    if (count > 1 && !tables_said_) {
      tables_said_ = true;
      out_.remarks.push_back("tables over speed are linear between their speeds; ROSS interpolates by splines");
    }
    out_.rotor.supports.push_back(std::move(s));
  }

  Settings s_;
  ImportedRotor out_;
  std::map<std::string, std::vector<std::string>> tables_;  // by class
  std::map<long, std::vector<Layer>> layers_;               // by number
  std::vector<double> nodes_;                               // positions, m
  std::map<long, std::size_t> bodies_;                      // by number
  std::set<std::size_t> placed_;
  std::set<std::string> axial_;
  bool tables_said_ = false, joined_ = false;
  int sleeves_ = 0;
};

}  // namespace

ImportedRotor import_ross_rotor(const std::filesystem::path& file) { return RossReader(file).read(); }

}  // namespace whirl::shaft
