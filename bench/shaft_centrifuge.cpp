// Promises of `whirl centrifuge check` on loadings that its library does not make (testing/shaft/centrifuge_rig.hpp):
// coverage of the imbalance's interval, wrong buckets named, false alarms, misses, speed of the decision.
//     bench_shaft_centrifuge [LOADINGS [FIRST_SEED [VERBOSE]]]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "whirl/core/angles.hpp"
#include "whirl/shaft/centrifuge/load_check.hpp"
#include "whirl/shaft/rotor_file.hpp"
#include "whirl/testing/shaft/centrifuge_rig.hpp"

using namespace whirl;

int main(int argc, char** argv) {
  const int count = argc > 1 ? std::atoi(argv[1]) : 500;
  const unsigned first = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1;
  const shaft::RotorJob job = shaft::parse_rotor_job(shaft::rotor_template("centrifuge"), "centrifuge");
  const std::vector<shaft::CentrifugeSensor> sensors{shaft::centrifuge_sensors(job.rotor, job.centrifuge).front()};
  int covered = 0, angle_covered = 0, named = 0, one = 0, wrong_name = 0, alarms = 0, right_loads = 0, false_alarms = 0;
  int wrong_loads = 0, missed = 0, open = 0, misfits = 0;
  double worst_speed = 0, half = 0, off = 0;
  const std::clock_t begin = std::clock();
  for (unsigned seed = first; seed < first + static_cast<unsigned>(count); ++seed) {
    const testing::CentrifugeRig rig = testing::make_loading(seed);
    const Recording record = testing::CentrifugeRigModel(rig).run();
    const shaft::OrderRun run = shaft::order_run(record, 0, record["beta"], {"housing"}, "spin-up");
    const shaft::LoadCheck c = shaft::check_load(job.rotor, job.centrifuge, run, sensors);
    const double truth = rig.size / job.centrifuge.radius;
    covered += c.imbalance.covers(truth);
    const double turn = std::remainder(rig.angle - 0.5 * (c.angle.low + c.angle.high), kTwoPi);
    angle_covered += std::abs(turn) <= 0.5 * (c.angle.high - c.angle.low);
    const auto nearest = static_cast<int>((std::lround(rig.angle / (kTwoPi / 4)) + 4) % 4) + 1;
    if (!c.named.empty()) {
      ++named;
      one += c.named.size() == 1;
      wrong_name += std::find(c.named.begin(), c.named.end(), nearest) == c.named.end();
    }
    const bool alarm = c.verdict == shaft::LoadVerdict::wrong;
    alarms += alarm;
    if (truth <= job.centrifuge.allowed) {
      ++right_loads;
      false_alarms += alarm;
    } else {
      ++wrong_loads;
      missed += c.verdict == shaft::LoadVerdict::right;
    }
    open += c.verdict == shaft::LoadVerdict::open;
    misfits += c.summary.distrust() != nullptr;
    worst_speed = std::max(worst_speed, c.decided_at / c.first_critical);
    half += 0.5e3 * (c.imbalance.high - c.imbalance.low) / count;
    off += 1e3 * (c.imbalance.value - truth) / count;
    if (argc > 3)
      std::printf(
          "%u truth %.3f g %.1f deg: %.3f (%.3f to %.3f) %.1f (%.1f to %.1f) %s p %.4f found %.2f miss %.3f more %.0f "
          "chi %.3f dev %.2f\n",
          seed, 1e3 * truth, rig.angle / kRadPerDegree, 1e3 * c.imbalance.value, 1e3 * c.imbalance.low,
          1e3 * c.imbalance.high, c.angle.value / kRadPerDegree, c.angle.low / kRadPerDegree,
          c.angle.high / kRadPerDegree, std::string(shaft::to_string(c.verdict)).c_str(), c.wrong_probability,
          1e3 * c.smallest_found, c.miss_rate, c.seconds_more, c.chi_square, c.misfit_deviations);
  }
  std::printf("%d loadings, seeds from %u, %.2f s processor time each\n", count, first,
              static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC / count);
  std::printf("  imbalance within its interval %.3f (mean half width %.2f g, mean error %+.3f g), angle %.3f\n",
              covered / double(count), half, off, angle_covered / double(count));
  std::printf("  buckets named in %d (one: %d), wrong %d: %.1f %%\n", named, one, wrong_name,
              100.0 * wrong_name / count);
  std::printf("  within the allowed imbalance %d: false alarms %d; above %d: called right %d, wrong %d; open %d\n",
              right_loads, false_alarms, wrong_loads, missed, alarms - false_alarms, open);
  std::printf("  highest speed used, of the first critical: %.3f; verdicts against the model %d\n", worst_speed,
              misfits);
}
