// Reports in a real browser: on paper, under a pointer, on a desktop and on a phone.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../cli/made_files.hpp"
#include "browser.hpp"

namespace whirl::testing {
namespace {

using nlohmann::json;
using ::testing::AnyOf;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

const std::filesystem::path kReportPictures = std::filesystem::path(binary_dir()) / "screenshots";

// The study's report has the widest tables and the longest equations.
TEST(ReportPageE2e, NothingIsCutOffOnPaper) {
  if (Browser::program().empty()) GTEST_SKIP() << "no Chromium here";
  const Folder folder;
  const std::filesystem::path report = made_study() / "study/report.html";
  Browser browser(folder / "");
  browser.open("file://" + report.string());
  ASSERT_TRUE(browser.wait("document.readyState === 'complete' && document.querySelectorAll('figure').length > 20"));
  browser.on_paper(688);  // A4 less its margins
  EXPECT_EQ(browser.evaluate("innerWidth"), 688);
  // The reader's machine decides which font there is: wider letters must fit too.
  for (const std::string spacing : {"0", "0.4px"}) {
    browser.evaluate("document.body.style.letterSpacing = '" + spacing + "'");
    EXPECT_EQ(browser.evaluate("[...document.querySelectorAll('table, :not(svg) > svg, math, dd, p')].filter((e) => "
                               "e.getBoundingClientRect().right > innerWidth + 1)"
                               ".map((e) => e.textContent.slice(0, 80))"),
              json::array())
        << spacing;
  }
  EXPECT_THAT(browser.complaints(), IsEmpty());
}

// Values under the pointer, cursors on all panels of one axis, a zoom by dragging, series on and off; without a server.
TEST(ReportPageE2e, ValuesZoomAndCursorsFollowThePointer) {
  if (Browser::program().empty()) GTEST_SKIP() << "no Chromium here";
  const Folder folder;
  ASSERT_EQ(folder.whirl("rig record --added-mass-g 5 --out down.csv").exit_code, 0);
  ASSERT_EQ(folder.whirl("report down.csv --out report.html").exit_code, 0);
  Browser browser(folder / "", 1400, 1000);
  browser.open("file://" + (folder / "report.html").string());
  ASSERT_TRUE(browser.wait("document.documentElement.classList.contains('live')"));
  // The Bode plot: its amplitude panel, the phase panel under it.
  browser.evaluate(
      "window.bode = [...document.querySelectorAll('svg.wf')].find((s) => s.querySelector('title').textContent === "
      "'Bode plot of the 1X vector'); bode.scrollIntoView({block: 'center'}); window.area = (i) => "
      "bode.querySelectorAll('svg[data-p]')[i]; window.read = (i) => "
      "[...bode.querySelectorAll('g.rd')[i].querySelectorAll('text')].map((t) => t.textContent); true");
  ASSERT_EQ(browser.evaluate("bode.querySelectorAll('svg[data-p]').length"), 2);
  const auto point = [&](double across, double down, const std::string& type) {
    browser.evaluate("(() => { const r = area(0).getBoundingClientRect(); area(0).dispatchEvent(new PointerEvent('" +
                     type + "', {clientX: r.x + " + std::to_string(across) + " * r.width, clientY: r.y + " +
                     std::to_string(down) +
                     " * r.height, pointerId: 1, button: 0, bubbles: true})); return true; })()");
  };
  browser.evaluate("Element.prototype.setPointerCapture = () => {}");  // of a hand-made pointer
  point(0.5, 0.5, "pointermove");
  ASSERT_TRUE(browser.wait("read(0).length > 1"));
  const std::string speed = browser.evaluate("read(0)[0]");
  EXPECT_THAT(speed, HasSubstr("rpm"));
  EXPECT_EQ(browser.evaluate("read(1)[0]"), speed) << "the cursor of the phase is not at the same speed";
  EXPECT_THAT(browser.evaluate("read(0)[1]").get<std::string>(), HasSubstr("mm"));
  EXPECT_THAT(browser.evaluate("read(1)[1]").get<std::string>(), HasSubstr("°"));
  EXPECT_EQ(browser.evaluate("[...bode.querySelectorAll('path.cur')].every((c) => c.getAttribute('d') !== '')"), true);

  // What is dragged over fills the panel, and the panel under it goes with it.
  const std::string views = "[0, 1].map((i) => area(i).getAttribute('viewBox').split(' ').map(Number)[2])";
  const json before = browser.evaluate(views);
  point(0.25, 0.5, "pointerdown");
  point(0.5, 0.5, "pointermove");
  point(0.5, 0.5, "pointerup");
  const json after = browser.evaluate(views);
  for (int i = 0; i < 2; ++i) EXPECT_NEAR(after[i].get<double>() / before[i].get<double>(), 0.25, 0.01) << i;
  // In the middle of what is shown now lies what was at 3/8.
  browser.evaluate("area(0).dispatchEvent(new Event('dblclick'))");
  EXPECT_EQ(browser.evaluate(views), before);

  // A series is put out and back by its entry of the legend.
  const std::string shown =
      "[...area(0).querySelectorAll(':scope > g.sr')].filter((g) => g.style.display !== 'none').length";
  const int all = browser.evaluate(shown);
  browser.evaluate("bode.querySelector('g.lg').dispatchEvent(new Event('click'))");
  EXPECT_EQ(browser.evaluate(shown), all - 1);
  browser.evaluate("bode.querySelector('g.lg').dispatchEvent(new Event('click'))");
  EXPECT_EQ(browser.evaluate(shown), all);
  EXPECT_THAT(browser.complaints(), IsEmpty());
  for (const std::string& address : browser.requests())
    EXPECT_THAT(address, AnyOf(StartsWith("file://"), StartsWith("data:")));
}

/// report.html of a run-down and the model found in it.
void report_with_model(const Folder& folder) {
  copy_model(folder, "model.json");
  ASSERT_EQ(folder.whirl("report down.csv model.json --out report.html").exit_code, 0);
}

// In the dark every letter and every line stands out from the page (contrast as WCAG 2.1 defines it: text 4.5,
// lines 2.2, the least of Okabe and Ito's colours on white), and paper stays white.
TEST(ReportPageE2e, DarkIsReadableAndPaperStaysWhite) {
  if (Browser::program().empty()) GTEST_SKIP() << "no Chromium here";
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(report_with_model(folder));
  Browser browser(folder / "", 1440, 900);
  browser.open("file://" + (folder / "report.html").string());
  ASSERT_TRUE(browser.wait("document.readyState === 'complete'"));
  browser.evaluate(R"js(
    window.light = (c) => { const v = c.match(/[\d.]+/g).slice(0, 3).map((x) => x / 255)
      .map((x) => x <= 0.03928 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4);
      return 0.2126 * v[0] + 0.7152 * v[1] + 0.0722 * v[2]; };
    window.page = () => light([document.body, document.documentElement].map((e) => getComputedStyle(e).backgroundColor)
      .find((c) => c.startsWith('rgb(')) || 'rgb(255, 255, 255)');
    window.faint = (elements, property, least) => [...document.querySelectorAll(elements)].filter((e) => {
      const c = getComputedStyle(e)[property]; if (!c.startsWith('rgb(') || !e.getClientRects().length) return false;
      const a = light(c), b = page(); return (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05) < least; })
      .map((e) => e.tagName + ' ' + e.getAttribute('class') + ' ' + getComputedStyle(e)[property] + ' ' + e.textContent.slice(0, 40));
    true)js");
  EXPECT_GT(browser.evaluate("document.querySelectorAll('svg.wf path[class^=s]').length").get<int>(), 10);
  for (const bool dark : {false, true}) {
    browser.dark(dark);
    EXPECT_EQ(browser.evaluate("page() < 0.05"), dark);
    EXPECT_EQ(browser.evaluate("faint('h1, h2, h3, p, td, th, dd, li, a, figcaption', 'color', 4.5)"), json::array());
    EXPECT_EQ(browser.evaluate("faint('svg.wf text', 'fill', 4.5)"), json::array());
    EXPECT_EQ(browser.evaluate("faint('svg.wf path[class^=s]', 'stroke', 2.2)"), json::array()) << dark;
  }
  browser.screenshot(kReportPictures / "report-dark.png");
  browser.evaluate("document.querySelector('p').style.color = '#30363d'");  // what is faint is found
  EXPECT_NE(browser.evaluate("faint('p', 'color', 4.5)"), json::array());
  browser.on_paper(688);
  EXPECT_GT(browser.evaluate("page()").get<double>(), 0.95);
  EXPECT_THAT(browser.complaints(), IsEmpty());
}

// No hidden column on a desktop, no letters below 9 px on a phone.
TEST(ReportPageE2e, FitsDesktopAndPhone) {
  if (Browser::program().empty()) GTEST_SKIP() << "no Chromium here";
  const Folder folder;
  ASSERT_NO_FATAL_FAILURE(report_with_model(folder));
  Browser browser(folder / "", 1440, 900);
  browser.open("file://" + (folder / "report.html").string());
  ASSERT_TRUE(browser.wait("document.readyState === 'complete'"));
  EXPECT_EQ(browser.evaluate("[...document.querySelectorAll('table')].filter((t) => t.getBoundingClientRect().right > "
                             "innerWidth || t.scrollWidth > t.parentElement.clientWidth + 1).length"),
            0);
  browser.screenshot(kReportPictures / "report-desktop.png");
  browser.resize(390, 844, true);
  const std::string small =
      "(() => { let least = 99; for (const e of document.querySelectorAll('p, td, th, dd, li, figcaption, svg.wf "
      "text')) "
      "{ if (!e.textContent.trim() || !e.getClientRects().length) continue; const m = e.getScreenCTM ? "
      "Math.hypot(e.getScreenCTM().a, e.getScreenCTM().b) : 1; least = Math.min(least, m * "
      "parseFloat(getComputedStyle(e).fontSize)); } return least; "
      "})()";
  EXPECT_GE(browser.evaluate(small).get<double>(), 9) << "px";
  browser.screenshot(kReportPictures / "report-phone.png");
}

}  // namespace
}  // namespace whirl::testing
