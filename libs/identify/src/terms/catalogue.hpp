#pragma once
#include "whirl/identify/rotor_terms.hpp"

/// The entries by their names.
namespace whirl::identification::terms {

#define TERM(name) const TermEntry& name()
#include "terms/list.hpp"
#undef TERM

}  // namespace whirl::identification::terms
