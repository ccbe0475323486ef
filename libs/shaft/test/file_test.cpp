#include <gtest/gtest.h>

#include "whirl/core/error.hpp"
#include "whirl/shaft/modes.hpp"
#include "whirl/shaft/rotor_file.hpp"

namespace whirl::shaft {
namespace {

TEST(RotorFile, EveryTemplateIsARotorWithModes) {
  for (const std::string& name : rotor_templates()) {
    const Rotor rotor = parse_rotor(rotor_template(name), name);
    EXPECT_EQ(modes(assemble(rotor), 100, 4).size(), 4u) << name;
  }
}

}  // namespace
}  // namespace whirl::shaft
