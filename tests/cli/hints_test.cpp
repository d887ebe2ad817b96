// What the program offers and says of its own: presets, options that do nothing.
#include <cstdlib>

#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

class Presets : public RowTest {
 protected:
  ~Presets() override { ::unsetenv("SURFSEG_PRESETS"); }

  void use_own() const {
    std::filesystem::create_directories(file("presets"));
    put("presets/ball.json",
        R"({"description": "A bright ball", "energy": ["window:mean=1,half-width=0.5", "area"],
            "radius": "3mm", "edge-length": "2mm"})");
    ::setenv("SURFSEG_PRESETS", "presets", /*overwrite=*/1);
  }
  void make_ball() const {
    must({"phantom", "ball", "--size", "24", "--spacing", "1", "-o", "ball.nii"});
  }
};

TEST_F(Presets, AreListedWithWhatTheyAreForAndNothingElseIsAsked) {
  const Outcome list = must({"segment", "--preset", "list"});
  EXPECT_NE(list.out.find("kidney-ct       Kidney in CT"), std::string::npos) << list.out;
  EXPECT_GE(std::count(list.out.begin(), list.out.end(), '\n'), 6);
  EXPECT_EQ(list.err, "");
}

TEST_F(Presets, GiveTheirOptionsWhereTheCommandLineHasNone) {
  make_ball();
  use_own();
  EXPECT_NE(must({"segment", "--preset", "list"}).out.find("ball            A bright ball"),
            std::string::npos);
  must({"segment", "ball.nii", "--seed", "0,0,0", "--preset", "ball", "--radius", "4mm", "-o",
        "a.ply", "--json", "s.json", "-q"});
  const auto config = json("s.json")["config"];
  EXPECT_EQ(config["radius"], "4mm");
  EXPECT_EQ(config["edge-length"], "2mm");
  EXPECT_EQ(config["energy"].size(), 2u);
}

TEST_F(Presets, AreInTheSummaryOptionByOptionSoThatItRepeatsTheRunWithoutThem) {
  make_ball();
  use_own();
  must({"segment", "ball.nii", "--seed", "0,0,0", "--preset", "ball", "-o", "a.ply", "--json",
        "s.json", "-q"});
  const std::string first = bytes("a.ply");
  ::unsetenv("SURFSEG_PRESETS");
  must({"segment", "--config", "s.json", "-q"});
  EXPECT_EQ(bytes("a.ply"), first);
}

TEST_F(Presets, MayBeNamedInAConfigWhichWins) {
  make_ball();
  use_own();
  put("c.json", R"({"preset": "ball", "radius": "5mm"})");
  must({"segment", "ball.nii", "--seed", "0,0,0", "--config", "c.json", "-o", "a.ply", "--json",
        "s.json", "-q"});
  const auto config = json("s.json")["config"];
  EXPECT_EQ(config["radius"], "5mm");
  EXPECT_EQ(config["edge-length"], "2mm");
}

/// `exit_code` is not looked at.
const std::vector<Row> kIdle = {
    {"Threshold",
     {"--selective-threshold", "3"},
     0,
     "note: --selective-threshold has no effect without --selective-sigma"},
    {"Levels", {"--levels", "2"}, 0, "note: --levels has no effect without --energy"},
    {"OpenCavities", {"--open-cavities"}, 0, "note: --open-cavities has no effect without"},
    {"NoSettle",
     {"--energy", "willmore", "--no-settle"},
     0,
     "note: --no-settle has no effect here"},
    {"NoSettleWithContent",
     {"--energy", "area", "--volume", "keep", "--no-settle"},
     0,
     "note: --no-settle has no effect here"},
    {"SheetDistance",
     {"--energy", "area", "--sheet-distance", "1mm"},
     0,
     "note: --sheet-distance has no effect with --topology free"},
    {"TopologyResolution",
     {"--energy", "area", "--topology", "fixed", "--topology-resolution", "1mm"},
     0,
     "note: --topology-resolution has no effect with --topology fixed"},
    {"Scheme",
     {"--energy", "area", "--flow", "newton", "--scheme", "explicit"},
     0,
     "note: --scheme has no effect with --flow newton"},
    {"StepRule",
     {"--energy", "area", "--flow", "lbfgs", "--step-rule", "backtracking"},
     0,
     "note: --step-rule has no effect with --flow lbfgs"},
    {"GeometryTolerance",
     {"--energy", "area", "--coarseness", "1", "--geometry-tolerance", "1mm"},
     0,
     "note: --geometry-tolerance has no effect with --coarseness 1"},
    {"Radius",
     {"--energy", "area", "--initial-ball", "0,0,0,5mm", "--radius", "3mm"},
     0,
     "note: --radius has no effect where the initial shape is given"},
    {"Gamma",
     {"--gamma", "-0.1"},
     0,
     "note: --gamma means --energy minimal-surface: the object is not looked for"},
    {"LambdaAndGamma0",
     {"--lambda", "2", "--gamma0", "2"},
     0,
     "note: --gamma0, --lambda mean --energy minimal-surface"}};

class IdleOptions : public RowTest {
 protected:
  Outcome run_with(const Words& options) const {
    must({"phantom", "ball", "--size", "16", "--spacing", "1", "-o", "ball.nii"});
    return run(joined({"segment", "ball.nii", "--seed", "0,0,0", "--max-iterations", "2", "-o",
                       "a.ply", "--json", "s.json"},
                      options));
  }
};

TEST_P(IdleOptions, AreNoted) {
  const Outcome outcome = run_with(GetParam().arguments);
  EXPECT_NE(outcome.err.find(GetParam().piece), std::string::npos) << outcome.err;
}
INSTANTIATE_TEST_SUITE_P(All, IdleOptions, ::testing::ValuesIn(kIdle), name_of);

TEST_F(IdleOptions, AreNotThoseWithAnEffectNorDefaultsOfASummaryThatIsFedBack) {
  for (const Words& options :
       {Words{}, Words{"--energy", "minimal-surface", "--gamma", "-0.1", "--levels", "2"},
        Words{"--energy", "area", "--topology", "fixed", "--sheet-distance", "1mm"}}) {
    const std::string notes = run_with(options).err;
    EXPECT_EQ(notes.find("has no effect"), std::string::npos) << notes;
    EXPECT_EQ(notes.find("means --energy"), std::string::npos) << notes;
    const std::string again = run({"segment", "--config", "s.json"}).err;
    EXPECT_EQ(again.find("has no effect"), std::string::npos) << again;
  }
}

}  // namespace
}  // namespace surfseg::test
