#include "terms/growing_model.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <numbers>

#include "terms/catalogue.hpp"

namespace whirl::identification::detail {

Growth with_term(Growth g, const TermId& term, bool poles) {
  const TermEntry& entry = *term.entry;
  if (entry.with != nullptr) return entry.with(std::move(g), term.place, poles);
  if (entry.sensor != nullptr) {
    g.active.probes.errors.push_back(&entry);
  } else {
    std::ranges::copy_if(g.terms, std::back_inserter(g.active.terms), [&](const RotorTerm& t) { return t.is(entry); });
  }
  return g;
}

std::optional<Growth> without_term(Growth g, const TermId& term) {
  const TermEntry& entry = *term.entry;
  if (entry.without != nullptr) return entry.without(std::move(g), term.place);
  if (entry.sensor != nullptr) {
    const auto needed_by = [&](const TermEntry* s) { return s->after != nullptr && &s->after() == &entry; };
    if (std::ranges::any_of(g.active.probes.errors, needed_by)) return std::nullopt;
    std::erase(g.active.probes.errors, &entry);
    g.active.probes.start.*entry.sensor = 0;
  } else {
    std::erase_if(g.active.terms, [&](const RotorTerm& t) { return t.is(entry); });
  }
  return g;
}

std::string label(const TermId& term, const Growth& growth) {
  const TermEntry& entry = *term.entry;
  if (entry.frequency != nullptr)
    return fmt::format("{} {:.4g} Hz", entry.label, entry.frequency(growth, term.place) / (2 * std::numbers::pi));
  return entry.numbered ? fmt::format("{} {}", entry.label, term.place) : std::string(entry.label);
}

}  // namespace whirl::identification::detail
