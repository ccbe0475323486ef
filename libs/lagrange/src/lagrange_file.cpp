#include "whirl/lagrange/lagrange_file.hpp"

#include <charconv>
#include <cmath>

#include "whirl/io/settings.hpp"

namespace whirl::lagrange {
namespace {

/// "kg", "1.5 kg" or "1.50 +- 0.01 kg": SI units only, so that a number never has to be converted.
PhysicalParameter read_parameter(const std::string& name, const std::string& text) {
  PhysicalParameter p{name, "", {}};
  std::string_view rest = text;
  const auto skip_space = [&] { rest.remove_prefix(std::min(rest.find_first_not_of(' '), rest.size())); };
  const auto number = [&](double& value) {
    skip_space();
    const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
    // "1/s" is a unit, not the number one.
    if (error != std::errc() || !std::isfinite(value) || (end < rest.data() + rest.size() && *end == '/')) return false;
    rest.remove_prefix(static_cast<std::size_t>(end - rest.data()));
    skip_space();
    return true;
  };
  double value = 0, sd = 0;
  if (number(value)) {
    if (rest.substr(0, 2) == "+-") {
      rest.remove_prefix(2);
      if (!number(sd) || sd < 0) throw Error("expected a standard deviation after +-");
    }
    p.value = Estimate::from_sd(value, sd);
  }
  skip_space();
  p.unit = rest;
  if (!expr::Unit::parse(p.unit).is_si())
    throw Error("the unit must be SI: kg m s A K V N J W Pa Hz rad and their products");
  return p;
}

LagrangeFile load(const io::Settings& settings) {
  LagrangeFile file;
  LagrangeProblem& p = file.problem;
  file.title = settings.text("title", "");
  p.coordinates = settings.texts("coordinates", {});
  for (const std::string& name : settings.texts("prescribed", {})) {
    p.prescribed.push_back({name, settings.text("laws." + name, "")});
  }
  p.inputs = settings.texts("inputs", {});
  for (const std::string& name : settings.keys("parameters")) {
    try {
      p.parameters.push_back(read_parameter(name, settings.text("parameters." + name, "")));
    } catch (const Error& e) {
      throw settings.error("parameters." + name, e.what());
    }
  }
  p.kinetic = settings.text("kinetic", "");
  p.potential = settings.text("potential", "");
  p.rayleigh = settings.text("rayleigh", "");
  for (const std::string& name : settings.keys("forces")) p.forces[name] = settings.text("forces." + name, "");
  p.symmetries = settings.texts("symmetries", {});
  p.positive = settings.texts("positive", {});
  for (const std::string& name : settings.keys("order")) {
    p.order[name] = static_cast<int>(settings.integer("order." + name, 1, 0, 6));
  }
  for (const std::string& name : settings.keys("names")) p.names[name] = settings.text("names." + name, "");
  if (const auto wrong = name_problem(p)) throw settings.error("names." + wrong->variable, wrong->reason);
  file.report = settings.texts("report", {});
  for (const std::string& text : file.report) {
    try {
      (void)expr::Expr::parse(text);
    } catch (const Error& e) {
      throw settings.error("report", e.what());
    }
  }
  settings.finish();
  return file;
}

}  // namespace

LagrangeFile read_lagrange_file(const std::filesystem::path& path) { return load(io::read_settings(path)); }

LagrangeFile parse_lagrange_file(std::string_view text, std::string_view name) {
  return load(io::parse_settings(text, name));
}

}  // namespace whirl::lagrange
