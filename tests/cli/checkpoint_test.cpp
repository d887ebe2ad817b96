// Nothing is lost: a run that is killed goes on from its last stage, and ends in the same bytes.
#include <algorithm>
#include <random>
#include <sstream>

#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

class Checkpoints : public Program {
 protected:
  using Words = std::vector<std::string>;

  static Words with(Words words, const Words& more) {
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }

  void make_volume() {
    must({"phantom", "ball", "--size", "48", "--spacing", "1", "--noise", "0.1", "-o", "v.nii"});
  }

  /// What -v printed of the steps, up to their numbers.
  static Words steps(const std::string& err) {
    constexpr std::size_t kStage = 20, kStep = 10;
    Words out;
    std::istringstream stream(err);
    for (std::string line; std::getline(stream, line);)
      if (line.size() > kStage + kStep && line.compare(kStage, 6, " step ") == 0)
        out.push_back(line.substr(0, kStage + kStep));
    return out;
  }

  /// Two summaries, but for what depends on the clock.
  static void expect_same_summary(nlohmann::json a, nlohmann::json b) {
    for (auto* summary : {&a, &b}) erase_times(*summary);
    EXPECT_EQ(a, b);
  }

 private:
  static void erase_times(nlohmann::json& json) {
    for (const char* key : {"time_s", "cpu_s", "peak_memory_mb", "stages", "config"})
      if (json.is_object()) json.erase(key);
    if (json.is_structured())
      for (auto& entry : json) erase_times(entry);
  }
};

TEST_F(Checkpoints, AKillAtAnyMomentCostsNothingButTime) {
  make_volume();
  const Words words = {"segment", "v.nii", "--seed", "1,0,0",  "--levels", "2",
                       "-v",      "-o",    "a.stl",  "--mask", "a.nii"};
  const Outcome whole =
      must(with(words, {"--recipe", "a.json", "--json", "a.summary.json", "--report", "a.html"}));
  const std::string surface = bytes("a.stl"), mask = bytes("a.nii"), recipe = bytes("a.json"),
                    page = bytes("a.html");
  const auto summary = json("a.summary.json");
  const Words moments = steps(whole.err);
  ASSERT_GT(moments.size(), 10u);
  const Words kept = with(words, {"--recipe", "a.json", "--json", "a.summary.json", "--report",
                                  "a.html", "--checkpoint", "c.json", "--resume"});
  std::mt19937 random(5);  // NOLINT: the same in every run
  for (int n = 0; n < 6; ++n) {
    for (const char* name : {"a.stl", "a.nii", "a.json", "a.summary.json", "a.html"})
      std::filesystem::remove(file(name));
    // Of two kills the second meets the run that goes on, if it gets as far.
    Words last;
    for (int kill = 0; kill < 2; ++kill) {
      const std::string at = moments[random() % moments.size()];
      last.push_back(at);
      const Outcome killed = interrupted_run(kept, SIGKILL, at);
      EXPECT_TRUE(killed.exit_code == 137 || killed.exit_code == 0) << killed.err;
    }
    must(kept);
    EXPECT_EQ(bytes("a.stl"), surface) << last[0] << ", " << last[1];
    EXPECT_EQ(bytes("a.nii"), mask) << last[0] << ", " << last[1];
    EXPECT_EQ(bytes("a.json"), recipe) << last[0] << ", " << last[1];
    EXPECT_EQ(bytes("a.html"), page) << last[0] << ", " << last[1];
    expect_same_summary(json("a.summary.json"), summary);
    EXPECT_FALSE(exists("c.json")) << "the checkpoint of a run that is done";
  }
}

TEST_F(Checkpoints, StagesThatAreDoneAreNotRunAgain) {
  make_volume();
  const Words words = {"segment", "v.nii", "--seed",       "1,0,0",  "-v",
                       "-o",      "a.stl", "--checkpoint", "c.json", "--resume"};
  const Outcome killed = interrupted_run(with(words, {"--max-iterations", "50"}), SIGKILL,
                                         "evolve               step    2");
  ASSERT_EQ(killed.exit_code, 137) << killed.err;
  ASSERT_TRUE(exists("c.json"));
  const Outcome other = run(words);  // other options
  EXPECT_EQ(other.exit_code, 3);
  EXPECT_NE(other.err.find("c.json: a checkpoint of another image, other clicks or options"),
            std::string::npos)
      << other.err;
  must(with(words, {"--max-iterations", "50"}));
}

TEST_F(Checkpoints, OfSeveralObjectsThoseThatAreDoneStay) {
  must({"phantom", "separate-balls", "--size", "48", "--spacing", "1", "-o", "v.nii"});
  const Words words = {"segment",        "v.nii",    "--object", "left",
                       "--seed=-10,0,0", "--object", "right",    "--seed",
                       "10,0,0",         "-v",       "-o",       "{object}.stl"};
  must(words);
  const std::string left = bytes("left.stl"), right = bytes("right.stl");
  const Words kept = with(words, {"--checkpoint", "c.json", "--resume"});
  const Outcome killed = interrupted_run(kept, SIGKILL, "right:");
  ASSERT_EQ(killed.exit_code, 137) << killed.err;
  const Outcome resumed = must(kept);
  const std::string before_right = resumed.err.substr(0, resumed.err.find("right:"));
  EXPECT_EQ(before_right.find("evolve "), std::string::npos) << resumed.err;
  EXPECT_EQ(bytes("left.stl"), left);
  EXPECT_EQ(bytes("right.stl"), right);
}

TEST_F(Checkpoints, WhatCannotBeOneIsTold) {
  make_volume();
  const Words words = {"segment", "v.nii", "--seed", "1,0,0", "-q", "-o", "a.stl"};
  EXPECT_EQ(run(with(words, {"--resume"})).exit_code, 2);
  EXPECT_EQ(run(with(words, {"--checkpoint", "c.json,x"})).exit_code, 2);
  EXPECT_EQ(run(with(words, {"--checkpoint", "none/c.json"})).exit_code, 4);
  std::ofstream(file("c.json")) << "{\"kind\":\"surfseg recipe\"}";
  EXPECT_EQ(run(with(words, {"--checkpoint", "c.json", "--resume"})).exit_code, 3);
  const Outcome foreign = run(with(words, {"--checkpoint", "c.json,60"}));
  EXPECT_EQ(foreign.exit_code, 2);
  EXPECT_NE(foreign.err.find("c.json is there and not a surfseg checkpoint"), std::string::npos)
      << foreign.err;
  EXPECT_EQ(bytes("c.json"), "{\"kind\":\"surfseg recipe\"}");
  std::filesystem::remove(file("c.json"));
  must(with(words, {"--checkpoint", "c.json,60"}));
  EXPECT_FALSE(exists("c.json"));
}

}  // namespace
}  // namespace surfseg::test
