#include "whirl/deploy/cortex_m4f.hpp"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <sstream>

#include "template.hpp"
#include "whirl/core/error.hpp"
#include "whirl/io/file.hpp"
#include "whirl/io/output.hpp"
#include "whirl/io/run_program.hpp"
#include "whirl/io/temporary.hpp"

namespace whirl::deploy {
namespace {

constexpr const char* kFlags =
    "-O2 -std=c99 -Wall -Wextra -Werror -mcpu=cortex-m4 -mthumb -mfpu=fpv4-sp-d16 -mfloat-abi=hard -ffunction-sections "
    "-fdata-sections -fno-math-errno -nostartfiles";

// What the controller adds to a program that does nothing is its flash.
constexpr const char* kEmpty = "int main(void) { return 0; }\n";
constexpr const char* kKeep = R"(#include "law.h"
int main(void) {
  static law_params p;
  static law_state s;
  law_input i = {0};
  law_output o;
  law_default_params(&p);
  return (int)law_init(&s, &p) + (int)law_step(&s, &i, &o);
}
)";

/// A command in the folder; what it printed. Throws Error when it does not end with 0.
std::string run(const io::TemporaryFolder& folder, const std::string& command) {
  const std::string all = fmt::format("cd '{}' && {} >said.txt 2>&1 </dev/null", folder.path().string(), command);
  const int status = io::run_program({"sh", "-c", all});
  std::string said = io::read_text(folder.path() / "said.txt");
  if (status != 0) {
    throw Error(
        fmt::format("{} did not succeed: {}", command.substr(0, command.find(' ')), said.substr(0, said.find('\n'))));
  }
  return said;
}

void require_tools(const io::TemporaryFolder& folder) {
  constexpr std::array<std::array<const char*, 3>, 3> tools{
      {{"command -v arm-none-eabi-gcc", "arm-none-eabi-gcc", "gcc-arm-none-eabi"},
       {"echo '#include <math.h>' | arm-none-eabi-gcc --specs=nosys.specs -x c -E -", "newlib for arm-none-eabi",
        "libnewlib-arm-none-eabi"},
       {"command -v qemu-system-arm", "qemu-system-arm", "qemu-system-arm"}}};
  for (const auto& [test, tool, package] : tools) {
    const std::string command = fmt::format("cd '{}' && ({}) >/dev/null 2>&1", folder.path().string(), test);
    if (io::run_program({"sh", "-c", command}) != 0) {
      throw Error(
          fmt::format("cortex-m4f: {} is not installed, which counts the instructions (Debian: apt-get install {})",
                      tool, package));
    }
  }
}

long flash(const io::TemporaryFolder& folder) {
  std::istringstream lines(run(folder, "arm-none-eabi-size image.elf"));
  std::string names;
  std::getline(lines, names);
  long text = 0, data = 0;
  if (!(lines >> text >> data)) throw Error("arm-none-eabi-size printed no sizes");
  return text + data;
}

void build(const io::TemporaryFolder& folder, const std::string& sources) {
  run(folder,
      fmt::format("arm-none-eabi-gcc {} start.c {} -T link.ld -Wl,--gc-sections --specs=nosys.specs -lm -o image.elf",
                  kFlags, sources));
}

}  // namespace

StepCost cortex_m4f_cost(const ControllerDesign& design) {
  CodeOptions options;
  options.prefix = "law";
  options.single_precision = true;
  const ControllerCode code = controller_code(design, options);
  const io::TemporaryFolder folder("cortex");
  require_tools(folder);
  std::vector<SourceFile> files{code.header, code.source, {"empty.c", kEmpty}, {"keep.c", kKeep}};
  for (const char* name : {"count.c", "start.c", "start.h", "link.ld"}) {
    files.push_back({name, std::string(deploy_template(name))});
  }
  io::write_files(folder.path(), files);

  StepCost out;
  build(folder, "empty.c");
  const long empty = flash(folder);
  build(folder, "keep.c law.c");
  out.flash = flash(folder) - empty;
  build(folder, "count.c law.c");
  std::istringstream said(run(folder,
                              "timeout 60 qemu-system-arm -M mps2-an386 -nographic -semihosting-config "
                              "enable=on,target=native -icount shift=0 -kernel image.elf"));
  for (std::string name; said >> name;) {
    long* const value = name == "mean"    ? &out.mean
                        : name == "worst" ? &out.worst
                        : name == "stack" ? &out.stack
                        : name == "state" ? &out.state
                                          : nullptr;
    if (value != nullptr) said >> *value;
  }
  if (out.mean <= 0 || out.worst <= 0) throw Error("qemu-system-arm counted no instructions");
  return out;
}

}  // namespace whirl::deploy
