#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>

#include "whirl/core/error.hpp"
#include "whirl/monitor/hub.hpp"

namespace whirl::monitor {
namespace {

using Eigen::Index;
using ::testing::HasSubstr;
using ::testing::Not;
using json = nlohmann::json;

/// A loop that is commanded.
class Commanded : public RingSource {
 public:
  Commanded(const StreamInfo& info, SampleRing& ring) : RingSource(info, ring) {}
  bool urgent(const std::string& name) override {
    if (name != "trip") return false;
    ++trips;
    return true;
  }
  bool command(const std::string& name, double value) override {
    if (name != "force_limit") return false;
    require_range("force_limit", value, 0, 40, "N");
    limit = value;
    return true;
  }
  std::vector<Control> controls() const override {
    return {{.name = "trip"},
            {.name = "force_limit", .takes_value = true, .low = 0, .high = 40, .value = 40, .unit = "N"}};
  }
  std::vector<std::string> events() override { return std::exchange(happened, {}); }

  int trips = 0;
  double limit = 40;
  std::vector<std::string> happened;
};

/// A whirl of 10 turns per second at 1 kHz, forward 1 mm and backward 0.25 mm, and its hub, driven by hand.
struct MonitorCommands : ::testing::Test {
  MonitorCommands() {
    auto owned = std::make_unique<Commanded>(info, ring);
    source = owned.get();
    hub.emplace(std::move(owned), HubOptions{});
    hub->add(client);
  }
  void feed(int samples) {
    for (int i = 0; i < samples; ++i, ++tick) {
      const double b = 2 * std::numbers::pi * 10 * static_cast<double>(tick) / 1000;
      const double row[] = {1.25e-3 * std::cos(b), 0.75e-3 * std::sin(b), b, 2e-5};
      ring.push(tick, row);
    }
    hub->step();
  }
  /// Messages since the last call; binary ones of a kind, decoded.
  std::vector<Eigen::MatrixXf> frames(FrameKind kind) {
    std::vector<Eigen::MatrixXf> out;
    while (MessagePtr m = client->pop()) {
      if (m->text) {
        texts.push_back(json::parse(m->data));
        continue;
      }
      Eigen::MatrixXf values;
      if (decode_frame(m->data, &values).kind == kind) out.push_back(values);
    }
    return out;
  }
  std::string log() {
    for (int i = 0; i < 13; ++i) hub->step();
    frames(FrameKind::samples);
    std::string all;
    for (const json& t : texts) {
      if (t["type"] == "status") all += t["log"].dump();
    }
    texts.clear();
    return all;
  }

  StreamInfo info{"loop",
                  1000,
                  {{"x", Quantity::displacement},
                   {"y", Quantity::displacement},
                   {"beta", Quantity::angle},
                   {"latency", Quantity::time}}};
  SampleRing ring{4, 1 << 14};
  Commanded* source = nullptr;
  std::optional<Hub> hub;
  std::shared_ptr<ClientQueue> client = std::make_shared<ClientQueue>(1000);
  std::uint64_t tick = 0;
  std::vector<json> texts;
};

TEST_F(MonitorCommands, TripActsAtOnceAndIsLogged) {
  hub->submit(R"({"command":"trip"})");
  EXPECT_EQ(source->trips, 1) << "before any step of the hub";
  EXPECT_THAT(log(), HasSubstr("command: trip"));
  EXPECT_EQ(source->trips, 1);
}

TEST_F(MonitorCommands, ValuesAreCheckedAndEveryCommandIsLogged) {
  hub->submit(R"({"command":"force_limit","value":12})");
  EXPECT_THAT(log(), HasSubstr("force_limit 12"));
  EXPECT_EQ(source->limit, 12);
  hub->submit(R"({"command":"force_limit","value":41})");
  EXPECT_THAT(log(), HasSubstr("refused: force_limit"));
  EXPECT_EQ(source->limit, 12);
  hub->submit(R"({"command":"limit","channel":"x","value":0.0005})");
  hub->submit(R"({"command":"limit","channel":"absent","value":1})");
  hub->submit(R"({"command":"limit","value":1})");
  hub->submit(R"({"command":"marker","text":"a\nb"})");
  hub->submit(R"({"command":17})");
  const std::string lines = log();
  EXPECT_THAT(lines, HasSubstr("limit of x set to 0.0005"));
  EXPECT_THAT(lines, HasSubstr("refused: limit"));
  EXPECT_THAT(lines, HasSubstr("refused: not a valid command"));
  EXPECT_THAT(lines, HasSubstr("marker: a b"));
}

TEST_F(MonitorCommands, EventsOfTheLoopReachTheLogAndALateClient) {
  source->happened = {"trip at tick 5: watchdog"};
  EXPECT_THAT(log(), HasSubstr("trip at tick 5: watchdog"));
  const auto late = std::make_shared<ClientQueue>(10);
  hub->add(late);
  EXPECT_EQ(json::parse(late->pop()->data)["type"], "stream");
  const json history = json::parse(late->pop()->data);
  EXPECT_EQ(history["type"], "history");
  EXPECT_THAT(history["log"].dump(), HasSubstr("watchdog"));
}

TEST_F(MonitorCommands, DescriptionNamesControlsOrbitAndReference) {
  const json stream = json::parse(hub->description());
  EXPECT_EQ(stream["controls"][1]["name"], "force_limit");
  EXPECT_EQ(stream["controls"][1]["high"], 40.0);
  EXPECT_EQ(stream["orbit"], (json{"x", "y"}));
  EXPECT_FALSE(stream.contains("reference"));
  HubOptions options;
  options.reference =
      Reference{"open.csv", Eigen::VectorXd::Constant(2, 100), {"x"}, Eigen::MatrixXd::Constant(2, 1, 1e-3)};
  const Hub other(std::make_unique<RingSource>(info, ring), options);
  const json described = json::parse(other.description());
  EXPECT_EQ(described["reference"]["amplitude"]["x"][1], 1e-3);
}

TEST_F(MonitorCommands, FullSpectrumSeparatesForwardAndBackwardWhirl) {
  hub->submit(R"({"command":"spectrum","block":1000,"window":"flat top"})");
  feed(2000);
  const auto full = frames(FrameKind::full_spectrum);
  ASSERT_FALSE(full.empty());
  const Eigen::MatrixXf& lines = full.back();
  ASSERT_EQ(lines.rows(), 999);
  EXPECT_NEAR(lines(499 + 10, 0), 1e-3, 1e-6);
  EXPECT_NEAR(lines(499 - 10, 0), 0.25e-3, 1e-6);
  EXPECT_LT(lines(499 + 30, 0), 1e-6);
}

TEST_F(MonitorCommands, WaterfallShowsTheNewestBlockAlone) {
  hub->submit(R"({"command":"spectrum","block":1000,"window":"flat top","averages":8})");
  feed(4000);
  const auto rows = frames(FrameKind::waterfall);
  ASSERT_FALSE(rows.empty());
  EXPECT_EQ(rows.back().rows(), 501);
  EXPECT_NEAR(rows.back()(10, 0), 1.25e-3, 1e-6);
}

TEST_F(MonitorCommands, TimesOfTheLoopAreCounted) {
  feed(3000);
  log();
  hub->submit(R"({"command":"marker","text":"now"})");
  hub->step();
  frames(FrameKind::samples);
  ASSERT_FALSE(texts.empty());
  const json times = texts.back()["times"];
  ASSERT_EQ(times.size(), 1U);
  EXPECT_EQ(times[0]["name"], "latency");
  EXPECT_EQ(times[0]["total"], 3000);
  EXPECT_NEAR(times[0]["p99"].get<double>(), 2e-5, 2e-6);
}

TEST_F(MonitorCommands, BlocksWithoutTheEstimateStillGiveTheSpectrumOfTheOrbit) {
  for (int i = 0; i < 2048; ++i, ++tick) {
    const double b = 2 * std::numbers::pi * 10 * static_cast<double>(tick) / 1000;
    const double row[] = {1e-3 * std::cos(b), 1e-3 * std::sin(b), b, NAN};
    ring.push(tick, row);
  }
  hub->step();
  EXPECT_FALSE(frames(FrameKind::spectrum).empty());
  EXPECT_THAT(texts.back().dump(), HasSubstr("\"blocks_skipped\":0"));
}

}  // namespace
}  // namespace whirl::monitor
