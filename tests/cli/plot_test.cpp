#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <fstream>
#include <map>

#include "program.hpp"
#include "whirl/core/angles.hpp"
#include "whirl/testing/data.hpp"

namespace whirl::testing {
namespace {

using ::testing::HasSubstr;
using Complex = std::complex<double>;

/// Columns of a figure's CSV by header; empty cells at the end of shorter columns are left out.
std::vector<std::pair<std::string, std::vector<double>>> columns_of(const std::filesystem::path& file) {
  const auto cells = [](const std::string& line) {
    std::vector<std::string> out(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"') {
        quoted = !quoted;
      } else if (c == ',' && !quoted) {
        out.emplace_back();
      } else {
        out.back() += c;
      }
    }
    return out;
  };
  std::ifstream in(file);
  std::string line;
  std::getline(in, line);
  std::vector<std::pair<std::string, std::vector<double>>> out;
  for (const std::string& header : cells(line)) out.push_back({header, {}});
  while (std::getline(in, line)) {
    const auto row = cells(line);
    for (std::size_t c = 0; c < row.size(); ++c) {
      if (!row[c].empty()) out[c].second.push_back(std::stod(row[c]));
    }
  }
  return out;
}

/// The n-th column whose header holds all of `parts`.
std::vector<double> column(const std::filesystem::path& file, const std::string& part, std::size_t n = 0) {
  for (const auto& [header, values] : columns_of(file)) {
    if (header.find(part) != std::string::npos && n-- == 0) return values;
  }
  ADD_FAILURE() << "no column with '" << part << "' in " << slurp(file).substr(0, 300);
  return {};
}

/// A run-up from `low` to `high` Hz at 2 kHz with known vectors of x and y in mm: x = Re(X(f) e^{j theta} + X2 e^{2 j
/// theta}).
template <class X, class Y>
std::string sweep(double low, double high, double seconds, X&& x_vector, Y&& y_vector, Complex second = 0) {
  std::string text = "t_s,x_mm,y_mm,beta_rad\n";
  const double rate = (high - low) / seconds;
  for (int i = 0; i < static_cast<int>(2000 * seconds); ++i) {
    const double t = i / 2000.0, f = low + rate * t, theta = 0.3 + kTwoPi * (low * t + rate * t * t / 2);
    const Complex turn = std::polar(1.0, theta);
    char line[160];
    std::snprintf(line, sizeof line, "%.4f,%.12g,%.12g,%.12g\n", t, (x_vector(f) * turn + second * turn * turn).real(),
                  (y_vector(f) * turn).real(), theta);
    text += line;
  }
  return text;
}

Complex resonance(double f) { return 0.02 * f * f / Complex(25 * 25 - f * f, 2 * 0.05 * 25 * f); }

TEST(PlotReference, BodeAndOrderTracksOfASweptResonanceAreWithinOnePercentAndOneDegree) {
  const Folder folder;
  folder.write("run.csv", sweep(
                              10, 40, 8, resonance, [](double f) { return resonance(f) * Complex(0, -0.5); },
                              Complex(0.01, 0.02)));
  ASSERT_EQ(folder.whirl("plot run.csv --what bode --phase lead --out bode.csv").exit_code, 0);
  const auto speed = column(folder / "bode.csv", "x: rotor speed"),
             amplitude = column(folder / "bode.csv", "x: 1X amplitude, peak [mm]");
  const auto phase = column(folder / "bode.csv", "phase lead [");
  ASSERT_GT(amplitude.size(), 150U);
  for (std::size_t i = 1; i + 1 < amplitude.size(); ++i) {
    const Complex exact = resonance(speed[i] / 60);
    EXPECT_NEAR(amplitude[i] / std::abs(exact), 1, 0.01) << speed[i] << " rpm";
    EXPECT_LT(std::abs(std::remainder(phase[i] - std::arg(exact) * 360 / kTwoPi, 360)), 1) << speed[i] << " rpm";
  }
  ASSERT_EQ(folder.whirl("plot run.csv --what orders --orders 1,2 --phase lead --out orders.csv").exit_code, 0);
  const auto time = column(folder / "orders.csv", "1X: time");
  const auto first = column(folder / "orders.csv", "1X: displacement, peak [mm]"),
             second = column(folder / "orders.csv", "2X: displacement, peak [mm]");
  const auto lead = column(folder / "orders.csv", "phase lead [");
  ASSERT_GT(time.size(), 10000U);
  for (std::size_t i = 1000; i + 1000 < time.size(); ++i) {
    const Complex exact = resonance(10 + 30 * time[i] / 8);
    ASSERT_NEAR(first[i] / std::abs(exact), 1, 0.01) << time[i];
    ASSERT_LT(std::abs(std::remainder(lead[i] - std::arg(exact) * 360 / kTwoPi, 360)), 1) << time[i];
    ASSERT_NEAR(second[i] / std::abs(Complex(0.01, 0.02)), 1, 0.02) << time[i];
  }
}

TEST(PlotReference, FullSpectrumSeparatesForwardAndBackwardWhirl) {
  const Folder folder;
  // x + i y = 0.3 e^{j theta} + 0.1 e^{-j theta} mm.
  folder.write("run.csv", sweep(
                              20, 20, 4, [](double) { return Complex(0.4); }, [](double) { return Complex(0, -0.2); }));
  ASSERT_EQ(folder.whirl("plot run.csv --what full-spectrum --out full.csv").exit_code, 0);
  const auto f = column(folder / "full.csv", "frequency"), a = column(folder / "full.csv", "peak [");
  const double unit = slurp(folder / "full.csv").find("peak [µm]") != std::string::npos ? 1e-3 : 1;
  ASSERT_EQ(f.size(), a.size());
  for (std::size_t i = 0; i < f.size(); ++i) {
    if (std::abs(f[i] - 20) < 1e-6) {
      EXPECT_NEAR(unit * a[i], 0.3, 0.003);
    }
    if (std::abs(f[i] + 20) < 1e-6) {
      EXPECT_NEAR(unit * a[i], 0.1, 0.001);
    }
    if (std::abs(std::abs(f[i]) - 20) > 2) {
      EXPECT_LT(unit * a[i], 1e-4);
    }
  }
}

TEST(PlotReference, WaterfallShowsFirstAndSecondOrderOfASweepAtTheirAmplitude) {
  const Folder folder;
  folder.write("run.csv",
               sweep(
                   15, 40, 20, [](double) { return Complex(0.2); }, [](double) { return Complex(0, -0.2); }, 0.05));
  for (const char* what : {"waterfall", "full-waterfall"}) {
    const bool full = std::string(what) == "full-waterfall";
    ASSERT_EQ(folder.whirl(std::string("plot run.csv --what ") + what + " --out map.csv").exit_code, 0);
    // One row a time; the columns of the map are named by their frequency.
    const auto all = columns_of(folder / "map.csv");
    const auto time = column(folder / "map.csv", "time [s]");
    std::string header;
    std::map<double, std::array<double, 3>> peaks;  // per time: 1X, 2X, -1X
    for (const auto& [name, db] : all) {
      const std::size_t at = name.rfind(" at ");
      if (at == std::string::npos || name.find(" Hz", at) == std::string::npos) continue;
      header = name;
      const double f = std::stod(name.substr(at + 4));
      ASSERT_EQ(time.size(), db.size());
      for (std::size_t i = 0; i < time.size(); ++i) {
        const double speed = 15 + 25 * time[i] / 20;
        auto& [one, two, back] = peaks.try_emplace(time[i], std::array<double, 3>{}).first->second;
        const double value = std::pow(10, db[i] / 20);
        if (std::abs(f - speed) < 5) one = std::max(one, value);
        if (std::abs(f - 2 * speed) < 5) two = std::max(two, value);
        if (std::abs(f + speed) < 5) back = std::max(back, value);
      }
    }
    ASSERT_GT(peaks.size(), 100U);
    for (const auto& [t, p] : peaks) {
      EXPECT_NEAR(p[0], 1, 0.01) << what << " " << t;
      // In x + i y half of the second order, which is in x alone, goes forward.
      EXPECT_NEAR(p[1], full ? 0.125 : 0.25, full ? 0.00125 : 0.0025) << what << " " << t;
      if (full) {
        EXPECT_LT(p[2], 0.01) << t;
      }
    }
    EXPECT_NE(header.find("0.200 mm peak"), std::string::npos) << header;
  }
}

TEST(PlotReference, MeasuredRunUpHasOnePassageAndNoBeatIsOne) {
  const auto data = data_file("rk4_runup/runup_bode_1037_2110rpm.csv");
  WHIRL_REQUIRE_DATA(data);
  const Folder folder;
  const Outcome bode = folder.whirl("plot '" + data.string() + "' --what bode --out bode.csv --out bode.svg");
  ASSERT_EQ(bode.exit_code, 0) << bode.err;
  // The maxima at 1770, 1837, ... 2071 rpm are beats of its free vibration.
  const auto passages = column(folder / "bode.csv", "passage of a critical speed");
  ASSERT_EQ(std::ranges::count_if(passages, [](double m) { return std::isfinite(m); }), 1);
  EXPECT_NEAR(passages.front(), 1665, 4);
  EXPECT_EQ(folder.whirl("plot '" + data.string() + "' --what polar --out polar.svg").exit_code, 0);
}

TEST(PlotE2e, OneAmplitudeInOrbitBodePolarAndOrders) {
  const Folder folder;
  for (const char* way : {"", " --run-up"}) {
    ASSERT_EQ(
        folder.whirl("rig record --added-mass-g 5 --snr-db 30 --force --out run.csv" + std::string(way)).exit_code, 0);
    const auto largest = [&](const std::string& what, const std::string& name) {
      EXPECT_EQ(folder.whirl("plot run.csv --force --what " + what + " --out figure.csv").exit_code, 0) << what;
      double top = 0;
      for (const double v : column(folder / "figure.csv", name)) top = std::max(top, v);
      return top;
    };
    const double bode = largest("bode", "x: 1X amplitude");
    EXPECT_NEAR(largest("polar", "1X amplitude, peak [mm]") / bode, 1, 1e-6) << way;
    EXPECT_NEAR(largest("orders", "1X: displacement, peak") / bode, 1, 0.03) << way;
    // The ellipse of the turn with the largest radius over both probes.
    EXPECT_NEAR(largest("orbit", "1X: x [mm]") / bode, 1, 0.04) << way;
    // The rotor has no second order: its free vibration of 3 mm crosses 2X and is not shown as such.
    EXPECT_LT(largest("orders", "2X: displacement, peak") / bode, 0.04) << way;
    std::size_t passages = 0;
    largest("bode", "x: 1X amplitude");
    for (const double rpm : column(folder / "figure.csv", "passage of a critical speed")) passages += rpm > 0;
    EXPECT_EQ(passages, 1U) << way;
  }
}

// Whoever signs a figure must see which run it shows, which way the shaft turned and where the probes stood.
TEST(PlotE2e, EveryFigureNamesItsRunItsDirectionAndTheMachine) {
  const Folder folder;
  const auto half = [](double) { return Complex(0.1); };
  const auto circle = [](double) { return Complex(0, -0.1); };
  folder.write("up.csv", sweep(10, 30, 6, half, circle));
  folder.write("down.csv", sweep(30, 12, 6, half, circle));
  folder.write("same.csv", sweep(20, 20, 6, half, circle));
  const auto drawn = [&](const std::string& files, const std::string& what, const std::string& more = "") {
    EXPECT_EQ(folder.whirl("plot " + files + " --force --what " + what + " --out figure.svg " + more).exit_code, 0)
        << what;
    return slurp(folder / "figure.svg");
  };
  for (const char* what : {"traces", "orbit", "centreline", "spectrum", "full-spectrum", "waterfall", "full-waterfall",
                           "cascade", "run-map", "bode", "polar", "nyquist", "orders", "phase-plane", "funnel"}) {
    EXPECT_THAT(drawn("up.csv", what), HasSubstr("up.csv, 0 to 6 s: run-up 600 to 1800 rpm</text>")) << what;
    EXPECT_THAT(drawn("down.csv", what), HasSubstr("down.csv, 0 to 6 s: run-down 1800 to 720 rpm</text>")) << what;
    const std::string svg = drawn("same.csv", what);
    EXPECT_THAT(svg, HasSubstr("same.csv, 0 to 6 s: steady at 1200 rpm</text>")) << what;
    const bool plane = std::string(what) == "orbit" || std::string(what) == "centreline" ||
                       std::string(what) == "polar" || std::string(what) == "nyquist";
    EXPECT_EQ(svg.find(">rotation</text>") != std::string::npos, plane) << what;
    EXPECT_EQ(svg.find("probe</text>") != std::string::npos, plane) << what;
  }
  // Overlays name each run, a part names its times, a log its two loops.
  const std::string both = drawn("up.csv down.csv", "bode");
  EXPECT_THAT(both, HasSubstr(">up.csv, 0 to 6 s: run-up"));
  EXPECT_THAT(both, HasSubstr(">down.csv, 0 to 6 s: run-down"));
  EXPECT_THAT(drawn("up.csv", "bode", "--from 1.5 --to 3"), HasSubstr("up.csv, 1.5 to 3 s: run-up 900 to 1200 rpm"));
  // Up through the range and down again; and a record without a rotor angle.
  std::string there_and_back = "t_s,x_mm,y_mm,beta_rad\n";
  for (int i = 0; i < 12000; ++i) {
    const double t = i / 2000.0, theta = kTwoPi * (10 * t + 20 * (t / 2 - 3 / kTwoPi * std::sin(kTwoPi * t / 6)));
    there_and_back += std::to_string(t) + "," + std::to_string(std::cos(theta)) + "," +
                      std::to_string(std::sin(theta)) + "," + std::to_string(theta) + "\n";
  }
  folder.write("loop.csv", there_and_back);
  EXPECT_THAT(drawn("loop.csv", "bode"), HasSubstr("run-up 600 to 1798 rpm, then run-down to 600 rpm"));
  folder.write(
      "still.csv", "t_s,x_mm,y_mm\n" + [] {
        std::string rows;
        for (int i = 0; i < 100; ++i) rows += std::to_string(i * 1e-3) + "," + std::to_string(i % 7) + ",1\n";
        return rows;
      }());
  const std::string still = drawn("still.csv", "orbit");
  EXPECT_THAT(still, HasSubstr("rotor angle not recorded"));
  EXPECT_EQ(still.find(">rotation</text>"), std::string::npos);
}

TEST(PlotE2e, EveryViewOfARecordIsDrawnToFileAndTerminal) {
  const Folder folder;
  folder.write("run.csv", sweep(10, 40, 3, resonance, [](double f) { return resonance(f) * Complex(0, -0.5); }));
  for (const char* what : {"traces", "orbit", "spectrum", "full-spectrum", "waterfall", "full-waterfall", "cascade",
                           "run-map", "bode", "polar", "nyquist", "centreline", "orders", "phase-plane", "funnel"}) {
    const Outcome svg = folder.whirl(std::string("plot run.csv --what ") + what + " --out figure.svg");
    EXPECT_EQ(svg.exit_code, 0) << what << svg.err;
    EXPECT_NE(slurp(folder / "figure.svg").find("</svg>"), std::string::npos) << what;
    const Outcome terminal = folder.whirl(std::string("plot run.csv --what ") + what);
    EXPECT_EQ(terminal.exit_code, 0) << what << terminal.err;
    EXPECT_GT(terminal.out.size(), 40U) << what;
  }
  if (std::system("command -v rsvg-convert >/dev/null") == 0) {
    EXPECT_EQ(folder.whirl("plot run.csv --what waterfall --out figure.png").exit_code, 0);
    EXPECT_EQ(slurp(folder / "figure.png").substr(1, 3), "PNG");
  }
}

TEST(PlotE2e, WhatCannotBeDrawnIsSaid) {
  const Folder folder;
  folder.write("no_angle.csv",
               "t_s,x_mm\n0,1\n0.001,2\n0.002,1\n0.003,2\n0.004,1\n0.005,2\n0.006,1\n0.007,2\n0.008,1\n0.009,2\n"
               "0.010,1\n0.011,2\n0.012,1\n0.013,2\n0.014,1\n0.015,2\n0.016,1\n0.017,2\n");
  const std::pair<const char*, const char*> calls[] = {
      {"plot no_angle.csv --what bode", "no rotor angle"},
      {"plot no_angle.csv --what wterfall", "did you mean 'waterfall'"},
      {"plot no_angle.csv --what orbit", "y"},
      {"plot no_angle.csv --out figure.gif", ".svg"},
      {"plot no_angle.csv --out missing/figure.svg", "missing"},
      {"plot no_angle.csv --from 3 --to 4", "between 3 and 4 s"},
      {"plot absent.csv", "absent.csv"},
  };
  for (const auto& [arguments, message] : calls) {
    const Outcome outcome = folder.whirl(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << arguments;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << arguments << "\n" << outcome.err;
  }
}

/// The CSV of every figure is a table that whirl reads; that of a plane holds the vectors over speed.
TEST(PlotE2e, TheCsvOfEveryFigureIsReadAgain) {
  const Folder folder;
  folder.write("run.csv", sweep(10, 40, 4, resonance, [](double f) { return resonance(f) * Complex(0, -0.5); }));
  for (const char* what : {"traces", "spectrum", "full-spectrum", "bode", "polar", "nyquist", "orders", "centreline",
                           "orbit", "run-map", "waterfall", "full-waterfall", "funnel"}) {
    const std::string file = std::string(what) + ".csv";
    ASSERT_EQ(folder.whirl("plot run.csv --what " + std::string(what) + " --out " + file).exit_code, 0) << what;
    const Outcome info = folder.whirl("info " + file);
    EXPECT_EQ(info.exit_code, 0) << what << ": " << info.err;
  }
  const auto vectors = column(folder / "bode.csv", "x: 1X amplitude");
  for (const char* plane : {"polar", "nyquist"}) {
    EXPECT_EQ(column(folder / (std::string(plane) + ".csv"), "x: 1X amplitude"), vectors);
    const Outcome modes = folder.whirl("transient " + std::string(plane) + ".csv --modes 1 --steady");
    EXPECT_EQ(modes.exit_code, 0) << modes.err;
    EXPECT_EQ(folder.whirl("plot " + std::string(plane) + ".csv --what bode --out again.svg --force").exit_code, 0);
  }
  // One row per time: the level of a frequency over time is a channel, and 1X beside it.
  const auto speed = column(folder / "waterfall.csv", "1X: frequency");
  EXPECT_GT(speed.size(), 50u);
  const Outcome levels = folder.whirl("info waterfall.csv");
  EXPECT_NE(levels.out.find(" Hz"), std::string::npos) << levels.out;
  // Samples of a run stand beside one column of time: a record again.
  EXPECT_EQ(folder.whirl("plot traces.csv --what spectrum --out again.svg --force").exit_code, 0);
}

// A table of 1X amplitudes is peak, peak-to-peak or rms: what its header does not state is said to be taken.
TEST(PlotE2e, AnAmplitudeOfNoStatedKindIsTakenAsPeakWithAWarning) {
  const Folder folder;
  for (const auto& [name, warned] : {std::pair{"amp_um", true}, {"amp_pp_um", false}, {"amp_peak_um", false}}) {
    folder.write("bode.csv", std::string("rpm,") + name + ",phase_deg\n600,10,5\n900,20,40\n1200,50,90\n1500,20,140\n");
    const Outcome outcome = folder.whirl("plot bode.csv --what bode --out b.svg --force");
    EXPECT_EQ(outcome.exit_code, 0) << name << outcome.err;
    EXPECT_EQ(outcome.err.find("states no kind of amplitude") != std::string::npos, warned) << name << outcome.err;
  }
}

}  // namespace
}  // namespace whirl::testing
