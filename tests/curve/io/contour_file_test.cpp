#include "libcurve/io/contour_file.h"

#include "libcurve/image/phantom.h"
#include "libcurve/mesh/verify.h"
#include "libcurve/segment/finish.h"
#include "libcurve/segment/segment.h"
#include "libsurf/base/error.h"
#include "libsurf/fem/geometry.h"
#include "tests/surf/io/scratch_folder.h"

namespace surf::curve {
namespace {

class ContourFile : public test::ScratchFolder {
 protected:
  PhantomOptions options_{.kind = PhantomKind::kRing, .size = {40, 40}};
  Image image_ = make_phantom(options_);
  Segments ring_ = phantom_contour(options_);

  std::string error_of(const std::string& path) const {
    try {
      read_contours(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }
};

TEST_F(ContourFile, CurvesComeBackBitForBit) {
  for (const char* name : {"r.json", "r.csv"}) {
    write_contours(path(name), ring_, image_);
    const Segments back = read_contours(path(name));
    EXPECT_TRUE(verify(back).passed()) << name;
    EXPECT_EQ(back.points, ring_.points) << name;  // written with all digits, in the same order
    EXPECT_EQ(back.elements, ring_.elements) << name;
  }
}

TEST_F(ContourFile, PixelsAndTheSlicesPlaceComeBackBitForBit) {
  write_contours(path("r.json"), ring_, image_);
  const auto flat = pixels_of_contours(path("r.json"));
  ASSERT_TRUE(flat);
  EXPECT_EQ(flat->size, image_.size());
  EXPECT_EQ(flat->to_plane.matrix(), image_.pixel_to_plane().matrix());
  EXPECT_FALSE(flat->plane_to_ras);

  Eigen::Affine3d frame(Eigen::AngleAxisd(0.3, Eigen::Vector3d(1, 2, 3).normalized()));
  frame.translation() << 100, 200, 1.0 / 3;
  const Image slice(image_.size(), image_.pixel_to_plane(), image_.values(), {}, frame, 0.7);
  write_contours(path("s.json"), ring_, slice);
  const auto placed = pixels_of_contours(path("s.json"));
  ASSERT_TRUE(placed && placed->plane_to_ras);
  EXPECT_EQ(placed->plane_to_ras->matrix(), frame.matrix());
  EXPECT_EQ(placed->thickness_mm, 0.7);

  const auto with = [&](const std::string& rest) {
    const std::string start = R"({"size": [4, 4], "pixel_to_mm": [[1, 0, 0], [0, 1, 0]], )";
    return pixels_of_contours(write("w.json", start + rest + "}"));
  };
  EXPECT_THROW(with(R"("mm_to_ras": [[1, 0, 0, 0]])"), InputError);
  EXPECT_THROW(with(R"("mm_to_ras": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 1, 0, 0]])"), InputError);
  EXPECT_EQ(with(R"("x": 0)")->thickness_mm, 0);
  EXPECT_FALSE(pixels_of_contours(write("g.json", "{}")));
}

TEST_F(ContourFile, WhatIsFinishedIsWrittenAsAnyCurvesAre) {
  segment::Proposal<2> proposal;
  proposal.shape = ring_;
  const auto finished = segment::finish<2>(*make_setting(image_), proposal, ".json");
  curve::write(path("finished.json"), finished, image_, io::Space::kRas);
  write_contours(path("r.json"), ring_, image_, io::Space::kRas);
  EXPECT_EQ(read(path("finished.json")), read(path("r.json")));
}

TEST_F(ContourFile, RingsAreTurnedToTheDomain) {
  const std::string square =
      R"({"type": "Polygon", "coordinates": [[[0,0],[0,4],[4,4],[4,0],[0,0]],
          [[1,1],[3,1],[3,3],[1,3],[1,1]]]})";
  const Segments curves = read_contours(write("s.json", square));
  EXPECT_TRUE(verify(curves).alternating);
  EXPECT_DOUBLE_EQ(fem::Geometry<2>(curves.points, curves.elements).enclosed(), 12);
}

TEST_F(ContourFile, SvgAndVtpHoldAHoleInOnePath) {
  write_contours(path("r.svg"), ring_, image_);
  const std::string svg = read(path("r.svg"));
  EXPECT_EQ(svg.find("<path"), svg.rfind("<path"));
  EXPECT_NE(svg.find("ZM"), std::string::npos);
  EXPECT_NE(svg.find("evenodd"), std::string::npos);
  write_contours(path("r.vtp"), ring_, image_);
  EXPECT_NE(read(path("r.vtp")).find("NumberOfLines=\"2\""), std::string::npos);
}

TEST_F(ContourFile, StacksLieInTheWorld) {
  Eigen::Affine3d frame = Eigen::Affine3d::Identity();
  frame.translation() << 100, 200, 300;
  write_stack(path("s.csv"), {{7, ring_, frame}}, io::Space::kRas);
  const std::string text = read(path("s.csv"));
  EXPECT_EQ(text.find("slice,polygon,ring,x_ras_mm,y_ras_mm,z_ras_mm\n7,0,0,1"), 0u);
  EXPECT_NE(text.find(",300\n"), std::string::npos);
  write_stack(path("s.json"), {{7, ring_, frame}});
  EXPECT_NE(read(path("s.json")).find("\"space\":\"LPS\""), std::string::npos);
  EXPECT_THROW(write_stack(path("s.svg"), {{7, ring_, frame}}), UsageError);
}

TEST_F(ContourFile, BrokenFilesEndInOneClearLine) {
  EXPECT_NE(error_of(path("gone.json")).find("cannot be read"), std::string::npos);
  EXPECT_NE(error_of(write("a.json", "{")).find("not GeoJSON"), std::string::npos);
  EXPECT_NE(error_of(write("b.json", R"({"type": "Point"})")).find("'Point'"), std::string::npos);
  EXPECT_NE(error_of(write("c.json", R"({"type": "Polygon", "coordinates": [[[0,0],[1,1]]]})"))
                .find("3 or more"),
            std::string::npos);
  EXPECT_NE(error_of(write("d.csv", "x,y\n1,2\n")).find("d.csv:1: expected"), std::string::npos);
  EXPECT_NE(error_of(write("e.csv", "polygon,ring,x_mm,y_mm\n0,0,1\n")).find("e.csv:2: expected"),
            std::string::npos);
  EXPECT_NE(error_of(write("f.csv", "polygon,ring,x_mm,y_mm\n")).find("holds no polygon"),
            std::string::npos);
}

}  // namespace
}  // namespace surf::curve
