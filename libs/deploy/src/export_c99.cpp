#include <fmt/format.h>

#include <cmath>
#include <complex>
#include <deque>
#include <random>

#include "template.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/control/lateral_model.hpp"
#include "whirl/control/method.hpp"
#include "whirl/deploy/code.hpp"

namespace whirl::deploy {
namespace {

struct Golden {
  Measurement in;
  int status = 0;
  Command command;
  std::complex<double> velocity;
};

double rounded(double value, bool single) { return single ? static_cast<double>(static_cast<float>(value)) : value; }

/// Status as the exported step returns it.
int status_of(const Expected<Command, Fault>& answer) {
  return answer ? 0 : answer.error() == Fault::not_finite ? 1 : answer.error() == control::kSupervision ? 4 : 2;
}

/// The library's controller in closed loop with its own model through the critical speed: sensor noise, a quarter more
/// unbalance than the model has, two lost readings, one wild and one that is no number.
std::vector<Golden> golden_run(const ControllerDesign& design, bool single, int ticks) {
  control::Controller controller = control::make_controller(design);
  const control::LateralModel model = control::LateralModel::from(design.model);
  const double h = design.sample_time, middle = std::sqrt(std::max(model.k1, 1.0));
  const std::complex<double> eps = 1.25 * design.model.eps;
  std::deque<std::complex<double>> force(static_cast<std::size_t>(std::lround(design.delay / h)) + 1);
  std::mt19937_64 random(1);
  const auto noise = [&] { return 2e-6 * (static_cast<double>(random()) / 18446744073709551616.0 - 0.5); };
  control::DiskMotion s{{2e-4, -1e-4}, {0, 0.01}, {}};
  double beta = 0;
  std::vector<Golden> out;
  for (int k = 0; k < ticks; ++k) {
    const double omega = middle * (1.2 - 0.4 * k / ticks), alpha = -0.4 * middle / (ticks * h);
    Golden g;
    const std::complex<double> z = s.z + design.model.offset + std::complex<double>(noise(), noise());
    g.in = {h * k,
            rounded(z.real(), single),
            rounded(z.imag(), single),
            rounded(std::remainder(beta, 2 * M_PI), single),
            rounded(omega, single),
            rounded(alpha, single),
            k != 60 && k != 61};
    if (control::law_entry(design.law).continuous_angle) g.in.beta = beta;
    if (k == 90) g.in.x = 0.011;
    if (k == 91) g.in.y = std::nan("");
    const auto answer = controller.step(g.in);
    g.status = status_of(answer);
    if (answer) g.command = *answer;
    g.velocity = controller.state().estimate.v;
    force.push_back({g.command.ux, g.command.uy});
    s.d = control::product(eps, control::unbalance_per_metre(beta, omega, alpha));
    s = control::predict_motion(model, s, design.model.gain * force.front(), omega, h);
    force.pop_front();
    beta += h * omega;
    out.push_back(g);
  }
  return out;
}

std::string hex(double value, bool single) {
  if (std::isnan(value)) return "NAN";
  return fmt::format("{:a}{}", value, single ? "F" : "");
}

}  // namespace

std::vector<SourceFile> export_c99(const ControllerDesign& design, const CodeOptions& options, int ticks) {
  const ControllerCode code = controller_code(design, options);
  const bool single = options.single_precision;
  TemplateSettings s;
  s.prefix = options.prefix;
  s.single_precision = single;
  s.slots["prefix"] = options.prefix;
  s.slots["ticks"] = std::to_string(ticks);
  // Another library of mathematical functions differs in the last bits.
  s.slots["tolerance"] = single ? "1e-3" : "1e-9";
  std::string& vectors = s.slots["vectors"];
  for (const Golden& g : golden_run(design, single, ticks)) {
    vectors += fmt::format("{}    {{{}, {}, {}, {}, {}, {}, {}, {}, {}, {}, {}}},", vectors.empty() ? "" : "\n",
                           hex(g.in.x, single), hex(g.in.y, single), hex(g.in.beta, single), hex(g.in.omega, single),
                           hex(g.in.omega_dot, single), g.in.valid ? 1 : 0, g.status, hex(g.command.ux, false),
                           hex(g.command.uy, false), hex(g.velocity.real(), false), hex(g.velocity.imag(), false));
  }
  return {code.header,
          code.source,
          {options.prefix + "_selftest.c", fill_template(deploy_template("selftest.c"), s)},
          {"CMakeLists.txt", fill_template(deploy_template("CMakeLists.txt.in"), s)},
          {"Makefile", fill_template(deploy_template("Makefile.in"), s)}};
}

}  // namespace whirl::deploy
