// Modal fits where reality leaves the model: frequencies that differ between FRFs, mass loading by a roving sensor,
// modes above the band, noise common to all responses, hysteretic damping, kinds whose size spans decades.
#include <fmt/format.h>

#include <cstdlib>
#include <cstring>
#include <ctime>

#include "../libs/modal/test/synthetic.hpp"
#include "whirl/modal/fit_modes.hpp"
#include "whirl/modal/frf.hpp"
#include "whirl/testing/drifting_blows.hpp"
#include "whirl/testing/modal/drawn_structure.hpp"
#include "whirl/testing/modal/windowed_random.hpp"
#include "whirl/testing/nonlinear_blows.hpp"
#include "whirl/testing/roving.hpp"

namespace {

int g_offset = 0;  // third argument: other seeds

void print(const char* name, const whirl::testing::ModeScore& s, const whirl::ModalModel& model, std::size_t truth,
           double seconds) {
  fmt::print("| {:<36} | {:2d}/{:<2d} | {:2d} | {:2d} ({}) | {:3.0f} {:3.0f} | {:7.5f} {:6.3f} | {:5.2f} |", name,
             s.frequency, truth, s.both, s.extra, s.sharp_extra, 100.0 * s.covered_frequency / std::max(1, s.frequency),
             100.0 * s.covered_damping / std::max(1, s.frequency), 100 * s.median_frequency_error,
             100 * s.median_damping_error, seconds);
  fmt::print(" {:.4f} % ({:.2f} %)\n", 100 * model.frequency_scatter, 100 * model.damping_scatter);
}

std::vector<std::complex<double>> poles_of(const std::vector<double>& f, const std::vector<double>& zeta) {
  std::vector<std::complex<double>> poles;
  for (std::size_t i = 0; i < f.size(); ++i) {
    poles.push_back(2 * std::numbers::pi * f[i] * std::complex<double>(-zeta[i], std::sqrt(1 - zeta[i] * zeta[i])));
  }
  return poles;
}

/// All sets of one case. `expected`: modes within 0.1 % by the standard deviations that the fits state.
struct Total {
  int sets = 0, modes = 0, found = 0, extra = 0, sharp = 0, frequency = 0, damping = 0;
  double expected = 0, seconds = 0, slowest = 0;

  void add(const whirl::testing::ModeScore& s, const whirl::ModalModel& model, std::size_t truth, double time) {
    ++sets;
    modes += static_cast<int>(truth);
    found += s.frequency;
    extra += s.extra;
    sharp += s.sharp_extra;
    frequency += s.covered_frequency;
    damping += s.covered_damping;
    for (const whirl::Mode& mode : model.modes) {
      if (mode.frequency.value < model.band_low || mode.frequency.value > model.band_high) continue;
      expected += std::erf(1e-3 * mode.frequency.value / (std::numbers::sqrt2 * mode.frequency.sd));
    }
    seconds += time;
    slowest = std::max(slowest, time);
  }
  void print(const char* name) const {
    if (sets == 0) return;
    fmt::print(
        "| {:<36} | all {} sets: {} of {} found ({:.1f} expected from the sd), {} false ({} sharp), intervals hold f "
        "{:.1f} %, zeta {:.1f} %, {:.2f} s, slowest {:.2f} s\n",
        name, sets, found, modes, expected, extra, sharp, 100.0 * frequency / std::max(1, found),
        100.0 * damping / std::max(1, found), seconds / sets, slowest);
  }
};

whirl::ModalModel timed(const char* name, const whirl::FrequencyResponse& frf,
                        const std::vector<std::complex<double>>& truth, Total& total) {
  const std::clock_t start = std::clock();
  const whirl::ModalModel model = whirl::modal::fit_modes(frf);
  const double seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  const whirl::testing::ModeScore score = whirl::testing::score(truth, model);
  print(name, score, model, truth.size(), seconds);
  total.add(score, model, truth.size(), seconds);
  return model;
}

void roving(const char* name, whirl::testing::RovingOptions o, int seeds) {
  Total total;
  for (int seed = 1; seed <= seeds; ++seed) {
    o.seed = static_cast<unsigned>(100 + seed + g_offset);
    const auto data = whirl::testing::make_roving(o);
    timed(name, data.frf, poles_of(data.frequency, data.damping), total);
  }
  total.print(name);
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 2;
  const char* only = argc > 2 ? argv[2] : "";
  g_offset = argc > 3 ? std::atoi(argv[3]) : 0;
  const auto wanted = [&](const char* name) { return std::strstr(name, only) != nullptr; };
  fmt::print("| case | found | both | false (sharp) | cover f, zeta | error f %, zeta % | s | scatter f (zeta) |\n");
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  for (const auto& [name, scatter] :
       {std::pair{"scatter 0.01 %", 1e-4}, {"scatter 0.03 %", 3e-4}, {"scatter 0.1 %", 1e-3}}) {
    if (wanted(name)) roving(name, {.frequency_scatter = scatter}, seeds);
  }
  if (wanted("scatter both"))
    roving("scatter both 0.03 %, damping 5 %", {.frequency_scatter = 3e-4, .damping_scatter = 0.05}, seeds);
  if (wanted("none")) roving("none", {}, seeds);
  for (int above : {6, 12, 20}) {
    const std::string name = fmt::format("{} modes above the band", above);
    if (wanted(name.c_str())) roving(name.c_str(), {.noise = 0.01, .modes_above = above}, seeds);
  }
  if (wanted("common")) roving("common force noise 2 %", {.noise = 0.002, .common_noise = 0.02}, seeds);
  if (wanted("hysteretic")) roving("hysteretic", {.hysteretic = true}, seeds);
  for (const bool structural : {false, true}) {
    const std::string name = fmt::format("drawn, {}", structural ? "structural" : "viscous");
    int taken = 0, told = 0;
    Total total;
    for (int seed = 1; seed <= seeds && wanted(name.c_str()); ++seed) {
      const auto data = whirl::testing::draw_structure(structural, static_cast<unsigned>(100 + seed + g_offset));
      const whirl::ModalModel model = timed(name.c_str(), data.frf, poles_of(data.frequency, data.damping), total);
      taken += model.damping_model == whirl::DampingModel::hysteretic;
      told += model.summary.trust.find("taken as viscous") != std::string::npos;
    }
    total.print(name.c_str());
    if (total.sets > 0) fmt::print("| taken as structural {}, said to look structural {} of {}\n", taken, told, seeds);
  }
  for (const double doublet : {0.0, 1.0, 2.0}) {
    for (const bool hann : {false, true}) {
      const std::string name = fmt::format("random force, {}{}", hann ? "Hann window" : "whole periods",
                                           doublet > 0 ? fmt::format(", pairs {:g} lines apart", doublet) : "");
      int taken = 0;
      Total total;
      for (int seed = 1; seed <= seeds && wanted(name.c_str()); ++seed) {
        const auto data = whirl::testing::make_random_test(
            {.doublet = doublet, .hann = hann, .seed = static_cast<unsigned>(seed + g_offset)});
        const whirl::ModalModel model = timed(name.c_str(), data.frf, poles_of(data.frequency, data.damping), total);
        taken += model.window_decay != data.frf.window_decay;
      }
      total.print(name.c_str());
      if (total.sets > 0) fmt::print("| a Hann window taken off in {} of {}\n", taken, seeds);
    }
  }
  Total drift;
  for (int seed = 1; seed <= seeds && wanted("drift"); ++seed) {
    whirl::testing::DriftOptions o;
    o.structure.seed = static_cast<unsigned>(700 + seed + g_offset);
    const auto data = whirl::testing::make_drifting(o);
    timed("drift between blows", data.frf, poles_of(data.frequency, data.damping), drift);
  }
  drift.print("drift between blows");
  for (const double mass : {0.0005, 0.001, 0.002, 0.005, 0.01}) {
    const std::string name = fmt::format("beam, sensor of {:g} % of its mass", 100 * mass);
    Total total;
    for (int seed = 1; seed <= seeds && wanted(name.c_str()); ++seed) {
      const auto beam = whirl::testing::make_beam({.mass = mass, .seed = static_cast<unsigned>(seed + g_offset)});
      timed(name.c_str(), beam.frf, poles_of(beam.frequency, beam.damping), total);
    }
    total.print(name.c_str());
  }
  for (const double hardening : {0.0, 5e-4, 1e-3, 3e-3}) {
    const std::string name = fmt::format("blows, nonlinear {:g} %", 100 * hardening);
    Total total;
    for (int seed = 1; seed <= seeds && wanted(name.c_str()); ++seed) {
      const auto data = whirl::testing::make_nonlinear_blows(
          {.hardening = hardening, .seed = static_cast<unsigned>(2000 + seed + g_offset)});
      timed(name.c_str(), whirl::modal::estimate_frf(data.blows), data.poles, total);
    }
    total.print(name.c_str());
  }
  for (const auto kind : {whirl::FrfKind::mobility, whirl::FrfKind::receptance}) {
    for (const bool proportional : {false, true}) {
      const std::string name = fmt::format("35 modes, {} 5 %, {}", to_string(kind), proportional ? "prop." : "add.");
      Total total;
      for (int seed = 1; seed <= seeds && wanted(name.c_str()); ++seed) {
        whirl::testing::SyntheticOptions o;
        o.kind = kind;
        o.noise = 0.05;
        o.proportional = proportional;
        o.seed = static_cast<unsigned>(seed + g_offset);
        const auto data = whirl::testing::make_synthetic(o);
        timed(name.c_str(), data.frf, data.poles, total);
      }
      total.print(name.c_str());
    }
  }
}
