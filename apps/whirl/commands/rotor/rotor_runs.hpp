#pragma once
#include <string>

#include "whirl/shaft/fit/fit.hpp"

namespace whirl::app {

/// The vectors of all probes of a rotor in a record. Throws Error where a probe has no channel.
shaft::OrderRun load_run(const std::string& file, const shaft::Rotor& rotor);

/// How an unknown of a fit is printed.
struct ShownUnit {
  double factor;
  const char* name;
};
ShownUnit shown_unit(shaft::UnknownKind kind);

}  // namespace whirl::app
