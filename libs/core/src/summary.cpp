#include "whirl/core/summary.hpp"

#include <algorithm>

namespace whirl {

void Summary::add(Finding finding, std::string_view because) {
  std::string said = text(finding);
  said += because;
  if (finding.consequence == Consequence::note) {
    notes.push_back(std::move(said));
    findings.push_back(std::move(finding));
    return;
  }
  if (finding.consequence == Consequence::unusable)
    fail(std::move(said));
  else
    warn(std::move(said));
  if (finding.consequence != Consequence::warning)
    trust = status == Status::unusable && !trust.empty() && finding.consequence != Consequence::unusable
                ? trust
                : trust_text(finding);
  findings.push_back(std::move(finding));
}

const Finding* Summary::find(FindingCode code) const {
  const auto at = std::ranges::find(findings, code, &Finding::code);
  return at == findings.end() ? nullptr : &*at;
}

const Finding* Summary::distrust() const {
  const auto at = std::ranges::find_if(findings, [](const Finding& f) {
    return f.consequence == Consequence::no_trust || f.consequence == Consequence::unusable;
  });
  return at == findings.end() ? nullptr : &*at;
}

}  // namespace whirl
