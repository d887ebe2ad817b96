// Several objects on one command line.
#include <fmt/format.h>

#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/difference.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/write_volume.h"
#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

class ObjectsProgram : public Program {
 protected:
  void make(const std::string& kind) const {
    must({"phantom", kind, "--size", "40", "--spacing", "1", "-o", "v.nii.gz"});
  }
  /// Two balls of unlike brightness that touch: what is in both is the left one's.
  void make_pair() const {
    std::vector<float> values;
    for (int k = 0; k < 40; ++k)
      for (int j = 0; j < 40; ++j)
        for (int i = 0; i < 40; ++i) {
          double sum = 0;
          for (int s = 0; s < 27; ++s) {
            const Eigen::Vector3d x(i + (s % 3 - 1) / 3.0 - 19.5, j + (s / 3 % 3 - 1) / 3.0 - 19.5,
                                    k + (s / 9 - 1) / 3.0 - 19.5);
            const bool is_left = (x - Eigen::Vector3d(-7, 0, 0)).norm() <= 9,
                       is_right = (x - Eigen::Vector3d(8, 0, 0)).norm() <= 8;
            sum += is_left ? 100 : is_right ? 180 : 0;
          }
          values.push_back(float(sum / 27));
        }
    const Eigen::Affine3d affine(Eigen::Translation3d(-19.5, -19.5, -19.5));
    surf::volume::write_volume(file("v.nii.gz"), {{40, 40, 40}, affine, values});
  }
  static Words two(const Words& more) {
    Words out = {"segment",  "v.nii.gz", "--object", "left",  "--seed", "-9,0,0",
                 "--object", "right",    "--seed",   "9,0,0", "-q"};
    out.insert(out.end(), more.begin(), more.end());
    return out;
  }
};

TEST_F(ObjectsProgram, HaveTheFilesBesideTheirOwnCheckedByTheirNames) {
  make_pair();
  const auto outcome = run({"segment", "v.nii.gz", "--object", "left kidney", "--seed", "-9,0,0",
                            "-o", "{object}.obj", "--json", "left_kidney.mtl", "-q"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("--json: left_kidney.mtl: is -o too"), std::string::npos)
      << outcome.err;
}

TEST_F(ObjectsProgram, WritesEachAndOneMapOfLabels) {
  make_pair();
  must(two({"-o", "{object}.stl", "--mask", "m.nii.gz", "--json", "s.json", "--recipe", "r.json",
            "--picture", "all.png"}));
  const surf::Triangles left = surf::io::read_surface(file("left.stl")),
                        right = surf::io::read_surface(file("right.stl"));
  EXPECT_FALSE(surf::mesh::do_overlap(left, right));
  EXPECT_TRUE(exists("all.png"));
  const surf::volume::Volume labels = surf::volume::read_volume(file("m.nii.gz"));
  std::vector<float> values(40 * 40 * 40);
  labels.copy_box({0, 0, 0}, {40, 40, 40}, values.data());
  const auto in_left = surf::mesh::rasterize(left, labels.size(), labels.index_to_world()),
             in_right = surf::mesh::rasterize(right, labels.size(), labels.index_to_world());
  for (std::size_t at = 0; at < values.size(); ++at) {
    ASSERT_FALSE(in_left[at] && in_right[at]);
    if (in_left[at]) {
      ASSERT_EQ(values[at], 1);
    }
    if (in_right[at]) {
      ASSERT_EQ(values[at], 2);
    }
  }
  const auto summary = json("s.json");
  EXPECT_EQ(summary["exit_code"], 0);
  ASSERT_EQ(summary["objects"].size(), 2u);
  EXPECT_EQ(summary["objects"][1]["name"], "right");
  EXPECT_EQ(summary["objects"][1]["label"], 2);
  EXPECT_EQ(summary["objects"][1]["file"], "right.stl");
  EXPECT_EQ(summary["objects"][1]["closed"], true);
  ASSERT_EQ(summary["objects"][1]["walls"].size(), 1u);
  EXPECT_EQ(summary["objects"][1]["walls"][0]["with"], "left");
  EXPECT_LE(summary["objects"][1]["walls"][0]["greatest_gap_mm"], 0.05);
  EXPECT_TRUE(summary["objects"][0].contains("certainty"));
  EXPECT_FALSE(summary["objects"][1].contains("certainty"));  // it was that of the uncut surface

  must({"replay", "r.json", "-o", "again-{object}.stl", "--mask", "again.nii.gz", "-q"});
  EXPECT_EQ(bytes("again-left.stl"), bytes("left.stl"));
  EXPECT_EQ(bytes("again-right.stl"), bytes("right.stl"));
  EXPECT_EQ(bytes("again.nii.gz"), bytes("m.nii.gz"));
  must({"replay", "r.json", "--object", "right", "-o", "one.stl", "-q"});
  EXPECT_EQ(bytes("one.stl"), bytes("right.stl"));
  EXPECT_EQ(run({"replay", "r.json", "-o", "one.stl", "-q"}).exit_code, 2);

  const Outcome config = run({"segment", "--config", "s.json", "-o", "{object}.stl"});
  EXPECT_EQ(config.exit_code, 2);
  EXPECT_NE(config.err.find("--recipe"), std::string::npos) << config.err;
}

TEST_F(ObjectsProgram, AReferenceOfEachObjectIsItsOwnFile) {
  make_pair();
  for (const auto& [name, seed] : {std::pair{"left", "-9,0,0"}, {"right", "9,0,0"}})
    must({"segment", "v.nii.gz", "--seed", seed, "-o", "s.stl", "--mask",
          std::string(name) + ".nii.gz", "-q"});
  const auto references = [&](const Words& more) {
    Words words = two({"-o", "{object}.stl", "--json", "s.json", "--reference", "{object}.nii.gz"});
    words.insert(words.end(), more.begin(), more.end());
    must(words);
    const auto objects = json("s.json")["objects"];
    return std::vector{objects[0]["reference"], objects[1]["reference"]};
  };
  for (const auto& reference : references({})) {
    EXPECT_GT(reference.value("dice", 0.0), 0.9) << reference;
    EXPECT_TRUE(reference["label"].is_null());
  }
  for (const auto& reference : references({"--reference-label", "1"})) {
    EXPECT_GT(reference.value("dice", 0.0), 0.9) << reference;
    EXPECT_EQ(reference["label"], 1);
  }
  for (const auto& reference : references({"--reference-label", "2"}))
    EXPECT_TRUE(reference.contains("not_compared")) << reference;
  must(two({"-o", "{object}.stl", "--recipe", "r.json"}));
  const Words replay = {"replay", "r.json", "-o", "again-{object}.stl", "-q"},
              one_label = {"--reference", "left.nii.gz", "--reference-label", "1"};
  for (const Words& words : {two({"-o", "{object}.stl"}), replay}) {
    const Outcome refused = run(joined(words, one_label));
    EXPECT_EQ(refused.exit_code, 2);
    EXPECT_NE(refused.err.find("put {object} into its name"), std::string::npos) << refused.err;
  }
  must(joined({"replay", "r.json", "-o", "left-again.stl", "--object", "left", "-q"}, one_label));
  std::filesystem::remove(file("right.nii.gz"));
  const Outcome missing = run(joined(replay, {"--reference", "{object}.nii.gz"}));
  EXPECT_EQ(missing.exit_code, 3);
  EXPECT_NE(missing.err.find("--reference: right.nii.gz: there is no such file"), std::string::npos)
      << missing.err;
  EXPECT_FALSE(exists("again-left.stl"));  // before anything is computed
}

TEST_F(ObjectsProgram, WithNothingToRepeatWasNotInterrupted) {
  make_pair();
  must(two({"-o", "{object}.stl", "--recipe", "r.json"}));
  auto recipe = json("r.json");
  recipe["objects"][1]["history"] = nlohmann::json::array();
  std::ofstream(file("r.json")) << recipe;
  const Outcome outcome = run({"replay", "r.json", "-o", "again-{object}.stl", "-q"});
  EXPECT_EQ(outcome.exit_code, 7) << outcome.err;
  EXPECT_NE(outcome.err.find("again-right.stl: nothing has been made of the clicks yet"),
            std::string::npos)
      << outcome.err;
}

// In one ball there is no edge between the two: the first has all but a dent round the other's
// click.
TEST_F(ObjectsProgram, WritesTheOthersWhereOneFails) {
  make("ball");
  const Outcome outcome = run(two({"-o", "{object}.stl", "--mask", "m.mha", "--json", "s.json"}));
  EXPECT_EQ(outcome.exit_code, 7) << outcome.err;
  EXPECT_NE(outcome.err.find("1 of 2 objects not written: right.stl: nothing of it"),
            std::string::npos)
      << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_TRUE(exists("left.stl"));
  EXPECT_FALSE(exists("right.stl"));
  EXPECT_TRUE(exists("m.mha"));
  const auto summary = json("s.json");
  EXPECT_EQ(summary["exit_code"], 7);
  EXPECT_EQ(summary["objects"][0]["exit_code"], 0);
  EXPECT_NE(summary["objects"][1]["exit_code"], 0);
  EXPECT_TRUE(summary["objects"][1].contains("not_written"));
}

TEST_F(ObjectsProgram, RefusesWhatCannotBe) {
  make("ball");
  const auto refused = [&](const Words& arguments, const std::string& words) {
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  };
  refused(two({"-o", "s.stl"}), "put {object} into the name");
  refused(two({"-o", "{object}.stl", "--start", "s.vtp"}), "--start");
  refused(two({"-o", "{object}.stl", "--object", "left", "--seed", "0,0,0"}), "twice");
  refused(two({"-o", "{object}.stl", "--object", "none"}), "--object none: at least one --seed");
  refused(two({"-o", "{object}.stl", "--object", "../up", "--seed", "0,0,0"}), "that a file can");
  refused(two({"-o", "{object}.stl", "--initial-ball", "0,0,0,5mm"}), "initial");
  refused(two({"-o", "{object}.stl", "--object", "third", "--seed", "9.2,0,0"}),
          "same voxel as an inside click of 'right'");
  refused({"segment", "v.nii.gz", "--seed", "0,0,0", "--object", "a", "--seed", "5,0,0", "-o",
           "{object}.stl"},
          "--seed: comes before the first --object");
  refused({"segment", "v.nii.gz", "--seed", "0,0,0", "-o", "{object}.stl"}, "there is no --object");
  for (const auto& [option, value] :
       {std::pair{"outside", "0,9,0"}, {"box", "-15,-9,-9,9,9,9"}, {"marks", "m.nii"}}) {
    write("c.json", fmt::format(R"({{"{}": ["{}"]}})", option, value));
    refused(two({"-o", "{object}.stl", "--config", path("c.json")}),
            fmt::format("--{}: a config does not hold whose clicks are whose", option));
  }
  EXPECT_EQ(files().size(), 1u);
}

}  // namespace
}  // namespace surfseg::test
