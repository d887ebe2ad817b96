// How a run of curveseg ends: words, codes and files.
#include <fmt/format.h>

#include <algorithm>

#include "libcurve/image/write_image.h"
#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

class CurveOutcomes : public Program {
 protected:
  void make_blob(const Words& more = {}) const {
    must(joined({"phantom", "blob", "-o", "blob.tif"}, more));
  }
  static Words segment(const Words& more) {
    return joined({"segment", "blob.tif", "--seed", "128,128", "-o", "c.json", "--json", "s.json"},
                  more);
  }
  void expect_no_curve(const Outcome& outcome, const std::string& said) const {
    EXPECT_EQ(outcome.exit_code, 8);
    EXPECT_NE(outcome.err.find(said), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    for (const char* name : {"c.json", "m.png", "p.png"}) EXPECT_FALSE(exists(name)) << name;
    EXPECT_EQ(json("s.json")["exit_code"], 8);
  }
  /// A curve that is sound, and nothing temporary.
  void expect_last_good_curve(const Outcome& outcome, int exit_code) const {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    ASSERT_TRUE(exists("c.json"));
    EXPECT_EQ(files().size(), 3u);
    EXPECT_EQ(json("s.json")["exit_code"], exit_code);
    EXPECT_EQ(json("s.json")["outcome"], "interrupted");
    EXPECT_EQ(json("s.json")["simple"], true);
    must({"evaluate", "c.json", "--reference", "c.json", "--json", "e.json"});
    EXPECT_EQ(json("e.json")["dice"], 1);
  }
};

TEST_F(CurveOutcomes, NothingThatStandsOutIsEight) {
  surf::curve::write_image(file("flat.tif"),
                           surf::curve::Image({12, 12}, surf::curve::pixel_to_plane({1, 1}),
                                              std::vector<float>(12 * 12, 5.f)));
  expect_no_curve(run({"segment", "flat.tif", "--seed", "6,6", "-o", "c.json", "--mask", "m.png",
                       "--picture", "p.png", "--json", "s.json", "--quiet"}),
                  "no object stands out");
  EXPECT_EQ(json("s.json")["outcome"], "no object");
}

TEST_F(CurveOutcomes, AnObjectThatVanishesIsEight) {
  make_blob();
  const Outcome outcome = run(segment({"--energy", "minimal-surface:gamma=5,lambda=7", "--mask",
                                       "m.png", "--picture", "p.png", "--quiet"}));
  expect_no_curve(outcome, "the object vanished: ");
  EXPECT_NE(outcome.err.find("; start from a larger shape"), std::string::npos) << outcome.err;
  EXPECT_EQ(json("s.json")["outcome"], "vanished");
}

TEST_F(CurveOutcomes, TheLimitOfStepsIsFiveInEveryMode) {
  make_blob();
  for (const Words& energy : {Words{}, Words{"--energy", "minimal-surface"}}) {
    std::filesystem::remove(file("c.json"));
    const Outcome outcome = run(segment(joined({"--max-iterations", "2"}, energy)));
    EXPECT_EQ(outcome.exit_code, 5);
    EXPECT_NE(outcome.err.find("stopped at a limit after 2 steps"), std::string::npos)
        << outcome.err;
    EXPECT_TRUE(exists("c.json"));
    EXPECT_EQ(json("s.json")["outcome"], "stopped at a limit");
    EXPECT_EQ(json("s.json")["exit_code"], 5);
  }
}

TEST_F(CurveOutcomes, SignalsLeaveTheLastGoodCurve) {
  for (const auto& [signal, exit_code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}}) {
    for (const std::string& name : files()) std::filesystem::remove(name);
    make_blob();
    expect_last_good_curve(interrupted_run(segment({"--energy", "minimal-surface", "-v"}), signal,
                                           "evolve               step    3"),
                           exit_code);
  }
}

TEST_F(CurveOutcomes, InterruptOfTheAutomaticRunLeavesACurve) {
  make_blob();
  expect_last_good_curve(interrupted_run(segment({"-v"}), SIGINT, "evolve               step    1"),
                         130);
}

TEST_F(CurveOutcomes, ASignalBeforeThereIsACurveLeavesNone) {
  make_blob();
  const Outcome outcome = interrupted_run(segment({"-v"}), SIGINT, "propose              step");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_FALSE(exists("c.json"));
  EXPECT_EQ(json("s.json")["outcome"], "interrupted");
}

// The blob's edges are wider than pixels, so what is seen of them depends on where one looks.
TEST_F(CurveOutcomes, TheStatedEnergyGivesTheSameBytesFromTheWrittenStart) {
  for (const auto& [noise, start] :
       {std::pair<std::string, std::string>{"0", "start.json"}, {"0.1", "start.csv"}}) {
    make_blob({"--noise", noise});
    must(segment({"-q", "--start", start}));
    const auto chosen = json("s.json")["chosen"];
    Words again = {"segment", "blob.tif", "--contour", start, "-o", "again.json", "-q"};
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
    EXPECT_EQ(bytes("again.json"), bytes("c.json")) << start;
  }
}

// Two parts, one with a hole.
TEST_F(CurveOutcomes, AGivenStartIsWrittenAsItWasRead) {
  make_blob();
  write("files/parts.json", R"({"type": "MultiPolygon", "coordinates": [
    [[[20,20],[40,20],[40,40],[20,40],[20,20]]],
    [[[90,90],[160,90],[160,160],[90,160],[90,90]],
     [[120,120],[120,130],[130,130],[130,120],[120,120]]]]})");
  const Words run = {"segment", "blob.tif", "--energy", "chan-vese", "-q", "-o", "c.json"};
  must(joined(run, {"--contour", "parts.json", "--start", "a.json"}));
  const std::string first = bytes("c.json");
  must(joined(run, {"--contour", "a.json", "--start", "b.json"}));
  EXPECT_EQ(bytes("b.json"), bytes("a.json"));
  EXPECT_EQ(bytes("c.json"), first);
}

}  // namespace
}  // namespace surfseg::test
