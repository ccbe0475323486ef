// Accuracy of identify_rotor over random rotors: errors, held-out prediction, chi-square, coverage, time.
// Usage: bench_identify_rotor_accuracy [rotors per row = 40] [first seed = 1] [only this SNR, dB]
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <random>
#include <vector>

#include "../../libs/identify/test/rotor_synthetic.hpp"
#include "whirl/identify/identify_rotor.hpp"
#include "whirl/identify/validate.hpp"

namespace {

using namespace whirl;
using namespace whirl::testing;

struct Row {
  std::vector<double> values;
  void print(const char* name, const char* unit) {
    std::sort(values.begin(), values.end());
    if (values.empty()) return;
    const auto at = [&](double share) {
      return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
    };
    std::printf("  %-22s median %9.4f   95 %% %9.4f   max %9.4f %s\n", name, at(0.5), at(0.95), at(1), unit);
  }
};

/// 95th percentile of the absolute errors of unbiased Gaussian estimates with these standard deviations: what no
/// unbiased estimator undercuts when they are the Cramer-Rao bounds of the rotors drawn.
double bound_95(const std::vector<double>& sd) {
  double low = 0, high = 10 * *std::max_element(sd.begin(), sd.end());
  for (int k = 0; k < 60; ++k) {
    const double mid = 0.5 * (low + high);
    double inside = 0;
    for (const double s : sd) inside += std::erf(mid / s / std::sqrt(2.0));
    (inside < 0.95 * static_cast<double>(sd.size()) ? low : high) = mid;
  }
  return 0.5 * (low + high);
}

struct Case {
  RotorModel rotor;
  Sweep sweep;
  Complex added;
};

// fn 11-13 Hz, zeta 1-3 %, hardening 20-30 % at 3 mm, e 0.06-0.16 mm, 25-40 Hz at the start, offset +-0.1 mm.
Case draw(std::mt19937_64& random, bool anisotropic) {
  const auto uniform = [&](double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random);
  };
  Case c;
  const double w = kTurn * uniform(11, 13);
  c.rotor.k1 = w * w;
  c.rotor.k2 = uniform(0.20, 0.30) * c.rotor.k1 / 9e-6;
  c.rotor.c = 2 * uniform(0.01, 0.03) * w;
  const double e = uniform(6e-5, 16e-5);
  c.rotor.eps = std::polar(e, uniform(-3, 3));
  c.rotor.offset = {uniform(-1e-4, 1e-4), uniform(-1e-4, 1e-4)};
  c.sweep = {uniform(25, 40), 0, 12, uniform(-3, 3), 1e-3};
  const double extra = uniform(3e-5, 1.2e-4);
  c.added = std::polar(extra, uniform(-3, 3));
  if (anisotropic) c.rotor.k1_conj = std::polar(0.01 * c.rotor.k1, uniform(-3, 3));
  return c;
}

void run(double snr, bool anisotropic, int rotors, unsigned first_seed) {
  Row k1, k2, c, e, phase, held, run_up, chi, time;
  int false_terms = 0, missed_terms = 0, not_ok = 0, folds = 0;
  int covered[5] = {};
  std::vector<double> bound[3];
  for (int n = 0; n < rotors; ++n) {
    const unsigned seed = first_seed + static_cast<unsigned>(n);
    std::mt19937_64 random(seed);
    const Case d = draw(random, anisotropic);
    const Recording data = recording(with_noise(motion(d.rotor, d.sweep), snr, seed + 1000), d.sweep);
    const std::clock_t begin = std::clock();
    const identification::RotorIdentification found =
        identification::identify_rotor_detailed({identification::rotor_record(data)});
    time.values.push_back(1e3 * static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC);
    if (found.model.summary.status == Status::unusable) {
      ++not_ok;
      continue;
    }
    if (found.model.summary.status != Status::ok) {
      ++not_ok;
      std::printf("  seed %u: %s\n", seed, found.model.summary.warnings[0].c_str());
    }
    for (const std::string& term : found.added) {
      if (anisotropic && term == "anisotropic stiffness") continue;
      ++false_terms;
      std::printf("  seed %u: false term %s\n", seed, term.c_str());
    }
    missed_terms +=
        anisotropic && std::find(found.added.begin(), found.added.end(), "anisotropic stiffness") == found.added.end();
    const ModelError error = model_error(*found.model.rotor, d.rotor);
    k1.values.push_back(std::abs(error.k1));
    k2.values.push_back(std::abs(error.k2));
    c.values.push_back(std::abs(error.c));
    e.values.push_back(std::abs(error.e));
    phase.values.push_back(std::abs(error.phase));
    const double known[3] = {d.rotor.k1, d.rotor.k2, d.rotor.c};
    for (Eigen::Index j = 0; j < 3; ++j) {  // k1, k2, c come first
      bound[j].push_back(100 * std::sqrt(found.fit.covariance(j, j)) / known[j]);
    }
    chi.values.push_back(found.model.summary.chi_square);
    covered[0] += found.model.parameter("k1")->covers(d.rotor.k1);
    covered[1] += found.model.parameter("k2")->covers(d.rotor.k2);
    covered[2] += found.model.parameter("c")->covers(d.rotor.c);
    covered[3] += found.model.parameter("e")->covers(std::abs(d.rotor.eps));
    const double turn = std::arg(d.rotor.eps), low = found.model.parameter("e_phase")->low;
    covered[4] += low + std::remainder(turn - low, kTurn) >= low &&
                  found.model.parameter("e_phase")->covers(low + std::remainder(turn - low, kTurn));

    // Held out: another run-down with an added mass; a run-up of the same rotor.
    RotorModel loaded = d.rotor;
    loaded.eps += d.added;
    const auto predict = [&](const RotorModel& truth, const Sweep& sweep, Complex added) {
      const Eigen::VectorXcd clean = motion(truth, sweep);
      identification::ValidateOptions options;
      options.unbalance = identification::UnbalanceSource::added;
      options.added = added;
      options.clean = recording(clean, sweep);
      return identification::validate(found.model, recording(with_noise(clean, snr, seed + 5000), sweep), options);
    };
    const identification::Validation down = predict(loaded, d.sweep, d.added);
    held.values.push_back(1e3 * std::max(down.clean_rmse_x, down.clean_rmse_y));
    Sweep up = d.sweep;
    std::swap(up.from, up.to);
    const identification::Validation rise = predict(d.rotor, up, 0);
    if (rise.fold_sensitive) {
      ++folds;
    } else {
      run_up.values.push_back(1e3 * std::max(rise.clean_rmse_x, rise.clean_rmse_y));
    }
  }
  std::printf("%.0f dB, %s, %d rotors: %d not ok, %d false terms, %d missed\n", snr,
              anisotropic ? "stiffness differs by 2 %" : "isotropic", rotors, not_ok, false_terms, missed_terms);
  k1.print("K1 error", "%");
  k2.print("K2 error", "%");
  c.print("C error", "%");
  e.print("e error", "%");
  std::printf("  Cramer-Rao bound, 95 %% of errors: K1 %.4f K2 %.4f C %.4f %%\n", bound_95(bound[0]),
              bound_95(bound[1]), bound_95(bound[2]));
  phase.print("phase error", "deg");
  held.print("held-out run-down", "mm");
  run_up.print("run-up", "mm");
  chi.print("chi-square", "");
  time.print("processor time", "ms");
  const double n = static_cast<double>(k1.values.size());
  std::printf(
      "  fold-sensitive run-ups left out: %d\n  coverage of 95 %% intervals K1 %.2f K2 %.2f C %.2f e %.2f phase %.2f\n",
      folds, covered[0] / n, covered[1] / n, covered[2] / n, covered[3] / n, covered[4] / n);
}

}  // namespace

int main(int argc, char** argv) {
  const int rotors = argc > 1 ? std::atoi(argv[1]) : 40;
  const unsigned seed = argc > 2 ? static_cast<unsigned>(std::atoi(argv[2])) : 1;
  const std::vector<double> levels =
      argc > 3 ? std::vector<double>{std::atof(argv[3])} : std::vector<double>{30, 20, 10};
  for (const double snr : levels) run(snr, false, rotors, seed);
  run(20, true, rotors, seed);
}
