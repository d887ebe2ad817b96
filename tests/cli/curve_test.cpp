// curveseg: from a phantom to scored contours, and what is wrong ends in one line.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "libcurve/image/write_image.h"
#include "libsurf/volume/phantom.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/write_volume.h"
#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

class Curveseg : public Program {
 protected:
  void make(const std::string& kind, const Words& more = {}) const {
    must(joined({"phantom", kind, "-o", kind + ".tif", "--contour", kind + "-exact.json"}, more));
  }
  nlohmann::json scores(const std::string& contour, const std::string& reference) const {
    must({"evaluate", contour, "--reference", reference, "--json", "e.json"});
    return json("e.json");
  }
};

TEST_F(Curveseg, FindsABlobFromOneSeedAndFromACircle) {
  make("blob");
  must({"segment", "blob.tif", "--seed", "128,128", "-o", "a.json", "-q"});
  EXPECT_GT(scores("a.json", "blob-exact.json")["dice"], 0.99);
  must({"segment", "blob.tif", "--circle", "127.5,127.5,125px", "--gamma", "0", "--lambda", "0.08",
        "-o", "b.json", "-q"});
  EXPECT_LT(scores("b.json", "blob-exact.json")["distance"]["mean_mm"], 0.052);  // pixels
}

// A PNG holds no pixel size here: it was a Dice of 0.
TEST_F(Curveseg, EvaluatesTheMaskThatItWritesWithPixelsOfAnySize) {
  make("blob");
  must({"segment", "blob.tif", "--spacing", "0.4,0.5", "--seed", "128,128", "-o", "a.json",
        "--mask", "m.png", "-q"});
  EXPECT_GT(scores("a.json", "m.png")["dice"], 0.999);
  auto cropped = json("a.json");
  cropped["size"] = {300, 300};
  write("files/b.json", cropped.dump());
  const Outcome noted = must({"evaluate", "b.json", "--reference", "m.png"});
  EXPECT_NE(noted.err.find("256 x 256 pixels, not the 300 x 300 that b.json was found on; pixels "
                           "count as 1 mm"),
            std::string::npos)
      << noted.err;
  const Outcome refused = run({"evaluate", "a.json", "--reference", "m.png", "--label", "7"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.err.find("no pixel has the label 7"), std::string::npos) << refused.err;
}

// What lay beyond the mask did not count, and where nothing counted it was a Dice of 1.
TEST_F(Curveseg, EvaluatesWhatLiesBeyondAMask) {
  const auto write_square = [&](const std::string& name, double x, double y, double side) {
    write(
        "files/" + name,
        fmt::format("polygon,ring,x_mm,y_mm\n0,0,{0},{1}\n0,0,{2},{1}\n0,0,{2},{3}\n0,0,{0},{3}\n",
                    x, y, x + side, y + side));
  };
  const auto write_columns = [&](const std::string& name, int first, int last) {
    std::vector<std::uint8_t> mask(16 * 16, 0);
    for (int j = 4; j < 12; ++j)
      for (int i = first; i <= last; ++i) mask[j * 16 + i] = 1;
    surf::curve::write_mask(file(name), {16, 16}, mask);
  };
  write_columns("none.png", 1, 0);
  write_columns("left.png", 0, 3);
  write_columns("right.png", 12, 15);
  write_square("over-left.csv", -4.5, 3.5, 8);
  write_square("over-right.csv", 11.5, 3.5, 8);
  write_square("beyond.csv", 100, 100, 4);
  for (const std::string side : {"left", "right"}) {  // 64 pixels, 32 of them in the mask
    const auto half = scores("over-" + side + ".csv", side + ".png");
    EXPECT_DOUBLE_EQ(half["dice"], 2.0 * 32 / (64 + 32)) << side;
    EXPECT_DOUBLE_EQ(half["jaccard"], 0.5) << side;
  }
  for (const char* mask : {"left.png", "none.png"})
    EXPECT_EQ(scores("beyond.csv", mask)["dice"], 0.0) << mask;

  write_square("between.csv", 2.2, 2.2, 0.5);
  write("files/flat.csv", "polygon,ring,x_mm,y_mm\n0,0,0,0\n0,0,5,0\n0,0,9,0\n");
  for (const auto& [contour, reference] :
       {std::pair{"between.csv", "none.png"}, {"flat.csv", "flat.csv"}}) {
    const auto unknown = scores(contour, reference);
    EXPECT_TRUE(unknown["dice"].is_null() && unknown["jaccard"].is_null()) << unknown;
    const std::string text = must({"evaluate", contour, "--reference", reference}).out;
    EXPECT_NE(text.find("overlap            unknown: no pixel's centre"), std::string::npos)
        << text;
  }

  write_square("far.csv", 1e12, 0, 4);
  const Outcome far = run({"evaluate", "far.csv", "--reference", "left.png"});
  EXPECT_EQ(far.exit_code, 3);
  EXPECT_NE(far.err.find("too many to compare"), std::string::npos) << far.err;
}

TEST_F(Curveseg, FindsABlobFromLandmarksByEveryFlow) {
  make("blob");
  write("files/points.txt", "233 128\n23 128\n128 233\n128 23\n202,202\n54,54\n");
  for (const std::string flow : {"h1", "l2", "newton", "lbfgs"}) {
    must({"segment", "blob.tif", "--landmarks", "points.txt", "--energy", "minimal-surface",
          "--lambda", "0.08", "--gamma", "0", "--flow", flow, "-o", "c.json", "-q"});
    EXPECT_LT(scores("c.json", "blob-exact.json")["distance"]["mean_mm"], 0.06) << flow;
  }
}

// 5 pixels inside the blob, whose radius is 54 to 74.
TEST_F(Curveseg, HasAnOutsidePointOutside) {
  make("blob");
  must({"segment", "blob.tif", "--seed", "128,128", "--outside", "196,127.5", "-o", "o.json",
        "--json", "s.json", "-q"});
  double nearest = 1e9, winding = 0;
  const nlohmann::json contours = json("o.json");
  for (const auto& feature : contours["features"])
    for (const auto& ring : feature["geometry"]["coordinates"])
      for (std::size_t i = 0; i + 1 < ring.size(); ++i) {
        const Eigen::Vector2d a(double(ring[i][0]) - 196, double(ring[i][1]) - 127.5),
            b(double(ring[i + 1][0]) - 196, double(ring[i + 1][1]) - 127.5), side = b - a;
        const double at = std::clamp(-a.dot(side) / side.squaredNorm(), 0.0, 1.0);
        nearest = std::min(nearest, (a + at * side).norm());
        winding += std::atan2(a[0] * b[1] - a[1] * b[0], a.dot(b));
      }
  EXPECT_GE(nearest, 0.5);
  EXPECT_LT(nearest, 8);  // a dent, no more
  EXPECT_NEAR(winding, 0, 1e-6);
}

// Of radius 12 in 48 x 48 pixels without noise, its edge a pixel wide: about a corner of pixels and
// about the middle of one. It ends by itself, by energies with their defaults and from the seed
// alone.
TEST_F(Curveseg, ADiscWithoutNoiseConverges) {
  constexpr int kSize = 48;
  constexpr double kRadius = 12, kArea = M_PI * kRadius * kRadius;
  for (const double middle : {23.5, 24.0}) {
    std::vector<float> values;
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i)
        values.push_back(
            float(std::clamp(kRadius - std::hypot(i - middle, j - middle) + 0.5, 0.0, 1.0)));
    surf::curve::write_image(
        file("disc.tif"),
        surf::curve::Image({kSize, kSize}, surf::curve::pixel_to_plane({1, 1}), values));
    for (const Words& energy :
         {Words{}, Words{"--energy", "minimal-surface"}, Words{"--energy", "chan-vese"}}) {
      must(joined(
          {"segment", "disc.tif", "--seed", "24,24", "-o", "d.json", "--json", "s.json", "-q"},
          energy));
      const std::string name = energy.empty() ? "the seed alone" : energy.back();
      EXPECT_EQ(json("s.json")["outcome"], "converged") << name;
      EXPECT_NEAR(json("s.json")["area_mm2"], kArea, 0.01 * kArea) << name;
    }
  }
}

TEST_F(Curveseg, KeepsTheAreaThatIsAskedFor) {
  make("blob");
  must({"segment", "blob.tif", "--circle", "128,128,30px", "--energy", "area", "--area", "5000mm2",
        "-o", "d.json", "--json", "s.json", "-q"});
  EXPECT_NEAR(json("s.json")["area_mm2"], 5000, 1e-3);
}

TEST_F(Curveseg, FindsTwelveNoisyDiscsFromOneCircleAndFromSeedsAllOver) {
  make("discs12", {"--edge-width", "0.02", "--noise", "0.1"});
  const Words run = {"segment",       "discs12.tif", "--energy", "chan-vese", "--energy",
                     "area:weight=1", "-q",          "--json",   "s.json"};
  for (const Words& start :
       {Words{"--circle", "127.5,127.5,125px"}, Words{"--seeds-grid", "20px"}}) {
    must(joined(joined(run, start), {"-o", "d.json", "--mask", "d.png"}));
    EXPECT_EQ(json("s.json")["regions"].size(), 12u) << start[0];
    const auto score = scores("d.json", "discs12-exact.json");
    EXPECT_LT(score["distance"]["mean_mm"], 0.12) << start[0];
    EXPECT_GT(scores("d.json", "d.png")["dice"], 0.9999) << start[0];
  }
}

TEST_F(Curveseg, DenoisesWithMumfordShah) {
  make("blob", {"--size", "96", "--noise", "0.25"});
  const Words run = {"segment", "blob.tif", "--circle", "47.5,47.5,40px", "-q", "-o", "b.json"};
  must(joined(run,
              {"--energy", "mumford-shah:gamma=0.6", "--denoised", "u.tif", "--json", "s.json"}));
  EXPECT_GT(scores("b.json", "blob-exact.json")["dice"], 0.98);
  EXPECT_EQ(json("s.json")["regions"].size(), 1u);
  // From a contour that is at its minimum, too, where mending takes back what steps gain.
  must({"segment", "u.tif", "--contour", "b.json", "--energy", "chan-vese", "-o", "c.json", "-q"});
  must(joined(run, {"--energy", "mumford-shah", "--denoised", "u.png"}));
  EXPECT_TRUE(exists("u.png"));
  must(joined(run, {"--energy", "mumford-shah", "--flow", "newton"}));
  EXPECT_GT(scores("b.json", "blob-exact.json")["dice"], 0.98);
}

// Alg. 17: how often it may step coarsely, and down to what derivative.
TEST_F(Curveseg, GoesThroughTheCoarseStagesThatAreAskedFor) {
  make("blob", {"--size", "64", "--noise", "0.1"});
  const auto n_steps = [&](const Words& more) {
    must(joined({"segment", "blob.tif", "--circle", "31.5,31.5,27px", "-q", "-o", "b.json",
                 "--energy", "mumford-shah", "--json", "s.json"},
                more));
    std::map<std::string, int> out;
    const auto summary = json("s.json");
    for (const auto& stage : summary["evolution"]) out[stage["stage"]] = stage["steps"];
    return out;
  };
  auto usual = n_steps({});
  EXPECT_GT(usual["coarse"], 2);
  EXPECT_LE(n_steps({"--coarse-steps", "2"})["coarse"], 2);
  EXPECT_EQ(n_steps({"--coarse-steps", "0"}).count("coarse"), 0u);
  EXPECT_LT(n_steps({"--second-threshold", "4000"})["coarse"], usual["coarse"]);
  EXPECT_GT(n_steps({"--one-way"})["evolve"], 0);
}

TEST_F(Curveseg, FindsTheHoleOfARingFromOutside) {
  make("ring", {"--edge-width", "0.02", "--noise", "0.1"});
  const Words run = {"segment",  "ring.tif",  "--circle", "127.5,127.5,125px",
                     "--energy", "chan-vese", "--energy", "area:weight=1",
                     "-q",       "--json",    "s.json"};
  must(joined(run, {"-o", "full.json"}));
  EXPECT_EQ(json("s.json")["regions"][0]["holes"].size(), 0u);
  must(joined(run, {"-o", "r.json", "--open-cavities"}));
  EXPECT_EQ(json("s.json")["regions"][0]["holes"].size(), 1u);
  EXPECT_LT(scores("r.json", "ring-exact.json")["distance"]["mean_mm"], 0.12);
  must(joined(run, {"-o", "f.json", "--open-cavities", "--fill-cavities"}));
  EXPECT_EQ(json("s.json")["components"], 1);
}

TEST_F(Curveseg, WritesEveryFormatMasksAndPictures) {
  make("blob", {"--size", "128"});
  std::filesystem::create_directories(file("frames"));
  for (const char* name : {"o.svg", "o.json", "o.vtp", "o.csv"})
    must({"segment", "blob.tif", "--seed", "64,64", "-o", name, "--overlay", "o.png", "-q"});
  must({"segment", "blob.tif", "--seed", "64,64", "-o", "p.csv", "--picture", "p.png", "-q"});
  EXPECT_EQ(bytes("p.png"), bytes("o.png"));
  run({"segment", "blob.tif", "--circle", "64,64,20px", "--energy", "chan-vese", "-o", "f.json",
       "--max-iterations", "3", "--no-settle", "--frames", "frames", "-q"});
  EXPECT_NE(bytes("o.svg").find("<path"), std::string::npos);
  EXPECT_NE(bytes("o.vtp").find("PolyData"), std::string::npos);
  EXPECT_TRUE(exists("o.png"));
  EXPECT_TRUE(exists("frames/frame-00000.png"));
  EXPECT_LT(scores("o.csv", "o.json")["distance"]["max_mm"], 1e-12);
  // A contour is a start.
  must({"segment", "blob.tif", "--contour", "o.json", "--energy", "chan-vese", "-o", "c.json",
        "-q"});
  EXPECT_GT(scores("c.json", "blob-exact.json")["dice"], 0.99);
}

// The same blob at three resolutions, its edge twice as wide at each. By the lengths of a pixel
// minimal-surface leaked out of the finest one, 154 pixels far.
TEST_F(Curveseg, ExplicitEnergiesTakeTheirScaleFromTheEdges) {
  for (const char* energy : {"minimal-surface", "chan-vese"})
    for (const int size : {128, 256, 512}) {
      make("blob", {"--size", std::to_string(size)});
      const std::string middle = std::to_string(size / 2);
      must({"segment", "blob.tif", "--seed", middle + "," + middle, "--energy", energy, "--energy",
            "area:weight=0.01", "-o", "c.json", "-q"});
      EXPECT_LT(scores("c.json", "blob-exact.json")["distance"]["mean_mm"], 0.15)
          << energy << " " << size;
    }
}

TEST_F(Curveseg, SummaryIsAConfig) {
  make("blob", {"--size", "128"});
  must({"segment", "blob.tif", "--seed", "64,64", "-o", "a.json", "--json", "s.json", "-q"});
  const auto summary = json("s.json");
  for (const char* key : {"energy", "iterations", "outcome", "elements", "area_mm2", "regions",
                          "simple", "alternating", "time_s", "config", "chosen", "evolution"})
    EXPECT_TRUE(summary.contains(key)) << key;
  const std::string first = bytes("a.json");
  must({"segment", "--config", "s.json"});
  EXPECT_EQ(bytes("a.json"), first);
}

/// A ball of radius 0.6 * 19.5 mm in 40^3 voxels of 1 mm.
void write_ball(const std::string& path) {
  surf::volume::PhantomOptions options;
  options.size = {40, 40, 40};
  options.spacing_mm = Eigen::Vector3d(1, 1, 1);
  surf::volume::write_volume(path, surf::volume::make_phantom(options));
}

TEST_F(Curveseg, SegmentsSlicesOfVolumes) {
  write_ball(file("ball.nii.gz"));
  constexpr double kArea = M_PI * (11.7 * 11.7 - 0.5 * 0.5);  // half a voxel off the centre
  const Words where[] = {{"--slice", "axial:20"}, {"--plane", "0,0,0.5,0,0,1"}};
  for (const Words& choice : where) {
    must(joined({"segment", "ball.nii.gz", "--space", "ras", "--seed", "0,0,0.5", "-o", "c.json",
                 "--json", "s.json", "-q"},
                choice));
    EXPECT_NEAR(json("s.json")["area_mm2"], kArea, 0.02 * kArea) << choice[0];
  }
  EXPECT_NE(must({"info", "ball.nii.gz", "--slice", "coronal:7"}).out.find("40 x 40"),
            std::string::npos);
}

/// The same ball on any grid; 1 within it or its core, as a label map has it, or with its edge a
/// voxel wide.
void write_ball_on(const std::string& path, const Eigen::Affine3d& to_ras, const std::string& kind,
                   const std::array<int, 3>& size = {30, 28, 26}) {
  std::vector<float> values;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) {
        const double depth = 11.7 - (to_ras * Eigen::Vector3d(i, j, k)).norm();
        values.push_back(kind == "labels" ? float(depth > 0)
                         : kind == "core" ? float(depth > 5)
                                          : float(std::clamp(depth + 0.5, 0.0, 1.0)));
      }
  surf::volume::write_volume(path, {size, to_ras, values});
}

// Each slice counts its millimetres from its own first pixel; a cropped label map was compared
// shifted by what is missing of it (a Dice of 0.6).
TEST_F(Curveseg, EvaluatesSlicesInTheWorld) {
  write_ball(file("ball.nii"));
  const Words segment = {"segment", "--space", "ras", "-q", "--seed"};
  must(joined(segment, {"0,0,0.5", "ball.nii", "--slice", "axial:20", "-o", "a.json"}));
  const Eigen::Affine3d cropped(Eigen::Translation3d(-15.5, -12.5, -12.5));
  Eigen::Affine3d turned(Eigen::AngleAxisd(0.4, Eigen::Vector3d::UnitZ()));
  turned.translate(Eigen::Vector3d(-13.5, -14.5, -12.5));
  write_ball_on(file("cropped.nii"), cropped, "labels");
  write_ball_on(file("turned.nii"), turned, "labels");
  const auto with = [](const std::string& reference, const std::string& slice) {
    return Words{"evaluate", "a.json", "--reference", reference,
                 "--json",   "e.json", "--slice",     slice};
  };
  for (const char* labels : {"cropped.nii", "turned.nii"}) {
    must(with(labels, "axial:13"));
    EXPECT_GT(json("e.json")["dice"], 0.98) << labels;
  }

  const auto refused = [&](const Words& words, const std::string& piece) {
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
    EXPECT_NE(outcome.err.find("a.json lies in another plane than " + piece), std::string::npos)
        << outcome.err;
  };
  refused(with("cropped.nii", "axial:12"),
          "cropped.nii (NIfTI-1, axial slice 12): up to 1 mm off, 0.0 degrees tilted; expected at "
          "most 0.5 mm");
  refused(with("cropped.nii", "sagittal:15"), "cropped.nii (NIfTI-1, sagittal slice 15): up to ");

  write_ball_on(file("part.nii"), cropped, "edge");
  must(joined(segment, {"0,0,0.5", "part.nii", "--slice", "axial:13", "-o", "b.json"}));
  const auto both = scores("a.json", "b.json");
  EXPECT_GT(both["dice"], 0.99);
  EXPECT_LT(both["distance"]["max_mm"], 0.3);
  must(joined(segment, {"0,0,-0.5", "part.nii", "--slice", "axial:12", "-o", "c.json"}));
  refused({"evaluate", "a.json", "--reference", "c.json"}, "c.json: up to 1 mm off");
}

// A label map of the same size that was moved, in the plane or out of it, was taken as it is.
TEST_F(Curveseg, TakesMarksOfASliceWhereTheyLie) {
  const Eigen::Affine3d place(Eigen::Translation3d(-14.5, -13.5, -12.5));
  write_ball_on(file("ball.nii"), place, "edge");
  write_ball_on(file("marks.nii"), place, "labels");
  write_ball_on(file("aside.nii"), Eigen::Translation3d(3, 0, 0) * place, "labels");
  write_ball_on(file("above.nii"), Eigen::Translation3d(0, 0, 3) * place, "labels");
  const auto with = [](const std::string& marks) {
    return Words{"segment", "ball.nii", "--slice", "axial:13", "--marks", marks, "-o", "c.json"};
  };
  must(with("marks.nii"));
  const Outcome aside = run(with("aside.nii")), above = run(with("above.nii"));
  EXPECT_EQ(aside.exit_code, 3);
  EXPECT_NE(aside.err.find("aside.nii: is on another grid than the image, up to 3 pixels away"),
            std::string::npos)
      << aside.err;
  EXPECT_EQ(above.exit_code, 3);
  EXPECT_NE(above.err.find("lies in another plane"), std::string::npos) << above.err;
}

// Labels were interpolated: where they end in a plane there were some that no voxel has.
TEST_F(Curveseg, TakesMarksOnAnObliquePlane) {
  const Eigen::Affine3d place(Eigen::Translation3d(-14.5, -13.5, -12.5));
  write_ball_on(file("ball.nii"), place, "edge");
  write_ball_on(file("marks.nii"), place, "core");
  must({"segment", "ball.nii", "--plane", "0,0,0.3,0.2,0.1,1", "--marks", "marks.nii", "-o",
        "c.json", "--json", "s.json", "-q"});
  EXPECT_NEAR(json("s.json")["area_mm2"], M_PI * 11.7 * 11.7, 0.03 * M_PI * 11.7 * 11.7);
}

// Slices 0.4 mm apart with pixels of 1 mm, and an older file, which does not say so.
TEST_F(Curveseg, TellsThinSlicesApart) {
  Eigen::Affine3d thin = Eigen::Affine3d::Identity();
  thin.linear()(2, 2) = 0.4;
  thin.translation() << -14.5, -13.5, -4;
  write_ball_on(file("thin.nii"), thin, "edge", {30, 28, 20});
  for (const std::string k : {"10", "11"})
    must({"segment", "thin.nii", "--slice", "axial:" + k, "--seed", "15,14", "-o", k + ".json",
          "-q"});
  const Outcome refused = run({"evaluate", "10.json", "--reference", "11.json"});
  EXPECT_EQ(refused.exit_code, 3);
  EXPECT_NE(refused.err.find("up to 0.4 mm off"), std::string::npos) << refused.err;
  auto older = json("11.json");
  older.erase("thickness_mm");
  write("files/11.json", older.dump());
  EXPECT_GT(scores("10.json", "11.json")["dice"], 0.98);
}

// By its plane mm the start was 6 and 5 mm off on a cropped volume. The area that it has is asked
// for: it stays where it begins.
TEST_F(Curveseg, StartsFromContoursWhereTheyLieInTheWorld) {
  write_ball(file("ball.nii"));
  write_ball_on(file("part.nii"), Eigen::Affine3d(Eigen::Translation3d(-15.5, -12.5, -12.5)),
                "edge");
  for (const char* name : {"a.json", "a.csv"})
    must({"segment", "ball.nii", "--slice", "axial:20", "--space", "ras", "--seed", "0,0,0.5", "-o",
          name, "--json", "s.json", "-q"});
  const std::string area = fmt::format("{}mm2", json("s.json")["area_mm2"].get<double>());
  const auto from = [&](const std::string& contour, const Words& more) {
    return joined(more, {"--contour", contour, "--energy", "area", "--area", area, "-q"});
  };
  const Words slice = {"segment", "part.nii", "-o", "b.json", "--slice"},
              stack = {"stack",  "part.nii", "--to",  "13",    "-o",
                       "c.json", "--mask",   "c.nii", "--from"};
  must(from("a.json", joined(slice, {"axial:13", "--start", "start.json"})));
  for (const char* found : {"start.json", "b.json"})
    EXPECT_LT(scores(found, "a.json")["distance"]["max_mm"], 0.3) << found;
  must(from("a.json", joined(stack, {"13"})));
  must({"evaluate", "a.json", "--reference", "c.nii", "--slice", "axial:13", "--json", "e.json"});
  EXPECT_GT(json("e.json")["dice"], 0.98);

  for (const Words& words : {joined(slice, {"axial:12"}), joined(stack, {"12"})}) {
    const Outcome refused = run(from("a.json", words));
    EXPECT_EQ(refused.exit_code, 3);
    EXPECT_NE(refused.err.find("a.json lies in another plane than part.nii (NIfTI-1, axial slice "
                               "12): up to 1 mm off"),
              std::string::npos)
        << refused.err;
    EXPECT_EQ(std::count(refused.err.begin(), refused.err.end(), '\n'), 1) << refused.err;
  }
  must(from("a.csv", joined(slice, {"axial:12"})));  // which has no place in the world
}

TEST_F(Curveseg, StackFollowsAnObjectToItsEnd) {
  write_ball(file("ball.nii.gz"));
  must({"stack", "ball.nii.gz", "--from", "20", "--to", "39", "--seed", "20,20", "-o", "b.vtp",
        "--mask", "b.nii.gz", "--json", "s.json", "-q"});
  const auto slices = json("s.json")["slices"];
  EXPECT_NEAR(double(slices.size()), 12, 1);  // slices 20 to 31 or so
  for (const auto& slice : slices) {
    const double z = slice["slice"].get<double>() - 19.5, area = M_PI * (11.7 * 11.7 - z * z);
    // The ladder's window is chosen on the first slice; near the pole the ball is all edge.
    if (z < 10) {
      EXPECT_NEAR(slice["area_mm2"], area, 0.06 * area) << slice["slice"];
    }
  }
  const auto labels = surf::volume::read_volume(file("b.nii.gz"));
  EXPECT_EQ(labels.value(20, 20, 22), 1);
  EXPECT_EQ(labels.value(20, 20, 12), 0);
  EXPECT_EQ(labels.value(1, 1, 22), 0);
}

// Nothing is found in the first slice, its contours fail a guarantee, or a signal comes before.
TEST_F(Curveseg, StackWithoutAFirstContourSaysWhy) {
  write_ball(file("ball.nii"));
  const Words stack = {"stack", "ball.nii", "--from", "20",     "--to",   "22",    "-o",
                       "b.vtp", "--mask",   "m.nii",  "--json", "s.json", "--seed"};
  const auto expect_none = [&](const Outcome& outcome, int exit_code, const std::string& why) {
    EXPECT_EQ(outcome.exit_code, exit_code) << outcome.err;
    EXPECT_NE(outcome.err.find("b.vtp: not written: slice 20: " + why), std::string::npos)
        << outcome.err;
    for (const char* name : {"b.vtp", "m.nii"}) EXPECT_FALSE(exists(name)) << name;
    const auto summary = json("s.json");
    EXPECT_EQ(summary["exit_code"], exit_code);
    EXPECT_TRUE(summary["slices"].empty());
    EXPECT_EQ(summary["notes"].size(), 1u);
    std::filesystem::remove(file("s.json"));
  };
  expect_none(run(joined(stack, {"1,1", "-q"})), 8, "no region");
  expect_none(run(joined(stack, {"20,20", "-q", "--min-component", "5000"})), 6, "no elements");
  for (const auto& [signal, exit_code] : {std::pair{SIGINT, 130}, {SIGTERM, 143}})
    expect_none(interrupted_run(joined(stack, {"20,20", "-v"}), signal, "slice 20 propose"),
                exit_code, "interrupted before");
}

Words segment(const Words& wrong) {
  return joined({"segment", "good.tif", "--seed", "8,8", "-o", "out.json"}, wrong);
}
Words in_slice(const Words& start) {
  return joined({"segment", "ball.nii", "--slice", "axial:8", "-o", "out.json", "--space", "ras"},
                start);
}
Words image(const char* name) { return {"segment", name, "--seed", "8,8", "-o", "out.json"}; }
Words stack(const Words& more) {
  return joined({"stack", "ball.nii", "--from", "8", "--to", "9"}, more);
}
Words start(const Words& how) {
  return joined({"segment", "good.tif", "-o", "out.json", "--energy", "chan-vese"}, how);
}

const std::vector<Row> kRows = {
    {"DenoisedAlone", joined(start({"--circle", "8,8,3px"}), {"--denoised", "u.tif"}), 2,
     "belongs to --energy mumford-shah"},
    {"DenoisedName",
     {"segment", "good.tif", "-o", "out.json", "--circle", "8,8,3px", "--energy", "mumford-shah",
      "--denoised", "u.jpg"},
     2,
     "ends in .png or .tif"},
    {"MumfordShahMu",
     {"segment", "good.tif", "-o", "out.json", "--circle", "8,8,3px", "--energy",
      "mumford-shah:mu=0"},
     2,
     "mu = 0 violates > 0"},
    {"ThresholdsTheWrongWay", segment({"--first-threshold", "30"}), 2,
     "--first-threshold = 30, second_threshold = 20 violate"},
    {"CoarseGeometryBelowOne", segment({"--coarse-geometry", "0.5"}), 2,
     "--coarse-geometry = 0.5 violates >= 1"},
    {"CoarseStepsNegative", segment({"--coarse-steps", "-1"}), 2, "--coarse-steps = -1 violates"},
    {"BoxOfThree", segment({"--box", "1,2,3"}), 2, "--box: expected 4 numbers X,Y,X,Y"},
    {"BoxOfNoPixel", segment({"--box", "90,90,99,99"}), 2, "holds no pixel"},
    {"OutsideBeyondTheImage", segment({"--outside", "99,0"}), 2, "--outside: (99, 0) mm is"},
    {"OutsideInTheSeedsPixel", segment({"--outside", "8.2,8"}), 2,
     "--outside: (8.2, 8) mm is in the same pixel as an inside click"},
    {"OutsideWithoutSeed",
     {"segment", "good.tif", "--outside", "3,3", "-o", "out.json"},
     2,
     "--seed: at least one point"},
    {"NoImage", {"segment", "--seed", "8,8", "-o", "out.json"}, 2, "an image is missing"},
    {"ImageMissing", image("gone.png"), 3, "gone.png: cannot be read"},
    {"ImageText", image("text.txt"), 3, "neither an image (PNG, JPEG, TIFF) nor a volume"},
    {"ImageEmpty", image("empty.png"), 3, "is empty"},
    {"ImageCut", image("cut.png"), 3, "truncated or damaged"},
    {"VolumeWithoutSlice", image("ball.nii"), 2, "choose a slice"},
    {"SliceOfImage", segment({"--slice", "axial:3"}), 2, "is an image, not a volume"},
    {"SliceText", segment({"--slice", "axial"}), 2, "--slice: expected PLANE:INDEX"},
    {"SlicePlane", segment({"--slice", "front:3"}), 2, "expected axial, sagittal or coronal"},
    {"SliceBeyond",
     {"segment", "ball.nii", "--slice", "axial:99", "--seed", "8,8", "-o", "out.json"},
     3,
     "there is no axial slice 99; they are 0 to 15"},
    {"PlaneOfFive", segment({"--plane", "0,0,0,1,0"}), 2, "--plane: expected a point and a normal"},
    {"PlaneElsewhere",
     {"segment", "ball.nii", "--plane", "900,0,0,1,0,0", "--seed", "8,8", "-o", "out.json"},
     2,
     "misses the volume"},
    {"SliceAndPlane", segment({"--slice", "axial:1", "--plane", "0,0,0,0,0,1"}), 2, "give one"},
    {"EdgesBelowThePixel", segment({"--edge-length", "0.0001px"}), 2, "a fiftieth of a pixel"},
    {"FrameOfImage", segment({"--frame-index", "3"}), 2,
     "--frame-index: good.tif is an image, not a 4-D volume"},
    {"SeriesOfImage", segment({"--series-uid", "1.2"}), 2,
     "--series-uid: good.tif is an image, not a volume"},
    {"PageOfSlice", in_slice({"--seed", "0,0,0", "--page", "1"}), 2, "--page: is of TIFF files"},
    {"PlaneOfOblongPixels",
     {"segment", "ball.nii", "--plane", "0,0,0,0,0,1", "--spacing", "1,2", "--seed", "8,8", "-o",
      "out.json"},
     2,
     "--spacing: pixels of a --plane are square"},
    {"SpacingZero", segment({"--spacing", "0"}), 2, "--spacing: a spacing must be positive"},
    {"PageBeyond", segment({"--page", "4"}), 3, "there is no page 4"},
    {"NoOutput", {"segment", "good.tif", "--seed", "8,8"}, 2, "-o: an output file is missing"},
    {"OutputEnding", {"segment", "good.tif", "--seed", "8,8", "-o", "out.stl"}, 2, "ends in .svg"},
    {"OutputFolder", {"segment", "good.tif", "--seed", "8,8", "-o", "no/o.svg"}, 4, "folder no"},
    {"MaskEnding", segment({"--mask", "m.nii"}), 2, "--mask: m.nii: expected a name"},
    {"StartEnding", segment({"--start", "a.svg"}), 2, "--start: a.svg: expected a name"},
    {"FramesMissing", segment({"--frames", "no"}), 4, "--frames: the folder no does not exist"},
    {"OutputIsInput", segment({"--overlay", "good.png", "--mask", "good.png"}), 2, "too; give"},
    {"NoSeed", {"segment", "good.tif", "-o", "out.json"}, 2, "--seed: at least one point"},
    {"SeedText", {"segment", "good.tif", "--seed", "a,b", "-o", "out.json"}, 2, "two numbers X,Y"},
    {"SeedOutside",
     {"segment", "good.tif", "--seed", "99,8", "-o", "out.json"},
     2,
     "16 x 16 pixels"},
    {"SeedOffTheSlice", in_slice({"--seed", "0,0,5"}), 2,
     "--seed: 0,0,5 lies 4.933 mm off the plane of the slice (NIfTI-1, axial slice 8; 0.1333 mm "
     "thick), whose next point is 0,0,0.0666667 ras"},
    {"SeedOffTheSliceInLps",
     {"segment", "ball.nii", "--slice", "axial:8", "-o", "out.json", "--space", "lps", "--seed",
      "0.2,0.1,-0.1"},
     2,
     "whose next point is 0.2,0.1,0.0666667 lps"},
    {"CircleOffTheSlice", in_slice({"--circle", "0,0,5,3px", "--energy", "area"}), 2,
     "--circle: 0,0,5 lies 4.933 mm off the plane"},
    {"StackSeedOffTheSlice",
     {"stack", "ball.nii", "--from", "8", "--to", "9", "--space", "ras", "--seed", "0,0,0.5", "-o",
      "o.vtp"},
     2,
     "--seed: 0,0,0.5 lies"},
    {"SeedInRasOfAnImage", segment({"--space", "ras", "--seed", "1,2,3"}), 2, "use px or mm"},
    {"CircleOfTwo", start({"--circle", "8,8"}), 2, "--circle: expected X,Y,RADIUS"},
    {"CircleUnit", start({"--circle", "8,8,3"}), 2, "a length with its unit"},
    {"CirclesMeetFixed",
     start({"--circle", "6,8,4px", "--circle", "10,8,4px", "--topology", "fixed"}), 6,
     "meet one another or themselves, and a fixed topology keeps them so"},
    {"CirclesTooSmall", start({"--circle", "8,8,0.5px"}), 6,
     "of the image; start from larger ones, or with shorter edges"},
    {"GridTooFine", start({"--seeds-grid", "0.001px"}), 2,
     "--seeds-grid = 0.001 means 2.25e+08 circles"},
    {"GridTooWide", start({"--seeds-grid", "900px"}), 2, "more than the image"},
    {"StartTwice", start({"--circle", "8,8,3px", "--seeds-grid", "9px"}), 2, "give one of them"},
    {"ContourMissing", start({"--contour", "gone.json"}), 3, "gone.json: cannot be read"},
    {"ContourBroken", start({"--contour", "broken.json"}), 3, "not GeoJSON"},
    {"ContourCrossed", start({"--contour", "crossed.csv"}), 3, "crossed.csv: "},
    {"ContourIsCandidate", start({"--contour", "out.candidate-1.json", "--candidates"}), 2,
     "out.candidate-1.json: is --contour too"},
    {"ContourEnding", start({"--contour", "c.svg"}), 2, "ends in .json or .csv"},
    {"GridWithoutEnergy",
     {"segment", "good.tif", "-o", "out.json", "--seeds-grid", "9px"},
     2,
     "an energy is needed"},
    {"EnergyUnknown", segment({"--energy", "foo"}), 2, "energy 'foo' is unknown"},
    {"RadiusUnit", segment({"--radius", "12"}), 2, "--radius: expected a length"},
    {"TopologyGenus", segment({"--topology", "genus0"}), 2, "--topology"},
    {"StackWithoutRange", {"stack", "ball.nii", "--seed", "8,8", "-o", "o.vtp"}, 2, "--from, --to"},
    {"StackOutput",
     {"stack", "ball.nii", "--from", "1", "--to", "2", "--seed", "8,8", "-o", "o.svg"},
     2,
     "ends in .json, .vtp or .csv"},
    {"StackRecipe", stack({"--seed", "8,8", "-o", "o.vtp", "--recipe", "r.json"}), 2, "--recipe"},
    {"StackCheckpoint", stack({"--seed", "8,8", "-o", "o.vtp", "--checkpoint", "c"}), 2,
     "--checkpoint"},
    {"StackBoxes", stack({"--seed", "8,8", "-o", "o.vtp", "--box", "1,1,9,9", "--box", "2,2,9,9"}),
     2, "2 boxes"},
    {"StackResume", stack({"--seed", "8,8", "-o", "o.vtp", "--resume"}), 2, "--resume"},
    {"StackProfile", stack({"--seed", "8,8", "-o", "o.vtp", "--profile"}), 2, "--profile"},
    {"StackMemory", stack({"--seed", "8,8", "-o", "o.vtp", "--memory", "9MB"}), 2,
     "--memory: 9MB is less than"},
    {"StackOutputIsContour",
     stack({"--contour", "crossed.csv", "--energy", "area", "-o", "crossed.csv"}), 2,
     "-o: crossed.csv: is --contour too"},
    {"StackSummaryIsLandmarks",
     stack({"--landmarks", "text.txt", "-o", "o.vtp", "--json", "text.txt"}), 2,
     "--json: text.txt: is --landmarks too"},
    {"PhantomKind", {"phantom", "cube", "-o", "o.tif"}, 2, "KIND"},
    {"PhantomSize", {"phantom", "blob", "-o", "o.tif", "--size", "1"}, 2, "--size: expected N"},
    {"PhantomOutput", {"phantom", "blob", "-o", "o.jpg"}, 2, "ends in .tif or .png"},
    {"EvaluateMissing", {"evaluate", "gone.json", "--reference", "x.json"}, 3, "gone.json"},
    {"EvaluateSliceOfContours",
     {"evaluate", "crossed.csv", "--reference", "crossed.csv", "--slice", "axial:3"},
     2,
     "--slice: crossed.csv holds contours"},
    {"EvaluateFrameOfContours",
     {"evaluate", "crossed.csv", "--reference", "crossed.csv", "--frame-index", "2"},
     2,
     "--frame-index: crossed.csv holds contours"},
    {"EvaluateSeriesOfContours",
     {"evaluate", "crossed.csv", "--reference", "crossed.csv", "--series-uid", "1.2"},
     2,
     "--series-uid: crossed.csv holds contours"},
    {"EvaluateSeriesOfImage",
     {"evaluate", "crossed.csv", "--reference", "good.tif", "--series-uid", "1.2"},
     2,
     "--series-uid: good.tif is an image"},
    {"EvaluateAPoint",
     {"evaluate", "point.csv", "--reference", "point.csv"},
     3,
     "point.csv: its contours have a length of 0 mm"},
    {"EvaluateAgainstAPoint",
     {"evaluate", "crossed.csv", "--reference", "point.csv"},
     3,
     "point.csv: its contours have a length of 0 mm"},
    {"ConfigKey", segment({"--config", "key.json"}), 2, "'radios' is not an option of segment"},
    {"NoVerb", {}, 2, "subcommand is required"},
    {"VerbUnknown", {"segmnet"}, 2, "(see curveseg --help)"},
    {"VerbNearlyKnown", {"stac"}, 2, "did you mean 'stack'?"},
    {"OptionNearlyKnown", segment({"--circel", "8,8,3px"}), 2, "did you mean '--circle'?"},
    {"PresetNearlyKnown", segment({"--preset", "kidney"}), 2, "did you mean 'kidney-ct'?"},
    {"GridTouches", start({"--seeds-grid", "4px", "--radius", "3px"}), 2, "--radius = 3: circles"},
    {"PictureIsMask", segment({"--picture", "p.png", "--mask", "p.png"}), 2, "too; give"},
};

class CurvesegBadInput : public RowTest {};
INSTANTIATE_TEST_SUITE_P(All, CurvesegBadInput, ::testing::ValuesIn(kRows), name_of);

TEST_P(CurvesegBadInput, EndsInOneClearLine) {
  must({"phantom", "ring", "--size", "16", "-o", "good.tif"});
  must({"phantom", "ring", "--size", "16", "-o", "whole.png"});
  surf::volume::write_volume(
      file("ball.nii"),
      surf::volume::make_phantom(
          {.size = {16, 16, 16}, .spacing_mm = {}, .origin_ras_mm = {}, .edge_width_mm = {}}));
  put("cut.png", bytes("whole.png").substr(0, 60));
  put("text.txt", "no image");
  put("empty.png", "");
  put("broken.json", "{\"type\": \"Polygon\"}");
  put("key.json", "{\"radios\": 3}");
  put("point.csv", "polygon,ring,x_mm,y_mm\n0,0,2,2\n0,0,2,2\n0,0,2,2\n0,0,2,2\n");
  put("crossed.csv", "polygon,ring,x_mm,y_mm\n0,0,2,2\n0,0,9,9\n0,0,9,2\n0,0,2,8\n");
  expect_refusal("curveseg");
}

}  // namespace
}  // namespace surfseg::test
