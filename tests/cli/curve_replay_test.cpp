// Recipes of images.
#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

class CurveReplay : public Program {};

TEST_F(CurveReplay, GivesTheSameBytesAndRefusesAnotherImage) {
  must({"phantom", "blob", "-o", "blob.tif"});
  must({"phantom", "blob", "--noise", "0.1", "-o", "noisy.tif"});
  must({"segment", "blob.tif", "--seed", "128,128", "-o", "a.json", "--recipe", "r.json", "-q"});
  must({"replay", "r.json", "-o", "b.json", "-q"});
  EXPECT_EQ(bytes("b.json"), bytes("a.json"));
  const Outcome outcome = run({"replay", "r.json", "-o", "c.json", "--image", "noisy.tif"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.err.find("belongs to another image"), std::string::npos) << outcome.err;
  EXPECT_FALSE(exists("c.json"));
  const Outcome none = run({"replay", "b.json", "-o", "c.json"});
  EXPECT_EQ(none.exit_code, 3);
  EXPECT_NE(none.err.find("b.json: recipe: not a surfseg recipe"), std::string::npos) << none.err;
}

}  // namespace
}  // namespace surfseg::test
