#pragma once
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <vector>

namespace whirl::testing {

/// A bearing housing of a machine at one speed, as an accelerometer (g), a velocity sensor (mm/s) and a displacement
/// probe with a gap (um) read it. All from one list of tones, whose velocity is stated in mm/s rms.
struct Housing {
  double rate = 5120, seconds = 8;
  double rpm = 1480;
  int teeth = 0, missing = 0;  ///< of the tacho; 0: none
  double drift = 20;           ///< mm/s rms of velocity at 1.25 Hz that the accelerometer reads and nothing moves
  double gap_um = 1763;        ///< of the probe
  std::uint64_t seed = 1;
  double noise_g = 1e-3;  ///< rms

  struct Tone {
    double hertz, mm_s, phase;
  };
  std::vector<Tone> tones;  ///< the first is 1X

  explicit Housing(std::uint64_t number, double speed_rpm = 1480) : rpm(speed_rpm), seed(number) {
    std::mt19937_64 draw(seed);
    std::uniform_real_distribution<double> unit(0, 1);
    const double one = rpm / 60, circle = 2 * std::numbers::pi;
    tones.push_back({one, 0.5 + 3 * unit(draw), circle * unit(draw)});
    tones.push_back({2 * one, 0.2 + unit(draw), circle * unit(draw)});
    tones.push_back({100, 0.1 + 0.5 * unit(draw), circle * unit(draw)});
    tones.push_back({300 + 400 * unit(draw), 0.1 + 0.8 * unit(draw), circle * unit(draw)});
  }

  /// mm/s rms of the tones from 10 Hz to 1 kHz.
  double velocity_rms() const {
    double sum = 0;
    for (const Tone& t : tones) sum += t.hertz >= 10 && t.hertz <= 1000 ? t.mm_s * t.mm_s : 0;
    return std::sqrt(sum);
  }
  /// 1X of the accelerometer, m/s^2 peak.
  double one_x_acceleration() const {
    return 2 * std::numbers::pi * tones.front().hertz * 1e-3 * std::numbers::sqrt2 * tones.front().mm_s;
  }
  /// 1X of the probe, um peak.
  double one_x_displacement() const {
    return 1e3 * std::numbers::sqrt2 * tones.front().mm_s / (2 * std::numbers::pi * tones.front().hertz);
  }

  /// Which sensors the table holds.
  struct Sensors {
    bool accelerometer = true, velocity = true, probe = true;
  };
  std::string csv(const Sensors& with) const {
    std::mt19937_64 draw(seed + 1000);
    std::normal_distribution<double> normal;
    const double circle = 2 * std::numbers::pi;
    std::string text = "t_s";
    if (with.accelerometer) text += ",DE_acc_g";
    if (with.velocity) text += ",NDE_vel_mm_s";
    if (with.probe) text += ",probe_um";
    if (teeth > 0) text += ",tacho_V";
    text += '\n';
    char cell[40];
    const auto add = [&](double value) {
      std::snprintf(cell, sizeof cell, ",%.9g", value);
      text += cell;
    };
    for (int i = 0; i < static_cast<int>(rate * seconds); ++i) {
      const double t = i / rate, slow = circle * 1.25;
      double a = slow * drift * 1e-3 * std::numbers::sqrt2 * std::cos(slow * t), v = 0, x = gap_um;
      for (const Tone& tone : tones) {
        const double w = circle * tone.hertz, peak = std::numbers::sqrt2 * tone.mm_s, at = w * t + tone.phase;
        v += peak * std::cos(at);
        a -= 1e-3 * peak * w * std::sin(at);
        x += 1e3 * peak / w * std::sin(at);
      }
      std::snprintf(cell, sizeof cell, "%.9f", t);
      text += cell;
      if (with.accelerometer) add(1 + a / 9.80665 + noise_g * normal(draw));  // 1 g: it stands upright
      if (with.velocity) add(v);
      if (with.probe) add(x);
      if (teeth > 0) {
        const double place = std::fmod(rpm / 60 * t * teeth, teeth);
        const bool tooth = place < teeth - missing && place - std::floor(place) < 0.4;
        add(tooth ? 5 : 0);
      }
      text += '\n';
    }
    return text;
  }
};

}  // namespace whirl::testing
