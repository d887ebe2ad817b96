// What the system allows a process, and names that are no text.
#include <sys/resource.h>

#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

class Limits : public Program {};

TEST_F(Limits, AFileThatMayNotGrowIsAnErrorOfWriting) {
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = 20000;  // bytes
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const Outcome outcome = run({"segment", "v.nii", "--seed", "0,0,0", "-o", "s.stl"});
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(outcome.exit_code, 4) << outcome.err;
  EXPECT_NE(outcome.err.find("s.stl: cannot be written: File too large"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(files().size(), 1u);  // the volume, nothing temporary
}

TEST_F(Limits, ANameThatIsNotUtf8IsToldInJsonAllTheSame) {
  const std::string name = "ball-\xff.nii";
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", name});
  must({"segment", name, "--seed", "0,0,0", "-o", "s.stl", "--json", "s.json", "--recipe",
        "r.json"});
  EXPECT_EQ(json("s.json")["exit_code"], 0);
  EXPECT_FALSE(json("r.json")["objects"].empty());
  must({"info", name, "--json"});
}

// A click in the air near a volume's border once asked for wider and wider blurs.
TEST_F(Limits, AClickBesideAnObjectEndsWithAnEnergyToo) {
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  const Outcome outcome = run({"segment", "v.nii", "--seed=-14,0,0", "--energy", "area:weight=1",
                               "--radius", "2mm", "--max-iterations", "1", "-o", "s.stl"});
  EXPECT_EQ(outcome.exit_code, 8) << outcome.err;  // a ball of 2 mm that area alone shrinks
}

}  // namespace
}  // namespace surfseg::test
