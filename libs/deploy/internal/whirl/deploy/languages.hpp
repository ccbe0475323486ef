#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "whirl/deploy/code.hpp"
#include "whirl/deploy/system.hpp"

namespace whirl::shaft {
struct RotorController;
}

namespace whirl::deploy {

/// Equations and numbers as a LaTeX fragment (packages amsmath, booktabs).
std::vector<SourceFile> export_latex(const ControllerDesign& design, const CodeOptions& options);
std::vector<SourceFile> export_latex(const IdentifiedModel& model, const CodeOptions& options);

/// Model: PREFIX.m, a MATLAB and Octave function `[rate, output] = PREFIX(t, state, input, p)`; `p = PREFIX()` gives
/// the parameters. Controller: the C99 source with PREFIX_mex.c, a MEX function around it.
std::vector<SourceFile> export_matlab(const ControllerDesign& design, const CodeOptions& options);
std::vector<SourceFile> export_matlab(const IdentifiedModel& model, const CodeOptions& options);

/// Model: PREFIX.py with rates(t, x, u, p), outputs(t, x, u, p) and PARAMETERS; NumPy when it is installed. Controller:
/// the C99 source with PREFIX.py, which compiles and calls it through ctypes.
std::vector<SourceFile> export_python(const ControllerDesign& design, const CodeOptions& options);
std::vector<SourceFile> export_python(const IdentifiedModel& model, const CodeOptions& options);

/// PREFIX.mo. Throws Error for a controller's caller to see: a controller goes to Modelica tools as an FMU.
std::vector<SourceFile> export_modelica(const IdentifiedModel& model, const CodeOptions& options);

/// The C99 source with PREFIX_sfun.c, a level-2 C S-function of Simulink around it.
std::vector<SourceFile> export_sfunction(const ControllerDesign& design, const CodeOptions& options);
std::vector<SourceFile> export_sfunction(const IdentifiedModel& model, const CodeOptions& options);

/// The files of a form by its name: c, latex, matlab, python, sfunction, modelica. Throws Error for another one, and
/// for a controller as Modelica.
std::vector<SourceFile> source_files(const ControllerDesign& design, const std::string& form,
                                     const CodeOptions& options);
std::vector<SourceFile> source_files(const IdentifiedModel& model, const std::string& form, const CodeOptions& options);
/// Of a flexible rotor: c alone.
std::vector<SourceFile> source_files(const shaft::RotorController& controller, const std::string& form,
                                     const CodeOptions& options);

/// A prefix from the name of a file: "Controller-tsmc.json" -> "controller_tsmc".
std::string prefix_of(const std::filesystem::path& file);

}  // namespace whirl::deploy
