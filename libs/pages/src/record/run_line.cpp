#include "record/run_line.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "record/record_part.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/core/error.hpp"
#include "whirl/diagnosis/rotation.hpp"

namespace whirl::pages {
namespace {

using Eigen::Index;
constexpr double kSteady = 0.03;  // of the highest speed
constexpr double kTurned = 0.1;   // of the range: beyond it a run turned round

// Speed at the begin, the end, and the extremes, each the mean over a fiftieth of the run.
std::string direction(const diagnosis::Rotation& turning) {
  const Index n = turning.size(), part = std::max<Index>(1, n / 50), parts = n / part;
  Eigen::VectorXd speed(parts);
  for (Index k = 0; k < parts; ++k) speed[k] = turning.speed.segment(k * part, part).mean() / kRadPerSecPerRpm;
  Index top = 0, bottom = 0;
  const double high = speed.maxCoeff(&top), low = speed.minCoeff(&bottom);
  const double begin = turning.speed[0] / kRadPerSecPerRpm, end = turning.speed[n - 1] / kRadPerSecPerRpm,
               range = high - low;
  if (range < kSteady * high) return fmt::format("steady at {:.0f} rpm", speed.mean());
  const bool over_the_top = high - speed[0] > kTurned * range && high - speed[parts - 1] > kTurned * range;
  const bool through_the_bottom = speed[0] - low > kTurned * range && speed[parts - 1] - low > kTurned * range;
  if (over_the_top && (!through_the_bottom || top < bottom))
    return fmt::format("run-up {:.0f} to {:.0f} rpm, then run-down to {:.0f} rpm", begin, high, end);
  if (through_the_bottom)
    return fmt::format("run-down {:.0f} to {:.0f} rpm, then run-up to {:.0f} rpm", begin, low, end);
  return fmt::format("{} {:.0f} to {:.0f} rpm", end > begin ? "run-up" : "run-down", begin, end);
}

std::string rotation_text(const Recording& shown) {
  try {
    const auto turning = diagnosis::rotation_of(shown);
    return turning ? direction(*turning) : "rotor angle not recorded";
  } catch (const Error&) {
    return "rotor angle not readable";  // a figure that needs it has said why
  }
}

}  // namespace

std::string run_line(const ViewedRun& run, const ViewOptions& options) {
  const Recording shown = cut(run.record, options);
  const std::string file = std::filesystem::path(run.record.source).filename().string();
  const bool named = file.empty() || std::filesystem::path(file).stem().string() == run.name || file == run.name;
  const std::string name = file.empty() ? run.name : named ? file : fmt::format("{} ({})", file, run.name);
  return fmt::format("{}, {:.4g} to {:.4g} s: {}", name, shown.t0,
                     shown.t0 + shown.dt * static_cast<double>(shown.size() - 1), rotation_text(shown));
}

}  // namespace whirl::pages
