#include "whirl/monitor/hub.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <thread>

#include "whirl/core/error.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/io/file.hpp"

namespace whirl::monitor {
namespace {

using Eigen::Index;
using ::testing::HasSubstr;
using json = nlohmann::json;

/// 4 s of circular whirl at 25 turns per second.
Recording whirl_record() {
  Recording r;
  r.dt = 1e-3;
  r.source = "circle.csv";
  const Eigen::VectorXd beta = Eigen::VectorXd::LinSpaced(4001, 0, 200 * std::numbers::pi);
  r.add("x", Quantity::displacement, 1e-3 * beta.array().cos());
  r.add("y", Quantity::displacement, 1e-3 * beta.array().sin());
  r.add("beta", Quantity::angle, beta);
  return r;
}

/// A hub driven by hand.
struct Bench {
  explicit Bench(HubOptions options = {}) : hub(make_source(), options) { hub.add(client); }
  std::unique_ptr<FrameSource> make_source() {
    auto playback = std::make_unique<PlaybackSource>(whirl_record(), 1, false, [this] { return now; });
    return playback;
  }
  /// Messages of one step.
  std::vector<MessagePtr> step(double seconds) {
    now += seconds;
    hub.step();
    std::vector<MessagePtr> out;
    while (MessagePtr m = client->pop()) out.push_back(m);
    return out;
  }
  json last_status(const std::vector<MessagePtr>& messages) {
    json status;
    for (const auto& m : messages) {
      if (m->text && json::parse(m->data)["type"] == "status") status = json::parse(m->data);
    }
    return status;
  }

  double now = 0;
  std::shared_ptr<ClientQueue> client = std::make_shared<ClientQueue>(1000);
  Hub hub;
};

std::vector<FrameHeader> frames(const std::vector<MessagePtr>& messages) {
  std::vector<FrameHeader> out;
  for (const auto& m : messages) {
    if (!m->text) out.push_back(decode_frame(m->data));
  }
  return out;
}

TEST(MonitorHub, NewClientGetsTheDescriptionFirst) {
  Bench bench;
  const auto messages = bench.step(0);
  ASSERT_FALSE(messages.empty());
  const json stream = json::parse(messages[0]->data);
  EXPECT_EQ(stream["type"], "stream");
  EXPECT_EQ(stream["rate"], 1000.0);
  EXPECT_EQ(stream["channels"][0]["unit"], "m");
  EXPECT_EQ(stream["tracked"].size(), 2U);
}

TEST(MonitorHub, SamplesSpectrumAndSynchronousVector) {
  Bench bench;
  bench.step(0);
  int spectra = 0, turns = 0;
  Index samples = 0;
  std::uint32_t next = 0;
  for (int i = 0; i < 100; ++i) {
    for (const auto& m : bench.step(0.04)) {
      if (m->text) continue;
      Eigen::MatrixXf values;
      const FrameHeader h = decode_frame(m->data, &values);
      EXPECT_EQ(h.seq, next++);
      if (h.kind == FrameKind::samples) samples += h.n;
      if (h.kind == FrameKind::spectrum) {
        ++spectra;
        const double line = 25 * 1024 / 1000.0;
        EXPECT_NEAR(values(static_cast<Index>(std::lround(line)), 0), 1e-3, 1e-4);
      }
      if (h.kind == FrameKind::synchronous) {
        turns += static_cast<int>(h.n);
        EXPECT_NEAR(values(0, 0), 50 * std::numbers::pi, 0.1);
        EXPECT_NEAR(values(0, 2), 1e-3, 1e-5);
        EXPECT_NEAR(values(0, 5), -1e-3, 1e-5);
      }
    }
  }
  EXPECT_GE(samples, 3999);
  EXPECT_EQ(spectra, 6);
  EXPECT_GE(turns, 98);
}

TEST(MonitorHub, FastPlaybackIsReducedToExtremesNotThinnedOut) {
  HubOptions options;
  options.frame_groups = 64;
  Bench bench(options);
  bench.step(0);
  const auto messages = bench.step(2);  // 2000 samples in one frame
  bool seen = false;
  for (const auto& m : messages) {
    if (m->text) continue;
    Eigen::MatrixXf values;
    const FrameHeader h = decode_frame(m->data, &values);
    if (h.kind != FrameKind::min_max) continue;
    seen = true;
    EXPECT_EQ(h.log2_group, 5U);
    EXPECT_EQ(h.n, 2U * 63U);
    EXPECT_NEAR(values.col(0).maxCoeff(), 1e-3, 1e-9);
    EXPECT_NEAR(values.col(0).minCoeff(), -1e-3, 1e-9);
  }
  EXPECT_TRUE(seen);
  EXPECT_TRUE(std::any_of(messages.begin(), messages.end(), [](const auto& m) {
    return !m->text && decode_frame(m->data).kind == FrameKind::decimated;
  }));
}

TEST(MonitorHub, SlowClientLosesTheOldestFramesAndOnlyThose) {
  Bench bench;
  auto slow = std::make_shared<ClientQueue>(4);
  bench.hub.add(slow);
  std::size_t delivered = 0;
  for (int i = 0; i < 20; ++i) delivered += bench.step(0.02).size();
  EXPECT_GT(slow->dropped(), 10U);
  EXPECT_EQ(bench.client->dropped(), 0U);
  int waiting = 0;
  MessagePtr newest;
  while (MessagePtr m = slow->pop()) newest = m, ++waiting;
  EXPECT_EQ(waiting, 4);
  EXPECT_GT(delivered, 20U);
}

// A page that stands still for a moment keeps every event; one that stands still for long is told all of them
// afterwards.
TEST(MonitorHub, SlowClientLosesNoEvent) {
  const auto heard = [](ClientQueue& client, const std::string& event) {
    bool found = false;
    while (const MessagePtr m = client.pop()) {
      if (!m->text) continue;
      for (const auto& line : json::parse(m->data).value("log", json::array()))
        found = found || line.get<std::string>().find(event) != std::string::npos;
    }
    return found;
  };
  for (const int steps : {6, 200}) {
    Bench bench;
    auto slow = std::make_shared<ClientQueue>(4);
    bench.hub.add(slow);
    bench.hub.submit(R"({"command":"marker","text":"the pump stopped"})");
    for (int i = 0; i < steps; ++i) bench.step(0.02);
    EXPECT_GT(slow->dropped(), 0U) << steps;
    bool found = heard(*slow, "the pump stopped");
    for (int i = 0; i < 100 && !found; ++i) {
      bench.step(0.02);
      found = heard(*slow, "the pump stopped");
    }
    EXPECT_TRUE(found) << steps << " steps";
  }
}

TEST(MonitorHub, CommandsChangeTheSpectrumAndAreLogged) {
  Bench bench;
  bench.step(0);
  bench.hub.submit(R"({"command":"spectrum","block":256,"window":"flat top","averaging":"peak hold","averages":2})");
  bench.hub.submit(R"({"command":"spectrum","block":3})");
  bench.hub.submit(R"({"command":"fly"})");
  bench.hub.submit("not json");
  const auto messages = bench.step(0.5);
  EXPECT_EQ(json::parse(messages[0]->data)["spectrum"]["block"], 256);
  const json status = bench.last_status(messages);
  ASSERT_EQ(status["log"].size(), 4U);
  EXPECT_THAT(status["log"][1].get<std::string>(), HasSubstr("refused: block = 3"));
  EXPECT_THAT(status["log"][2].get<std::string>(), HasSubstr("unknown command 'fly'"));
  EXPECT_EQ(status["averages"], 2);
  for (const FrameHeader& h : frames(messages)) {
    if (h.kind == FrameKind::spectrum) {
      EXPECT_EQ(h.n, 129U);
    }
  }
}

TEST(MonitorHub, RecordHoldsEverySample) {
  const auto folder = std::filesystem::temp_directory_path() / "whirl_monitor_hub_test";
  std::filesystem::remove_all(folder);
  HubOptions options;
  options.recorder.folder = folder;
  {
    Bench bench(options);
    bench.step(0.1);
    bench.hub.submit(R"({"command":"record","value":1})");
    for (int i = 0; i < 10; ++i) bench.step(0.1);
    bench.hub.submit(R"({"command":"record","value":0})");
    const json status = bench.last_status(bench.step(0.1));
    EXPECT_EQ(status["recording"], false);
    EXPECT_EQ(status["record_samples"], 1000);
  }
  std::ifstream file(folder / "run_001" / "record.csv");
  std::string line;
  std::getline(file, line);
  EXPECT_EQ(line, "t_s,x_m,y_m,beta_rad,valid_1");
  int rows = 0;
  std::string first;
  while (std::getline(file, line)) {
    if (rows++ == 0) first = line;
  }
  EXPECT_EQ(rows, 1000);
  EXPECT_THAT(first, HasSubstr("0.100000000,"));
  const Recording back = io::read_csv(folder / "run_001" / "record.csv");
  EXPECT_NEAR(back.dt, 1e-3, 1e-12);
  EXPECT_EQ(back["x"], whirl_record()["x"].segment(100, 1000));
  EXPECT_TRUE(std::filesystem::exists(folder / "run_001" / "settings.json"));
  std::filesystem::remove_all(folder);
}

TEST(MonitorHub, LostValuesAreHeldAndMarkedInTheRecord) {
  const auto folder = std::filesystem::temp_directory_path() / "whirl_monitor_lost_test";
  std::filesystem::remove_all(folder);
  Recorder recorder({folder, 1'000'000, 0});
  recorder.start({"loop", 1000, {{"x", Quantity::displacement}}}, "{}");
  recorder.write(0, (Eigen::MatrixXd(4, 1) << 1, 2, NAN, 3).finished());
  recorder.event(0.002, "lost, once");
  recorder.stop("done");
  EXPECT_EQ(recorder.lost(), 1U);
  const Recording back = io::read_csv(folder / "run_001" / "record.csv");
  EXPECT_EQ(back["x"], Eigen::Vector4d(1, 2, 2, 3));
  EXPECT_EQ(back["valid"], Eigen::Vector4d(1, 1, 0, 1));
  std::ifstream events(folder / "run_001" / "events.csv");
  std::string line;
  std::getline(events, line);
  std::getline(events, line);
  EXPECT_EQ(line, "0.002000,\"lost, once\"");
  std::filesystem::remove_all(folder);
}

// The disk is full in the middle of a block: whole lines, and the events say why. `ulimit -f` plays the disk.
TEST(MonitorHub, ARecordOnAFullDiskEndsInAWholeLineAndSaysSo) {
  const auto folder = std::filesystem::temp_directory_path() / "whirl_monitor_full_test";
  std::filesystem::remove_all(folder);
  Recorder recorder({folder, 1'000'000, 0});
  recorder.start({"loop", 1000, {{"x", Quantity::displacement}}}, "{}");
  const Eigen::MatrixXd block = Eigen::MatrixXd::Constant(100, 1, 1.2345678901e-3);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const auto handler = std::signal(SIGXFSZ, SIG_IGN);
  rlimit full = before;
  full.rlim_cur = 10'001;
  setrlimit(RLIMIT_FSIZE, &full);
  for (int i = 0; i < 10 && recorder.active(); ++i) recorder.write(0.1 * i, block);
  setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, handler);
  EXPECT_FALSE(recorder.active());
  EXPECT_THAT(recorder.stopped_because(), HasSubstr("cannot be written"));
  const Recording back = io::read_csv(folder / "run_001" / "record.csv");
  EXPECT_EQ(static_cast<std::uint64_t>(back.size()), recorder.samples());
  EXPECT_GT(back.size(), 100);
  EXPECT_THAT(io::read_text(folder / "run_001" / "events.csv"), HasSubstr("record stopped: "));
  std::filesystem::remove_all(folder);
}

TEST(MonitorHub, ARecordNeverEntersAFolderThatIsThere) {
  const auto folder = std::filesystem::temp_directory_path() / "whirl_monitor_many_test";
  std::filesystem::remove_all(folder);
  std::filesystem::create_directory(folder);
  for (int i = 1; i <= 9999; ++i) std::filesystem::create_directory(folder / fmt::format("run_{:03}", i));
  {
    Recorder recorder({folder, 1'000'000, 0});
    recorder.start({"loop", 1000, {{"x", Quantity::displacement}}}, "{}");
    EXPECT_EQ(recorder.folder().filename(), "run_10000");
  }
  EXPECT_TRUE(std::filesystem::is_empty(folder / "run_9999"));
  Recorder none({folder, 1'000'000, std::uintmax_t{1} << 60});
  EXPECT_THROW(none.start({"loop", 1000, {{"x", Quantity::displacement}}}, "{}"), Error);
  std::filesystem::remove_all(folder);
}

TEST(MonitorHub, RecordStopsAtItsSizeLimit) {
  const auto folder = std::filesystem::temp_directory_path() / "whirl_monitor_limit_test";
  std::filesystem::remove_all(folder);
  HubOptions options;
  options.recorder = {folder, 2000, 0};
  Bench bench(options);
  bench.hub.submit(R"({"command":"record","value":1})");
  const auto messages = bench.step(1);
  EXPECT_THAT(bench.last_status(messages)["log"].dump(), HasSubstr("size limit reached"));
  std::filesystem::remove_all(folder);
}

TEST(MonitorHub, SeamOfALoopedRunDownIsNoRunUp) {
  // 30 to 2 turns per second in 8 s, played three times.
  Recording r;
  r.dt = 1e-3;
  const Eigen::VectorXd t = Eigen::VectorXd::LinSpaced(8001, 0, 8);
  r.add("beta", Quantity::angle, 2 * std::numbers::pi * (30 * t.array() - 1.75 * t.array().square()));
  r.add("x", Quantity::displacement, 1e-3 * r["beta"].array().cos());
  double now = 0;
  Hub hub(std::make_unique<PlaybackSource>(r, 1, true, [&now] { return now; }), {});
  auto client = std::make_shared<ClientQueue>(100000);
  hub.add(client);
  std::vector<std::string> log;
  for (int i = 0; i < 560; ++i) {
    now += 0.04;
    hub.step();
    while (MessagePtr m = client->pop()) {
      if (!m->text) continue;
      const json status = json::parse(m->data);
      if (status["type"] != "status") continue;
      for (const auto& line : status["log"]) log.push_back(line.get<std::string>());
    }
  }
  const auto count = [&](std::string_view words) {
    return std::ranges::count_if(log, [&](const std::string& line) { return line.find(words) != std::string::npos; });
  };
  EXPECT_EQ(count("run-up"), 0);
  EXPECT_EQ(count("run-down begins"), 3);
  EXPECT_GE(count("run-down from"), 2);
}

TEST(MonitorHub, LimitIsLoggedOnceWhenCrossed) {
  HubOptions options;
  options.limits = {{"x", 0.9e-3}, {"y", 2e-3}};
  Bench bench(options);
  std::vector<std::string> log;
  for (int i = 0; i < 20; ++i) {
    const json status = bench.last_status(bench.step(0.1));
    if (status.is_object()) {
      for (const auto& line : status["log"]) log.push_back(line.get<std::string>());
    }
  }
  ASSERT_EQ(log.size(), 1U);
  EXPECT_THAT(log[0], HasSubstr("x above its limit of 0.900 mm peak since 0.000 s"));
  options.limits = {{"absent", 1}};
  EXPECT_THROW(Bench{options}, Error);
}

TEST(MonitorHub, LimitEndsAfterASecondBelow) {
  SampleRing ring(1, 1 << 14);
  HubOptions options;
  options.limits = {{"u", 5}};
  Hub hub(std::make_unique<RingSource>(StreamInfo{"loop", 1000, {{"u", Quantity::force}}}, ring), options);
  auto client = std::make_shared<ClientQueue>(100);
  hub.add(client);
  for (std::uint64_t k = 0; k < 4000; ++k) {
    const double u = k >= 1000 && k < 2000 ? 7 * std::sin(0.1 * static_cast<double>(k)) : 1;
    ring.push(k, &u);
  }
  hub.step();
  hub.step();
  std::string log;
  while (MessagePtr m = client->pop()) {
    if (m->text && json::parse(m->data)["type"] == "status") log += json::parse(m->data)["log"].dump();
  }
  EXPECT_THAT(log, HasSubstr("u above its limit of 5.00 N peak since 1."));
  EXPECT_THAT(log, HasSubstr("largest 7.00 N peak"));
}

TEST(MonitorLoopRealtime, ViewAtThirtyFramesCostsTheLoopNoSample) {
  SampleRing ring(8, 1 << 14);
  StreamInfo info{"loop", 10'000, {}};
  for (int c = 0; c < 8; ++c) info.channels.push_back({"x" + std::to_string(c), Quantity::displacement});
  HubOptions options;
  options.frame_rate = 30;
  Hub hub(std::make_unique<RingSource>(info, ring), options);
  auto reader = std::make_shared<ClientQueue>(10'000), blocked = std::make_shared<ClientQueue>(4);
  hub.add(reader);
  hub.add(blocked);
  hub.start();
  const auto start = std::chrono::steady_clock::now();
  std::uint64_t tick = 0;
  while (tick < 10'000) {  // one second, as many rows as are due
    const double due = 10'000 * std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    for (; static_cast<double>(tick) < due && tick < 10'000; ++tick) {
      const double row[8] = {static_cast<double>(tick)};
      ring.push(tick, row);
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  hub.stop();
  EXPECT_EQ(ring.dropped(), 0U);
  Index samples = 0;
  while (MessagePtr m = reader->pop()) {
    if (m->text) continue;
    const FrameHeader h = decode_frame(m->data);
    if (h.kind == FrameKind::samples) samples += h.n;
    if (h.kind == FrameKind::decimated) samples += Index{h.n} << h.log2_group;
  }
  EXPECT_GE(samples, 10'000);
  EXPECT_EQ(reader->dropped(), 0U);
  EXPECT_GT(blocked->dropped(), 0U);
}

TEST(MonitorHub, RecordingIsOffWithoutAFolder) {
  Bench bench;
  bench.hub.submit(R"({"command":"record","value":1})");
  EXPECT_THAT(bench.last_status(bench.step(0.1))["log"].dump(), HasSubstr("recording is off"));
}

}  // namespace
}  // namespace whirl::monitor
