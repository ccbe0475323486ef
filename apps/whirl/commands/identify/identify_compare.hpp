#pragma once
#include "command.hpp"
#include "identify_options.hpp"

namespace whirl::app {

/// `whirl identify --compare`: the table, and comparison.json where --out asks for it.
void print_comparison(const identification::MethodComparison& comparison, const IdentifyFlags& flags,
                      const Provenance& provenance, Session& session);

}  // namespace whirl::app
