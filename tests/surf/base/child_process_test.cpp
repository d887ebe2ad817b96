#include "libsurf/base/detail/child_process.h"

#include <gtest/gtest.h>

#include <csignal>
#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <vector>

namespace surf {
namespace {

/// Answers each number with its double.
void double_all(Channel& channel) {
  int number = 0;
  while (channel.receive(number)) channel.send(2 * number);
}

TEST(ChildProcess, AnswersAsLongAsItIsAsked) {
  ChildProcess child(double_all);
  for (const int number : {1, -7, 1 << 20}) {
    int answer = 0;
    ASSERT_TRUE(child.channel().send(number));
    ASSERT_TRUE(child.channel().receive(answer));
    EXPECT_EQ(answer, 2 * number);
  }
}

TEST(ChildProcess, SendsMoreThanTheSystemHoldsBack) {
  std::vector<char> bytes(50'000'000, 'x');
  ChildProcess child([&](Channel& channel) { channel.send(bytes.data(), bytes.size()); });
  std::vector<char> received(bytes.size());
  ASSERT_TRUE(child.channel().receive(received.data(), received.size()));
  EXPECT_EQ(received, bytes);
}

TEST(ChildProcess, ItsEndIsSeenAndNotHeard) {
  testing::internal::CaptureStderr();
  for (void (*end)() : {+[] { std::abort(); }, +[] { throw std::runtime_error("no"); },
                        +[] { std::cerr << "damaged" << std::endl; }}) {
    ChildProcess child([&](Channel&) { end(); });
    int answer = 0;
    EXPECT_FALSE(child.channel().receive(answer));
    while (child.channel().send(answer)) {  // until the end has come here, too
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(ChildProcess, TellsAnEndByTheSystemFromOthers) {
  int answer = 0;
  ChildProcess killed([](Channel&) { std::raise(SIGKILL); });
  EXPECT_FALSE(killed.channel().receive(answer));
  EXPECT_TRUE(killed.was_killed());
  for (void (*end)() : {+[] {}, +[] { std::abort(); }}) {
    ChildProcess ended([&](Channel&) { end(); });
    EXPECT_FALSE(ended.channel().receive(answer));
    EXPECT_FALSE(ended.was_killed());
  }
}

TEST(ChildProcess, MayBeGivenSoMuchTimeOfTheProcessor) {
  ChildProcess child([](Channel&) {
    limit_cpu_seconds(0);
    for (;;) {
    }
  });
  int answer = 0;
  EXPECT_FALSE(child.channel().receive(answer));
  EXPECT_FALSE(child.was_killed());
}

TEST(ChildProcess, IsEndedWithItsObject) {
  const auto child = [] {
    return ChildProcess([](Channel&) {
      for (;;) {
      }
    });
  };
  child();
}

}  // namespace
}  // namespace surf
