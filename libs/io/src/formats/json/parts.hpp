#pragma once
#include "whirl/io/json.hpp"

/// What more than one result file writes and reads.
namespace whirl::io {

inline void finish(Json& out, const Summary& summary, const Provenance& provenance) {
  out.set("summary", to_json(summary)).set("provenance", to_json(provenance));
}

template <class T>
void read_finish(const JsonReader& in, T& value) {
  value.summary = read_summary(in.at("summary"));
  value.provenance = read_provenance(in.at("provenance"));
}

}  // namespace whirl::io
