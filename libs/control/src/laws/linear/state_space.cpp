#include "whirl/control/laws/state_space.hpp"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "laws/linear/linear_entries.hpp"
#include "laws/parameters.hpp"
#include "whirl/core/error.hpp"

namespace whirl::control {
namespace {

constexpr double kPerVelocity = -60;

/// Without a file it is a damper.
double fallback_of(const std::string& name) { return name == "x_d_3" || name == "y_d_4" ? kPerVelocity : 0; }

std::vector<ParameterInfo> entries(const Parameters& given) {
  std::vector<ParameterInfo> out;
  for (const std::string axis : kAxes) {
    visit_entries(axis, order_of(given, axis), [&](const std::string& name, const char* unit, char part, int, int) {
      out.push_back({name, unit, meaning_of(part), fallback_of(name), -kMostEntry, kMostEntry, 0, 0});
    });
  }
  return out;
}

LinearAxis axis_of(const Parameters& v, const std::string& axis) {
  LinearAxis out;
  out.order = order_of(v, axis);
  visit_entries(axis, out.order, [&](const std::string& name, const char*, char part, int row, int column) {
    entry_of(out, part, row, column) = v.at(name);
  });
  return out;
}

AnyLaw make_linear(const ControllerDesign& d, const Parameters& v) {
  if (const double h = v.at("law_sample_time"); h > 0 && std::abs(h / d.sample_time - 1) > 1e-9) {
    throw Error::in_field("sample_time", fmt::format("{:g} s", d.sample_time),
                          fmt::format("that of the law, law_sample_time {:g} s", h));
  }
  return StateSpace{{0, 0}, {0, 0}, LinearLaw(axis_of(v, "x"), axis_of(v, "y"))};
}

/// Names a law that grows by itself; the loop around it may hold nevertheless.
std::vector<std::string> linear_remarks(const Parameters& v) {
  std::vector<std::string> out;
  for (const std::string axis : kAxes) {
    const LinearAxis law = axis_of(v, axis);
    if (law.order == 0) continue;
    using Rows = Eigen::Matrix<double, LinearAxis::kOrder, LinearAxis::kOrder, Eigen::RowMajor>;
    const Eigen::MatrixXd a = Eigen::Map<const Rows>(law.a.data()).topLeftCorner(law.order, law.order);
    const double largest = a.eigenvalues().cwiseAbs().maxCoeff();
    if (!(largest <= 1 + 1e-9)) {
      out.push_back(fmt::format(
          "the law of axis {} is unstable by itself: its largest pole is {:.4g} a sample, above 1", axis, largest));
    }
  }
  return out;
}

std::vector<std::pair<ParameterInfo, double>> linear_code_parameters(const ControllerDesign&, const Parameters& v) {
  std::vector<std::pair<ParameterInfo, double>> out;
  for (const ParameterInfo& info : entries(v)) {
    if (v.at(info.name) != 0) out.emplace_back(info, v.at(info.name));
  }
  return out;
}

}  // namespace

CodeFragment linear_code(const Parameters& v) {
  CodeFragment out{"state_space"};
  for (const std::string axis : kAxes) {
    const int order = order_of(v, axis);
    const std::string upper = axis == "x" ? "X" : "Y";
    if (order > 0) out.features.insert("STATES_" + upper);
    out.slots[axis + "_order"] = std::to_string(order);
    std::string &next = out.slots[axis + "_next"], &sum = out.slots[axis + "_sum"];
    visit_entries(axis, order, [&](const std::string& name, const char*, char part, int row, int column) {
      if (v.at(name) == 0) return;
      const std::string factor = fmt::format("p->{} * {}[{}]", name, part == 'a' || part == 'c' ? "q" : "u", column);
      std::string& lines = part == 'a' || part == 'b' ? next : sum;
      if (!lines.empty()) lines += "\n";
      lines += part == 'a' || part == 'b' ? fmt::format("  next[{}] += {};", row, factor)
                                          : fmt::format("  a += {};", factor);
    });
  }
  return out;
}

double LinearAxis::step(const Inputs& u) noexcept {
  std::array<double, kOrder> next{};
  double sum = 0;
  const auto n = static_cast<std::size_t>(order), stride = static_cast<std::size_t>(kOrder);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < n; ++j) next[i] += a[i * stride + j] * q[j];
    for (std::size_t k = 0; k < u.size(); ++k) next[i] += b[i * u.size() + k] * u[k];
    sum += c[i] * q[i];
  }
  for (std::size_t k = 0; k < u.size(); ++k) sum += d[k] * u[k];
  q = next;
  return sum;
}

std::map<std::string, double> linear_parameters(const LinearAxis& x, const LinearAxis& y, double gain,
                                                double sample_time) {
  std::map<std::string, double> out{{"x_order", x.order}, {"y_order", y.order}, {"law_sample_time", sample_time}};
  for (const std::string axis : kAxes) {
    const LinearAxis& law = axis == "x" ? x : y;
    visit_entries(axis, law.order, [&](const std::string& name, const char*, char part, int row, int column) {
      const double value = entry_of(law, part, row, column) * (part == 'c' || part == 'd' ? gain : 1);
      if (value != fallback_of(name)) out[name] = value;
    });
  }
  return out;
}

LawEntry state_space_law() {
  return {.info = {"state_space",
                   "state space or transfer function of the user",
                   "the user (--law-file)",
                   {{"x_order", "1", "states behind the force of the x axis", 0, 0, LinearAxis::kOrder, 0, 0},
                    {"y_order", "1", "states behind the force of the y axis", 0, 0, LinearAxis::kOrder, 0, 0},
                    {"law_sample_time", "s", "sample time that A, B, C, D hold for; 0: any", 0, 0, 1, 0, 0}}},
          .equation = "     q+ = A q + B u,  a = C q + D u - d,  u = (x, y, v_x, v_y): a law that the user wrote",
          .latex = equations({R"(q_{k+1} = A q_k + B u_k)", R"(a = C q_k + D u_k - d)", R"(u = (x, y, v_x, v_y))"}),
          .make = make_linear,
          .code = linear_code,
          .model_free = true,
          .code_parameters = linear_code_parameters,
          .entries = entries,
          .remarks = linear_remarks,
          .own = true};
}

}  // namespace whirl::control
