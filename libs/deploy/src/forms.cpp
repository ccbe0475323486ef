#include <algorithm>
#include <cctype>

#include "whirl/core/error.hpp"
#include "whirl/deploy/languages.hpp"

namespace whirl::deploy {
namespace {

/// The forms that a controller and a model have in common.
template <class T>
std::vector<SourceFile> files_of(const T& value, const std::string& form, const CodeOptions& options) {
  if (form == "c") return export_c99(value, options);
  if (form == "latex") return export_latex(value, options);
  if (form == "matlab") return export_matlab(value, options);
  if (form == "python") return export_python(value, options);
  if (form == "sfunction") return export_sfunction(value, options);
  throw Error::in_field("form", form, "c, fmu, latex, matlab, modelica, python or sfunction");
}

}  // namespace

std::vector<SourceFile> source_files(const ControllerDesign& design, const std::string& form,
                                     const CodeOptions& options) {
  if (form == "modelica")
    throw Error("a controller is sampled C: Modelica tools take it as an FMU, see `whirl export fmu`");
  return files_of(design, form, options);
}

std::vector<SourceFile> source_files(const IdentifiedModel& model, const std::string& form,
                                     const CodeOptions& options) {
  return form == "modelica" ? export_modelica(model, options) : files_of(model, form, options);
}

std::string prefix_of(const std::filesystem::path& file) {
  std::string stem = file.filename().string(), out;
  stem = stem.substr(0, stem.find('.'));
  for (const char c : stem) {
    const bool word = std::isalnum(static_cast<unsigned char>(c)) != 0;
    out += word ? static_cast<char>(std::tolower(static_cast<unsigned char>(c))) : '_';
  }
  if (out.empty() || std::isdigit(static_cast<unsigned char>(out.front())) != 0) out.insert(0, "whirl_");
  return out.substr(0, 24);
}

}  // namespace whirl::deploy
