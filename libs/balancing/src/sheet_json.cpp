
#include "solve.hpp"
#include "whirl/core/angles.hpp"

namespace whirl::balancing {
namespace {

io::Json budget_json(const diagnosis::PlaneBudget& budget) {
  return io::Json::object()
      .set("residual", budget.residual)
      .set("scatter", budget.scatter)
      .set("error", budget.error)
      .set("permitted", budget.permitted)
      .set("tolerance", budget.tolerance == diagnosis::Tolerance::held       ? "held"
                        : budget.tolerance == diagnosis::Tolerance::not_held ? "not held"
                                                                             : "undecided");
}

io::Json plane_json(const BalancingSheet::Plane& p) {
  io::Json placed = io::Json::array();
  for (const auto& [mass, angle] : p.placed)
    placed.push(io::Json::object().set("mass_kg", mass).set("angle_deg", angle / kRadPerDegree));
  io::Json plane = io::Json::object();
  if (p.budget) plane.set("budget_kg_m", budget_json(*p.budget));
  return plane.set("plane", p.name)
      .set("mass", to_json(p.mass, "kg"))
      .set("angle", to_json(p.angle, "rad"))
      .set("independent_part", p.independent)
      .set("placed", std::move(placed));
}

}  // namespace

std::string_view per_kg(Quantity quantity) {
  return quantity == Quantity::velocity       ? "m_s_per_kg"
         : quantity == Quantity::acceleration ? "m_s2_per_kg"
                                              : "m_per_kg";
}

io::Json balancing_document(const BalancingSheet& sheet) {
  io::Json planes = io::Json::array(), rows = io::Json::array(), influence = io::Json::array();
  const std::string_view unit = si_unit(sheet.quantity);
  for (const BalancingSheet::Plane& p : sheet.planes) planes.push(plane_json(p));
  for (const BalancingSheet::Row& r : sheet.rows)
    rows.push(io::Json::object()
                  .set("reading", r.name)
                  .set("measured_as_found", r.measured)
                  .set("before", to_json(r.before, unit))
                  .set("after", to_json(r.after, unit))
                  .set("before_phase_rad", r.before_phase)
                  .set("after_phase_rad", r.after_phase));
  for (const BalancingSheet::Coefficient& c : sheet.influence)
    influence.push(io::Json::object()
                       .set("reading", c.row)
                       .set("plane", c.plane)
                       .set(std::string(per_kg(sheet.quantity)), c.magnitude)
                       .set("sd_" + std::string(per_kg(sheet.quantity)), c.sd)
                       .set("phase_rad", c.phase));
  io::Json out = io::start_document("whirl.balancing", 1);
  out.set("quantity", to_string(sheet.quantity))
      .set("convention", sheet.convention)
      .set("amplitude_stated", sheet.amplitude_stated)
      .set("criterion", sheet.criterion)
      .set("planes", std::move(planes));
  out.set("readings", std::move(rows)).set("influence", std::move(influence));
  return out.set(sheet.quantity == Quantity::displacement ? "objective_m" : "objective", sheet.objective)
      .set("summary", whirl::to_json(sheet.summary));
}

}  // namespace whirl::balancing
