#pragma once
#include <optional>
#include <string>
#include <vector>

#include "whirl/core/recording.hpp"
#include "whirl/diagnosis/vibration.hpp"
#include "whirl/diagnosis/vibration_findings.hpp"
#include "whirl/report/table.hpp"

namespace whirl::pages {

/// What a record says about its machine.
struct Verdict {
  std::string record;
  diagnosis::VibrationFindings vibration;
  /// Zone of the largest unfiltered shaft vibration of its displacement channels, at the speed judged (ISO 20816-3);
  /// 0 where it has none or does not reach the speed.
  char zone = 0;
  bool steady = true;       ///< the run stays at one speed: what the zones are made for
  double peak_to_peak = 0;  ///< m, of that channel
  double speed = 0;         ///< rad/s, judged: the service speed, else the highest
  std::string channel;
  /// Velocity of the housing sensor with the highest level, m/s rms; 0 where the record has none.
  double velocity = 0;
  std::string housing_channel;
  /// Of that level (ISO 20816-3); nothing where the class of the machine is not stated or the speed changes.
  std::optional<diagnosis::HousingZone> housing_zone;
};
/// Who signs, about what; as the user writes it. Empty: stands as not stated.
struct Signature {
  std::string machine, date, analyst;
};
/// `service_speed` rad/s; 0: the highest of the record. Of the samples within 2 % of that speed one in a thousand at
/// either end does not count.
Verdict verdict_on(const std::string& name, const Recording& record, double service_speed);

/// Machine, date, analyst, standard, zone, findings, next step; a column per record.
report::Table verdict_table(const std::vector<Verdict>& verdicts, const Signature& signature);

}  // namespace whirl::pages
