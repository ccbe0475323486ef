// From a model file to two controllers, compared on the simulated rig. Usage: design_and_run MODEL
#include <cstdio>
#include <whirl/whirl.hpp>

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  const auto model = whirl::io::load<whirl::IdentifiedModel>(argv[1]);
  bool good = true;
  for (const char* law : {"tsmc", "pd"}) {
    const auto controller = whirl::design(model, {.mass_kg = 1.5, .law = law, .evaluations = 12});
    const auto run = whirl::run(controller, whirl::VirtualRig{});
    std::printf("%s: peak %.3f mm instead of %.3f mm, force %.2f N rms\n", law, 1e3 * run.metrics.closed.all,
                1e3 * run.metrics.open.all, run.metrics.force_rms);
    good = good && run.metrics.stable;
    whirl::io::save(std::string(law) + ".json", controller);
  }
  return good ? 0 : 1;
} catch (const whirl::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
