// Ctrl-C, SIGTERM, a limit of CPU time: the last good surface is written, and the exit code tells.
#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

class Signals : public Program {
 protected:
  void expect_last_good_surface(int signal, int exit_code) {
    must({"phantom", "ball", "--size", "96", "--spacing", "1", "-o", "v.nii"});
    const Outcome outcome = interrupted_run(
        {"segment", "v.nii", "--seed", "0,0,0", "--radius", "6mm", "--edge-length", "0.7mm",
         "--energy", "minimal-surface", "-v", "-o", "s.ply", "--json", "s.json"},
        signal, "evolve               step    3");
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    ASSERT_TRUE(exists("s.ply"));
    EXPECT_EQ(json("s.json")["exit_code"], exit_code);
    EXPECT_EQ(json("s.json")["outcome"], "interrupted");
    must({"evaluate", "s.ply", "--reference", "s.ply", "--json", "e.json"});
    EXPECT_TRUE(json("e.json")["quality"]["passed"]) << json("e.json")["quality"];
    EXPECT_GT(json("e.json")["volume_mm3"], 0);
    EXPECT_EQ(files().size(), 4u);  // nothing temporary is left
  }
};

TEST_F(Signals, InterruptLeavesTheLastGoodSurface) { expect_last_good_surface(SIGINT, 130); }

TEST_F(Signals, TerminateLeavesTheLastGoodSurface) { expect_last_good_surface(SIGTERM, 143); }

// As the kernel sends it: again with each second.
TEST_F(Signals, ALimitOfCpuTimeLeavesTheLastGoodSurface) { expect_last_good_surface(SIGXCPU, 152); }

TEST_F(Signals, InterruptOfTheAutomaticRunLeavesASurface) {
  must({"phantom", "ball", "--size", "96", "--spacing", "1", "-o", "v.nii"});
  const Outcome outcome = interrupted_run(
      {"segment", "v.nii", "--seed", "0,0,0", "--edge-length", "0.7mm", "-v", "-o", "s.stl"},
      SIGINT, "evolve               step    1");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  must({"evaluate", "s.stl", "--reference", "s.stl", "--json", "e.json"});
  EXPECT_TRUE(json("e.json")["quality"]["passed"]) << json("e.json")["quality"];
}

}  // namespace
}  // namespace surfseg::test
