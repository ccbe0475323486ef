#include "evidence/channel_units.hpp"

#include "whirl/expr/unit.hpp"

namespace whirl::identification::detail {

void set_coefficient_units(IdentifiedModel& model, const Recording& record) {
  const expr::Unit second = expr::Unit::parse("s");
  expr::UnitMap units{{"t", second}};
  for (const Channel& c : record.channels) {
    const expr::Unit unit = expr::Unit::parse(si_unit(c.quantity));
    units[c.name] = unit;
    units.emplace(c.name + "'", unit / second);
  }
  for (Equation& e : model.equations) {
    const bool map = e.lhs.ends_with("[k+1]");
    const std::string state = e.lhs.substr(0, e.lhs.size() - (map ? 5 : 1));
    const auto at = units.find(state);
    if (at == units.end()) continue;
    const expr::Unit lhs = map ? at->second : at->second / second;
    for (EquationTerm& t : e.terms) {
      if (t.unit.empty()) t.unit = expr::coefficient_unit(expr::Expr::parse(t.function), lhs, units);
    }
  }
}

}  // namespace whirl::identification::detail
