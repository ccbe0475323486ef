#pragma once
#include <string>

namespace whirl::io {

/// Notes a file or folder that a signal must remove. Returns its slot, -1 when there is no room (it then stays behind).
int remember_temporary(const std::string& path, bool folder);
void forget_temporary(int slot);

}  // namespace whirl::io
