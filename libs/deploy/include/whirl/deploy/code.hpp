#pragma once
#include <string>
#include <vector>

#include "whirl/core/control_types.hpp"
#include "whirl/io/output.hpp"

namespace whirl::deploy {

/// A file to be written: name relative to the folder of the export, and its text.
using SourceFile = io::FileText;

/// How names and numbers of exported source are written.
struct CodeOptions {
  std::string prefix = "controller";  ///< of every file, type and function: a C identifier in lower case
  bool single_precision = false;      ///< float instead of double
  std::string origin;                 ///< one line for the banner: name and hash of the file exported
};

/// Throws Error unless `prefix` is a C identifier of lower-case letters, digits and underscores that is no keyword.
void require_prefix(const std::string& prefix);

/// One adjustable number of an exported controller or model. SI.
struct CodeParameter {
  std::string name, unit, meaning;
  double value = 0;
  double low = 0, high = 0;  ///< admissible, inclusive; both infinite when only finiteness is asked for
};

/// The equation of a control law, for one axis x' = v, v' = f + a + D.
struct LawEquation {
  std::string text;   ///< lines of a comment
  std::string latex;  ///< the same for a document
};
/// Throws Error for a name that is no law.
LawEquation law_equation(const std::string& law);

/// A controller as C99: what its files share. `lqr` is exported as the PD gains it stands for.
struct ControllerCode {
  std::vector<CodeParameter> parameters;  ///< in the order of the struct, so that the first is number 1
  SourceFile header, source;
};

/// The C99 source of a controller: header and source of one prefix, no allocation, no input or output, no globals.
/// Throws Error for a bad design, a bad prefix, and for what single precision cannot hold.
ControllerCode controller_code(const ControllerDesign& design, const CodeOptions& options);

/// controller_code with a self-test on golden vectors (PREFIX_selftest.c), CMakeLists.txt and Makefile. The vectors are
/// `ticks` samples of the library's controller in closed loop with its own model, lost and wild readings included.
std::vector<SourceFile> export_c99(const ControllerDesign& design, const CodeOptions& options, int ticks = 200);

}  // namespace whirl::deploy
