#include "trajectory/input_lag.hpp"

#include <cmath>

#include "trajectory/held_input.hpp"
#include "whirl/expr/expr.hpp"

namespace whirl::identification::detail {
namespace {

std::string replaced(const std::string& function, const std::string& name, const std::string& by) {
  const std::map<std::string, expr::Expr, std::less<>> map{{name, expr::Expr::symbol(by)}};
  return expr::substitute(expr::Expr::parse(function), map).str();
}

}  // namespace

Eigen::VectorXd acting(const Eigen::Ref<const Eigen::VectorXd>& samples, double dt, const InputLag& lag) {
  constexpr int kFine = 16;
  Eigen::VectorXd out = samples;
  const double dead = lag.timing.dead_time.value / dt, stay = std::exp(-dt / lag.time / kFine);
  each_whole_stretch(samples, [&](Eigen::Index first, Eigen::Index count) {
    const HeldInput input(samples.segment(first, count), lag.timing.hold);
    double now = samples[first];
    for (Eigen::Index i = 0; i < count; ++i) {
      out[first + i] = now;
      for (int k = 0; k < kFine; ++k) {
        const double in = input.value(static_cast<double>(i) + (k + 0.5) / kFine - dead);
        now = in + stay * (now - in);
      }
    }
  });
  return out;
}

std::vector<Recording> with_input_acting(const std::vector<Recording>& records, const InputLag& lag) {
  std::vector<Recording> out = records;
  for (Recording& r : out) {
    for (Channel& c : r.channels) {
      if (c.name == lag.timing.input) c.samples = acting(c.samples, r.dt, lag);
    }
  }
  return out;
}

IdentifiedModel with_lag(const IdentifiedModel& model, const InputLag& lag) {
  IdentifiedModel out = model;
  for (Equation& e : out.equations) {
    for (EquationTerm& t : e.terms) t.function = replaced(t.function, lag.timing.input, lag.state());
  }
  EquationTerm term;
  term.function = expr::Expr::parse(lag.timing.input + "-" + lag.state()).str();
  term.coefficient.value = 1 / lag.time;
  term.unit = "1/s";
  out.states.push_back(lag.state());
  out.equations.push_back({lag.state() + "'", {term}});
  return out;
}

std::string in_input(const std::string& function, const InputLag& lag) {
  return replaced(function, lag.state(), lag.timing.input);
}

}  // namespace whirl::identification::detail
