#pragma once
#include <fmt/format.h>

#include <string>

namespace whirl::io {

/// Window behind the functions that follow it in a universal file (dataset 1858).
struct UffWindow {
  long code = 0;      ///< 1, 2 Hann, 3 flat top, 4 exponential, 5 force, 6 force and exponential
  double factor = 0;  ///< damping factor of an exponential one, as the file states it

  /// What it does to the modes read from frequency responses behind it; empty: nothing to say.
  std::string remark() const {
    if (code == 4 || code == 6) {
      return fmt::format(
          "dataset 1858 states an exponential window (damping factor {:g}): every mode decays faster by it, "
          "so that all dampings come out too large; `whirl modes --window-end-percent` takes it off",
          factor);
    }
    if (code < 1 || code > 3) return {};
    return fmt::format(
        "dataset 1858 states a {} window: it smears every peak over the nearest lines, so that modes "
        "narrower than about five lines come out with too large a damping",
        code == 3 ? "flat top" : "Hann");
  }
};

}  // namespace whirl::io
