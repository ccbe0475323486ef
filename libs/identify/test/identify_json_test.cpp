// What is read back of a model file's evidence.
#include "whirl/identify/identify_json.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "whirl/core/error.hpp"
#include "whirl/io/json.hpp"
#include "whirl/testing/compiled.hpp"

namespace whirl::identification {
namespace {

double left(const std::string& text) {
  const testing::TemporaryFolder folder;
  io::save_json(folder.path() / "model.json", io::parse_json(text, "text"));
  return load_left_unexplained(folder.path() / "model.json");
}

TEST(LeftUnexplained, IsTheWorstStateOfTheMotionHeldOut) {
  EXPECT_DOUBLE_EQ(left(R"({"evidence":{"held_out":{"free_run":[{"nrmse":0.02},{"nrmse":0.3},{"nrmse":null}]}}})"),
                   0.3);
  EXPECT_TRUE(std::isnan(left(R"({"evidence":{"held_out":{"free_run":[]}}})")));
  EXPECT_TRUE(std::isnan(left(R"({"evidence":{"held_out":null}})")));
  EXPECT_TRUE(std::isnan(left(R"({"schema":"whirl.model/1"})")));
  EXPECT_THROW(left(R"({"evidence":{"held_out":{"free_run":[{"nrmse":"much"}]}}})"), Error);
  EXPECT_THROW(left(R"({"evidence":{"held_out":{"free_run":3}}})"), Error);
}

}  // namespace
}  // namespace whirl::identification
