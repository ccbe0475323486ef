#include "door.hpp"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <memory>
#include <string>
#include <vector>

namespace whirl::monitor {
namespace {

struct Street {
  explicit Street(std::size_t most) : door(most) {}
  Door door;
  std::vector<std::string> closed;
  std::vector<std::shared_ptr<Door::Place>> places;
  Door::Place& enter(const std::string& address, const std::string& name) {
    places.push_back(door.enter([this, name] { closed.push_back(name); }, address));
    return *places.back();
  }
};

TEST(Door, WhoHoldsMostPlacesLosesTheOldest) {
  Street street(4);
  street.enter("operator", "first of all");
  for (int i = 0; i < 100; ++i) street.enter("storm", "storm" + std::to_string(i));
  ASSERT_EQ(street.closed.size(), 97U);
  for (std::size_t i = 0; i < street.closed.size(); ++i) EXPECT_EQ(street.closed[i], "storm" + std::to_string(i));
  EXPECT_EQ(street.door.size(), 4U);
  street.enter("colleague", "one more");
  EXPECT_EQ(street.closed.back(), "storm97");
}

TEST(Door, OfOneAddressThoseWhoHaveAskedStayLonger) {
  Street street(3);
  street.enter("one", "asked").asked = true;
  street.enter("one", "silent");
  street.enter("one", "silent too");
  street.enter("one", "new");
  EXPECT_EQ(street.closed, std::vector<std::string>{"silent"});
  while (street.door.close_one()) {
  }
  EXPECT_EQ(street.closed, (std::vector<std::string>{"silent", "silent too", "new", "asked"}));
  EXPECT_FALSE(street.door.close_one());
}

TEST(Door, APlaceThatIsGivenUpCountsNoMore) {
  Street street(2);
  street.enter("one", "a");
  street.enter("one", "b");
  street.places.clear();
  EXPECT_EQ(street.door.size(), 0U);
  street.enter("one", "c");
  EXPECT_TRUE(street.closed.empty());
}

TEST(Door, HasAnEighthOfTheDescriptorsBetweenFourAndAHundredAndTwentyEight) {
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const auto most = [&](rlim_t descriptors) {
    rlimit changed = before;
    changed.rlim_cur = descriptors;
    setrlimit(RLIMIT_NOFILE, &changed);
    return most_unfinished();
  };
  const std::size_t few = most(16), some = most(400), many = most(before.rlim_max);
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(few, 4U);
  EXPECT_EQ(some, 50U);
  EXPECT_EQ(many, before.rlim_max < 1024 ? before.rlim_max / 8 : 128U);
}

}  // namespace
}  // namespace whirl::monitor
