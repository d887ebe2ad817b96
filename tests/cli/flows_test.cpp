// Flows, kept contents and landmarks through the program.
#include <cmath>

#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

using Words = std::vector<std::string>;

constexpr double kRadiusMm = 0.6 * 15.5;  // the ball of 32^3 voxels of 1 mm: phantom.h
const double kVolumeMm3 = 4.0 / 3 * M_PI * std::pow(kRadiusMm, 3);

class Flows : public Program {
 protected:
  void SetUp() override {
    must({"phantom", "ball", "--size", "32", "--spacing", "1", "--origin", "-11.5,-15.5,-18.5",
          "-o", "ball.nii.gz"});  // about (4, 0, -3) RAS
    save("lps.fcsv",
         "# CoordinateSystem = LPS\n0,-14,0,-3\n1,6,0,-3\n2,-4,10,-3\n3,-4,-10,-3\n4,-4,0,7\n"
         "5,-4,0,-13\n");
  }
  void save(const std::string& name, const std::string& content) const {
    write("files/" + name, content);
  }
  Outcome segment(const Words& more) const {
    Words words = {"segment", "ball.nii.gz", "-q", "-o", "s.ply", "--json", "s.json"};
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  }
  double volume() const { return json("s.json")["volume_mm3"]; }
};

TEST_F(Flows, OfAllKindsFindTheBallFromLandmarksRoundIt) {
  constexpr double kShell = 3 * 0.15 / kRadiusMm;  // volume of a shell of 0.15 mm, of the ball's
  std::vector<double> volumes;
  for (const std::string flow : {"h1", "l2", "newton", "lbfgs"}) {
    const Outcome outcome =
        segment({"--landmarks", "lps.fcsv", "--flow", flow, "--energy", "minimal-surface:gamma=0"});
    ASSERT_EQ(outcome.exit_code, 0) << flow << outcome.err;
    EXPECT_NEAR(volume(), kVolumeMm3, kShell * kVolumeMm3) << flow;
    volumes.push_back(volume());
    EXPECT_NEAR(volumes.back(), volumes.front(), 1e-3 * kVolumeMm3) << flow;
    const auto centre = json("s.json")["centroid_ras_mm"];
    EXPECT_NEAR(centre[0], 4, 0.1) << flow;
    EXPECT_NEAR(centre[2], -3, 0.1) << flow;
  }
}

TEST_F(Flows, KeepTheVolumeThatIsAskedFor) {
  constexpr double kFloats = 1e-6;  // coordinates in the file
  for (const std::string flow : {"h1", "l2", "newton"}) {
    const Outcome outcome =
        segment({"--landmarks", "lps.fcsv", "--flow", flow, "--energy", "area", "--volume", "3ml"});
    ASSERT_EQ(outcome.exit_code, 0) << flow << outcome.err;
    EXPECT_NEAR(volume(), 3000, 3000 * kFloats) << flow;
  }
  ASSERT_EQ(
      segment({"--initial-ellipsoid", "4,0,-3,12mm,8mm,6mm", "--flow", "h-1", "--energy", "area"})
          .exit_code,
      0);
  const double ellipsoid = 4.0 / 3 * M_PI * 12 * 8 * 6;
  EXPECT_NEAR(volume(), ellipsoid, 0.02 * ellipsoid);  // chords
  const double area = json("s.json")["area_mm2"];
  EXPECT_NEAR(area, std::cbrt(36 * M_PI) * std::pow(volume(), 2.0 / 3), 0.01 * area);
}

TEST_F(Flows, TakeLandmarksInTheSpaceOfTheirFileOrTheOption) {
  const Words energy = {"--energy", "minimal-surface:gamma=0", "--max-iterations", "1"};
  const auto start = [&](const Words& more) {
    Words words = energy;
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = segment(words);
    EXPECT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 5) << outcome.err;
    return json("s.json")["centroid_ras_mm"];
  };
  const auto expected = start({"--landmarks", "lps.fcsv"});
  save("ras.txt", "14 0 -3\n-6 0 -3\n4 -10 -3\n4 10 -3\n4 0 7\n4 0 -13\n");
  save("ijk.txt",
       "25.5,15.5,15.5\n5.5,15.5,15.5\n15.5,5.5,15.5\n15.5,25.5,15.5\n"
       "15.5,15.5,25.5\n15.5,15.5,5.5\n");
  EXPECT_EQ(start({"--landmarks", "ras.txt"}), expected);
  const auto from_voxels = start({"--landmarks", "ijk.txt", "--space", "ijk"});
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_NEAR(from_voxels[axis].get<double>(), expected[axis].get<double>(), 1e-6);
}

TEST_F(Flows, TakeNoLongerStepThanIsAskedFor) {
  const auto n_steps = [&](const Words& more) {
    Words words = {"--landmarks", "lps.fcsv", "--energy", "minimal-surface:gamma=0"};
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(segment(words).exit_code, 0);
    int n = 0;
    const auto summary = json("s.json");
    for (const auto& stage : summary["evolution"]) n += stage["steps"].get<int>();
    return n;
  };
  EXPECT_GE(n_steps({"--tau-max", "0.1"}), 2 * n_steps({}));
}

TEST_F(Flows, SayWhatDoesNotGoTogether) {
  const std::vector<std::pair<Words, std::string>> cases = {
      {{"--landmarks", "lps.fcsv", "--energy", "area", "--volume", "9l"},
       "--volume: expected keep, or a content such as 5000mm3 or 5ml; got '9l'"},
      {{"--landmarks", "lps.fcsv", "--energy", "area", "--volume", "keep", "--flow", "lbfgs"},
       "--volume: --flow lbfgs cannot keep the volume"},
      {{"--landmarks", "lps.fcsv", "--energy", "area", "--flow", "newton", "--scheme",
        "semi-implicit"},
       "--scheme semi-implicit: it belongs to the flows h1, l2 and h-1"},
      {{"--seed", "4,0,-3", "--flow", "h-1"}, "--flow h-1: the volume stays"},
      {{"--seed", "4,0,-3", "--flow", "newton"}, "--flow newton: it needs an --energy"},
      {{"--landmarks", "lps.fcsv", "--initial-ball", "4,0,-3,5mm", "--energy", "area"},
       "give one of them"}};
  for (const auto& [words, message] : cases) {
    const Outcome outcome = segment(words);
    EXPECT_EQ(outcome.exit_code, 2) << message;
    EXPECT_NE(outcome.err.find(message), std::string::npos) << outcome.err;
  }
  save("two.txt", "1 2\n3 4\n5 7\n");
  const Outcome outcome = segment({"--landmarks", "two.txt", "--energy", "area"});
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_NE(outcome.err.find("expected three coordinates a line; got 2"), std::string::npos);
}

}  // namespace
}  // namespace surfseg::test
