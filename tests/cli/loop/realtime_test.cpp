#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <thread>

#include "served.hpp"
#include "whirl/io/csv.hpp"
#include "whirl/rt/recorder.hpp"

namespace whirl::testing {
namespace {

double at(const io::Json& json, const char* table, const char* key) {
  return io::JsonReader(json, table).at(table).at(key).number();
}
std::string text(const io::Json& json, const char* key) { return io::JsonReader(json, key).at(key).text(); }

struct RealtimeE2e : ::testing::Test {
  Folder folder;
  RealtimeE2e() {
    io::save(folder / "controller.json", pd_design());
    folder.write("rig.toml", kRig);
  }
  // Closed loop through the wires; the summary of `whirl run`, the exit code in `code`.
  io::Json run(const std::string& arguments = "") {
    const Outcome o = folder.whirl("run controller.json --io io.toml --json " + arguments);
    code = o.exit_code;
    error = o.err;
    return io::parse_json(o.out, "run");
  }
  int code = -1;
  std::string error;
};

TEST_F(RealtimeE2e, ThroughPseudoTerminalsAndASecondProcessAsInOneProcess) {
  const Outcome inside = folder.whirl("run controller.json --rig rig.toml --json");
  const double expected = at(io::parse_json(inside.out, "inside"), "whole", "suppression");
  ASSERT_GT(expected, 0.3);
  const Served rig(folder, "--lockstep --rig rig.toml");
  rig.be_patient();
  const io::Json log = run("--record run.h5");
  EXPECT_EQ(code, 0) << error;
  EXPECT_EQ(text(log, "trip"), "none");
  EXPECT_NEAR(at(rig.result(), "whole", "suppression"), expected, 0.05 * expected);

  // The recording gives the same forces again.
  const rt::LoopRecord record = rt::read_loop_record(folder / "run.h5");
  EXPECT_TRUE(record.closed);
  EXPECT_GT(record.cycles.size(), 3000u);
  const Outcome replayed = folder.whirl("replay run.h5 --json --out replay.csv");
  EXPECT_EQ(replayed.exit_code, 0) << replayed.err;
  const io::Json replay = io::parse_json(replayed.out, "replay");
  EXPECT_GT(io::JsonReader(replay, "replay").at("compared").number(), 3000);
  EXPECT_LT(io::JsonReader(replay, "replay").at("force_difference_max").number(), 1e-9);
  // Another estimator has its own parameters.
  ControllerDesign tuned = pd_design();
  tuned.parameters["cutoff"] = 1000;
  io::save(folder / "tuned.json", tuned);
  const Outcome other = folder.whirl("replay run.h5 --controller tuned.json --estimator kalman");
  EXPECT_EQ(other.exit_code, 0) << other.err;
}

struct FaultCase {
  const char* name;
  const char* fault;
  const char* trip;
};

TEST_F(RealtimeE2e, EveryFaultEndsInItsDocumentedState) {
  const FaultCase cases[] = {
      {"lost bytes", "kind = \"lost_bytes\"\nevery = 97\nstart_s = 0.5\nend_s = 2", "none"},
      {"short error", "kind = \"error_code\"\naxis = \"x\"\nstart_s = 1\nend_s = 1.01", "none"},
      {"long error", "kind = \"error_code\"\naxis = \"x\"\nstart_s = 1", "stale_sensor"},
      {"dropout", "kind = \"dropout\"\nstart_s = 1", "stale_sensor"},
      {"delay", "kind = \"delay\"\ndelay_ms = 30\nstart_s = 1", "stale_sensor"},
      {"stuck", "kind = \"stuck\"\naxis = \"y\"\nstart_s = 1", "stale_sensor"},
      {"encoder", "kind = \"encoder_stuck\"\nstart_s = 1", "encoder_stuck"},
      {"board", "kind = \"board_silent\"\nstart_s = 1", "watchdog"},
  };
  for (const FaultCase& c : cases) {
    SCOPED_TRACE(c.name);
    folder.write("faults.toml", std::string("[[fault]]\n") + c.fault + "\n");
    const Served rig(folder, "--lockstep --rig rig.toml --faults faults.toml");
    const io::Json log = run();
    EXPECT_EQ(text(log, "trip"), c.trip) << error;
    EXPECT_EQ(code, std::string(c.trip) == "none" ? 0 : 1);
    const io::Json served = rig.result();
    EXPECT_LE(at(served, "whole", "closed_peak"), at(served, "whole", "open_peak"));
  }
}

TEST_F(RealtimeE2e, KilledControllerLeavesASafeRigAndARecordingThatOpens) {
  // Long enough that the run is still on its way when it is killed, on a machine that does other work too.
  folder.write("rig.toml", "[profile]\nstart_rpm = 1200\nramp_s = 24\ndwell_end_s = 0.2\n");
  const Served rig(folder, "--lockstep --watchdog-ms 10 --rig rig.toml");
  const std::string command =
      "cd '" + (folder / "").string() + "' && { '" + program() +
      "' run controller.json --io io.toml --record killed.h5 >/dev/null 2>&1 & } ; echo $! >run.pid";
  ASSERT_EQ(std::system(command.c_str()), 0);
  rig.wait_for("killed.h5");
  // A recording can be read while it is written.
  const auto rows = [&] { return rt::read_loop_record(folder / "killed.h5").cycles.size(); };
  ASSERT_TRUE(await([&] { return rows() >= 1; }));
  ::kill(std::stoi(slurp(folder / "run.pid")), SIGKILL);
  const io::Json served = rig.result();
  EXPECT_GE(io::JsonReader(served, "served").at("watchdog_expired").number(), 1);
  const rt::LoopRecord record = rt::read_loop_record(folder / "killed.h5");
  // The instant is nobody's choice. Released, the rotor has the open-loop motion and, as free vibration, what it moved
  // and what it did not move: at most the two radii of that instant times speed over natural frequency (674 rpm).
  ASSERT_EQ(folder.whirl("rig record --rig rig.toml --out open.csv --truth truth.csv").exit_code, 0);
  const Recording open = io::read_csv(folder / "truth.csv");
  const auto tick = static_cast<Eigen::Index>(io::JsonReader(served, "served").at("commands").number());
  ASSERT_LT(tick, open.size());
  const Eigen::Index turn = std::min<Eigen::Index>(100, open.size() - tick);
  const double not_moved =
      (open["x"].segment(tick, turn).array().square() + open["y"].segment(tick, turn).array().square())
          .sqrt()
          .maxCoeff();
  double moved = 0;
  for (std::size_t k = record.cycles.size() - std::min<std::size_t>(100, record.cycles.size());
       k < record.cycles.size(); ++k)
    moved = std::max(moved, std::hypot(record.cycles[k].x, record.cycles[k].y));
  EXPECT_LE(at(served, "whole", "closed_peak"), at(served, "whole", "open_peak") + 1200.0 / 674 * (moved + not_moved));
  EXPECT_FALSE(record.closed);
  EXPECT_NE(folder.whirl("info killed.h5").err.find("its writer did not come to its end"), std::string::npos);
}

TEST_F(RealtimeE2e, RecordWithoutControl) {
  const Served rig(folder, "--lockstep --rig rig.toml");
  rig.be_patient();
  const Outcome o = folder.whirl("record --io io.toml --out open.h5");
  EXPECT_EQ(o.exit_code, 0) << o.err;
  const rt::LoopRecord record = rt::read_loop_record(folder / "open.h5");
  EXPECT_GT(record.cycles.size(), 3000u);
  EXPECT_EQ(folder.whirl("replay open.h5 --controller controller.json").exit_code, 0);
}

TEST_F(RealtimeE2e, WrongSettingsAreRefused) {
  folder.write("typo.toml", "[loop]\nrate_hertz = 1000\n");
  Outcome o = folder.whirl("run controller.json --io typo.toml");
  EXPECT_EQ(o.exit_code, 2);
  EXPECT_NE(o.err.find("typo.toml"), std::string::npos) << o.err;
  folder.write("slow.toml", "[loop]\nrate_hz = 500\n[board]\naddress = \"127.0.0.1:9\"\n");
  o = folder.whirl("run controller.json --io slow.toml");
  EXPECT_EQ(o.exit_code, 2);
  EXPECT_NE(o.err.find("1000 Hz"), std::string::npos) << o.err;
  EXPECT_EQ(folder.whirl("replay controller.json").exit_code, 2);
}

}  // namespace
}  // namespace whirl::testing
