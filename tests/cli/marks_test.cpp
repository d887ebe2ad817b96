// Strokes of a label map, and clicks that cannot be.
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/volume/write_volume.h"
#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

using Words = std::vector<std::string>;

class Marks : public Program {
 protected:
  Marks() {
    must({"phantom", "separate-balls", "--size", "40", "--spacing", "1", "-o", "v.nii.gz"});
  }

  /// On the phantom's grid unless it is moved.
  void write(const std::string& name, const std::vector<std::pair<std::array<int, 3>, int>>& cells,
             double moved_mm = 0, int size = 40) const {
    std::vector<std::uint8_t> labels(std::size_t(size) * size * size, 0);
    for (const auto& [cell, label] : cells)
      labels[std::size_t(cell[0] + size * (cell[1] + size * cell[2]))] = std::uint8_t(label);
    const Eigen::Affine3d affine(Eigen::Translation3d(-19.5 + moved_mm, -19.5, -19.5));
    surf::volume::write_label_map(file(name), {size, size, size}, affine, labels);
  }
  void refused(const Words& more, int exit_code, const std::string& words) const {
    Words arguments = {"segment", "v.nii.gz", "-o", "s.stl", "-q"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Outcome outcome = run(arguments);
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
    EXPECT_FALSE(exists("s.stl"));
  }
};

TEST_F(Marks, AreClicks) {
  std::vector<std::pair<std::array<int, 3>, int>> cells;
  for (int i = 7; i <= 12; ++i) cells.push_back({{i, 19, 20}, 1});   // in the left ball
  for (int i = 27; i <= 32; ++i) cells.push_back({{i, 20, 19}, 1});  // in the right one
  for (int j = 0; j < 40; ++j) cells.push_back({{20, j, 2}, 2});
  write("m.nii.gz", cells);
  must({"segment", "v.nii.gz", "--marks", "m.nii.gz", "-o", "s.stl", "--json", "s.json", "--recipe",
        "r.json", "-q"});
  const auto inside =
      surf::mesh::rasterize(surf::io::read_surface(file("s.stl")), {40, 40, 40},
                            Eigen::Affine3d(Eigen::Translation3d(-19.5, -19.5, -19.5)));
  for (const auto& [cell, label] : cells)
    EXPECT_EQ(inside[std::size_t(cell[0] + 40 * (cell[1] + 40 * cell[2]))], label == 1);
  EXPECT_EQ(json("s.json")["components"], 2);
  std::size_t n_clicks = 0;
  const auto recipe = json("r.json");
  for (const auto& entry : recipe["objects"][0]["history"]) n_clicks += entry["do"] == "click";
  EXPECT_EQ(n_clicks, 3u);
  must({"replay", "r.json", "-o", "again.stl", "-q"});
  EXPECT_EQ(bytes("again.stl"), bytes("s.stl"));
}

TEST_F(Marks, OnAnotherGridAreRefused) {
  write("moved.nii.gz", {{{9, 19, 19}, 1}}, 0.4);
  refused({"--marks", "moved.nii.gz"}, 3, "moved.nii.gz: is on another grid than the volume");
  write("smaller.nii.gz", {{{9, 19, 19}, 1}}, 0, 32);
  refused({"--marks", "smaller.nii.gz"}, 3, "32 x 32 x 32 voxels of 1 x 1 x 1 mm");
  write("labels.nii.gz", {{{9, 19, 19}, 1}, {{29, 19, 19}, 7}});
  refused({"--marks", "labels.nii.gz"}, 3, "label 7 at voxel (29, 19, 19)");
  write("empty.nii.gz", {});
  refused({"--marks", "empty.nii.gz"}, 3, "no voxel is marked");
  write("outside.nii.gz", {{{9, 19, 19}, 2}});
  refused({"--marks", "outside.nii.gz"}, 3, "no stroke is inside");
  refused({"--marks", "gone.nii.gz"}, 3, "gone.nii.gz");
}

TEST_F(Marks, AreWhatManyClicksShouldBe) {
  Words clicks;
  for (int n = 0; n < 10000; ++n) clicks.insert(clicks.end(), {"--seed", "-9.75,0,0"});
  refused(clicks, 2, "10000 clicks; at most 1000 for an object; paint strokes");
  refused({"--outside", "0,0,0", "--outside", "1,0,0"}, 2, "--seed: at least one point inside");
  refused({"--seed=-9.75,0,0", "--outside", "90,0,0"}, 2, "outside the volume of 40 x 40 x 40");
}

}  // namespace
}  // namespace surfseg::test
