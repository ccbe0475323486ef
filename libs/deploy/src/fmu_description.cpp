#include "fmu_description.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <optional>
#include <set>

#include "whirl/core/summary.hpp"
#include "whirl/expr/expr.hpp"
#include "whirl/report/format.hpp"

namespace whirl::deploy {
namespace {

/// For an attribute, in which a reader takes a line end for a blank unless it is written as a character.
std::string escape(const std::string& text) {
  std::string out = report::escape_markup(text);
  for (std::size_t at = out.find('\n'); at != std::string::npos; at = out.find('\n', at)) out.replace(at, 1, "&#10;");
  return out;
}

/// Exponents of kg, m, s, rad for the units that occur here; none when one is not whole ("m/sqrt(s)").
std::optional<std::map<std::string, int>> base_unit(const std::string& unit) {
  std::map<std::string, int> powers;
  int sign = 1;
  for (std::size_t i = 0; i < unit.size();) {
    const char c = unit[i];
    if (c == '/') sign = -1;
    if (c == '(') {
      if (i > 0 && unit[i - 1] != '/') return std::nullopt;
    }
    if (std::isalpha(static_cast<unsigned char>(c)) == 0) {
      ++i;
      continue;
    }
    std::string symbol;
    while (i < unit.size() && std::isalpha(static_cast<unsigned char>(unit[i])) != 0) symbol += unit[i++];
    int power = sign;
    if (i < unit.size() && unit[i] == '^') {
      char* end = nullptr;
      const double value = std::strtod(unit.c_str() + i + 1, &end);
      if (value != std::floor(value)) return std::nullopt;
      power *= static_cast<int>(value);
      i = static_cast<std::size_t>(end - unit.c_str());
    }
    if (symbol == "N") {
      powers["kg"] += power, powers["m"] += power, powers["s"] -= 2 * power;
    } else if (symbol == "Hz") {
      powers["s"] -= power;
    } else if (symbol == "kg" || symbol == "m" || symbol == "s" || symbol == "rad") {
      powers[symbol] += power;
    } else {
      return std::nullopt;
    }
  }
  return powers;
}

std::string units_xml(const FmuDescription& d) {
  std::set<std::string> units;
  for (const FmuVariable& v : d.variables) {
    if (!v.unit.empty() && v.unit != "1") units.insert(v.unit);
  }
  std::string out = "  <UnitDefinitions>\n";
  for (const std::string& unit : units) {
    out += fmt::format("    <Unit name=\"{}\">", escape(unit));
    if (const auto powers = base_unit(unit)) {
      out += "<BaseUnit";
      for (const auto& [name, power] : *powers) {
        if (power != 0) out += fmt::format(" {}=\"{}\"", name, power);
      }
      out += "/>";
    }
    out += "</Unit>\n";
  }
  return out + "  </UnitDefinitions>\n";
}

bool is_output(const FmuVariable& v) { return v.causality == "output"; }
bool is_calculated(const FmuVariable& v) { return is_output(v) || v.derivative_of >= 0; }

std::string variable_xml(const FmuDescription& d, std::size_t reference, int version) {
  const FmuVariable& v = d.variables[reference];
  const std::string common = fmt::format(" name=\"{}\" valueReference=\"{}\" causality=\"{}\" variability=\"{}\"",
                                         escape(v.name), reference, v.causality, v.variability);
  std::string text = v.description.empty() ? "" : fmt::format(" description=\"{}\"", escape(v.description));
  const bool state = v.causality == "local" && !v.start.empty();
  if (state) text += " initial=\"exact\"";
  std::string value;
  if (!v.unit.empty() && v.unit != "1") value += fmt::format(" unit=\"{}\"", escape(v.unit));
  if (v.derivative_of >= 0) value += fmt::format(" derivative=\"{}\"", v.derivative_of + (version == 2 ? 1 : 0));
  if (v.low < v.high)
    value += fmt::format(" min=\"{}\" max=\"{}\"", expr::number_text(v.low), expr::number_text(v.high));
  if (v.nominal > 0) value += fmt::format(" nominal=\"{}\"", expr::number_text(v.nominal));
  if (!v.start.empty()) value += fmt::format(" start=\"{}\"", v.start);
  constexpr std::array types2{"Real", "Integer", "Boolean"}, types3{"Float64", "Int32", "Boolean"};
  const auto type = static_cast<std::size_t>(v.type);
  if (version == 3) return fmt::format("    <{}{}{}{}/>\n", types3[type], common, text, value);
  return fmt::format("    <ScalarVariable{}{}><{}{}/></ScalarVariable>\n", common, text, types2[type], value);
}

std::string structure_xml(const FmuDescription& d, int version) {
  std::string outputs, derivatives, unknowns, events;
  for (std::size_t i = 0; i < d.variables.size(); ++i) {
    const FmuVariable& v = d.variables[i];
    std::string depends;
    if (v.depends) {
      std::vector<std::size_t> known = *v.depends;
      for (std::size_t& k : known) k += version == 2 ? 1 : 0;
      depends = fmt::format(" dependencies=\"{}\"", fmt::join(known, " "));
    }
    const auto entry = [&](const char* name) {
      return version == 3 ? fmt::format("    <{} valueReference=\"{}\"{}/>\n", name, i, depends)
                          : fmt::format("      <Unknown index=\"{}\"{}/>\n", i + 1, depends);
    };
    if (is_output(v)) outputs += entry("Output");
    if (v.derivative_of >= 0) derivatives += entry("ContinuousStateDerivative");
    if (is_calculated(v)) unknowns += entry("InitialUnknown");
    if (v.event) events += entry("EventIndicator");
  }
  if (version == 3) return "  <ModelStructure>\n" + outputs + derivatives + unknowns + events + "  </ModelStructure>\n";
  const auto list = [](const char* name, const std::string& entries) {
    return entries.empty() ? "" : fmt::format("    <{0}>\n{1}    </{0}>\n", name, entries);
  };
  return "  <ModelStructure>\n" + list("Outputs", outputs) + list("Derivatives", derivatives) +
         list("InitialUnknowns", unknowns) + "  </ModelStructure>\n";
}

}  // namespace

std::string fmu_xml(const FmuDescription& d, const FmuOptions& o, const std::string& token) {
  const std::string& id = o.code.prefix;
  const bool three = o.version == 3;
  const auto events =
      std::count_if(d.variables.begin(), d.variables.end(), [](const FmuVariable& v) { return v.event; });
  std::string xml = "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n";
  xml += fmt::format(
      "<fmiModelDescription fmiVersion=\"{}\" modelName=\"{}\" {}=\"{}\" description=\"{}\" generationTool=\"whirl "
      "{}\" "
      "variableNamingConvention=\"flat\"",
      three ? "3.0" : "2.0", id, three ? "instantiationToken" : "guid", token, escape(d.title), version());
  if (!three) xml += fmt::format(" numberOfEventIndicators=\"{}\"", events);
  xml += ">\n";
  std::string capable = three ? "canGetAndSetFMUState=\"true\" canSerializeFMUState=\"true\""
                              : "canGetAndSetFMUstate=\"true\" canSerializeFMUstate=\"true\"";
  if (d.directional)
    capable += three ? " providesDirectionalDerivatives=\"true\"" : " providesDirectionalDerivative=\"true\"";
  const std::string sources =
      three ? "/>\n"
            : fmt::format("><SourceFiles><File name=\"{0}.c\"/><File name=\"{0}_fmu.c\"/></SourceFiles></", id);
  const auto kind = [&](const char* name, const std::string& attributes) {
    return fmt::format("  <{} modelIdentifier=\"{}\" {}{}{}", name, id, capable, attributes, sources) +
           (three ? "" : fmt::format("{}>\n", name));
  };
  if (o.model_exchange) xml += kind("ModelExchange", "");
  if (o.co_simulation) {
    std::string attributes =
        fmt::format(" canHandleVariableCommunicationStepSize=\"{}\"", d.variable_step ? "true" : "false");
    if (three && !d.variable_step)
      attributes += fmt::format(" fixedInternalStepSize=\"{}\"", expr::number_text(d.step));
    xml += kind("CoSimulation", attributes);
  }
  xml += units_xml(d);
  xml += "  <LogCategories><Category name=\"error\"/></LogCategories>\n";
  xml += fmt::format("  <DefaultExperiment startTime=\"0\"{} stepSize=\"{}\"/>\n",
                     o.model_exchange ? " tolerance=\"1e-6\"" : "", expr::number_text(d.step));
  xml += "  <ModelVariables>\n";
  for (std::size_t i = 0; i < d.variables.size(); ++i) xml += variable_xml(d, i, o.version);
  xml += "  </ModelVariables>\n" + structure_xml(d, o.version);
  return xml + "</fmiModelDescription>\n";
}

}  // namespace whirl::deploy
