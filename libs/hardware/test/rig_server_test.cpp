#include "whirl/hardware/rig_server.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <chrono>
#include <filesystem>
#include <fstream>
#include <thread>

#include "whirl/core/error.hpp"
#include "whirl/hardware/realtime_run.hpp"

namespace whirl::hardware {
namespace {

TEST(IoSettings, ComeBackFromTheirTomlAsTheyWere) {
  RigServer server({});
  IoSettings io = server.io();
  io.rate = 500;
  io.overrun = "trip";
  io.safety.displacement = 1.25e-3;
  io.hardware.position[1].laser.range = 10e-3;
  const std::filesystem::path file = std::filesystem::path(::testing::TempDir()) / "whirl_io_settings.toml";
  std::ofstream(file) << io_toml(io);
  const IoSettings back = read_io(file);
  EXPECT_EQ(io_toml(back), io_toml(io));
  EXPECT_EQ(back.source, file.string());
  EXPECT_DOUBLE_EQ(back.safety.displacement, 1.25e-3);
  std::ofstream(file) << "[loop]\nrate_hz = 5\n";
  EXPECT_THROW(read_io(file), Error);
  std::ofstream(file) << "[loop]\nrat_hz = 500\n";
  EXPECT_THROW(read_io(file), Error);
}

// The first command with `start` runs the experiment and no key is asked for: no other machine may reach the port.
TEST(RigServerSettings, AnAddressThatOtherMachinesReachIsRefused) {
  for (const char* address : {"0.0.0.0:0", "192.0.2.7:47010", "10.0.0.1:0"}) {
    ServeOptions options;
    options.address = address;
    try {
      RigServer server(options);
      FAIL() << address << " is served";
    } catch (const Error& e) {
      EXPECT_THAT(e.what(), ::testing::AllOf(::testing::HasSubstr(address), ::testing::HasSubstr("127.0.0.1")))
          << address;
    }
  }
  ServeOptions options;
  options.address = "127.0.0.2:0";
  EXPECT_NO_THROW(RigServer{options});
}

/// A served rig in a thread of its own, as another process would be.
TEST(RecordDisarmedRealtime, AServedRigIsRecordedAndTheStopRequestEndsIt) {
  RigServer server({});
  const IoSettings io = server.io();
  std::atomic<bool> over{false};
  std::thread rig([&] { server.run([&] { return over.load(); }); });
  long seen = 0;
  RealtimeRunOptions options;
  options.seconds = 0.3;
  options.record = std::filesystem::path(::testing::TempDir()) / "whirl_disarmed.h5";
  options.take = [&](const rt::LoopSample&) { ++seen; };
  const RecordRun run = record_disarmed(io, options);
  over = true;
  rig.join();
  EXPECT_EQ(run.summary.status, Status::ok) << run.loop.reason;
  EXPECT_GT(run.cycles, 50);
  EXPECT_EQ(run.cycles, seen);
  EXPECT_FALSE(run.loop.armed);
}

TEST(RigServerSettings, TheServedLimitLiesWellBelowThePeakWithoutControl) {
  for (const double mass : {0.0, 2.5e-3, 5e-3}) {
    ServeOptions options;
    options.rig.rotor.added_mass = mass;
    const double open = tuning::ClosedLoopPlant(options.rig).open().all,
                 limit = RigServer(options).io().safety.displacement;
    EXPECT_GE(limit, 1e-3);
    if (open > 5e-3) {
      EXPECT_LT(limit, 0.25 * open) << mass;
    }
  }
}

// The board answers to whoever commands it: the first tick is not waited for in vain.
TEST(RecordDisarmedRealtime, TheLengthOfARunDoesNotDependOnTheWatchdog) {
  RigServer server({});
  IoSettings io = server.io();
  io.watchdog = io.hardware.board_timeout = 60;
  std::atomic<bool> over{false};
  std::thread rig([&] { server.run([&] { return over.load(); }); });
  RealtimeRunOptions options;
  options.seconds = 0.2;
  options.record = std::filesystem::path(::testing::TempDir()) / "whirl_watchdog.h5";
  const auto before = std::chrono::steady_clock::now();
  const RecordRun run = record_disarmed(io, options);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - before;
  over = true;
  rig.join();
  EXPECT_GT(run.cycles, 50) << run.loop.reason;
  EXPECT_LT(took.count(), 30);
}

TEST(RunRealtime, AControllerOfAnotherRateIsRefusedBeforeAnythingIsOpened) {
  ControllerDesign design;
  design.sample_time = 2e-3;
  IoSettings io;
  io.source = "io.toml";
  try {
    run_realtime(design, io, {});
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), ::testing::HasSubstr("io.toml: loop.rate_hz = 1000"));
  }
}

}  // namespace
}  // namespace whirl::hardware
