// Recipes: what was done is done again, and what cannot be done says so in one line.
#include <algorithm>

#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

class Replay : public Program {
 protected:
  /// ball.nii.gz, s.stl from it, and r.json that says how.
  void make_recipe(const std::vector<std::string>& more = {}) const {
    must({"phantom", "ball", "--size", "40", "--spacing", "1", "-o", "ball.nii.gz"});
    std::vector<std::string> segment = {"segment", "ball.nii.gz", "--seed", "0,0,0", "-o",
                                        "s.stl",   "--recipe",    "r.json", "-q"};
    segment.insert(segment.end(), more.begin(), more.end());
    run(segment);
  }
  /// r.json with one value of it changed.
  void change(const std::string& pointer, const nlohmann::json& value) const {
    nlohmann::json recipe = json("r.json");
    recipe[nlohmann::json::json_pointer(pointer)] = value;
    write("files/r.json", recipe.dump());
  }
  /// The replay ends with a code, one line with these words, and no file.
  void expect_refused(int exit_code, const std::vector<std::string>& words,
                      const std::vector<std::string>& more = {}) const {
    std::vector<std::string> replay = {"replay", "r.json", "-o", "again.stl", "-q"};
    replay.insert(replay.end(), more.begin(), more.end());
    const Outcome outcome = run(replay);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    for (const std::string& word : words)
      EXPECT_NE(outcome.err.find(word), std::string::npos) << outcome.err;
    EXPECT_FALSE(exists("again.stl"));
  }
};

TEST_F(Replay, GivesTheSameBytesAndTheSameSummary) {
  make_recipe({"--json", "s.json", "--mask", "s.nii.gz"});
  const Outcome outcome =
      must({"replay", "r.json", "-o", "again.stl", "--json", "a.json", "--mask", "a.nii.gz"});
  EXPECT_EQ(bytes("again.stl"), bytes("s.stl"));
  EXPECT_EQ(bytes("a.nii.gz"), bytes("s.nii.gz"));
  EXPECT_NE(outcome.err.find("converged after"), std::string::npos) << outcome.err;
  for (const std::string key : {"outcome", "volume_mm3", "triangles", "chosen", "exit_code"})
    EXPECT_EQ(json("a.json")[key], json("s.json")[key]) << key;
}

// As a dialogue leaves it that is cut off between a click and what comes of it.
TEST_F(Replay, SaysThatTheLastClickIsNotHeeded) {
  make_recipe();
  nlohmann::json recipe = json("r.json");
  recipe["objects"][0]["history"].push_back(
      {{"do", "click"}, {"side", "outside"}, {"point_mm", {8, 0, 0}}});
  write("files/r.json", recipe.dump());
  const Outcome outcome = must({"replay", "r.json", "-o", "again.stl", "--json", "a.json"});
  EXPECT_NE(outcome.err.find("what was done last is not heeded"), std::string::npos) << outcome.err;
  EXPECT_TRUE(json("a.json")["verdict"].is_null());
  recipe["objects"][0]["history"].back()["point_mm"] = {19, 0, 0};  // it is obeyed as it is
  write("files/r.json", recipe.dump());
  EXPECT_EQ(must({"replay", "r.json", "-o", "again.stl"}).err.find("not heeded"),
            std::string::npos);
}

TEST_F(Replay, EndsWithTheCodeOfWhatItRepeats) {
  make_recipe({"--max-iterations", "2"});
  EXPECT_EQ(run({"replay", "r.json", "-o", "again.stl"}).exit_code, 5);
  EXPECT_EQ(bytes("again.stl"), bytes("s.stl"));
}

TEST_F(Replay, FindsTheVolumeBesideTheRecipeOrWhereItIsToldTo) {
  make_recipe();
  std::filesystem::create_directories(file("moved"));
  std::filesystem::rename(file("ball.nii.gz"), file("moved/ball.nii.gz"));
  expect_refused(3, {"ball.nii.gz"});
  must({"replay", "r.json", "-o", "told.stl", "--volume", "moved/ball.nii.gz", "-q"});
  std::filesystem::rename(file("r.json"), file("moved/r.json"));
  must({"replay", "moved/r.json", "-o", "beside.stl", "-q"});
  EXPECT_EQ(bytes("told.stl"), bytes("s.stl"));
  EXPECT_EQ(bytes("beside.stl"), bytes("s.stl"));
  nlohmann::json recipe = json("moved/r.json");
  for (const char* path : {"scans/ball.nii.gz", "/no/such/folder/ball.nii.gz"}) {
    recipe["image"]["path"] = path;
    write("files/moved/r.json", recipe.dump());
    must({"replay", "moved/r.json", "-o", "again.stl", "-q"});
    EXPECT_EQ(bytes("again.stl"), bytes("s.stl"));
  }
}

TEST_F(Replay, RefusesAnotherVolumeAndRecipesThatItCannotRead) {
  make_recipe();
  must({"phantom", "box", "--size", "40", "--spacing", "1", "-o", "box.nii.gz"});
  expect_refused(3, {"r.json", "belongs to another image", "ball.nii.gz"},
                 {"--volume", "box.nii.gz"});
  expect_refused(2, {"--object", "'object 1'", "'spleen'"}, {"--object", "spleen"});
  const Outcome early = run({"replay", "r.json", "-o", "again.stl", "--object", "spleen"});
  EXPECT_EQ(early.exit_code, 2);
  EXPECT_EQ(early.err.find("evolve"), std::string::npos) << early.err;  // before it computes
  change("/dimension", 2);
  expect_refused(3, {"r.json: is a recipe of an image; curveseg replays it"});
  change("/dimension", 4);
  expect_refused(3, {"r.json: recipe: dimension: expected 2 or 3; got 4"});
  change("/dimension", 3);
  change("/objects/0/history/1/do", "dance");
  expect_refused(3, {"r.json", "object 1, entry 2", "'dance' is no action"});
  change("/version", 1000);
  expect_refused(3, {"r.json", "version 1000 is newer"});
  change("/version", "2");
  expect_refused(3, {"r.json", "version \"2\" is no whole number"});
  write("files/r.json", "{}");
  expect_refused(3, {"r.json", "not a surfseg recipe"});
  std::filesystem::remove(file("r.json"));
  expect_refused(3, {"r.json", "cannot be read: No such file"});
  std::filesystem::create_symlink("r.json", file("r.json"));  // leads nowhere
  EXPECT_EQ(run({"replay", "r.json", "-o", "a.stl"}).exit_code, 3);
  const Outcome name = run({"replay", std::string(300, 'r'), "-o", "a.stl"});
  EXPECT_EQ(name.exit_code, 3) << name.err;
}

// A reference that is overwritten would be compared with itself, a Dice of 1.
TEST_F(Replay, OverwritesNothingThatItReads) {
  make_recipe();
  const std::string surface = bytes("s.stl"), volume = bytes("ball.nii.gz");
  write("files/object 1.stl", surface);
  write("files/m.nii.gz", volume);
  const struct {
    std::vector<std::string> words;
    std::string message;
  } cases[] = {
      {{"-o", "s.stl", "--reference", "s.stl"}, "-o: s.stl: is --reference too"},
      {{"-o", "{object}.stl", "--reference", "object 1.stl"},
       "-o: object 1.stl: is --reference too"},
      {{"-o", "object 1.stl", "--reference", "{object}.stl"},
       "-o: object 1.stl: is --reference too"},
      {{"-o", "again.stl", "--mask", "m.nii.gz", "--reference", "m.nii.gz"},
       "--mask: m.nii.gz: is --reference too"},
      {{"-o", "again.stl", "--json", "ball.nii.gz"}, "--json: ball.nii.gz: is the input too"},
      {{"-o", "again.stl", "--json", "ball.nii.gz", "--volume", "ball.nii.gz"},
       "--json: ball.nii.gz: is the input too"}};
  for (const auto& one : cases) {
    std::vector<std::string> replay = {"replay", "r.json", "-q"};
    replay.insert(replay.end(), one.words.begin(), one.words.end());
    const Outcome outcome = run(replay);
    EXPECT_EQ(outcome.exit_code, 2) << one.message;
    EXPECT_NE(outcome.err.find(one.message), std::string::npos) << outcome.err;
  }
  EXPECT_EQ(bytes("s.stl"), surface);
  EXPECT_EQ(bytes("object 1.stl"), surface);
  EXPECT_EQ(bytes("ball.nii.gz"), volume);
  EXPECT_EQ(bytes("m.nii.gz"), volume);
  EXPECT_FALSE(exists("again.stl"));
}

TEST_F(Replay, WithoutRecipeOrOutputIsAUsageError) {
  make_recipe();
  EXPECT_EQ(run({"replay", "-o", "again.stl"}).exit_code, 2);
  EXPECT_EQ(run({"replay", "r.json"}).exit_code, 2);
  EXPECT_EQ(run({"replay", "r.json", "-o", "r.json"}).exit_code, 2);
  change("/image/path", "");
  expect_refused(2, {"--volume", "r.json names no image"});
}

}  // namespace
}  // namespace surfseg::test
