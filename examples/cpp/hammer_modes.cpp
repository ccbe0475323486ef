// Modes of a structure from a recording of a hammer test. Usage: hammer_modes FILE
#include <cstdio>
#include <whirl/modal/fit_modes.hpp>
#include <whirl/modal/frf.hpp>
#include <whirl/whirl.hpp>

int main(int argc, char** argv) try {
  if (argc != 2) return 2;
  const whirl::FrequencyResponse frf = whirl::modal::estimate_frf({whirl::io::read(argv[1])});
  whirl::modal::ModeOptions options;
  options.poles.band_low = 20;  // Hz
  options.poles.band_high = 3000;
  const whirl::ModalModel found = whirl::modal::fit_modes(frf, options);
  for (const whirl::Mode& mode : found.modes)
    std::printf("%.2f Hz +- %.2f, damping %.3f %%\n", mode.frequency.value, mode.frequency.sd,
                100 * mode.damping.value);
  for (const std::string& warning : frf.summary.warnings) std::printf("warning: %s\n", warning.c_str());
} catch (const whirl::Error& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 2;
}
