// Pictures that the program makes of its results.
#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

class Pictures : public FileTest {
 protected:
  Pictures() {
    must({"phantom", "ball", "--size", "24", "--spacing", "1", "-o", "ball.nii"});
    must({"segment", "ball.nii", "--seed", "1,0,2", "-o", "a.ply", "--picture", "a.png", "-q"});
  }
  std::string render(const Words& more) const {
    must(joined({"render", "a.ply", "--volume", "ball.nii", "-o", "b.png"}, more));
    return bytes("b.png");
  }
};

TEST_F(Pictures, OfSegmentAreThoseOfRenderWithTheSeeds) {
  EXPECT_EQ(render({"--seed", "1,0,2"}), bytes("a.png"));
  EXPECT_NE(render({}), bytes("a.png"));
}

TEST_F(Pictures, ShowPointsInEverySpace) {
  const std::string ras = render({"--seed", "1,0,2", "--outside", "-9,8,3"});
  EXPECT_EQ(render({"--seed=-1,0,2", "--outside", "9,-8,3", "--space", "lps"}), ras);
  EXPECT_EQ(render({"--seed", "12.5,11.5,13.5", "--outside", "2.5,19.5,14.5", "--space", "ijk"}),
            ras);
  EXPECT_NE(render({"--seed", "1,0,2", "--seed", "-9,8,3"}), ras);
}

TEST_F(Pictures, KnowTheWindowsOfCt) {
  EXPECT_EQ(render({"--window", "brain"}), render({"--window", "0,80"}));
  EXPECT_EQ(render({"--window", "lung"}), render({"--window=-1350,150"}));
  EXPECT_NE(render({"--window", "bone"}), render({"--window", "soft-tissue"}));
}

TEST_F(Pictures, AreSheetsAlongAnAxis) {
  const std::string sheet = render({"--sheet", "3x2"});
  EXPECT_EQ(render({"--sheet", "6"}), sheet);
  EXPECT_EQ(render({"--sheet", "6", "--axis", "axial"}), sheet);
  EXPECT_NE(render({"--sheet", "6", "--axis", "coronal"}), sheet);
  EXPECT_NE(render({"--sheet", "5"}), sheet);
}

}  // namespace
}  // namespace surfseg::test
