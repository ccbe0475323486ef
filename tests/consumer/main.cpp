// From a measured run-down to a controller that ran: the whole of what a C++ user writes.
#include <cstdio>
#include <whirl/whirl.hpp>

namespace {

int fail(const whirl::Summary& summary) {
  for (const std::string& warning : summary.warnings) std::fprintf(stderr, "%s\n", warning.c_str());
  return 1;
}

}  // namespace

int main(int, char** argv) {
  auto id = whirl::identify(whirl::io::read(argv[1]));
  if (!id.usable()) return fail(id.summary);
  auto ctl = whirl::design(id.model, {.mass_kg = 1.5, .evaluations = 12});
  auto run = whirl::run(ctl, whirl::VirtualRig{});
  whirl::io::save("controller.json", ctl);
  std::printf("suppression %.3f\n", run.metrics.suppression.all);
  return run.metrics.stable && run.metrics.suppression.all > 0.5 ? 0 : 1;
}
