#pragma once
#include <string>
#include <string_view>
#include <vector>

#include "whirl/deploy/system.hpp"

/// Text that came in a file, as it is written into generated source: one function per place, used by every generator.
/// Names are identifiers already (`core/names.hpp`); XML is written by `fmu_description.cpp`.
namespace whirl::deploy {

/// Inside /* */ of C: one line that does not end or open a comment.
std::string c_comment(std::string_view text);
/// The rest of a line after %, # or //.
std::string line_comment(std::string_view text);
/// Between " and " of C, Python (docstrings too) and Modelica.
std::string quoted_text(std::string_view text);
/// Running text of LaTeX.
std::string latex_text(std::string_view text);

enum class Language { fmi, matlab, modelica, python };
/// The system with other names for states, inputs and outputs that are words of the language or of the file made: an
/// underscore more behind them. Names of MATLAB begin with a letter.
ModelSystem with_names_for(Language language, ModelSystem system);

}  // namespace whirl::deploy
