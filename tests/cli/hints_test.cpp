// What the program offers and says of its own: presets, options that do nothing.
#include <cstdlib>

#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

class Presets : public FileTest {
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

TEST_F(Presets, FilesOfASummarysRunAreNotWrittenOverByAnotherOutput) {
  make_ball();
  must({"segment", "ball.nii", "--seed", "0,0,0", "-o", "a.ply", "--mask", "a.nii", "--recipe",
        "a.rec.json", "--json", "s.json", "-q"});
  const std::string mask = bytes("a.nii"), recipe = bytes("a.rec.json");
  must({"segment", "--config", "s.json", "--outside", "0,0,5", "-o", "b.ply", "-q"});
  EXPECT_EQ(bytes("a.nii"), mask);
  EXPECT_EQ(bytes("a.rec.json"), recipe);
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

/// Options beside which others do nothing.
struct Idle {
  const char* test;
  Words options, idle;
};
void PrintTo(const Idle& row, std::ostream* stream) { *stream << row.test; }

const Words kArea = {"--energy", "area"};
const std::vector<Idle> kIdle = {
    {"Threshold", kArea, {"--selective-threshold", "3"}},
    {"NoSettle", {"--energy", "willmore"}, {"--no-settle"}},
    {"NoSettleWithContent", joined(kArea, {"--volume", "keep"}), {"--no-settle"}},
    {"NoLocate", kArea, {"--no-locate"}},
    {"NoLocateWithoutSettling", {"--no-settle"}, {"--no-locate"}},
    {"SheetDistance", kArea, {"--sheet-distance", "1mm"}},
    {"TopologyResolution",
     joined(kArea, {"--topology", "fixed"}),
     {"--topology-resolution", "1mm"}},
    {"Scheme", joined(kArea, {"--flow", "newton"}), {"--scheme", "explicit"}},
    {"StepRule", joined(kArea, {"--flow", "lbfgs"}), {"--step-rule", "backtracking"}},
    {"Radius", joined(kArea, {"--initial-ball", "0,0,0,5mm"}), {"--radius", "3mm"}}};

class IdleOptions : public FileTest {
 protected:
  IdleOptions() { must({"phantom", "ball", "--size", "16", "--spacing", "1", "-o", "ball.nii"}); }

  Outcome run_with(const Words& options) const {
    return run(joined({"segment", "ball.nii", "--seed", "0,0,0", "--max-iterations", "2", "-o",
                       "a.ply", "--json", "s.json"},
                      options));
  }
};

class EachIdleOption : public IdleOptions, public ::testing::WithParamInterface<Idle> {};

TEST_P(EachIdleOption, IsNotedAndChangesNothing) {
  const auto& [test, options, idle] = GetParam();
  const std::string sentence = "note: " + idle[0] + " has no effect ";
  EXPECT_EQ(run_with(options).err.find(sentence), std::string::npos);
  const std::string without = bytes("a.ply");
  const std::string notes = run_with(joined(options, idle)).err;
  EXPECT_NE(notes.find(sentence), std::string::npos) << notes;
  EXPECT_EQ(bytes("a.ply"), without);
}
INSTANTIATE_TEST_SUITE_P(All, EachIdleOption, ::testing::ValuesIn(kIdle),
                         [](const auto& row) { return row.param.test; });

TEST_F(IdleOptions, AreNotTheShorthandsButTheyLeaveTheAutomaticWay) {
  EXPECT_NE(run_with({"--gamma", "-0.1"})
                .err.find("note: --gamma means --energy minimal-surface: the object is not looked"),
            std::string::npos);
  EXPECT_NE(run_with({"--lambda", "2", "--gamma0", "2"})
                .err.find("note: --gamma0, --lambda mean --energy minimal-surface"),
            std::string::npos);
}

TEST_F(IdleOptions, AreNotThoseWithAnEffectNorDefaultsOfASummaryThatIsFedBack) {
  for (const Words& options :
       {Words{}, Words{"--no-locate"},
        Words{"--energy", "minimal-surface", "--gamma", "-0.1", "--levels", "2"},
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
