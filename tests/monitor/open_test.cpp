// Recordings that are dropped on the page: played, compared, refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "../cli/loop/served.hpp"
#include "browser.hpp"
#include "live_program.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::testing {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

const std::filesystem::path kOpenPictures = std::filesystem::path(binary_dir()) / "screenshots";
constexpr double kLater = 1.75;  ///< s that the clock of the second record is ahead

struct MonitorOpenE2e : ::testing::Test {
  void SetUp() override {
    if (Browser::program().empty()) GTEST_SKIP() << "no Chromium here";
    folder.write("up.toml", "[profile]\nstart_rpm = 300\nend_rpm = 1200\nramp_s = 8\ndwell_end_s = 2\n");
    ASSERT_EQ(folder.whirl("rig record --rig up.toml --added-mass-g 5 --out first.csv").exit_code, 0);
    ASSERT_EQ(folder.whirl("rig record --rig up.toml --added-mass-g 8 --out all.csv").exit_code, 0);
    // The second record begins 1.5 s later in the run, and its clock is ahead.
    Recording second = io::read_csv(folder / "all.csv");
    const Eigen::Index cut = 1500;
    for (Channel& c : second.channels) c.samples = Eigen::VectorXd(c.samples.tail(c.samples.size() - cut));
    second.t0 += 1.5 + kLater;
    io::write_csv(folder / "second.csv", second);
  }
  /// Drops a file as a hand with a mouse would, on the element `selector`.
  void drop(Browser& browser, const std::string& file, const std::string& selector) {
    browser.evaluate("(() => { const d = new DataTransfer(); d.items.add(new File([" +
                     nlohmann::json(slurp(folder / file)).dump() + "], " + nlohmann::json(file).dump() +
                     ")); const at = document.querySelector('" + selector +
                     "'); for (const type of ['dragenter', 'dragover', 'drop']) at.dispatchEvent(new DragEvent(type, "
                     "{dataTransfer: d, bubbles: true, cancelable: true})); return true; })()");
  }
  static bool says(Browser& browser, const std::string& id, const std::string& text) {
    return browser.wait("document.getElementById('" + id + "').textContent.includes('" + text + "')");
  }
  Folder folder;
};

TEST_F(MonitorOpenE2e, ASecondRecordIsAlignedAndCompared) {
  const LiveProgram live(folder, "monitor first.csv --port 0 --speed 0.01");
  Browser browser(folder / "");
  browser.open(live.url());
  ASSERT_TRUE(says(browser, "stream", "first.csv"));
  EXPECT_EQ(browser.evaluate("document.getElementById('open').hidden"), false);
  drop(browser, "second.csv", "#runs");
  ASSERT_TRUE(says(browser, "open-state", "opened second.csv")) << browser.text("open-state");
  ASSERT_TRUE(says(browser, "log", "compared with second.csv"));
  browser.evaluate(
      "(() => { const s = document.getElementById('play-speed'); s.value = '5'; s.dispatchEvent(new "
      "Event('change')); })()");
  ASSERT_TRUE(says(browser, "state", "ended")) << browser.text("state");
  // 8 g against 5 g at one angle: the vectors differ, most near the critical speed.
  EXPECT_TRUE(browser.wait(
      "/peak apart, at ([6-9][0-9][0-9]|1[01][0-9][0-9]) rpm/.test(document.getElementById('runs-state').textContent)"))
      << browser.text("runs-state");
  browser.evaluate("document.getElementById('runs').scrollIntoView()");
  browser.screenshot(kOpenPictures / "two-runs-speed.png");

  browser.evaluate(
      "(() => { const s = document.getElementById('runs-over'); s.value = 'time'; s.dispatchEvent(new "
      "Event('change')); })()");
  ASSERT_TRUE(says(browser, "runs-state", "compared run moved by")) << browser.text("runs-state");
  const std::string state = browser.text("runs-state"), moved = "moved by −";
  const std::size_t at = state.find(moved);
  ASSERT_NE(at, std::string::npos) << state;
  EXPECT_NEAR(std::stod(state.substr(at + moved.size())), kLater, 0.03) << state;
  browser.screenshot(kOpenPictures / "two-runs-time.png");
  EXPECT_THAT(browser.complaints(), IsEmpty());
}

TEST_F(MonitorOpenE2e, ADroppedRecordIsPlayedInPlaceOfTheOneShown) {
  Recording probes = io::read_csv(folder / "second.csv");
  probes.add("lateral", Quantity::displacement, probes["x"]);
  probes.t0 = 0;
  probes.channels.erase(probes.channels.begin());
  io::write_csv(folder / "probes.csv", probes);
  LiveProgram live(folder, "monitor first.csv --port 0 --speed 2 --limit x_mm=1 --record-folder records");
  Browser browser(folder / "");
  browser.open(live.url());
  ASSERT_TRUE(says(browser, "stream", "first.csv"));
  browser.click("#record");
  ASSERT_TRUE(browser.wait("document.getElementById('record').getAttribute('aria-pressed') === 'true'"));
  drop(browser, "probes.csv", "#open-played");
  ASSERT_TRUE(says(browser, "stream", "probes.csv"));
  EXPECT_TRUE(says(browser, "log", "opened probes.csv"));
  EXPECT_TRUE(says(browser, "log", "no limit of x: probes.csv has no such channel"));
  EXPECT_TRUE(says(browser, "log", "record stopped: another recording was opened"));
  EXPECT_TRUE(says(browser, "channels", "lateral"));
  ASSERT_TRUE(browser.wait("parseFloat(document.getElementById('clock').textContent) > 1")) << browser.text("clock");
  EXPECT_TRUE(says(browser, "state", "live")) << browser.text("state");
  // And the way back, by the list of files.
  drop(browser, "first.csv", "#open-played");
  ASSERT_TRUE(says(browser, "stream", "first.csv"));
  EXPECT_TRUE(says(browser, "log", "run-up from"));
  EXPECT_THAT(browser.complaints(), IsEmpty());
  EXPECT_EQ(live.stop(), 0);
}

TEST_F(MonitorOpenE2e, WhatCannotBeOpenedIsRefusedWithItsReason) {
  folder.write("broken.csv", "t_s,x_mm,beta_rad\n0,1,0\n0.001,abc,1\n");
  folder.write("still.csv", "t_s,x_mm\n0,1\n0.001,2\n0.002,1\n");
  const std::filesystem::path temporary = folder / "temporary";
  std::filesystem::create_directory(temporary);
  setenv("TMPDIR", temporary.c_str(), 1);
  LiveProgram live(folder, "monitor first.csv --port 0 --speed 0.1");
  unsetenv("TMPDIR");
  Browser browser(folder / "");
  browser.open(live.url());
  ASSERT_TRUE(says(browser, "stream", "first.csv"));
  drop(browser, "broken.csv", "#open-played");
  ASSERT_TRUE(says(browser, "open-state", "broken.csv:3")) << browser.text("open-state");
  EXPECT_TRUE(says(browser, "log", "refused: broken.csv:3"));
  drop(browser, "still.csv", "#open-compared");
  ASSERT_TRUE(says(browser, "open-state", "beta")) << browser.text("open-state");
  EXPECT_THAT(browser.text("open-state"), HasSubstr("still.csv"));
  EXPECT_THAT(browser.text("stream"), HasSubstr("first.csv"));
  EXPECT_TRUE(std::filesystem::is_empty(temporary));
  // Without the token nothing is taken.
  const std::string post =
      "fetch('/open/played', {method: 'POST', headers: {'X-Whirl-Token': '0', 'X-Whirl-Name': "
      "'a.csv'}, body: 't_s,x_mm\\n0,1\\n1,2\\n'}).then((a) => a.text())";
  EXPECT_THAT(browser.evaluate(post).get<std::string>(), HasSubstr("needs the token"));
  browser.open("about:blank");
  browser.open(live.page());
  ASSERT_TRUE(says(browser, "stream", "first.csv"));
  EXPECT_EQ(browser.evaluate("document.getElementById('open').hidden"), true);
  drop(browser, "second.csv", "#runs");
  EXPECT_TRUE(says(browser, "open-state", "only who has the address with the token"));
  EXPECT_EQ(live.stop(), 0);
}

TEST_F(MonitorOpenE2e, ALoopKeepsItsPlaceAndIsComparedWithARecord) {
  io::save(folder / "controller.json", pd_design());
  LiveProgram live(folder, "run controller.json --rig up.toml --added-mass-g 5 --monitor --port 0");
  Browser browser(folder / "");
  browser.open(live.url());
  ASSERT_TRUE(says(browser, "state", "armed"));
  EXPECT_EQ(browser.evaluate("document.getElementById('open-played').hidden"), true);
  drop(browser, "second.csv", "main");
  EXPECT_TRUE(says(browser, "log", "compared with second.csv"));
  const std::string post =
      "fetch('/open/played', {method: 'POST', headers: {'X-Whirl-Token': new "
      "URLSearchParams(location.hash.slice(1)).get('token'), 'X-Whirl-Name': 'a.csv'}, body: "
      "'t_s,x_mm\\n0,1\\n1,2\\n'}).then((a) => a.text())";
  EXPECT_THAT(browser.evaluate(post).get<std::string>(), HasSubstr("a running loop is shown"));
  EXPECT_EQ(live.stop(), 0);
}

// The alignment in itself: two runs of known offset, and those that say nothing.
TEST_F(MonitorOpenE2e, AlignmentFindsOffsetsAndRefusesSteadyRuns) {
  LiveProgram live(folder, "monitor first.csv --port 0");
  Browser browser(folder / "");
  browser.open(live.page());
  const auto shift = [&](const std::string& a, const std::string& b) {
    return browser.evaluate(
        "import('/align.js').then(({alignment}) => { const run = (t0, n, f) => Array.from({length: n}, (_, i) => ({t: "
        "t0 + 0.05 * i, rpm: f(0.05 * i)})); const f = alignment(" +
        a + ", " + b + "); return f && f.shift; })");
  };
  const std::string ramp = "((t) => 300 + 60 * Math.min(10, Math.max(0, t - 3)))";
  EXPECT_NEAR(shift("run(0, 400, " + ramp + ")", "run(7, 400, " + ramp + ")").get<double>(), -7, 0.02);
  EXPECT_NEAR(shift("run(5, 300, " + ramp + ")", "run(2, 200, (t) => " + ramp + "(t + 2.13))").get<double>(), 5.13,
              0.03);
  // A run-down, and a run that turns round.
  EXPECT_NEAR(shift("run(0, 400, (t) => 3000 * Math.exp(-t / 8))", "run(1, 300, (t) => 3000 * Math.exp(-(t + 4) / 8))")
                  .get<double>(),
              3, 0.02);
  EXPECT_NEAR(shift("run(0, 400, (t) => 900 + 300 * Math.sin(t / 3))",
                    "run(0, 300, (t) => 900 + 300 * Math.sin((t + "
                    "2.5) / 3))")
                  .get<double>(),
              2.5, 0.02);
  EXPECT_TRUE(shift("run(0, 400, () => 900)", "run(0, 400, () => 900)").is_null());
  EXPECT_TRUE(shift("run(0, 2, () => 900)", "run(0, 400, " + ramp + ")").is_null());
}

}  // namespace
}  // namespace whirl::testing
