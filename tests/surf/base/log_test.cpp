#include "libsurf/base/log.h"

#include <gtest/gtest.h>

#include <thread>
#include <utility>
#include <vector>

namespace surf {
namespace {

struct Log : ::testing::Test {
  ~Log() override { set_log_sink({}); }
};

TEST_F(Log, PrintsNothingWithoutASink) {
  ::testing::internal::CaptureStdout();
  ::testing::internal::CaptureStderr();
  log(LogLevel::kWarning, "nobody hears this");
  EXPECT_EQ(::testing::internal::GetCapturedStdout(), "");
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

TEST_F(Log, SendsLevelAndLineToTheSinkOnly) {
  std::vector<std::pair<LogLevel, std::string>> lines;
  set_log_sink([&](LogLevel level, const std::string& line) { lines.emplace_back(level, line); });
  log(LogLevel::kInfo, "one");
  log(LogLevel::kDebug, "two");
  set_log_sink({});
  log(LogLevel::kWarning, "three");
  ASSERT_EQ(lines.size(), 2u);
  EXPECT_EQ(lines[0], std::pair(LogLevel::kInfo, std::string("one")));
  EXPECT_EQ(lines[1], std::pair(LogLevel::kDebug, std::string("two")));
}

TEST_F(Log, CallsTheSinkFromOneThreadAtATime) {
  int n_lines = 0;  // unguarded: the logger's lock is what keeps the count right
  set_log_sink([&](LogLevel, const std::string&) { ++n_lines; });
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([] {
      for (int k = 0; k < 2000; ++k) log(LogLevel::kInfo, "line");
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(n_lines, 8000);
}

}  // namespace
}  // namespace surf
