#include <fmt/format.h>

#include <cmath>

#include "laws/linear/linear_entries.hpp"
#include "laws/parameters.hpp"
#include "whirl/control/hinfinity.hpp"
#include "whirl/core/decompositions.hpp"

namespace whirl::control {
namespace {

/// States: the rotor (2), the weight of its displacement (1), the delay (2).
constexpr int kPredictedOrder = 3, kDelayedOrder = 5;

std::vector<ParameterInfo> hinf_parameters() {
  return {{"position_scale", "m", "displacement weighted as 1", 1e-3, 1e-9, 1e3, 1e-5, 1e-2},
          {"weight_bandwidth", "rad/s", "above it the displacement is weighted less, first order", 300, 1e-3, 1e6, 30,
           3000},
          {"noise_scale", "m", "error of a reading taken as 1", 1e-5, 1e-12, 1e3, 1e-7, 1e-3},
          {"disturbance_scale", "m/s^2", "acceleration by the disturbance taken as 1", 1, 1e-9, 1e6, 0, 0},
          {"control_scale", "m/s^2", "control acceleration weighted as 1", 3, 1e-9, 1e6, 0, 0}};
}

int hinf_order(const Parameters& v) { return v.at("predict") > 0 ? kPredictedOrder : kDelayedOrder; }

/// The weighted plant of one axis in a time of its own, s / rate, and with everything in its scale.
WeightedPlant weighted(double k1, double c, double rate, double delay, const Parameters& v) {
  const int n = hinf_order(v);
  const double x = v.at("position_scale"), per = 1 / (rate * rate * x);
  WeightedPlant p;
  p.a.setZero(n, n), p.b1.setZero(n, 1), p.b2.setZero(n, 1), p.c1.setZero(1, n), p.c2.setZero(1, n);
  const double band = v.at("weight_bandwidth") / rate, push = v.at("control_scale") * per;
  p.a(0, 1) = 1;
  p.a(1, 0) = -k1 / (rate * rate), p.a(1, 1) = -c / rate;
  p.a(2, 0) = band, p.a(2, 2) = -band;
  p.b1(1, 0) = v.at("disturbance_scale") * per;
  p.c1(0, 2) = 1;
  p.c2(0, 0) = x / v.at("noise_scale");
  if (n == kPredictedOrder) {
    p.b2(1, 0) = push;
  } else {
    // Pade, second order: 1 - 4 D (s/w) / (1 + 2 D s/w + s^2/w^2), w = sqrt(12) / delay, D = sqrt(3)/2.
    const double w = std::sqrt(12.0) / (rate * delay), damping = std::sqrt(0.75);
    p.a(3, 4) = w, p.a(4, 3) = -w, p.a(4, 4) = -2 * damping * w;
    p.b2(1, 0) = push, p.b2(4, 0) = w;
    p.a(1, 4) = -4 * damping * push;
  }
  return p;
}

/// K(s) sampled: s = (2/h) (z - 1)/(z + 1), in accelerations per metre.
LinearAxis sampled_axis(const HInfinity& k, double h, double rate, const Parameters& v) {
  const Eigen::Index n = k.a.rows();
  const Eigen::MatrixXd one = Eigen::MatrixXd::Identity(n, n), a = rate * k.a;
  const Eigen::MatrixXd inverse = Eigen::PartialPivLU<Eigen::MatrixXd>(Eigen::MatrixXd(one - 0.5 * h * a)).inverse();
  const Eigen::VectorXd b = h * inverse * (rate / v.at("noise_scale") * k.b);
  const Eigen::RowVectorXd c = v.at("control_scale") * k.c * inverse;
  const Eigen::MatrixXd next = (one + 0.5 * h * a) * inverse;
  LinearAxis out;
  out.order = static_cast<int>(n);
  const auto at = [](Eigen::Index i) { return static_cast<std::size_t>(i); };
  for (Eigen::Index i = 0; i < n; ++i) {
    for (Eigen::Index j = 0; j < n; ++j) out.a[at(i * LinearAxis::kOrder + j)] = next(i, j);
    out.b[at(i * LinearAxis::kInputs)] = b[i];
    out.c[at(i)] = c[i];
  }
  out.d[0] = 0.5 * v.at("control_scale") * h * (k.c * inverse * (rate / v.at("noise_scale") * k.b)).value();
  return out;
}

LinearAxis axis_law(const ControllerDesign& d, const Parameters& v, double side) {
  const double k1 = d.model.k1 + side * d.model.k1_conj.real(), c = d.model.c + side * d.model.c_conj.real();
  const double delay = d.delay + 0.5 * d.sample_time;
  const double rate = std::max(std::sqrt(std::abs(d.model.k1)), 0.01 / d.sample_time);
  return sampled_axis(solve_hinfinity(weighted(k1, c, rate, delay, v)), d.sample_time, rate, v);
}

/// The same numbers at the inputs of the y axis.
LinearAxis turned_axis(LinearAxis law) {
  for (std::size_t i = 0; i < static_cast<std::size_t>(law.order); ++i) std::swap(law.b[4 * i], law.b[4 * i + 1]);
  std::swap(law.d[0], law.d[1]);
  return law;
}

LinearLaw both_axes(const ControllerDesign& d, const Parameters& v) {
  const bool alike = d.model.k1_conj.real() == 0 && d.model.c_conj.real() == 0;
  const LinearAxis x = axis_law(d, v, 1);
  return {x, turned_axis(alike ? x : axis_law(d, v, -1))};
}

/// Entries of an axis that are not zero by structure: a reading of the axis alone.
template <class Visit>
void visit_own(int order, const Visit& visit) {
  for (const std::string axis : kAxes) {
    visit_entries(axis, order, [&](const std::string& name, const char* unit, char part, int row, int column) {
      const bool input = part == 'b' || part == 'd';
      if (!input || column == (axis == "x" ? 0 : 1)) visit(axis, name, unit, part, row, column);
    });
  }
}

std::vector<std::pair<ParameterInfo, double>> hinf_code_parameters(const ControllerDesign& d, const Parameters& v) {
  const LinearLaw law = both_axes(d, v);
  std::vector<std::pair<ParameterInfo, double>> out;
  visit_own(hinf_order(v),
            [&](const std::string& axis, const std::string& name, const char* unit, char part, int row, int column) {
              const ParameterInfo info{name, unit, meaning_of(part), 0, -kMostEntry, kMostEntry};
              out.emplace_back(info, entry_of(axis == "x" ? law.x() : law.y(), part, row, column));
            });
  return out;
}

CodeFragment hinf_code(const Parameters& v) {
  const int order = hinf_order(v);
  Parameters present{{"x_order", order}, {"y_order", order}};
  for (const std::string axis : kAxes)
    visit_entries(axis, order, [&](const std::string& name, const char*, char, int, int) { present[name] = 0; });
  visit_own(order,
            [&](const std::string&, const std::string& name, const char*, char, int, int) { present[name] = 1; });
  return linear_code(present);
}

}  // namespace

LawEntry hinf_law() {
  return {.info = {"hinf", "mixed-sensitivity H-infinity control", "Doyle, Glover, Khargonekar, Francis 1989",
                   hinf_parameters()},
          .equation =
              "     q+ = A q + B x,  a = C q + D x - d: the controller that keeps the largest gain from disturbance\n"
              "   and noise to weighted displacement and acceleration within 5 % of the least there is, sampled",
          .latex = equations({R"(a = K x - d)",
                              R"(\min_K \left\| \begin{matrix} W P S & W T \\ T & K S \end{matrix} \right\|_\infty)"}),
          .make = [](const ControllerDesign& d, const Parameters& v) -> AnyLaw {
            return StateSpace{{0, 0}, {0, 0}, both_axes(d, v)};
          },
          .code = hinf_code,
          .model_free = true,
          .code_parameters = hinf_code_parameters};
}

}  // namespace whirl::control
