#include "libsurf/io/write_surface.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <vtkCell.h>
#include <vtkCompositeDataGeometryFilter.h>
#include <vtkGLTFReader.h>
#include <vtkNew.h>
#include <vtkPolyData.h>

#include <csignal>
#include <cstring>
#include <filesystem>
#include <limits>

#include "libsurf/base/error.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/verify.h"
#include "tests/surf/io/scratch_folder.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf::io {
namespace {

using namespace surf::test;

constexpr const char* kEndings[] = {".stl", ".obj", ".ply", ".vtp"};

/// Coordinates with all the digits of a double.
Triangles ball() { return sphere({-31.7, 122.4, 1000.0 / 3}, 17.3, 3); }

/// Rows of corners, whatever the numbering of the points.
Points<3> corners(const Triangles& surface) {
  Points<3> result(surface.elements.size(), 3);
  for (Eigen::Index at = 0; at < surface.elements.size(); ++at)
    result.row(at) = surface.points.row(surface.elements.data()[at]);
  return result;
}

class WriteSurface : public ScratchFolder {};

TEST_F(WriteSurface, ComesBackBitForBitAsRounded) {
  for (const char* ending : kEndings)
    for (const Space space : {Space::kLps, Space::kRas}) {
      const std::string file = path(std::string("ball") + ending);
      write_surface(file, ball(), {space});
      const Triangles back = read_surface(file);
      EXPECT_TRUE(corners(back) == corners(rounded_to_file(ball(), ending))) << ending;
      EXPECT_EQ(back.points.rows(), ball().points.rows()) << ending;
      EXPECT_TRUE(mesh::verify(back).passed()) << ending;
      EXPECT_GT(mesh::volume_mm3(back), 0) << ending;
    }
}

// Upright, looking at the viewer, in metres: what VTK's reader finds.
TEST_F(WriteSurface, GlbStandsUprightInMetres) {
  WriteOptions options;
  options.colour = {{230, 159, 0}};
  options.arrays = {{"deviation_mm", ball().points.col(2)}};
  for (const Space space : {Space::kLps, Space::kRas}) {
    options.space = space;
    const std::string file = path("ball.glb");
    write_surface(file, ball(), options);
    vtkNew<vtkGLTFReader> reader;
    reader->SetFileName(file.c_str());
    reader->ApplyDeformationsToGeometryOn();
    reader->Update();
    vtkNew<vtkCompositeDataGeometryFilter> flat;
    flat->SetInputConnection(reader->GetOutputPort());
    flat->Update();
    vtkPolyData* found = flat->GetOutput();
    ASSERT_EQ(found->GetNumberOfPoints(), ball().points.rows());
    ASSERT_EQ(found->GetNumberOfPolys(), ball().elements.rows());
    double furthest = 0;
    for (Eigen::Index i = 0; i < ball().points.rows(); ++i) {
      Vector<3> at;
      found->GetPoint(i, at.data());
      const Vector<3> ras(-1e3 * at[0], 1e3 * at[2], 1e3 * at[1]);
      furthest = std::max(furthest, (ras - ball().points.row(i).transpose()).norm());
    }
    EXPECT_LT(furthest, 1e-4);  // mm
    EXPECT_EQ(found->GetCell(7)->GetPointId(1), ball().elements(7, 1));
  }
}

TEST_F(WriteSurface, GiftiHasTheNumbersOfThePointsBesideIt) {
  WriteOptions options;
  write_surface(path("ball.surf.gii"), ball(), options);
  EXPECT_FALSE(std::filesystem::exists(path("ball.shape.gii")));
  options.arrays = {{"deviation_mm", ball().points.col(2)}};
  write_surface(path("ball.surf.gii"), ball(), options);
  EXPECT_TRUE(std::filesystem::exists(path("ball.shape.gii")));
}

TEST_F(WriteSurface, RemovesTheNumbersOfAnEarlierSurfaceButNotSomebodyElses) {
  const std::string numbers = path("ball.shape.gii");
  EXPECT_EQ(file_beside(path("ball.surf.gii")), numbers);
  EXPECT_EQ(file_beside(path("ball.gii")), numbers);
  write_surface(path("ball.surf.gii"), ball(), {Space::kLps, {{"z", ball().points.col(2)}}});
  ASSERT_TRUE(std::filesystem::exists(numbers));
  write_surface(path("ball.surf.gii"), ball());
  EXPECT_FALSE(std::filesystem::exists(numbers));
  write("ball.shape.gii", "<GIFTI Version=\"1.0\">of another program</GIFTI>");
  write_surface(path("ball.surf.gii"), ball());
  EXPECT_TRUE(std::filesystem::exists(numbers));
}

TEST_F(WriteSurface, ObjNamesItsColourInAFileBesideIt) {
  WriteOptions options;
  options.colour = {{51, 102, 255}};
  options.name = "left kidney";
  write_surface(path("t.obj"), tetrahedron(), options);
  EXPECT_TRUE(
      read(path("t.obj")).starts_with("# surfseg\n# SPACE=LPS\nmtllib t.mtl\no left_kidney\nv "));
  EXPECT_NE(read(path("t.obj")).find("\nusemtl left_kidney\nf "), std::string::npos);
  EXPECT_EQ(read(path("t.mtl")), "# surfseg\nnewmtl left_kidney\nKd 0.2 0.4 1\n");
  EXPECT_TRUE(corners(read_surface(path("t.obj"))) == corners(tetrahedron()));
  EXPECT_EQ(file_beside("a/t.stl"), "");
}

TEST_F(WriteSurface, ObjsColourHasAFileWithoutBlanksInItsName) {
  WriteOptions options;
  options.colour = {{51, 102, 255}};
  write_surface(path("my liver.obj"), tetrahedron(), options);
  EXPECT_NE(read(path("my liver.obj")).find("\nmtllib my_liver.mtl\n"), std::string::npos);
  EXPECT_TRUE(std::filesystem::exists(path("my_liver.mtl")));
  EXPECT_EQ(file_beside("a folder/my liver.obj"), "a folder/my_liver.mtl");
}

TEST_F(WriteSurface, DicomNeedsTheSeriesItBelongsTo) {
  EXPECT_THROW(write_surface(path("t.dcm"), tetrahedron()), Error);
  EXPECT_EQ(n_files(), 0u);
}

TEST_F(WriteSurface, EveryEndingThatIsOfferedCanBeWritten) {
  for (const std::string& ending : surface_endings()) {
    EXPECT_TRUE(is_writable_surface("liver" + ending)) << ending;
    if (ending != ".stl.dcm") {
      EXPECT_NO_THROW(write_surface(path("t" + ending), tetrahedron()));
    }
  }
}

TEST_F(WriteSurface, KeepsDoublesInVtpAndFloatsElsewhere) {
  EXPECT_EQ(rounded_to_file(ball(), ".vtp").points, ball().points);
  const double exact = ball().points(0, 1);
  for (const char* ending : {".stl", ".obj", ".ply"})
    EXPECT_EQ(rounded_to_file(ball(), ending).points(0, 1), double(float(exact))) << ending;
  EXPECT_NE(double(float(exact)), exact);
}

TEST_F(WriteSurface, HoldsNumbersOfThePointsInPlyAndVtp) {
  const Triangles surface = ball();
  const Eigen::VectorXd heights = surface.points.col(2) / 7;
  const WriteOptions options{Space::kLps, {{"height_mm", heights}, {"twice", 2 * heights}}};
  for (const char* ending : {".ply", ".vtp"}) {
    const std::string file = path(std::string("ball") + ending);
    write_surface(file, surface, options);
    EXPECT_TRUE(corners(read_surface(file)) == corners(rounded_to_file(surface, ending)));
    const Eigen::VectorXd back = read_point_array(file, "height_mm");
    if (std::string(ending) == ".vtp")
      EXPECT_EQ(back, heights);
    else
      EXPECT_EQ(back, heights.cast<float>().cast<double>());
    EXPECT_THROW(read_point_array(file, "depth_mm"), InputError);
  }
  write_surface(path("ball.stl"), surface, options);
  EXPECT_THROW(read_point_array(path("ball.stl"), "height_mm"), InputError);
  EXPECT_THROW(write_surface(path("b.ply"), surface, {Space::kLps, {{"short", heights.head(3)}}}),
               InvalidMesh);
}

TEST_F(WriteSurface, StatesItsSpaceAsSlicerReadsIt) {
  for (const auto& [space, word] : {std::pair(Space::kLps, "LPS"), {Space::kRas, "RAS"}}) {
    for (const char* ending : kEndings)
      write_surface(path(std::string("t") + ending), tetrahedron(), {space});
    const std::string statement = std::string("SPACE=") + word;
    EXPECT_NE(read(path("t.stl")).substr(0, 80).find(statement + " "), std::string::npos);
    EXPECT_FALSE(read(path("t.stl")).starts_with("solid"));
    EXPECT_NE(read(path("t.obj")).find("# " + statement + "\n"), std::string::npos);
    EXPECT_NE(read(path("t.ply")).find("comment " + statement + "\n"), std::string::npos);
    EXPECT_NE(read(path("t.vtp")).find("type=\"String\" Name=\"SPACE\""), std::string::npos);
  }
}

TEST_F(WriteSurface, LpsIsTheDefaultAndNegatesXAndY) {
  write_surface(path("t.obj"), tetrahedron());
  EXPECT_EQ(read(path("t.obj")),
            "# surfseg\n# SPACE=LPS\nv -0 -0 0\nv -1 -0 0\nv -0 -1 0\nv -0 -0 1\n"
            "f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
}

TEST_F(WriteSurface, StlHasOutwardUnitNormals) {
  write_surface(path("t.stl"), sphere({0, 0, 0}, 1e-12, 2), {Space::kRas});
  const std::string bytes = read(path("t.stl"));
  ASSERT_EQ(bytes.size(), 84u + 50 * 128);
  for (int facet = 0; facet < 128; ++facet) {
    float values[6];
    std::memcpy(values, bytes.data() + 84 + 50 * facet, sizeof values);
    const Eigen::Vector3f normal(values), corner(values + 3);
    EXPECT_NEAR(normal.norm(), 1, 1e-6);
    EXPECT_GT(normal.dot(corner), 0);
  }
}

TEST_F(WriteSurface, GivesTheSameBytesTwice) {
  for (const char* ending : {".stl", ".obj", ".ply", ".vtp", ".gii", ".glb", ".3mf"}) {
    const std::string a = path(std::string("a") + ending), b = path(std::string("b") + ending);
    write_surface(a, ball());
    write_surface(b, ball());
    EXPECT_EQ(read(a), read(b)) << ending;
  }
}

TEST_F(WriteSurface, AcceptsEndingsInCapitals) {
  write_surface(path("BALL.STL"), ball());
  EXPECT_EQ(read_surface(path("BALL.STL")).elements.rows(), ball().elements.rows());
}

TEST_F(WriteSurface, RefusesAnUnknownEnding) {
  for (const char* name : {"t.off", "t", "t.nii.gz", "stl"}) {
    EXPECT_THROW(write_surface(path(name), tetrahedron()), UsageError) << name;
    EXPECT_FALSE(is_writable_surface(name));
  }
  EXPECT_THROW(rounded_to_file(tetrahedron(), ".off"), UsageError);
  EXPECT_EQ(n_files(), 0u);
}

TEST_F(WriteSurface, RefusesWhatNoFileCanHold) {
  Triangles surface = tetrahedron();
  surface.points(0, 0) = 1e300;  // not a float
  EXPECT_THROW(write_surface(path("t.stl"), surface), InvalidMesh);
  EXPECT_NO_THROW(write_surface(path("t.vtp"), surface));
  surface.points(0, 0) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(write_surface(path("t.vtp"), surface), InvalidMesh);
  surface = tetrahedron();
  surface.elements(0, 0) = 4;
  EXPECT_THROW(write_surface(path("t.stl"), surface), InvalidMesh);
}

TEST_F(WriteSurface, FailsWhereItCannotWrite) {
  for (const char* ending : kEndings) {
    EXPECT_THROW(write_surface(path(std::string("no/folder/t") + ending), ball()), OutputError);
    EXPECT_THROW(write_surface(std::string("/proc/t") + ending, ball()), OutputError);
  }
  std::filesystem::create_directory(path("folder.stl"));
  EXPECT_THROW(write_surface(path("folder.stl"), ball()), OutputError);
}

/// Files cannot grow beyond a size while this lives, as on a full disk.
class FullDisk {
 public:
  explicit FullDisk(rlim_t bytes) {
    ::getrlimit(RLIMIT_FSIZE, &old_);
    old_handler_ = std::signal(SIGXFSZ, SIG_IGN);
    const rlimit limit{bytes, old_.rlim_max};
    ::setrlimit(RLIMIT_FSIZE, &limit);
  }
  ~FullDisk() {
    ::setrlimit(RLIMIT_FSIZE, &old_);
    std::signal(SIGXFSZ, old_handler_);
  }

 private:
  rlimit old_{};
  void (*old_handler_)(int);
};

TEST_F(WriteSurface, KeepsTheOldFileWhenTheDiskIsFull) {
  for (const char* ending : kEndings) {
    const std::string file = path(std::string("t") + ending);
    write_surface(file, tetrahedron());
    const std::string before = read(file);
    {
      const FullDisk full(2000);
      EXPECT_THROW(write_surface(file, sphere({0, 0, 0}, 1, 5)), OutputError) << ending;
    }
    EXPECT_EQ(read(file), before) << ending;
  }
  EXPECT_EQ(n_files(), std::size(kEndings));  // no temporary is left
}

}  // namespace
}  // namespace surf::io
