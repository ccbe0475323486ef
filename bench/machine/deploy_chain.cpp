/// The whole chain on machines that libs/rig does not know (testing/foreign_rig.hpp): laboratory files, identify,
/// stiffness, frf, modes, design, exported C, closed loop.
///     bench_deploy_chain WHIRL [MACHINES [FIRST_SEED [PARTICIPATION [EVALUATIONS]]]]
#include <cstdio>
#include <cstdlib>

#include "whirl/io/model_json.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/control/foreign_rig.hpp"
#include "whirl/testing/control/step_wrapper.hpp"

namespace {

using namespace whirl;
using namespace whirl::testing;

/// Peaks of the disc, m, above 1.5, from 1.5 to 1.1, from 1.1 to 0.8 and below 0.8 times the critical speed, after
/// 0.3 s.
struct Played {
  std::array<double, 4> peak{};
  int trips = 0;
};

template <class Step>
Played play(const ForeignMachine& m, std::uint64_t seed, Step&& step) {
  Played played;
  ForeignRig rig(m, seed);
  for (; !rig.done(); rig.advance()) {
    const Measurement r = rig.read();
    Command u;
    const int status = step(r, u);
    played.trips += status == 4;
    rig.write(status == 0 ? u : Command{});
    const double ratio = rig.speed() / m.critical();
    const std::size_t segment = ratio > 1.5 ? 0 : ratio > 1.1 ? 1 : ratio > 0.8 ? 2 : 3;
    if (r.t > 0.3) played.peak[segment] = std::max(played.peak[segment], std::hypot(rig.x(), rig.y()));
  }
  return played;
}

Played play_exported(const ForeignMachine& m, std::uint64_t seed, const std::filesystem::path& library) {
  const SharedLibrary drive(library);
  drive.get<int()>("start")();
  auto* const go = drive.get<int(const double*, int, double*)>("go");
  return play(m, seed, [&](const Measurement& r, Command& u) {
    const double in[] = {r.x, r.y, r.beta, r.omega, r.omega_dot};
    double out[3];
    const int status = go(in, 1, out);
    u = {out[0], out[1]};
    return status;
  });
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2)
    return std::puts("usage: bench_deploy_chain WHIRL [MACHINES [FIRST_SEED [PARTICIPATION [EVALUATIONS]]]]"), 2;
  const std::string whirl = std::filesystem::absolute(argv[1]).string() + " ";
  const int machines = argc > 2 ? std::atoi(argv[2]) : 12, first = argc > 3 ? std::atoi(argv[3]) : 1;
  const double participation = argc > 4 ? std::atof(argv[4]) : 0.1;
  const std::string evaluations = argc > 5 ? argv[5] : "24";
  int designs = 0, certified = 0, bad = 0;
  for (int seed = first; seed < first + machines; ++seed) {
    const ForeignMachine m = ForeignMachine::draw(static_cast<std::uint64_t>(seed), participation);
    const TemporaryFolder folder;
    write_laboratory(m, folder.path(), static_cast<std::uint64_t>(seed));
    folder.write("wrapper.c", step_wrapper());
    const auto run = [&](const std::string& command) { return shell(folder.path(), command).exit_code; };
    const auto program = [&](const std::string& arguments) { return run(whirl + arguments + " --quiet"); };
    program("identify rundown.csv --out model.json");
    program("stiffness pull.csv --out stiffness.json");
    program("frf blow_1.csv blow_2.csv blow_3.csv blow_4.csv blow_5.csv --out frf.json");
    program("modes frf.json --out modes.json");
    const auto noise = static_cast<std::uint64_t>(100 + seed);
    const Played open = play(m, noise, [](const Measurement&, Command&) { return 0; });
    std::printf(
        "machine %d: %.2f kg, %.2f Hz, modes %.1f Hz (%+.3f) %.1f Hz (%+.3f); open loop %.3f %.3f %.3f %.3f mm\n", seed,
        m.mass, m.critical() / (2 * std::numbers::pi), m.modes[0].hertz, m.modes[0].participation(m.mass),
        m.modes[1].hertz, m.modes[1].participation(m.mass), 1e3 * open.peak[0], 1e3 * open.peak[1], 1e3 * open.peak[2],
        1e3 * open.peak[3]);
    for (const auto& [law, estimator] :
         {std::pair{"tsmc", "lpf"}, {"tsmc", "eso"}, {"pd", "kfe"}, {"pd_notch", "lpf"}, {"lsmc", "kfe"}}) {
      const std::string name = std::string(law) + "_" + estimator;
      const int exit_code = program(
          "design model.json --stiffness stiffness.json --modes modes.json --hardware lab.toml "
          "--law " +
          std::string(law) + " --estimator " + estimator + (name == "pd_notch_lpf" ? " --no-feedforward" : "") +
          " --evaluations " + evaluations + " --out " + name + ".json");
      ++designs;
      // A model that is not to be trusted makes no error of the program, and no certificate either.
      const auto file = folder.path() / (name + ".json");
      const bool holds = exit_code == 0 && io::load<ControllerDesign>(file).margins.at("certified") == 1;
      certified += holds;
      if (program("export c " + name + ".json --prefix drive --out " + name) != 0 ||
          run("cp wrapper.c " + name + " && cd " + name + " && cc " + kStrictC99 +
              " -fPIC -shared drive.c wrapper.c -lm -o drive.so") != 0) {
        std::printf("  %-13s exit code %d, no controller\n", name.c_str(), exit_code);
        continue;
      }
      const Played closed = play_exported(m, noise, folder.path() / name / "drive.so");
      double worst = 0;
      for (std::size_t i = 0; i < 4; ++i) worst = std::max(worst, closed.peak[i] / open.peak[i]);
      const bool failed = !(worst <= 1.05) || closed.trips > 0;
      bad += failed && holds;
      std::printf("  %-13s %s, exit code %d; %.3f %.3f %.3f %.3f mm, at most %.2f of open loop%s\n", name.c_str(),
                  holds ? "certified" : "not certified", exit_code, 1e3 * closed.peak[0], 1e3 * closed.peak[1],
                  1e3 * closed.peak[2], 1e3 * closed.peak[3], worst, closed.trips > 0 ? ", tripped" : "");
      std::fflush(stdout);
    }
  }
  std::printf("%d designs, %d certified, %d certified that trip or leave 1.05 of open loop\n", designs, certified, bad);
  return 0;
}
