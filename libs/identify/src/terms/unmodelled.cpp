#include "terms/term.hpp"

/// Terms that no model here holds: they name what is missing.
namespace whirl::identification::terms {
namespace {

TermEntry unmodelled(std::string_view label, bool both_axes, decltype(TermEntry::columns) columns) {
  return {.label = label, .columns = columns, .both_axes = both_axes, .in_model = false};
}

}  // namespace

const TermEntry& cubic_conj() {
  static const TermEntry entry =
      unmodelled("anisotropic cubic stiffness", true, [](const ScorePoint& at) -> Candidates {
        const Eigen::VectorXcd& z = at.own.main;
        return {{0, {at.force(z.cwiseAbs2().cast<Complex>().cwiseProduct(z.conjugate()))}}};
      });
  return entry;
}

const TermEntry& conj_cubed() {
  static const TermEntry entry = unmodelled("conj(z)^3", true, [](const ScorePoint& at) -> Candidates {
    const Eigen::VectorXcd c = at.own.main.conjugate();
    return {{0, {at.force(c.cwiseProduct(c).cwiseProduct(c))}}};
  });
  return entry;
}

}  // namespace whirl::identification::terms
