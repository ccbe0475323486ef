// Rotors that leave the model class and records as laboratories have them: how often identify_rotor is right, warns, or
// is confidently wrong (status ok, an error beyond 4 stated sd and 1 %, 0.1 % for k1).
// Usage: bench_identify_reality [seeds per row = 6] [first seed = 1] [SNR dB = 20] [rows | records | trust | missing |
// all] [row name]
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/diagnosis/balancing.hpp"
#include "whirl/identify/identify.hpp"
#include "whirl/testing/damages.hpp"
#include "whirl/testing/machines.hpp"

namespace {

using namespace whirl;
using namespace whirl::testing;

double quantile(std::vector<double> v, double share) {
  if (v.empty()) return NAN;
  std::sort(v.begin(), v.end());
  return v[static_cast<std::size_t>(share * static_cast<double>(v.size() - 1) + 0.5)];
}

struct Truth {
  const char* name;
  double value, tolerance;  // share beyond which an error counts as wrong
};

struct Row {
  int ok = 0, warning = 0, unusable = 0, refused = 0, wrong = 0, beyond5 = 0, covered = 0, intervals = 0;
  int prescribed = 0, mass_held = 0,
      angle_held = 0;            // results of whirl balance, and where their interval holds the truth
  int named = 0, ambiguous = 0;  // the odd term is taken up or stands in a reading; some reading is stated
  std::map<std::string, std::vector<double>> errors, stated, bounds;  // %
  std::map<std::string, int> terms;                                   // added, or named in a warning
  std::vector<double> chi, time;
  std::string message;  // first warning of the last seed
  std::string missed;   // what was confidently wrong

  void count(unsigned seed, const identification::RotorIdentification& found, const std::vector<Truth>& truths,
             const std::vector<std::string>& names) {
    const IdentifiedModel& model = found.model;
    const std::vector<std::string>& added = found.added;
    std::string said;
    for (const std::string& t : added) said += t + "; ";
    for (const Ambiguity& a : found.model.ambiguities) {
      // Said of any rotor whose record is too weak to exclude the term: no finding.
      if (a.readings.find("not small enough to be excluded") == std::string::npos) said += a.readings + "; ";
    }
    named += std::any_of(names.begin(), names.end(),
                         [&](const std::string& n) { return said.find(n) != std::string::npos; });
    ambiguous += !found.model.ambiguities.empty();
    const Status s = model.summary.status;
    (s == Status::ok ? ok : s == Status::warning ? warning : unusable)++;
    if (!model.summary.warnings.empty()) message = model.summary.warnings.front();
    if (s == Status::unusable) return;
    for (const std::string& t : added) ++terms[t];
    chi.push_back(model.summary.chi_square);
    bool is_wrong = false, beyond = false;
    std::string how;
    for (const Truth& t : truths) {
      const Estimate* p = model.parameter(t.name);
      if (p == nullptr) continue;
      double error = p->value - t.value, size = std::abs(t.value);
      if (std::string(t.name) == "e_phase") {
        error = std::remainder(error, 2 * std::numbers::pi);
        size = 1;
      }
      errors[t.name].push_back(100 * std::abs(error) / size);
      stated[t.name].push_back(100 * p->sd / size);
      // Deviation from the noise of the samples used alone: the Cramer-Rao bound at the estimate.
      if (const Eigen::Index at = found.fit.index(t.name); at >= 0)
        bounds[t.name].push_back(100 * std::sqrt(found.fit.covariance(at, at)) / size);
      const double sds = std::abs(error) / p->sd;
      if (sds > 4 && std::abs(error) > t.tolerance * size) {
        is_wrong = true;
        how += fmt::format(" {} {:+.2g} % ({:.1f} sd)", t.name, 100 * error / size, sds);
      }
      beyond |= sds > 5;
      covered += sds < 1.96;
      ++intervals;
    }
    const diagnosis::BalancingAdvice advice =
        diagnosis::balancing_advice(*model.rotor, 1, 0.1, 200, 6.3, model.rotor_covariance);
    if (advice.mass_interval) {
      ++prescribed;
      double angle = 0;
      for (const Truth& t : truths) {
        if (std::string(t.name) == "e") mass_held += advice.mass_interval->covers(t.value / 0.1);
        if (std::string(t.name) == "e_phase") angle = t.value + std::numbers::pi;
      }
      const double off = std::remainder(angle - advice.correction_angle, 2 * std::numbers::pi);
      angle_held += advice.angle_interval->covers(advice.correction_angle + off);
    }
    if (s == Status::ok && is_wrong) {
      ++wrong;
      missed += fmt::format("    seed {}:{}; {}\n", seed, how, said);
    }
    beyond5 += beyond;
  }

  void print(const char* name) const {
    const auto at = [&](const char* p, double q) {
      const auto it = errors.find(p);
      return it == errors.end() ? NAN : quantile(it->second, q);
    };
    const auto sd = [&](const char* p) {
      const auto it = stated.find(p);
      return it == stated.end() ? NAN : quantile(it->second, 0.5);
    };
    std::printf(
        "%-21s ok %3d warn %3d unus %3d err %2d | wrong %3d >5sd %3d named %3d ambiguous %3d | 95%%: k1 %7.3f k2 %7.2f "
        "c "
        "%7.2f e %7.2f %% ph %6.2f deg | sd: k1 %.3f k2 %.2f c %.2f e %.2f | chi2 %7.2f cover %.2f balance mass %d "
        "angle %d of %d %5.0f ms |",
        name, ok, warning, unusable, refused, wrong, beyond5, named, ambiguous, at("k1", 0.95), at("k2", 0.95),
        at("c", 0.95), at("e", 0.95), at("e_phase", 0.95) * 1.8 / std::numbers::pi, sd("k1"), sd("k2"), sd("c"),
        sd("e"), quantile(chi, 0.5), intervals ? static_cast<double>(covered) / intervals : NAN, mass_held, angle_held,
        prescribed, quantile(time, 0.5));
    for (const auto& [term, times] : terms) std::printf(" %s x%d", term.c_str(), times);
    std::printf(" | bound:");
    for (const auto& [parameter, v] : bounds) std::printf(" %s %.4f", parameter.c_str(), quantile(v, 0.5));
    std::printf("\n");
    if (!message.empty()) std::printf("    %s\n", message.c_str());
    std::printf("%s", missed.c_str());
    std::fflush(stdout);
  }
};

/// How the odd term is called; drift and speed are one along a linear sweep.
std::vector<std::string> names_of(Oddity oddity) {
  switch (oddity) {
    case Oddity::bow:
      return {"bow"};
    case Oddity::damping_in_time:
      return {"damping drifting in time"};
    case Oddity::damping_with_speed:
      return {"damping changing with speed"};
    case Oddity::warming:
      return {"stiffness drifting in time"};
    case Oddity::quintic:
      return {"quintic"};
    case Oddity::gyroscopic:
      return {"gyroscopic"};
    case Oddity::rotating_damping:
      return {"rotating damping"};
    case Oddity::sensor_gain:
      return {"sensor gain"};
    case Oddity::sensor_angle:
      return {"sensor angle"};
    case Oddity::cubic_per_axis:
      return {"along the axes", "cubic stiffness per axis"};
    case Oddity::quadratic_damping:
      return {"quadratic damping"};
    case Oddity::coulomb:
      return {"Coulomb"};
    case Oddity::anisotropic:
      return {"anisotropic stiffness"};
    case Oddity::cross_coupled:
      return {"cross-coupled"};
    case Oddity::stiffness_with_speed:
      return {"stiffness changing with speed"};
    case Oddity::tilt:
      return {"tilt"};
    case Oddity::none:
      return {};
  }
  return {};
}

std::vector<Truth> truths_of(const Machine& m, Oddity oddity) {
  std::vector<Truth> t = {{"k1", m.k, 1e-3}, {"e", m.e, 1e-2}, {"e_phase", m.e_phase, 1e-2}};
  if (oddity == Oddity::tilt) return t;
  // A warming rotor has no single k1, one with damping in time no single c: the value at the start of the record.
  if (oddity != Oddity::cubic_per_axis) t.push_back({"k2", m.cubic, 1e-2});
  t.push_back({"c", m.c, 1e-2});
  return t;
}

void run(const char* name, int seeds, int first, const std::function<Recording(unsigned)>& record,
         const std::function<std::vector<Truth>(unsigned)>& truths, const std::vector<std::string>& names) {
  Row row;
  for (int n = 0; n < seeds; ++n) {
    const auto seed = static_cast<unsigned>(first + n);
    const std::clock_t begin = std::clock();
    try {
      const Recording r = record(seed);
      identification::RotorIdentifyOptions options;
      if (!r.has("beta")) options.angle_source = identification::AngleSource::vibration;
      const identification::RotorIdentification found =
          identification::identify_rotor_detailed(std::vector<Recording>{r}, options);
      row.count(seed, found, truths(seed), names);
    } catch (const Error& e) {
      ++row.refused;
      row.message = e.what();
    }
    row.time.push_back(1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
  }
  row.print(name);
}

/// Of rotors of the model class, how often the whole verdict, part held out included, withdraws its trust.
void count_withdrawals(int seeds, int first, double snr) {
  int trusted = 0, warned = 0, withdrawn = 0, terms = 0;
  std::string said;
  for (int n = 0; n < seeds; ++n) {
    const auto seed = static_cast<unsigned>(first + n);
    const auto found = identification::identify(machine_record(draw_machine(Oddity::none, seed), snr, seed));
    trusted += found.summary.trust.starts_with("Trust");
    withdrawn += !found.summary.trust.starts_with("Trust");
    terms += !found.model.rotor->modes.empty() || found.model.rotor->k1_conj != 0.0 || found.model.rotor->c_conj != 0.0;
    if (found.summary.status == Status::ok) continue;
    ++warned;
    for (const std::string& w : found.summary.warnings) said += fmt::format("    seed {}: {}\n", seed, w);
  }
  std::printf("clean rotors %d: trusted %d, trust withdrawn %d, not ok %d, with modes or unequal axes %d\n%s", seeds,
              trusted, withdrawn, warned, terms, said.c_str());
}

/// Records without a channel: of rotors of the model class, and of some that break what one axis takes for granted.
void missing_channels(int seeds, int first, double snr, const std::string& only) {
  const auto without = [](Recording r, const std::string& channel) {
    std::erase_if(r.channels, [&](const Channel& c) { return c.name == channel; });
    return r;
  };
  for (const Oddity o : {Oddity::none, Oddity::anisotropic, Oddity::cross_coupled, Oddity::quintic, Oddity::warming,
                         Oddity::coulomb, Oddity::bow, Oddity::sensor_gain}) {
    for (const char* channel : {"y", "x", "beta"}) {
      const std::string name = std::string(to_string(o)) + " no " + channel;
      if (!only.empty() && name.find(only) == std::string::npos) continue;
      run(
          name.c_str(), seeds, first,
          [&](unsigned seed) { return without(machine_record(draw_machine(o, seed), snr, seed), channel); },
          [&](unsigned seed) { return truths_of(draw_machine(o, seed).machine, o); }, names_of(o));
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 6, first = argc > 2 ? std::atoi(argv[2]) : 1;
  const double snr = argc > 3 ? std::atof(argv[3]) : 20;
  const std::string what = argc > 4 ? argv[4] : "all", only = argc > 5 ? argv[5] : "";
  if (what == "trust") {
    count_withdrawals(seeds, first, snr);
    return 0;
  }
  if (what == "missing") {
    missing_channels(seeds, first, snr, only);
    return 0;
  }
  if (what != "records") {
    for (const Oddity o : kOddities) {
      if (!only.empty() && only != to_string(o)) continue;
      run(
          to_string(o), seeds, first, [&](unsigned seed) { return machine_record(draw_machine(o, seed), snr, seed); },
          [&](unsigned seed) { return truths_of(draw_machine(o, seed).machine, o); }, names_of(o));
    }
  }
  if (what != "rows") {
    for (const Damage d : kDamages) {
      if (!only.empty() && only != to_string(d)) continue;
      run(
          to_string(d), seeds, first,
          [&](unsigned seed) {
            // AR(1) noise replaces the white noise, at the same level.
            const DrawnMachine drawn = draw_machine(Oddity::none, seed);
            const double level = std::pow(10.0, (20 - snr) / 20);
            return d == Damage::ar1 ? damaged(machine_record(drawn, 80, seed), d, seed, level)
                                    : damaged(machine_record(drawn, snr, seed), d, seed);
          },
          [&](unsigned seed) { return truths_of(draw_machine(Oddity::none, seed).machine, Oddity::none); }, {});
    }
  }
}
