#pragma once
#include <functional>
#include <string_view>
#include <vector>

#include "control/sampled_plant.hpp"
#include "whirl/shaft/control/controller.hpp"

namespace whirl::shaft {

/// What a law is made for: the machine at the speeds of the schedule.
struct LawTask {
  double sample_time = 0;  ///< s
  std::vector<Probe> probes;
  std::vector<Actuator> actuators;
  std::vector<double> speeds;  ///< rad/s
  std::vector<SampledPlant> plants;
};

/// One of the numbers of a law that the search varies: `count` of them from `low` to `high`, each by one ratio
/// larger than the one before.
struct LawNumber {
  std::string_view name;  ///< as in JSON
  std::string_view unit;  ///< "1/s": `low` and `high` are parts of the sample rate
  double low = 0, high = 0;
  int count = 1;
};

/// Feedback at some or all speeds of a task by the numbers of a law; empty where these numbers have none.
using LawGains = std::function<std::vector<ControlGains>(const std::vector<double>& numbers)>;

struct Law {
  std::string_view name;
  std::vector<LawNumber> numbers;
  /// Of the task, which must live as long. It may keep what several sets of numbers have in common.
  LawGains (*gains_on)(const LawTask&);
};

extern const Law kLqg, kPid;

}  // namespace whirl::shaft
