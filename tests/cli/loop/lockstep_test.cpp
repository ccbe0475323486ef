// In lockstep nothing of the machine's speed gets into a run.
#include <gtest/gtest.h>

#include <atomic>
#include <cstring>
#include <thread>
#include <vector>

#include "served.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::testing {
namespace {

// The rotor comes to rest at 2000 rpm/s.
constexpr const char* kQuickStop = "[profile]\nstart_rpm = 1200\nramp_s = 0.6\ndwell_end_s = 0.3\n";

struct LockstepRun {
  std::string truth;
  rt::LoopRecord record;
};

LockstepRun lockstep_run(const Folder& folder) {
  LockstepRun out;
  {
    const Served rig(folder, "--lockstep --seed 3 --rig rig.toml --log truth.csv");
    rig.be_patient();
    const Outcome o = folder.whirl("run controller.json --io io.toml --record run.h5");
    EXPECT_EQ(o.exit_code, 0) << o.err;
    rig.result();
  }
  out.truth = slurp(folder / "truth.csv");
  out.record = rt::read_loop_record(folder / "run.h5");
  return out;
}

TEST(LockstepE2e, EqualRunsGiveEqualRecordsBitForBit) {
  const Folder folder;
  io::save(folder / "controller.json", pd_design());
  folder.write("rig.toml", kQuickStop);
  const LockstepRun first = lockstep_run(folder);
  ASSERT_EQ(first.record.cycles.size(), 901u);
  ASSERT_GT(first.truth.size(), 50000u);
  for (int k = 0; k < 3; ++k) {
    // Once on a machine that has much else to do.
    std::atomic<bool> over{false};
    std::vector<std::thread> others;
    for (int i = 0; i < (k == 1 ? 4 : 0); ++i)
      others.emplace_back([&] {
        while (!over) continue;
      });
    const LockstepRun again = lockstep_run(folder);
    over = true;
    for (std::thread& t : others) t.join();
    EXPECT_TRUE(again.truth == first.truth) << "run " << k;
    ASSERT_EQ(again.record.cycles.size(), first.record.cycles.size());
    for (std::size_t i = 0; i < first.record.cycles.size(); ++i) {
      const rt::LoopSample &a = first.record.cycles[i], &b = again.record.cycles[i];
      ASSERT_EQ(std::memcmp(&a, &b, sizeof a), 0) << "run " << k << ", cycle " << i << ": x " << a.x << " and " << b.x;
    }
  }
  for (const rt::LoopEvent& e : first.record.events) EXPECT_EQ(e.text.find("trip"), std::string::npos) << e.text;
}

}  // namespace
}  // namespace whirl::testing
