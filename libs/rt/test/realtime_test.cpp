#include "whirl/rt/realtime.hpp"

#include <gtest/gtest.h>
#include <pthread.h>
#include <sched.h>

#include <thread>

namespace whirl::rt {
namespace {

cpu_set_t processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  EXPECT_EQ(pthread_getaffinity_np(pthread_self(), sizeof set, &set), 0);
  return set;
}

int last_of(const cpu_set_t& set) {
  int last = CPU_SETSIZE - 1;
  while (last > 0 && !CPU_ISSET(static_cast<unsigned>(last), &set)) --last;
  return last;
}

TEST(RealtimeThread, GivesTheProcessorsBack) {
  const cpu_set_t before = processors();
  RealtimeOptions options{.priority = 0, .cpu = last_of(before), .lock_memory = false, .no_deep_idle = false};
  {
    const RealtimeThread thread(options);
    ASSERT_TRUE(thread.refused().empty()) << thread.refused().front();
    const cpu_set_t bound = processors();
    EXPECT_EQ(CPU_COUNT(&bound), 1);
    EXPECT_TRUE(CPU_ISSET(static_cast<unsigned>(options.cpu), &bound));
  }
  cpu_set_t after = processors();
  EXPECT_TRUE(CPU_EQUAL(&before, &after)) << CPU_COUNT(&before) << " before, " << CPU_COUNT(&after) << " after";
  std::thread([&] { after = processors(); }).join();
  EXPECT_TRUE(CPU_EQUAL(&before, &after)) << "a thread that starts later";
  options.cpu = CPU_SETSIZE - 1;  // none of them
  if (!CPU_ISSET(static_cast<unsigned>(options.cpu), &before)) {
    EXPECT_EQ(RealtimeThread(options).refused().size(), 1u);
    after = processors();
    EXPECT_TRUE(CPU_EQUAL(&before, &after));
  }
}

TEST(RealtimeThread, GivesItsSchedulingBack) {
  std::thread([] {
    const sched_param none{};
    ASSERT_EQ(pthread_setschedparam(pthread_self(), SCHED_BATCH, &none), 0);
    bool granted = false;
    {
      const RealtimeThread thread({.priority = 1, .lock_memory = false, .no_deep_idle = false});
      granted = thread.refused().empty();
      EXPECT_EQ(sched_getscheduler(0), granted ? SCHED_FIFO : SCHED_BATCH);
    }
    EXPECT_EQ(sched_getscheduler(0), SCHED_BATCH) << (granted ? "granted" : "refused");
  }).join();
}

}  // namespace
}  // namespace whirl::rt
