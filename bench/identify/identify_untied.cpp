// Full library of paper eq. 24 without ties, order 2, displacement and angle only: support and coefficients of rotor B
// found by the general front end, and the same with a radial cubic in the library. Arguments: seeds, "untied" or
// "radial".
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <complex>
#include <cstdlib>
#include <numbers>
#include <random>
#include <string>

#include "whirl/identify/sindy.hpp"
#include "whirl/rotor/simulate.hpp"

using namespace whirl;

int main(int argc, char** argv) {
  const int seeds = argc > 1 ? std::atoi(argv[1]) : 1;
  const double pi = std::numbers::pi;
  RotorModel truth;
  truth.k1 = 8882.6;
  truth.k2 = 2e8;
  truth.c = 7.5;
  truth.eps = 3e-4;
  const AngleSignal angle = rotor::angle_signal(rotor::SpeedProfile::run_down(2 * pi * 40, 15.0), 1e-3);
  const rotor::Response clean = rotor::simulate(truth, angle);
  for (bool radial : {false, true}) {
    if (argc > 2 && radial != (std::string(argv[2]) == "radial")) continue;
    for (double snr : {200.0, 40.0, 20.0}) {
      for (int seed = 1; seed <= seeds; ++seed) {
        Recording r = clean.recording();
        std::mt19937_64 engine(static_cast<std::uint64_t>(seed));
        std::normal_distribution<double> normal;
        for (Channel& c : r.channels) {
          const double sd =
              std::sqrt((c.samples.array() - c.samples.mean()).square().mean()) * std::pow(10.0, -snr / 20);
          for (double& v : c.samples) v += sd * normal(engine);
        }
        Eigen::VectorXd beta(r.size()), omega(r.size());
        for (Eigen::Index i = 0; i < r.size(); ++i) {
          beta[i] = angle.beta[2 * i];
          omega[i] = angle.omega[2 * i];
        }
        r.add("b", Quantity::angle, beta);
        r.add("w", Quantity::angular_velocity, omega);
        identification::SindyOptions o;
        o.states = {"x", "y"};
        o.inputs = {"b", "w"};
        o.order = 2;
        const std::vector<std::string> forcing{"1", "x",  "x'", "w^2*cos(b)", "w^2*sin(b)", "w*cos(b)", "w*sin(b)",
                                               "y", "y'", "w",  "w^2",        "sin(b)",     "cos(b)"};
        o.library = forcing;
        if (radial) {
          o.equations.library_of["x''"] = forcing;
          o.equations.library_of["x''"].push_back("x*(x^2+y^2)");
          o.equations.library_of["y''"] = forcing;
          o.equations.library_of["y''"].push_back("y*(x^2+y^2)");
        } else {
          for (const char* f : {"x^3", "x*y^2", "x^2*y", "y^3"}) o.library.push_back(f);
        }
        const auto t0 = std::chrono::steady_clock::now();
        const IdentifiedModel m = identification::fit_sindy({r}, o);
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count();
        fmt::print("{} cubic, {:3.0f} dB, seed {}: chi2 {:.4g}, {:.1f} s\n", radial ? "radial" : "untied", snr, seed,
                   m.summary.chi_square, seconds);
        for (const Equation& e : m.equations) {
          if (!e.lhs.ends_with("''")) continue;
          fmt::print("  {} =", e.lhs);
          for (const EquationTerm& t : e.terms) fmt::print(" {:+.5g} {}", t.coefficient.value, t.function);
          fmt::print("\n");
        }
        std::fflush(stdout);
      }
    }
  }
}
