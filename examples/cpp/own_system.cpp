// Equations of a system that is no rotor, from samples in memory: a damped Duffing oscillator, simulated here in the
// role of the laboratory. The candidate terms are whirl's default: all monomials up to degree three.
#include <cstdio>
#include <whirl/whirl.hpp>

int main() {
  const double dt = 0.01;
  const Eigen::Index n = 3000;
  Eigen::VectorXd x(n), v(n);
  double a = 2, b = 0;
  for (Eigen::Index k = 0; k < n; ++k) {
    x[k] = a;
    v[k] = b;
    for (int i = 0; i < 100; ++i) {  // symplectic Euler with a hundredth of the sampling step
      b += dt / 100 * (-0.1 * b - a - 0.5 * a * a * a);
      a += dt / 100 * b;
    }
  }
  whirl::Recording record;
  record.dt = dt;
  record.source = "oscillator";
  record.add("x", whirl::Quantity::displacement, x);
  record.add("v", whirl::Quantity::velocity, v);

  whirl::IdentifyOptions options;
  options.method = whirl::identification::Method::sindy;
  options.sindy.states = {"x", "v"};
  const whirl::Identification id = whirl::identify(record, options);
  for (const whirl::Equation& equation : id.model.equations) {
    std::printf("%s =", equation.lhs.c_str());
    for (const auto& term : equation.terms) std::printf("  %+.4f %s", term.coefficient.value, term.function.c_str());
    std::printf("\n");
  }
  return id.usable() ? 0 : 1;
}
