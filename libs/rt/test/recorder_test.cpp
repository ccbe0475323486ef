#include "whirl/rt/recorder.hpp"

#include <gtest/gtest.h>
#include <signal.h>
#include <sys/mount.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <filesystem>
#include <fstream>
#include <random>
#include <thread>

#include "whirl/core/error.hpp"

namespace whirl::rt {
namespace {

struct RecorderTest : ::testing::Test {
  std::filesystem::path folder =
      std::filesystem::temp_directory_path() / ("whirl_recorder_" + std::to_string(::getpid()));
  RecorderTest() { std::filesystem::create_directories(folder); }
  ~RecorderTest() override { std::filesystem::remove_all(folder); }
};

LoopSample sample(long k) {
  LoopSample s;
  s.tick = k;
  s.t = 1e-3 * static_cast<double>(k);
  s.x = 1e-6 * static_cast<double>(k % 997);
  s.uy_requested = -static_cast<double>(k);
  s.flags = kValid | kArmed;
  s.missed = static_cast<std::int32_t>(k % 3);
  return s;
}

TEST_F(RecorderTest, WhatIsRecordedIsRead) {
  const auto path = folder / "run.h5";
  {
    LoopRecorder recorder(path, {2e-3, {{"controller", std::string(100000, 'c')}, {"io", "[loop]"}}}, 0.01);
    for (long k = 0; k < 5000; ++k) recorder.append(sample(k));
    recorder.event({1234, 1.234, "trip: watchdog"});
    EXPECT_EQ(recorder.rows(), 5000);
  }
  const LoopRecord r = read_loop_record(path);
  EXPECT_TRUE(r.closed);
  EXPECT_EQ(r.head.sample_time, 2e-3);
  ASSERT_NE(r.text("controller"), nullptr);
  EXPECT_EQ(r.text("controller")->size(), 100000u);
  EXPECT_EQ(*r.text("io"), "[loop]");
  EXPECT_EQ(r.text("none"), nullptr);
  ASSERT_EQ(r.cycles.size(), 5000u);
  for (long k = 0; k < 5000; ++k) {
    const LoopSample &a = r.cycles[static_cast<std::size_t>(k)], b = sample(k);
    ASSERT_EQ(a.tick, k);
    ASSERT_EQ(a.x, b.x);
    ASSERT_EQ(a.uy_requested, b.uy_requested);
    ASSERT_EQ(a.flags, b.flags);
    ASSERT_EQ(a.missed, b.missed);
  }
  ASSERT_EQ(r.events.size(), 2u);
  EXPECT_EQ(r.events[0].text, "trip: watchdog");
  EXPECT_EQ(r.events[0].tick, 1234);
}

TEST_F(RecorderTest, SomethingElseIsRefused) {
  const auto path = folder / "text.h5";
  std::ofstream(path) << "no HDF5";
  EXPECT_THROW((void)read_loop_record(path), Error);
  EXPECT_THROW((void)read_loop_record(folder / "missing.h5"), Error);
  EXPECT_THROW(LoopRecorder(folder / "no" / "such" / "run.h5", {}), Error);
}

TEST_F(RecorderTest, AFullDiskEndsAFileThatCanBeReadAndCountsWhatIsMissing) {
  const auto small = folder / "small";
  std::filesystem::create_directories(small);
  if (::mount("tmpfs", small.c_str(), "tmpfs", 0, "size=6m") != 0) GTEST_SKIP() << "no right to make a small disk";
  long rows = 0, lost = 0;
  std::string failure;
  {
    LoopRecorder recorder(small / "full.h5", {1e-3, {{"controller", "{}"}}}, 0.05);
    for (long k = 0; k < 100000; ++k) recorder.append(sample(k));
    recorder.close();
    rows = recorder.rows(), lost = recorder.lost(), failure = recorder.failure();
  }
  EXPECT_NE(failure.find("No space left"), std::string::npos) << failure;
  EXPECT_EQ(rows + lost, 100000);
  EXPECT_GT(lost, 0);
  {
    const LoopRecord r = read_loop_record(small / "full.h5");
    EXPECT_FALSE(r.closed);
    EXPECT_EQ(static_cast<long>(r.cycles.size()), rows);
    EXPECT_GT(rows, 2000);
    for (std::size_t k = 0; k < r.cycles.size(); ++k) ASSERT_EQ(r.cycles[k].tick, static_cast<long>(k));
    ASSERT_FALSE(r.events.empty());
    EXPECT_EQ(r.events.back().text.rfind("recording stopped: No space", 0), 0u);
  }
  EXPECT_EQ(::umount(small.c_str()), 0);
  EXPECT_THROW(LoopRecorder("/dev/null", {}), Error) << "no file";
}

TEST_F(RecorderTest, ADamagedRecordingIsRefusedAndNotWaitedFor) {
  const auto path = folder / "sound.h5";
  {
    LoopRecorder recorder(path, {1e-3, {}}, 0.01);
    for (long k = 0; k < 3000; ++k) recorder.append(sample(k));
  }
  std::ifstream in(path, std::ios::binary);
  const std::string sound((std::istreambuf_iterator<char>(in)), {});
  std::mt19937_64 random(11);
  const auto begin = std::chrono::steady_clock::now();
  for (int round = 0; round < 10; ++round) {
    std::string bytes = sound;
    for (int i = 0; i < 12; ++i)
      bytes[random() % std::min<std::size_t>(bytes.size(), 6000)] = static_cast<char>(random());
    const auto damaged = folder / "damaged.h5";
    std::ofstream(damaged, std::ios::binary) << bytes;
    try {
      (void)read_loop_record(damaged);
    } catch (const Error&) {
    }
  }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(10));  // 20 s each by the limit on sleep
}

// The writer is killed at an instant nobody chose; --gtest_repeat=20 does it a hundred times.
TEST_F(RecorderTest, AKilledWriterLeavesAFileThatLacksAtMostTheLastFlush) {
  std::mt19937_64 random(3);
  for (int round = 0; round < 5; ++round) {
    const auto path = folder / ("kill" + std::to_string(round) + ".h5");
    int pipe_ends[2];
    ASSERT_EQ(::pipe(pipe_ends), 0);
    const pid_t child = ::fork();
    if (child == 0) {
      LoopRecorder recorder(path, {1e-3, {{"controller", "{}"}}}, 0.05);
      // Every flushed row count is told; what is told must be there later.
      for (long k = 0;; ++k) {
        recorder.append(sample(k));
        if (k % 50 == 49) {
          recorder.flush();
          const long rows = recorder.rows();
          (void)!::write(pipe_ends[1], &rows, sizeof rows);
          std::this_thread::sleep_for(std::chrono::microseconds(200));
        }
      }
    }
    ::close(pipe_ends[1]);
    long told = 0, rows = 0;
    const auto one = [&] { return ::read(pipe_ends[0], &rows, sizeof rows) == sizeof rows; };
    ASSERT_TRUE(one());
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 100000));
    ::kill(child, SIGKILL);
    ::waitpid(child, nullptr, 0);
    do told = rows;
    while (one());
    ::close(pipe_ends[0]);
    const LoopRecord r = read_loop_record(path);
    EXPECT_FALSE(r.closed);
    ASSERT_GE(static_cast<long>(r.cycles.size()), told);
    for (std::size_t k = 0; k < r.cycles.size(); ++k) {
      ASSERT_EQ(r.cycles[k].tick, static_cast<long>(k));
      ASSERT_EQ(r.cycles[k].uy_requested, -static_cast<double>(k));
    }
  }
}

}  // namespace
}  // namespace whirl::rt
