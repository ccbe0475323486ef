#include "drive/drive_model.hpp"

namespace whirl::identification::detail {

using expr::Expr;

DriveRates drive_rates(const std::string& drive) {
  const auto s = [](const char* name) { return Expr::symbol(name); };
  const Expr x = s("X1"), v = s("X2"), y = s("X3"), w = s("X4"), b = s("X5"), n = s("X6");
  const Expr radial = s("k1") + s("k2") * (pow(x, 2) + pow(y, 2));
  const Expr fx = radial * x + s("c") * v, fy = radial * y + s("c") * w;
  // e e^{i b} with e = e_re + i e_im.
  const Expr ec = s("e_re") * cos(b) - s("e_im") * sin(b), es = s("e_re") * sin(b) + s("e_im") * cos(b);
  DriveRates rates;
  rates.reaction = fy * ec - fx * es;
  rates.speed =
      s("mass_per_inertia") * rates.reaction - s("coulomb") * sgn(n) - s("viscous") * n - s("drag") * n * abs(n);
  if (!drive.empty()) {
    const Expr u = Expr::symbol(drive);
    rates.speed = rates.speed + s("motor") * u - s("motor_slope") * abs(sgn(u)) * n;
  }
  rates.x = pow(n, 2) * ec + rates.speed * es - fx;
  rates.y = pow(n, 2) * es - rates.speed * ec - fy;
  return rates;
}

TrajectoryModel drive_trajectory(const std::string& drive, const std::vector<double>& values,
                                 const std::vector<std::string>& channels) {
  const DriveRates rates = drive_rates(drive);
  TrajectoryModel model;
  model.states = {"X1", "X2", "X3", "X4", "X5", "X6"};
  model.rates = {Expr::symbol("X2"), rates.x, Expr::symbol("X4"), rates.y, Expr::symbol("X6"), rates.speed};
  if (!drive.empty()) {
    model.inputs = {drive};
    model.timing = {{drive, Hold::zero, {0, 0, 0, 0}}};
  }
  for (std::size_t k = 0; k < values.size(); ++k) model.parameters.push_back({drive_parameters()[k], values[k]});
  model.parameters.push_back({"offset_x", 0});
  model.parameters.push_back({"offset_y", 0});
  model.channels = channels;
  model.outputs = {Expr::symbol("X1") + Expr::symbol("offset_x"), Expr::symbol("X3") + Expr::symbol("offset_y"),
                   Expr::symbol("X5")};
  return model;
}

expr::Expr with_values(const expr::Expr& e, const std::vector<double>& values) {
  std::map<std::string, Expr, std::less<>> by;
  for (std::size_t k = 0; k < values.size(); ++k) by.emplace(drive_parameters()[k], Expr(values[k]));
  return expr::substitute(e, by);
}

}  // namespace whirl::identification::detail
