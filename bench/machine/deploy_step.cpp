// Step time of exported C beside the library's, in double and float, and what a target needs: bytes of code, of state,
// of stack. Promise: one step of the exported controller takes at most 1 us in the median.
#include <dlfcn.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "whirl/control/catalogue.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/testing/designs.hpp"

namespace {

using namespace whirl;

template <class Real>
struct Input {
  Real x, y, beta, omega, omega_dot;
  bool valid;
};

double median_ns(std::vector<double> times) {
  std::nth_element(times.begin(), times.begin() + static_cast<std::ptrdiff_t>(times.size() / 2), times.end());
  return times[times.size() / 2];
}

template <class Step>
double time_of(const std::vector<Measurement>& readings, const Step& step) {
  std::vector<double> times;
  for (const Measurement& m : readings) {
    const auto start = std::chrono::steady_clock::now();
    step(m);
    times.push_back(std::chrono::duration<double, std::nano>(std::chrono::steady_clock::now() - start).count());
  }
  return median_ns(times);
}

long first_number(const std::string& path) {
  std::ifstream in(path);
  long value = -1;
  in >> value;
  return value;
}

template <class Real>
double exported_ns(const ControllerDesign& d, const std::vector<Measurement>& readings, const std::string& folder,
                   long& code, long& stack) {
  const deploy::ControllerCode files = deploy::controller_code(d, {"c", sizeof(Real) == 4, ""});
  std::ofstream(folder + "/c.h") << files.header.text;
  std::ofstream(folder + "/c.c") << files.source.text;
  const std::string build =
      "cd " + folder +
      " && rm -f c.so && cc -std=c99 -O2 -fstack-usage -fPIC -c c.c -o c.o && cc -shared -o c.so c.o -lm && "
      "size c.o | awk 'NR==2{print $1}' > code && sort -k2 -n -r c.su | awk 'NR==1{print $2}' > stack";
  if (std::system(build.c_str()) != 0) return NAN;
  code = first_number(folder + "/code");
  stack = first_number(folder + "/stack");
  void* const library = dlopen((folder + "/c.so").c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return NAN;
  alignas(std::max_align_t) static std::byte params[4096], state[4096], out[256];
  reinterpret_cast<void (*)(void*)>(dlsym(library, "c_default_params"))(params);
  reinterpret_cast<int (*)(void*, const void*)>(dlsym(library, "c_init"))(state, params);
  const auto step = reinterpret_cast<int (*)(void*, const Input<Real>*, void*)>(dlsym(library, "c_step"));
  const double ns = time_of(readings, [&](const Measurement& m) {
    const Input<Real> in{Real(m.x), Real(m.y), Real(m.beta), Real(m.omega), Real(m.omega_dot), true};
    step(state, &in, out);
  });
  dlclose(library);
  return ns;
}

}  // namespace

int main() {
  const std::vector<Measurement> readings = testing::run_down_readings();
  std::string folder = (std::filesystem::temp_directory_path() / "whirl-bench-XXXXXX").string();
  if (mkdtemp(folder.data()) == nullptr) return 1;
  double worst = 0;
  std::printf("%-14s %-10s %9s %9s %9s   %10s %10s\n", "law", "estimator", "library", "C double", "C float",
              "code bytes", "deepest frame");
  const auto row = [&](const ControllerDesign& d, const std::vector<Measurement>& samples, const char* label) {
    control::Controller controller = control::make_controller(d);
    const double library = time_of(samples, [&](const Measurement& m) { (void)controller.step(m); });
    long code = 0, stack = 0, ignored = 0;
    const double with_float = exported_ns<float>(d, samples, folder, ignored, ignored);
    const double with_double = exported_ns<double>(d, samples, folder, code, stack);
    std::printf("%-14s %-10s %6.0f ns %6.0f ns %6.0f ns   %10ld %10ld\n", label, d.estimator.c_str(), library,
                with_double, with_float, code, stack);
    worst = std::max(worst, with_double);
  };
  for (const auto& [law, estimator] :
       {std::pair("tsmc", "lpf"), std::pair("tsmc", "kfe"), std::pair("lsmc", "lpf"), std::pair("pd", "lpf"),
        std::pair("sta_implicit", "red_implicit"), std::pair("tsmc_implicit", "kfe"), std::pair("nftsmc", "eso"),
        std::pair("pd_notch", "kfo"), std::pair("mpc", "kfe")}) {
    row(testing::design_of(law, estimator), readings, law);
  }
  ControllerDesign limited = testing::design_of("mpc", "kfe");
  limited.force_limit = 5;
  row(limited, testing::run_down_readings(2e-3), "mpc, limited");
  std::filesystem::remove_all(folder);
  std::printf("worst median of the exported step: %.0f ns (promise 1000 ns)\n", worst);
  return worst <= 1000 ? 0 : 1;
}
