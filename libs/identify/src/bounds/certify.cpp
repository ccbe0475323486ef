#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <random>

#include "bounds/trapping.hpp"
#include "whirl/core/error.hpp"
#include "whirl/identify/simulate_model.hpp"

namespace whirl::identification::detail {

Trapping certify(const IdentifiedModel& model, const Eigen::VectorXd& shift, const Eigen::VectorXd& weights) {
  constexpr int kDirections = 200;
  const CompiledModel compiled(model);
  const Eigen::Index n = shift.size();
  const Eigen::VectorXd d = weights.cwiseSqrt();
  // Power into the energy |y|^2 / 2 at the distance y = d (x - m).
  const auto power = [&](const Eigen::VectorXd& y) {
    const Eigen::VectorXd x = shift + y.cwiseQuotient(d);
    Eigen::VectorXd rate(n);
    compiled.rate(x.data(), rate.data());
    return y.dot(d.cwiseProduct(rate));
  };
  const double h = std::max(d.cwiseProduct(shift).norm(), 1e-3);
  const auto even = [&](const Eigen::VectorXd& u) { return (power(h * u) + power(-h * u)) / (2 * h * h); };
  const auto odd = [&](const Eigen::VectorXd& u, double r) { return (power(r * u) - power(-r * u)) / 2; };
  double cubic = 0;
  const auto look = [&](const Eigen::VectorXd& u) {
    cubic = std::max(cubic, std::abs(odd(u, 2 * h) - 2 * odd(u, h)) / (6 * h * h * h * std::pow(u.norm(), 3)));
  };
  Eigen::MatrixXd s(n, n);
  Eigen::VectorXd constant(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Eigen::VectorXd ui = Eigen::VectorXd::Unit(n, i);
    look(ui);
    s(i, i) = even(ui);
    constant[i] = (8 * odd(ui, h) - odd(ui, 2 * h)) / (6 * h);
    for (Eigen::Index j = 0; j < i; ++j) {
      const Eigen::VectorXd uj = Eigen::VectorXd::Unit(n, j);
      look(ui + uj);
      look(ui - uj);
      for (Eigen::Index k = 0; k < j; ++k) look(ui + uj + Eigen::VectorXd::Unit(n, k));
      s(i, j) = s(j, i) = (even(ui + uj) - even(ui - uj)) / 4;
    }
  }
  Trapping t;
  t.states = model.states;
  t.shift.assign(shift.data(), shift.data() + n);
  t.weights.assign(weights.data(), weights.data() + n);
  t.eigenvalue = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(s, Eigen::EigenvaluesOnly).eigenvalues().maxCoeff();
  const auto no = [](const std::string& why) { return Error("the model found is not certified as trapping: " + why); };
  if (!(t.eigenvalue < 0))
    throw no(fmt::format("the largest eigenvalue about the shift is {:.3g} 1/s, not negative", t.eigenvalue));
  t.radius = constant.norm() / -t.eigenvalue;
  if (!(cubic * t.radius <= 1e-6 * -t.eigenvalue)) throw no("its quadratic terms do not preserve the energy");
  // On spheres beyond the radius the energy falls, in every direction tried.
  std::mt19937_64 generator(1);
  std::normal_distribution<double> normal;
  for (int i = 0; i < kDirections; ++i) {
    Eigen::VectorXd u(n);
    for (double& value : u) value = normal(generator);
    const double far = 1.001 * t.radius * (1 + i % 4) + 1e-9;
    if (!(power(far * u.normalized()) < 0)) throw no(fmt::format("energy grows at the distance {:.3g}", far));
  }
  return t;
}

}  // namespace whirl::identification::detail
