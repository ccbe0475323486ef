#include "whirl/control/laws/pd_scheduled.hpp"

#include <fmt/format.h>

#include <cmath>

#include "parameters.hpp"

namespace whirl::control {
namespace {

constexpr int kScheduleNodes = static_cast<int>(ScheduledPd::kNodes);
/// Nodes by critical speed: below it, at either side of it, above it.
constexpr std::array kByCritical{0.5, 0.9, 1.1, 1.7};
static_assert(kByCritical.size() == ScheduledPd::kNodes);

std::string at_node(const char* name, int node) { return fmt::format("{}_{}", name, node); }

std::vector<ParameterInfo> schedule_parameters() {
  constexpr double kCritical = 75;  // rad/s, until `design` takes that of the model
  std::vector<ParameterInfo> out;
  for (int k = 1; k <= kScheduleNodes; ++k) {
    out.push_back({at_node("speed", k), "rad/s", "speed of the node, above that of the one before",
                   kByCritical[static_cast<std::size_t>(k - 1)] * kCritical, 0, 1e6, 0, 0});
  }
  for (const ParameterInfo& gain : {kKp, kKd}) {
    for (int k = 1; k <= kScheduleNodes; ++k) out.emplace_back(gain).name = at_node(gain.name.c_str(), k);
  }
  return out;
}

AnyLaw make_schedule(const ControllerDesign&, const Parameters& v) {
  ScheduledPd law;
  for (int k = 1; k <= kScheduleNodes; ++k) {
    const auto i = static_cast<std::size_t>(k - 1);
    law.gains.speed[i] = v.at(at_node("speed", k));
    law.gains.value[i] = {v.at(at_node("kp", k)), v.at(at_node("kd", k))};
  }
  return both(law);
}

/// A node at a critical speed of 0 would be none.
Parameters schedule_measures(const ControllerDesign& d, double) {
  const double critical = std::sqrt(std::abs(d.model.k1));
  Parameters out;
  for (int k = 1; k <= kScheduleNodes && critical > 0; ++k)
    out[at_node("speed", k)] = kByCritical[static_cast<std::size_t>(k - 1)] * critical;
  return out;
}

}  // namespace

LawEntry pd_scheduled_law() {
  return {.info = {"pd_scheduled", "PD with gains that follow the speed", "straight lines between four speeds",
                   schedule_parameters()},
          .equation = "     a = -kp x - kd v - d,  kp and kd straight lines between their values at four speeds",
          .latex = R"(a = -k_p(|\omega|) x - k_d(|\omega|) v - d)",
          .make = make_schedule,
          .code = [](const Parameters&) { return CodeFragment{"pd_scheduled"}; },
          .model_free = true,
          .conditions = {{"speed_2", [](const Parameters& v) { return v.at("speed_2") > v.at("speed_1"); },
                          "above speed_1", "p->speed_2 > p->speed_1"},
                         {"speed_3", [](const Parameters& v) { return v.at("speed_3") > v.at("speed_2"); },
                          "above speed_2", "p->speed_3 > p->speed_2"},
                         {"speed_4", [](const Parameters& v) { return v.at("speed_4") > v.at("speed_3"); },
                          "above speed_3", "p->speed_4 > p->speed_3"}},
          .measures = schedule_measures};
}

}  // namespace whirl::control
