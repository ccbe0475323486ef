// Identification of the virtual rig's default plant (anisotropy, laser latency, runout, free modes, encoder, speed
// ripple) from its records; errors against its truth. Usage: bench_identify_rotor_rig
#include <cmath>
#include <cstdio>
#include <ctime>
#include <numbers>
#include <string>

#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/validate.hpp"
#include "whirl/rig/records.hpp"

namespace {

using namespace whirl;
using Complex = std::complex<double>;

rig::RigParameters plant(double grams, bool profile_angle = false) {
  rig::RigParameters p;
  p.rotor.added_mass = 1e-3 * grams;
  p.encoder.profile_angle = profile_angle;
  return p;
}

/// What a hammer test would give: frequencies 0.3 % off, damping 20 % off.
ModalModel hammer() {
  ModalModel m;
  for (const rig::RigMode& r : rig::RigParameters::default_modes()) {
    Mode mode;
    mode.frequency = Estimate::from_sd(1.003 * r.frequency, 0.002 * r.frequency);
    mode.damping = Estimate::from_sd(1.2 * r.damping_ratio, 0.1 * r.damping_ratio);
    m.modes.push_back(mode);
  }
  return m;
}

void report(const char* name, const std::vector<double>& grams, const identification::RotorIdentifyOptions& options,
            std::optional<double> snr = {}, bool profile_angle = false) {
  std::vector<identification::RotorRecord> records;
  for (std::size_t k = 0; k < grams.size(); ++k) {
    records.push_back(identification::rotor_record(
        rig::record_open_loop(plant(grams[k], profile_angle), {k + 1, {}}, snr).measured, options.record));
  }
  const std::clock_t begin = std::clock();
  const identification::RotorIdentification r = identification::identify_rotor_detailed(records, options);
  const double ms = 1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC;
  std::printf("%s: %s, chi2 %.2f (trajectory %.2f), residual %.2f um, %.0f ms, added:", name,
              std::string(to_string(r.model.summary.status)).c_str(), r.chi_square_weak, r.fit.summary.chi_square,
              1e6 * r.model.summary.residual, ms);
  for (const std::string& a : r.added) std::printf(" [%s]", a.c_str());
  std::printf("\n");
  for (const std::string& w : r.model.summary.warnings) std::printf("    %s\n", w.c_str());
  if (!r.model.rotor) return;
  const RotorModel truth = plant(grams[0]).true_model();
  const RotorModel& m = *r.model.rotor;
  const auto half = [&](const char* p) {
    const Estimate& e = *r.model.parameter(p);
    return 100 * 1.96 * e.sd / std::abs(e.value);
  };
  const double turn = 180 / std::numbers::pi;
  std::printf(
      "    K1 %+.3f (+-%.3f) %%  K2 %+.2f (+-%.2f) %%  C %+.2f (+-%.2f) %%  e %+.2f (+-%.2f) %%  phase %+.2f deg\n",
      100 * (m.k1 / truth.k1 - 1), half("k1"), 100 * (m.k2 / truth.k2 - 1), half("k2"), 100 * (m.c / truth.c - 1),
      half("c"), 100 * (std::abs(m.eps) / std::abs(truth.eps) - 1), half("e"), turn * std::arg(m.eps / truth.eps));
  std::printf(
      "    conj stiffness %.2f%+.2fi (true %.2f%+.2fi)  conj damping %.4f%+.4fi (true %.4f%+.4fi)  delay %.3f ms\n",
      m.k1_conj.real(), m.k1_conj.imag(), truth.k1_conj.real(), truth.k1_conj.imag(), m.c_conj.real(), m.c_conj.imag(),
      truth.c_conj.real(), truth.c_conj.imag(), 1e3 * r.fit.delay);
  if (r.model.summary.status == Status::unusable) return;
  // Other unbalances, predicted from the difference of the true eccentricities.
  std::printf("    held out:");
  for (const double g : {0.0, 2.5, 5.0}) {
    bool used = false;
    for (const double own : grams) used = used || own == g;
    if (used) continue;
    identification::ValidateOptions v;
    v.record = options.record;
    v.unbalance = identification::UnbalanceSource::added;
    v.added = plant(g).true_model().eps - truth.eps;
    const rig::OpenLoopRecord run = rig::record_open_loop(plant(g, profile_angle), {50, {}}, snr);
    const identification::Validation a = identification::validate(r.model, run.measured, v);
    v.unbalance = identification::UnbalanceSource::refitted;
    const identification::Validation b = identification::validate(r.model, run.measured, v);
    std::printf("  %.1f g %.1f / %.1f um x / y (peak %.3f mm, %.3f simulated), e refitted %.1f / %.1f um", g,
                1e6 * a.rmse_x, 1e6 * a.rmse_y, 1e3 * a.peak_measured, 1e3 * a.peak_simulated, 1e6 * b.rmse_x,
                1e6 * b.rmse_y);
  }
  std::printf("\n");
}

}  // namespace

int main() {
  identification::RotorIdentifyOptions plain;
  identification::RotorIdentifyOptions informed;
  informed.modal = hammer();
  informed.record.sensor_delay = rig::RigLaser{}.latency;
  report("balanced, default", {0}, plain);
  report("5 g, default", {5}, plain);
  report("balanced, hammer modes, known latency", {0}, informed);
  report("2.5 g, hammer modes, known latency", {2.5}, informed);
  report("5 g, hammer modes, known latency", {5}, informed);
  report("balanced + 5 g, hammer modes, known latency", {0, 5}, informed);
  for (const double snr : {40.0, 20.0}) {
    report(snr == 40 ? "balanced, 40 dB" : "balanced, 20 dB", {0}, informed, snr);
    report(snr == 40 ? "5 g, 40 dB" : "5 g, 20 dB", {5}, informed, snr);
    report(snr == 40 ? "balanced + 5 g, 40 dB" : "balanced + 5 g, 20 dB", {0, 5}, informed, snr);
  }
  identification::RotorIdentifyOptions assumed = informed;
  assumed.angle_source = identification::AngleSource::profile;
  assumed.profile_degree = 6;
  report("5 g, angle from the commanded profile", {5}, assumed, {}, true);
  return 0;
}
