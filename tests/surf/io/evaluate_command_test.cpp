// surfseg evaluate through the program: scores of known shapes, exit codes.
#include <fmt/format.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <regex>

#include "libsurf/io/write_surface.h"
#include "libsurf/volume/volume.h"
#include "libsurf/volume/write_volume.h"
#include "tests/surf/io/scratch_folder.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf {
namespace {

using namespace surf::test;

class EvaluateCommand : public ScratchFolder {
 protected:
  /// Exit code; what was printed is in output_.
  int run(const std::string& arguments) {
    const std::string command =
        fmt::format("{} evaluate {} > {} 2>&1", SURFSEG_PROGRAM, arguments, path("output.txt"));
    const int status = std::system(command.c_str());
    output_ = read(path("output.txt"));
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }
  /// The first number that follows the key in a text.
  static double number(const std::string& text, const std::string& key) {
    std::smatch match;
    if (!std::regex_search(text, match, std::regex(key + "\\W*?(-?[0-9.]+(e-?[0-9]+)?)"))) {
      ADD_FAILURE() << key << " is missing in " << text;
      return 0;
    }
    return std::stod(match[1]);
  }
  std::string ball(const std::string& name, double radius) const {
    io::write_surface(path(name), sphere({10, -20, 30}, radius, 5));
    return path(name);
  }
  /// Label 3: a ball of radius 12 in a mirrored grid; label 1: a corner.
  std::string ball_labels() const {
    const Eigen::Affine3d affine = Eigen::Translation3d(10, -20, 30) *
                                   Eigen::Scaling(-0.75, 0.75, 1.0) *
                                   Eigen::Translation3d(-23.5, -23.5, -19.5);
    std::vector<float> values;
    for (int k = 0; k < 40; ++k)
      for (int j = 0; j < 48; ++j)
        for (int i = 0; i < 48; ++i) {
          const bool is_ball = (affine * Vector<3>(i, j, k) - Vector<3>(10, -20, 30)).norm() <= 12;
          values.push_back(is_ball ? 3.0f : i + j + k < 5 ? 1.0f : 0.0f);
        }
    volume::write_volume(path("labels.nii.gz"), {{48, 48, 40}, affine, values});
    return path("labels.nii.gz");
  }

  std::string output_;
};

TEST_F(EvaluateCommand, SaysWhereTheReferenceHoldsIntensities) {
  const std::string surface = ball("ball.stl", 12);
  EXPECT_EQ(run(fmt::format("{} --reference {}", surface, ball_labels())), 0);
  EXPECT_EQ(output_.find("warning"), std::string::npos) << output_;
  std::vector<float> values(std::size_t(32) * 32 * 32, -1000);
  values[5000] = 40;
  const Eigen::Affine3d affine(Eigen::Translation3d(-6, -36, 14));
  volume::write_volume(path("ct.nii.gz"), {{32, 32, 32}, affine, values});
  EXPECT_EQ(run(fmt::format("{} --reference {}", surface, path("ct.nii.gz"))), 0) << output_;
  EXPECT_NE(output_.find("ct.nii.gz: -1000 is no label: is this a label map?"), std::string::npos)
      << output_;
  for (std::size_t n = 0; n < values.size(); ++n) values[n] = float(n % 300);
  volume::write_volume(path("mr.nii.gz"), {{32, 32, 32}, affine, values});
  EXPECT_EQ(run(fmt::format("{} --reference {}", surface, path("mr.nii.gz"))), 0) << output_;
  EXPECT_NE(output_.find("mr.nii.gz: more than 255 values: is this a label map?"),
            std::string::npos)
      << output_;
}

TEST_F(EvaluateCommand, MeasuresConcentricBalls) {
  ASSERT_EQ(run(fmt::format("{} --reference {} --json {}", ball("a.stl", 10), ball("b.vtp", 11),
                            path("scores.json"))),
            0)
      << output_;
  const std::string json = read(path("scores.json"));
  const double ratio = std::pow(10.0 / 11, 3);
  constexpr double kSampling = 2e-3, kInscribed = 0.01;
  EXPECT_NEAR(number(json, "\"dice\""), 2 * ratio / (1 + ratio), kSampling);
  EXPECT_NEAR(number(json, "\"jaccard\""), ratio, kSampling);
  EXPECT_NEAR(number(json, "\"volume_difference_percent\""), 100 * (ratio - 1), 0.01);
  EXPECT_NEAR(number(json, "\"mean_mm\""), 1, kInscribed);
  EXPECT_NEAR(number(json, "\"max_mm\""), 1, kInscribed);
  EXPECT_NE(json.find("\"passed\": true"), std::string::npos);
  EXPECT_NE(json.find("\"self_intersections\": 0"), std::string::npos);
  EXPECT_NEAR(number(output_, "Dice"), 2 * ratio / (1 + ratio), kSampling);
}

TEST_F(EvaluateCommand, ComparesWithALabel) {
  ASSERT_EQ(run(fmt::format("{} --reference {} --label 3 --json {}", ball("a.ply", 12),
                            ball_labels(), path("scores.json"))),
            0)
      << output_;
  const std::string json = read(path("scores.json"));
  EXPECT_GT(number(json, "\"dice\""), 0.97);
  EXPECT_NEAR(number(json, "\"volume_difference_percent\""), 0, 1);
  EXPECT_LT(number(json, "\"mean_mm\""), 0.25);  // stairs of 0.75 and 1 mm
  EXPECT_LT(number(json, "\"max_mm\""), 0.75);
}

TEST_F(EvaluateCommand, OpenSurfacesHaveDistancesButNoDice) {
  io::write_surface(path("open.stl"), without_triangle(sphere({10, -20, 30}, 10, 4), 7));
  ASSERT_EQ(run(fmt::format("{} --reference {} --json {}", path("open.stl"), ball("b.vtp", 11),
                            path("scores.json"))),
            0);
  const std::string json = read(path("scores.json"));
  EXPECT_NE(json.find("\"dice\": null"), std::string::npos);
  EXPECT_NEAR(number(json, "\"mean_mm\""), 1, 0.02);
  EXPECT_NE(json.find("\"closed\": false"), std::string::npos);
  EXPECT_NE(output_.find("3 border edges"), std::string::npos);
}

TEST_F(EvaluateCommand, FacetsWithTwoEqualCornersDoNotOpenASurface) {
  Triangles surface = sphere({10, -20, 30}, 10, 4);
  surface.points.row(surface.elements(7, 1)) = surface.points.row(surface.elements(7, 0)).eval();
  io::write_surface(path("a.stl"), surface);
  ASSERT_EQ(run(fmt::format("{} --reference {} --json {}", path("a.stl"), ball("b.vtp", 10),
                            path("scores.json"))),
            0);
  const std::string json = read(path("scores.json"));
  EXPECT_GT(number(json, "\"dice\""), 0.99) << json;
  EXPECT_NEAR(number(json, "\"volume_difference_percent\""), 0, 1);
  EXPECT_NE(json.find("\"closed\": true"), std::string::npos);
  EXPECT_NE(output_.find("2 degenerate triangles"), std::string::npos) << output_;
}

TEST_F(EvaluateCommand, ShellsThatAreInsideOutTakeNoVolumeFromTheOthers) {
  const Triangles left = sphere({-15, 0, 0}, 10, 4), right = sphere({15, 0, 0}, 8, 4);
  io::write_surface(path("both.stl"), joined(left, right));
  const auto difference_of = [&](const Triangles& surface) {
    io::write_surface(path("a.stl"), surface);
    EXPECT_EQ(run(fmt::format("{} --reference {} --json {}", path("a.stl"), path("both.stl"),
                              path("scores.json"))),
              0);
    const std::string json = read(path("scores.json"));
    EXPECT_EQ(number(json, "\"dice\""), 1);
    return number(json, "\"volume_difference_percent\"");
  };
  constexpr double kSampling = 0.2;  // per cent
  EXPECT_NEAR(difference_of(joined(left, flipped(right))), 0, kSampling);
  EXPECT_NEAR(difference_of(flipped(joined(left, right))), 0, 1e-9) << "as a whole";
}

// The grid that counts has 256 points along both together.
TEST_F(EvaluateCommand, SurfacesBetweenThePointsOfTheGridHaveNoDice) {
  io::write_surface(path("a.ply"), sphere({0, 0, 0}, 0.05, 2));
  io::write_surface(path("b.ply"), sphere({300, 0.03, 0.02}, 0.05, 2));
  ASSERT_EQ(run(fmt::format("{} --reference {} --json {}", path("a.ply"), path("b.ply"),
                            path("scores.json"))),
            0);
  const std::string json = read(path("scores.json"));
  EXPECT_NE(json.find("\"dice\": null"), std::string::npos) << json;
  EXPECT_GT(number(json, "\"volume_mm3\""), 0);
  EXPECT_EQ(output_.find("nan"), std::string::npos) << output_;
  EXPECT_NE(output_.find("overlap            unknown: no point"), std::string::npos) << output_;
}

TEST_F(EvaluateCommand, FailsWithItsCodes) {
  const std::string a = ball("a.stl", 10), labels = ball_labels();
  EXPECT_EQ(run(a), 2);  // no reference
  EXPECT_EQ(run(fmt::format("{} --reference {} --label 3", a, a)), 2);
  EXPECT_EQ(run(fmt::format("{} --reference {} --label x", a, labels)), 2);
  EXPECT_EQ(run(fmt::format("{} --reference {}", path("none.stl"), a)), 3);
  EXPECT_EQ(run(fmt::format("{} --reference {}", a, path("none.nii"))), 3);
  EXPECT_EQ(run(fmt::format("{} --reference {} --label 9", a, labels)), 3);
  EXPECT_NE(output_.find("no voxel has the label 9"), std::string::npos) << output_;
  const std::string line = path("line.ply");
  std::ofstream(line) << "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n"
                         "property float y\nproperty float z\nelement face 1\n"
                         "property list uchar int vertex_indices\nend_header\n"
                         "0 0 0\n1 1 1\n2 2 2\n3 0 1 2\n";
  for (const auto& [first, second] : {std::pair{line, a}, {a, line}}) {
    EXPECT_EQ(run(fmt::format("{} --reference {}", first, second)), 3);
    EXPECT_NE(output_.find("line.ply: none of its triangles has an area"), std::string::npos)
        << output_;
  }
  EXPECT_EQ(run(fmt::format("{} --reference {} --json {}", a, a, path("no/folder/s.json"))), 4);
}

}  // namespace
}  // namespace surf
