#include "libsurf/flow/moving_shape.h"

#include <gtest/gtest.h>

#include <set>

namespace surf::flow {
namespace {

// Summaries and progress lines are read by programs: each kind has a word of its own.
TEST(TopologyChange, HasAWordOfItsOwn) {
  std::set<std::string> words;
  for (int kind = 0; kind <= int(TopologyChange::kVanishing); ++kind)
    words.insert(to_string(TopologyChange(kind)));
  EXPECT_EQ(words,
            (std::set<std::string>{"untangling", "merging", "self-merging", "self-crossing",
                                   "handle-closing", "splitting", "inside-opening", "vanishing"}));
}

}  // namespace
}  // namespace surf::flow
