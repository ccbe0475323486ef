#pragma once
#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "fmu_description.hpp"
#include "template.hpp"
#include "whirl/expr/unit.hpp"

namespace whirl::deploy {

/// The list of variables with the enumeration of their value references for the C side.
class FmuBuilder {
 public:
  explicit FmuBuilder(std::string title) {
    description.title = std::move(title);
    FmuVariable time{"time", "s", "independent variable", "independent", "continuous", ""};
    description.variables.push_back(time);
  }
  /// Starts the block FIRST_<name> with the count <names>.
  void block(const char* name, std::size_t count) {
    layout += fmt::format("{}  FIRST_{} = {},\n  {}S = {}", layout.empty() ? "" : ",\n", name,
                          description.variables.size(), name, count);
  }
  void constant(const char* name, std::size_t value) { layout += fmt::format(",\n  {} = {}", name, value); }
  int add(FmuVariable v) {
    description.variables.push_back(std::move(v));
    return static_cast<int>(description.variables.size()) - 1;
  }
  /// Parameters: addresses `prefix`name, tunable except `fixed`. Returns the reference of `fixed`.
  int parameters(const std::vector<CodeParameter>& all, const std::string& fixed) {
    int reference = -1;
    for (const CodeParameter& p : all) {
      const bool is_fixed = p.name == fixed;
      const int r =
          add({p.name, p.unit, p.meaning, "parameter", is_fixed ? "fixed" : "tunable", expr::number_text(p.value),
               FmuVariable::Type::real, -1, std::isinf(p.low) ? 0 : p.low, std::isinf(p.high) ? 0 : p.high});
      if (is_fixed) reference = r;
      pointers += fmt::format("{}    case {}U:\n      return &c->{}{};", pointers.empty() ? "" : "\n", r,
                              p.name == "inner_step" ? "" : "params.", p.name);
    }
    return reference;
  }

  FmuDescription description;
  std::string layout, pointers;
};

inline FmuVariable fmu_real(const std::string& name, const std::string& unit, const std::string& meaning,
                            const char* causality, const char* variability, const std::string& start) {
  return {name, unit, meaning, causality, variability, start};
}

void require_fmu(const FmuOptions& options);

/// All files of an FMU around the exported C of `header` and `source`; `part` of c/fmi holds what is its own.
std::vector<SourceFile> finish_fmu(FmuBuilder& builder, const FmuOptions& options, TemplateSettings settings,
                                   const std::string& part, const SourceFile& header, const SourceFile& source);

}  // namespace whirl::deploy
