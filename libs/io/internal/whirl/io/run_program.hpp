#pragma once
#include <string>
#include <vector>

namespace whirl::io {

/// Runs a program found in PATH without a shell, its input from `input_text`; what it prints goes to `output`, or is
/// discarded when that is null. Returns its exit code, 127 when it is not installed, 128 + n when signal n ended it.
/// Unlike std::system, whirl itself still ends at Ctrl-C meanwhile.
int run_program(const std::vector<std::string>& arguments, const std::string& input_text = "",
                std::string* output = nullptr);

}  // namespace whirl::io
