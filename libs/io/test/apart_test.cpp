#include "whirl/io/apart.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <vector>

#include "whirl/core/error.hpp"
#include "whirl/testing/error_of.hpp"

namespace whirl::io {
namespace {

using ::testing::AllOf;
using testing::error_of;
using ::testing::HasSubstr;

void nothing(ParcelReader&) {}

TEST(ReadApart, HandsOverWhatItWroteWhateverItsSize) {
  const std::vector<double> many(300'000, 2.5);  // beyond the buffer
  int here = 0;
  std::vector<double> got;
  read_apart(
      "a.h5", 1000,
      [&](ParcelWriter& out) {
        here = 1;  // in the other process only
        out.value(7);
        out.text("mm");
        out.text("");
        out.values(std::span(many.data(), many.size()));
        out.value(8L);
      },
      [&](ParcelReader& in) {
        EXPECT_EQ(in.value<int>(), 7);
        EXPECT_EQ(in.text(), "mm");
        EXPECT_EQ(in.text(), "");
        got.resize(in.count<double>());
        in.copy(got.data(), 8 * got.size());
        EXPECT_EQ(in.value<long>(), 8);
      });
  EXPECT_EQ(got, many);
  EXPECT_EQ(here, 0);
}

TEST(ReadApart, WhateverHappensThereIsAnErrorHere) {
  const auto failing = [](const std::function<void(ParcelWriter&)>& read) {
    bool taken = false;
    const std::string error = error_of([&] { read_apart("a.h5", 1000, read, [&](ParcelReader&) { taken = true; }); });
    EXPECT_FALSE(taken);
    return error;
  };
  EXPECT_EQ(failing([](ParcelWriter&) { throw Error("a.h5: cut off"); }), "a.h5: cut off");
  EXPECT_THAT(failing([](ParcelWriter& out) {
                out.text(std::string(200'000, 'x'));  // a part is out already
                throw std::bad_alloc();
              }),
              AllOf(HasSubstr("a.h5"), HasSubstr("needs more memory than the")));
  EXPECT_THAT(failing([](ParcelWriter&) { std::raise(SIGSEGV); }),
              HasSubstr("a.h5: is damaged: the HDF5 library fails"));
  EXPECT_THAT(failing([](ParcelWriter&) { std::abort(); }), HasSubstr("is damaged"));
  EXPECT_THAT(failing([](ParcelWriter&) { _exit(3); }), HasSubstr("is damaged"));
  EXPECT_THAT(failing([](ParcelWriter&) { std::raise(SIGALRM); }), HasSubstr("does not come to an end within 20 s"));
}

// A small file gives no more than deflate can make of it.
TEST(ReadApart, WhatIsHandedOverIsBoundedByTheSizeOfTheFile) {
  const std::vector<char> block(1 << 20);
  long taken = 0;
  EXPECT_THAT(error_of([&] {
                read_apart(
                    "a.h5", 1000,
                    [&](ParcelWriter& out) {
                      for (int i = 0; i < 100; ++i) out.values(std::span(block.data(), block.size()));
                    },
                    [&](ParcelReader&) { ++taken; });
              }),
              HasSubstr("a.h5"));
  EXPECT_EQ(taken, 0);
}

// A machine that is busy, or a disk that is slow, does not make a sound file damaged: time that is slept does not
// count.
TEST(ReadApart, TheMemoryIsBoundedAndOnlyComputingCounts) {
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)  // their own memory would count too
  EXPECT_THAT(error_of([&] {
                read_apart(
                    "a.h5", 1000,
                    [&](ParcelWriter& out) {
                      std::vector<std::vector<char>> kept;
                      for (int i = 0; i < 64; ++i) kept.emplace_back(std::size_t{1} << 25, 'x');
                      out.value(static_cast<int>(kept.size()));
                    },
                    nothing);
              }),
              HasSubstr("a.h5: needs more memory"));
#endif
  rlimit time{};
  unsigned alarm_at = 0;
  read_apart(
      "a.h5", 1000,
      [](ParcelWriter& out) {
        rlimit here{};
        getrlimit(RLIMIT_CPU, &here);
        out.value(here);
        out.value(alarm(0));
      },
      [&](ParcelReader& in) { time = in.value<rlimit>(), alarm_at = in.value<unsigned>(); });
  EXPECT_EQ(time.rlim_cur, 20U);
  EXPECT_GE(alarm_at, 500U);
}

TEST(ReadApart, SleepWithoutEndIsEnded) {
  const auto start = std::chrono::steady_clock::now();
  EXPECT_THAT(error_of([&] {
                read_apart(
                    "a.h5", 10, [](ParcelWriter&) { sleep(300); }, nothing, 1);
              }),
              HasSubstr("does not come to an end within 1 s"));
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(60));
}

TEST(ReadApart, AParcelThatEndsBeforeItsNumbersIsRefused) {
  const auto error = [](auto write, auto take) { return error_of([&] { read_apart("a.h5", 10, write, take); }); };
  const auto four = [](ParcelWriter& out) { out.value(std::uint64_t{4}); };
  EXPECT_THAT(error(four, [](ParcelReader& in) { (void)in.count<double>(); }),
              AllOf(HasSubstr("a.h5"), HasSubstr("end")));
  EXPECT_THAT(error(four, [](ParcelReader& in) { (void)in.text(); }), HasSubstr("end"));
  EXPECT_THAT(error(four, [](ParcelReader& in) { (void)in.value<double>(), (void)in.value<char>(); }),
              HasSubstr("end"));
  EXPECT_THAT(error([](ParcelWriter& out) { out.value(~std::uint64_t{0}); },
                    [](ParcelReader& in) { (void)in.count<double>(); }),
              HasSubstr("end"));
  EXPECT_EQ(error(four, nothing), "no error") << "what is not asked for is left";
}

}  // namespace
}  // namespace whirl::io
