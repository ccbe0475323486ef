// The page in a real browser against a loop that really runs.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/read.hpp>
#include <boost/asio/write.hpp>
#include <cmath>
#include <regex>

#include "../cli/loop/served.hpp"
#include "browser.hpp"
#include "live_program.hpp"
#include "whirl/io/csv.hpp"

namespace whirl::testing {
namespace {

using nlohmann::json;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;
using ::testing::StrEq;

const std::filesystem::path kPictures = std::filesystem::path(binary_dir()) / "screenshots";

struct MonitorPageE2e : ::testing::Test {
  void SetUp() override {
    if (Browser::program().empty()) GTEST_SKIP() << "no Chromium here";
    io::save(folder / "controller.json", pd_design());
    // A shaft that turns at 900 rpm for a long time.
    folder.write("steady.toml",
                 "[profile]\nstart_rpm = 900\nend_rpm = 900\nramp_s = 60\ndwell_end_s = 0\nripple_percent = 0\n");
  }
  static std::string run(const std::string& more = "") {
    return "run controller.json --rig steady.toml --added-mass-g 1 --monitor --port 0 --repeat --record-folder "
           "records " +
           more;
  }
  void await_live(Browser& browser, const std::string& state) {
    ASSERT_TRUE(browser.wait("document.getElementById('state').textContent.includes('" + state + "')"))
        << browser.text("state") << " " << ::testing::PrintToString(browser.complaints());
  }
  bool logged(Browser& browser, const std::string& text) {
    return browser.wait("document.getElementById('log').textContent.includes('" + text + "')");
  }
  /// Trips; not one cycle after the command may still control.
  void trip_by_key(Browser& browser) {
    browser.key("t");
    await_live(browser, "tripped: requested");
    ASSERT_TRUE(logged(browser, "safe output from the cycle on that began"));
    std::smatch found;
    const std::string log = browser.text("log");
    ASSERT_TRUE(std::regex_search(
        log, found, std::regex("began ([0-9.]+) ms after the command, ([0-9]+) controlled cycles between")))
        << log;
    EXPECT_EQ(found[2], "0") << log;
    RecordProperty("trip_ms", found[1]);
  }
  Folder folder;
};

// The run without control is drawn behind the one with it: the limit is that of the latter.
TEST_F(MonitorPageE2e, ALimitIsNotComparedWithTheRunBehind) {
  std::string text = "t_s,x_mm,y_mm,x_open_mm,y_open_mm,beta_rad\n";
  for (int i = 0; i < 4000; ++i) {
    const double t = 1e-3 * i, angle = 94 * t;
    text += fmt::format("{:.3f},{:.6f},{:.6f},{:.6f},{:.6f},{:.4f}\n", t, 0.1 * std::cos(angle), 0.1 * std::sin(angle),
                        5 * std::cos(angle), 5 * std::sin(angle), angle);
  }
  folder.write("loop.csv", text);
  const LiveProgram live(folder, "monitor loop.csv --loop --port 0 --limit x_mm=1");
  Browser browser(folder / "", 420, 900);
  browser.open(live.url());
  await_live(browser, "live");
  browser.evaluate(
      "{window.drawn = []; const p = CanvasRenderingContext2D.prototype, f = p.fillText;"
      "p.fillText = function (text, ...at) { window.drawn.push([String(text), this.measureText(text).width]); "
      "return f.call(this, text, ...at); }}");
  ASSERT_TRUE(browser.wait("window.drawn.some(([t]) => t.includes('peak in view'))"));
  EXPECT_FALSE(browser.evaluate("window.drawn.some(([t]) => t.includes('above limit'))").get<bool>());
  EXPECT_TRUE(
      browser.evaluate("window.drawn.some(([t]) => /(^|; )100 µm peak in view|0\\.1(00)? mm peak in view/.test(t))"))
      << browser.evaluate("JSON.stringify(window.drawn.filter(([t]) => t.includes('peak')).slice(0, 3))");
  EXPECT_TRUE(browser.evaluate("window.drawn.every(([t, w]) => !t.includes('peak in view') || w < 344)").get<bool>());
}

TEST_F(MonitorPageE2e, ShowsARunningLoopWithNothingFromOutside) {
  const LiveProgram live(folder, run("--limit x_mm=0.001"));
  ASSERT_THAT(live.url(), StartsWith("http://127.0.0.1:"));
  Browser browser(folder / "");
  browser.open(live.url());
  await_live(browser, "live, armed");

  const std::string picture = "document.getElementById('time').toDataURL()";
  const std::string first = browser.evaluate(picture);
  EXPECT_TRUE(browser.wait(picture + " !== '" + first + "'")) << "the traces stand still";
  // 15 turns per second; the lines of the spectrum are a hertz apart; Bode reads 0.158 mm.
  ASSERT_TRUE(
      browser.wait("/x: 0\\.1(5[5-9]|6[01])[0-9]* mm peak at 1(4\\.[89]|5\\.[012])[0-9] "
                   "Hz/.test(document.getElementById('spectrum-peak').textContent)"))
      << browser.text("spectrum-peak");
  EXPECT_TRUE(browser.wait("Math.abs(parseFloat(document.getElementById('speed').textContent) - 900) < 5"))
      << browser.text("speed");
  EXPECT_TRUE(logged(browser, "x above its limit of 1.00 µm peak"));
  EXPECT_TRUE(browser.wait("/^[1-9][0-9]* frames\\/s/.test(document.getElementById('rate').textContent)"))
      << browser.text("rate");
  EXPECT_TRUE(browser.wait("document.getElementById('alarm').textContent.includes('x above limit')"));

  // Overall vibration is first: 0.158 mm of 1X at 900 rpm against a limit of 1 um.
  EXPECT_EQ(browser.evaluate("document.querySelector('main > section h2').firstChild.textContent.trim()"), "Overall");
  const std::string level = "document.querySelector('#levels li')";
  EXPECT_TRUE(browser.wait("/^0\\.1[567][0-9]* mm$/.test(" + level + ".children[1].textContent)"))
      << browser.evaluate(level + ".textContent");
  EXPECT_TRUE(browser.wait(level + ".className === 'over'"));
  browser.evaluate(
      "{const s = document.getElementById('level-kind'); s.value = 'p-p'; s.dispatchEvent(new Event('change'))}");
  EXPECT_TRUE(browser.wait("/^0\\.3[0-4][0-9]* mm$/.test(" + level + ".children[1].textContent)"))
      << browser.evaluate(level + ".textContent");
  // The vector of the steady speed taken off leaves nothing of it.
  browser.click("#slow-roll");
  EXPECT_TRUE(browser.wait("/1X [0-9.]+ µm/.test(" + level + ".children[3].textContent)"))
      << browser.evaluate(level + ".textContent");
  EXPECT_THAT(browser.text("slow-roll-state"), HasSubstr("of 16 turns at 900 rpm"));

  for (const std::string& address : browser.requests()) {
    EXPECT_THAT(address, AnyOf(StartsWith(live.page()), StartsWith("ws://" + live.host() + "/"), StartsWith("data:")));
  }
  EXPECT_GT(browser.requests().size(), 10u);
  ASSERT_TRUE(browser.wait("document.getElementById('waterfall-state').textContent.includes('single blocks')"));
  browser.screenshot(kPictures / "loop-light.png");
  browser.dark(true);
  ASSERT_TRUE(browser.wait("getComputedStyle(document.body).backgroundColor === 'rgb(13, 17, 23)'"));
  const std::string light = browser.evaluate(picture);
  EXPECT_TRUE(browser.wait(picture + " !== '" + light + "'"));
  browser.screenshot(kPictures / "loop-dark.png");
  browser.resize(820, 1180, true);
  EXPECT_TRUE(browser.wait("document.documentElement.scrollWidth <= innerWidth")) << "wider than a tablet";
  browser.screenshot(kPictures / "loop-tablet.png");
  browser.resize(390, 844, true);
  EXPECT_TRUE(browser.wait("document.documentElement.scrollWidth <= innerWidth")) << "wider than a phone";
  EXPECT_TRUE(browser.wait("document.getElementById('levels').getBoundingClientRect().top < innerHeight"))
      << "a phone shows the levels only after scrolling";
  browser.screenshot(kPictures / "loop-phone.png");
  EXPECT_THAT(browser.complaints(), IsEmpty());
}

TEST_F(MonitorPageE2e, RecordsWhatWhirlInfoOpens) {
  const LiveProgram live(folder, run());
  Browser browser(folder / "");
  browser.open(live.url());
  await_live(browser, "live, armed");
  browser.click("#record");
  ASSERT_TRUE(browser.wait("document.getElementById('record').getAttribute('aria-pressed') === 'true'"));
  browser.key("m");
  ASSERT_TRUE(browser.wait("document.activeElement.id === 'marker'"));
  for (const char c : std::string("test t")) browser.key(std::string(1, c));  // a letter in a text is no trip
  browser.click("#marker-controls button");
  EXPECT_TRUE(logged(browser, "marker: test t"));
  browser.key("r");
  ASSERT_TRUE(browser.wait("document.getElementById('record').getAttribute('aria-pressed') === 'false'"));
  EXPECT_TRUE(logged(browser, "record stopped by the user"));
  EXPECT_THAT(browser.text("state"), HasSubstr("armed"));

  const Outcome info = folder.whirl("info records/run_001/record.csv --json");
  EXPECT_EQ(info.exit_code, 0) << info.err;
  const json tables = json::parse(info.out)["tables"];
  EXPECT_NEAR(tables[0]["step"].get<double>(), 1e-3, 1e-9);
  EXPECT_GT(tables[0]["rows"].get<double>(), 10);
  EXPECT_THAT(slurp(folder / "records/run_001/events.csv"), HasSubstr("marker: test t"));
  EXPECT_EQ(folder.whirl("plot records/run_001/record.csv --what traces --out traces.svg").exit_code, 0);
}

TEST_F(MonitorPageE2e, OneKeyTripsAndOnlyByHandItGoesOn) {
  const LiveProgram live(folder, run());
  Browser browser(folder / "");
  browser.open(live.url());
  await_live(browser, "live, armed");
  trip_by_key(browser);
  EXPECT_TRUE(logged(browser, "command: trip"));
  browser.screenshot(kPictures / "tripped.png");

  browser.key("a");
  EXPECT_TRUE(logged(browser, "refused: arm: a trip is latched"));
  EXPECT_THAT(browser.text("state"), HasSubstr("tripped"));
  browser.click("[data-command=clear]");
  await_live(browser, "disarmed");
  browser.click("[data-command=arm]");
  await_live(browser, "live, armed");
  browser.key("d");
  await_live(browser, "disarmed");
  // Beyond the actuator: refused, and said so.
  browser.evaluate("document.getElementById('force-limit').value = 1e6");
  browser.click("#force-set");
  EXPECT_TRUE(logged(browser, "refused: force_limit"));
  browser.evaluate("document.getElementById('force-limit').value = 5");
  browser.click("#force-set");
  EXPECT_TRUE(logged(browser, "force_limit 5"));
}

TEST_F(MonitorPageE2e, ATripFromThePageReachesTheWires) {
  // In lockstep the rig runs up to 25 times as fast as a clock: it must not be at its end before the page is open.
  folder.write("rig.toml",
               "[profile]\nstart_rpm = 900\nend_rpm = 900\nramp_s = 1500\ndwell_end_s = 0\nripple_percent = 0\n");
  const Served rig(folder, "--lockstep --rig rig.toml --added-mass-g 1 --log wires.csv");
  rig.be_patient();
  // A busy machine starts a browser slowly, and lets the loop run, which has the priority.
  Browser browser(folder / "");
  LiveProgram live(folder, "run controller.json --io io.toml --monitor --port 0");
  browser.open(live.url());
  await_live(browser, "live, armed");
  trip_by_key(browser);
  EXPECT_TRUE(browser.wait("parseFloat(document.getElementById('clock').textContent) > " +
                           std::to_string(std::stod(browser.text("clock")) + 1)));
  live.stop();
  rig.end();

  // What came out of the converter: forces up to the trip, then none to the end.
  const Recording wires = io::read_csv(folder / "wires.csv");
  const Eigen::ArrayXd force = wires["ux"].array().abs() + wires["uy"].array().abs();
  Eigen::Index last = force.size() - 1;
  while (last >= 0 && force(last) == 0) --last;
  EXPECT_GT(force.head(last + 1).maxCoeff(), 0.1);
  EXPECT_GT((force.head(last + 1) > 0).count(), 0.9 * static_cast<double>(last)) << "no force while armed";
  EXPECT_GT(force.size() - last, 500);
}

/// Bytes of a connection until its end, or until the server says with a closing frame that it ends it: 1002, protocol
/// error, or 1009, too big.
std::string until_closed(boost::asio::ip::tcp::socket& socket) {
  std::string all, part(65536, '\0');
  boost::system::error_code failed;
  while (!failed && !all.ends_with("\x88\x02\x03\xea") && !all.ends_with("\x88\x02\x03\xf1")) {
    all.append(part, 0, socket.read_some(boost::asio::buffer(part), failed));
  }
  return all;
}

TEST_F(MonitorPageE2e, WrongTokensForeignPagesAndBrokenFramesDoNoHarm) {
  LiveProgram live(folder, run());
  Browser browser(folder / "");
  browser.open(live.page() + "#token=0123456789abcdef0123456789abcdef");
  await_live(browser, "live, armed");
  browser.key("t");
  EXPECT_TRUE(logged(browser, "refused: this needs the token"));
  EXPECT_TRUE(logged(browser, "refused: a command without the right token"));
  EXPECT_THAT(browser.text("state"), HasSubstr("armed"));
  browser.open("about:blank");
  browser.open(live.page());
  await_live(browser, "live, armed");
  EXPECT_EQ(browser.evaluate("document.getElementById('controls').hidden"), true) << "commands without a token";

  const std::string socket_of = "new Promise((done) => { const s = new WebSocket('ws://" + live.host() +
                                "/stream'); s.onopen = () => done('open'); s.onerror = () => done('refused'); })";
  browser.open("data:text/html,foreign");
  ASSERT_TRUE(browser.wait("location.protocol === 'data:'"));
  EXPECT_EQ(browser.evaluate(socket_of), "refused");

  // A reserved opcode, a frame without mask, a frame of a petabyte, ten kilobytes, and bytes that are no WebSocket at
  // all.
  using boost::asio::ip::tcp;
  boost::asio::io_context context;
  const std::uint16_t port = static_cast<std::uint16_t>(std::stoi(live.host().substr(live.host().find(':') + 1)));
  const std::string huge("\x82\xff\x00\x03\x8d\x7e\xa4\xc6\x80\x00\x01\x02\x03\x04", 14);
  const std::string large = std::string("\x81\xfe\x27\x10\x01\x02\x03\x04", 8) + std::string(10'000, 'x');
  for (const std::string& bytes :
       {std::string("\x83\x80\x01\x02\x03\x04"), std::string("\x81\x02hi"), huge, large, std::string(64, '\xff')}) {
    tcp::socket socket(context);
    socket.connect({boost::asio::ip::make_address("127.0.0.1"), port});
    const std::string shake = "GET /stream HTTP/1.1\r\nHost: " + live.host() +
                              "\r\nUpgrade: websocket\r\nConnection: Upgrade\r\nSec-WebSocket-Version: 13\r\n"
                              "Sec-WebSocket-Key: dGhlIHNhbXBsZSBub25jZQ==\r\n\r\n";
    boost::system::error_code ignored;
    boost::asio::write(socket, boost::asio::buffer(shake), ignored);
    std::string answer(4096, '\0');
    answer.resize(socket.read_some(boost::asio::buffer(answer), ignored));
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 101"));
    boost::asio::write(socket, boost::asio::buffer(bytes), ignored);
    const std::string rest = until_closed(socket);
    const std::string end = rest.substr(rest.size() < 4 ? 0 : rest.size() - 4);
    EXPECT_THAT(end, AnyOf(StrEq("\x88\x02\x03\xea"), StrEq("\x88\x02\x03\xf1")))
        << "after " << bytes.size() << " bytes";
  }
  {
    tcp::socket socket(context);
    socket.connect({boost::asio::ip::make_address("127.0.0.1"), port});
    boost::system::error_code ignored;
    boost::asio::write(socket, boost::asio::buffer(std::string(20'000, '\xff')), ignored);
    until_closed(socket);
  }
  // The loop did not notice.
  browser.open(live.page());
  await_live(browser, "live, armed");
  EXPECT_THAT(browser.text("status"), HasSubstr("samples lost to the view0"));
  EXPECT_EQ(live.stop(), 0);
}

TEST_F(MonitorPageE2e, ALostPageLeavesTheLoopAlone) {
  const LiveProgram live(folder, run());
  {
    Browser lost(folder / "lost");
    lost.open(live.url());
    await_live(lost, "live, armed");
  }  // killed
  Browser browser(folder / "");
  browser.open(live.url());
  await_live(browser, "live, armed");
  const double time = browser.evaluate("parseFloat(document.getElementById('clock').textContent)");
  EXPECT_TRUE(browser.wait("parseFloat(document.getElementById('clock').textContent) > " + std::to_string(time + 0.5)));
}

TEST_F(MonitorPageE2e, PlaysARunUpWithBodeAndPolar) {
  // A run-up through a resonance, simulated without control.
  folder.write("up.toml", "[profile]\nstart_rpm = 300\nend_rpm = 1200\nramp_s = 8\ndwell_end_s = 2\n");
  ASSERT_EQ(folder.whirl("run controller.json --rig up.toml --log up.csv").exit_code, 0);
  const LiveProgram live(folder, "monitor up.csv --port 0 --speed 4 --reference up.csv");
  Browser browser(folder / "");
  browser.open(live.url());
  EXPECT_TRUE(logged(browser, "run-up from"));
  EXPECT_TRUE(logged(browser, "rpm/s), largest 1X x"));
  browser.screenshot(kPictures / "run-up.png");
  // What a viewer chose to see is there the next time.
  browser.evaluate(
      "(() => { const set = (id, v) => { const f = document.getElementById(id); f.value = v; f.dispatchEvent(new "
      "Event('change')); }; set('phase-kind', 'lead'); set('window', '30');"
      " [...document.querySelectorAll('#panels label')].find((l) => l.textContent.trim() === 'Waterfall')"
      ".querySelector('input').click(); })()");
  const auto chosen = [&] {
    return browser.evaluate(
        "document.getElementById('phase-kind').value + ' ' + document.getElementById('window').value + ' ' + "
        "document.getElementById('waterfall').checkVisibility()");
  };
  EXPECT_EQ(chosen(), "lead 30 false");
  browser.open("about:blank");
  browser.open(live.url());
  EXPECT_TRUE(logged(browser, "run-up from"));
  EXPECT_EQ(chosen(), "lead 30 false");
  browser.key("End");
  browser.click("[data-command=play]");
  EXPECT_TRUE(logged(browser, "command: play"));
  browser.evaluate(
      "(() => { const s = document.getElementById('play-speed'); s.value = '0.5'; s.dispatchEvent(new "
      "Event('change')); })()");
  EXPECT_TRUE(logged(browser, "speed 0.5"));
  browser.key("h");
  EXPECT_EQ(browser.evaluate("document.getElementById('follow').getAttribute('aria-pressed')"), "false");
  EXPECT_THAT(browser.complaints(), IsEmpty());
}

TEST(MonitorCommandE2e, BadInputIsRefusedWithAReason) {
  const Folder folder;
  folder.write("x.csv", "t_s,x_mm\n0,0\n0.001,1\n0.002,0\n");
  for (const auto& [arguments, reason] :
       {std::pair{"absent.csv", "absent.csv"}, std::pair{"x.csv --limit x=1", "--limit"},
        std::pair{"x.csv --limit q_mm=1", "a channel of the stream: x"},
        std::pair{"x.csv --record-folder x.csv", "x.csv: is a file; give the name of a folder"},
        std::pair{"x.csv --speed 1e9", "speed"}, std::pair{"x.csv --address nowhere", "nowhere"}}) {
    const Outcome o = folder.whirl(std::string("monitor --port 0 ") + arguments);
    EXPECT_EQ(o.exit_code, 2) << arguments;
    EXPECT_THAT(o.err, HasSubstr(reason));
  }
}

}  // namespace
}  // namespace whirl::testing
