#pragma once
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "importer.hpp"
#include "whirl/control/controller.hpp"
#include "whirl/deploy/code.hpp"
#include "whirl/testing/compiled.hpp"
#include "whirl/testing/control/step_wrapper.hpp"
#include "whirl/testing/designs.hpp"

namespace whirl::deploy {

/// Forces of what is exported against those of the library, N.
struct StepDifference {
  double worst = 0, largest = 0;

  void add(double ux, double uy, const Command& u) {
    worst = std::max({worst, std::abs(ux - u.ux), std::abs(uy - u.uy)});
    largest = std::max(largest, std::abs(u.ux));
  }
};

/// The step of a design, compiled; `more`: C that is appended to the wrapper.
struct Exported {
  explicit Exported(const ControllerDesign& d, const std::string& more = "",
                    const std::string& flags = testing::kQuickC99) {
    const ControllerCode code = controller_code(d, {"drive", false, ""});
    folder.write(code.header.name, code.header.text);
    folder.write(code.source.name, code.source.text);
    folder.write("wrapper.c", testing::step_wrapper() + more);
    const auto built =
        testing::shell(folder.path(), "cc " + flags + " -fPIC -shared drive.c wrapper.c -lm -o drive.so");
    EXPECT_EQ(built.exit_code, 0) << d.law << " " << d.estimator << built.text;
    library = std::make_unique<testing::SharedLibrary>(folder.path() / "drive.so");
    EXPECT_EQ(library->get<int()>("start")(), 0);
    go = library->get<int(const double*, int, double*)>("go");
  }
  testing::TemporaryFolder folder;
  std::unique_ptr<testing::SharedLibrary> library;
  int (*go)(const double*, int, double*) = nullptr;
};

/// Of the C of a supervised controller, compiled, over a run-down that turns that way; status and supervision's word
/// are those of the library, too.
inline void compare_code(const ControllerDesign& d, double side, StepDifference& out) {
  const Exported exported(d);
  ASSERT_NE(exported.go, nullptr);
  control::Controller mine = control::make_controller(d);
  for (Measurement m : testing::run_down_readings()) {
    m.y *= side, m.beta *= side, m.omega *= side, m.omega_dot *= side;
    const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
    double forces[3] = {};
    const int status = exported.go(in, 1, forces);
    const auto u = mine.step(m);
    ASSERT_EQ(status == 0, static_cast<bool>(u));
    if (!u) break;
    out.add(forces[0], forces[1], *u);
    ASSERT_EQ(static_cast<std::uint32_t>(forces[2]), mine.state().supervision.word);
  }
}

/// Of an FMU over these readings, as far as the library goes.
inline void compare_fmu(const testing::Importer& fmu, const ControllerDesign& d,
                        const std::vector<Measurement>& readings, StepDifference& out) {
  void* const c = fmu.instantiate(false, fmu.token);
  ASSERT_NE(c, nullptr);
  ASSERT_EQ(fmu.enter_initialization(c, 0), 0);
  ASSERT_EQ(fmu.call("ExitInitializationMode", c), 0);
  control::Controller mine = control::make_controller(d);
  for (const Measurement& m : readings) {
    const double in[] = {m.x, m.y, m.beta, m.omega, m.omega_dot};
    const char* names[] = {"x", "y", "beta", "omega", "omega_dot"};
    for (int i = 0; i < 5; ++i) ASSERT_EQ(fmu.set(c, names[i], in[i]), 0);
    ASSERT_EQ(fmu.step(c, m.t, 1e-3), 0);
    const auto u = mine.step(m);
    if (!u) break;  // the supervision's last step
    out.add(fmu.get(c, "ux"), fmu.get(c, "uy"), *u);
  }
  fmu.free(c);
}

}  // namespace whirl::deploy
