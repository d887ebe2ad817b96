// How a run ends: words, codes and files.
#include <fmt/format.h>

#include <algorithm>

#include "libsurf/volume/write_volume.h"
#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

class Outcomes : public Program {
 protected:
  void make_ball() {
    must({"phantom", "ball", "--size", "40", "--spacing", "1", "-o", "ball.nii.gz"});
  }
  static std::vector<std::string> segment(std::vector<std::string> more) {
    more.insert(more.begin(), {"segment", "ball.nii.gz", "--seed", "0,0,0", "-o", "s.stl"});
    return more;
  }
};

TEST_F(Outcomes, NothingThatStandsOutIsEight) {
  surf::volume::write_volume(file("flat.nii.gz"),
                             surf::volume::Volume({12, 12, 12}, Eigen::Affine3d::Identity(),
                                                  std::vector<float>(12 * 12 * 12, 5.f)));
  const Outcome outcome = run(
      {"segment", "flat.nii.gz", "--seed", "6,6,6", "-o", "s.stl", "--json", "s.json", "--quiet"});
  EXPECT_EQ(outcome.exit_code, 8);
  EXPECT_NE(outcome.err.find("no object stands out"), std::string::npos) << outcome.err;
  EXPECT_FALSE(exists("s.stl"));
  EXPECT_EQ(json("s.json")["outcome"], "no object");
  EXPECT_EQ(json("s.json")["exit_code"], 8);
}

TEST_F(Outcomes, AnObjectThatVanishesIsEight) {
  make_ball();
  const Outcome outcome =
      run(segment({"--energy", "minimal-surface:gamma=5,lambda=7", "--json", "s.json", "--quiet"}));
  EXPECT_EQ(outcome.exit_code, 8);
  EXPECT_FALSE(exists("s.stl"));
  EXPECT_EQ(json("s.json")["outcome"], "vanished");
  const std::string said = "the object vanished: ";
  EXPECT_NE(outcome.err.find(said), std::string::npos) << outcome.err;
  EXPECT_EQ(outcome.err.find(said), outcome.err.rfind(said)) << outcome.err;
  EXPECT_NE(outcome.err.find("; start from a larger shape"), std::string::npos) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
}

TEST_F(Outcomes, TheLimitOfStepsIsFiveInEveryMode) {
  make_ball();
  for (const std::vector<std::string>& energy :
       {std::vector<std::string>{}, {"--energy", "minimal-surface"}}) {
    auto arguments = segment({"--max-iterations", "2", "--json", "s.json"});
    arguments.insert(arguments.end(), energy.begin(), energy.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 5);
    EXPECT_NE(outcome.err.find("stopped at a limit after 2 steps"), std::string::npos)
        << outcome.err;
    EXPECT_TRUE(exists("s.stl"));
    EXPECT_EQ(json("s.json")["outcome"], "stopped at a limit");
  }
}

TEST_F(Outcomes, TheStatedEnergyGivesTheSameBytesFromTheWrittenStart) {
  make_ball();
  must(segment({"--json", "s.json", "--start", "start.vtp"}));
  const auto chosen = json("s.json")["chosen"];
  std::vector<std::string> again = {"segment",   "ball.nii.gz", "--initial",
                                    "start.vtp", "-o",          "again.stl"};
  for (const auto& [option, key] : {std::pair{"--sigma", "sigma_mm"},
                                    {"--edge-length", "edge_length_mm"},
                                    {"--geometry-tolerance", "geometry_tolerance_mm"}}) {
    again.push_back(option);
    again.push_back(fmt::format("{}mm", chosen[key].get<double>()));
  }
  for (const auto& energy : chosen["energies"]) {
    again.push_back("--energy");
    again.push_back(energy);
  }
  must(again);
  EXPECT_EQ(bytes("again.stl"), bytes("s.stl"));
}

TEST_F(Outcomes, ARecipeNamesImageAndClicks) {
  make_ball();
  must(segment({"--recipe", "r.json"}));
  const auto recipe = json("r.json");
  EXPECT_EQ(recipe["kind"], "surfseg recipe");
  EXPECT_EQ(recipe["image"]["path"], "ball.nii.gz");
  EXPECT_EQ(recipe["image"]["content"].get<std::string>().size(), 40u);
  EXPECT_EQ(recipe["objects"][0]["history"][1]["do"], "click");
  EXPECT_EQ(recipe["objects"][0]["history"][2]["do"], "evolve");
}

}  // namespace
}  // namespace surfseg::test
