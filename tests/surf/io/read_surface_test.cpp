#include "libsurf/io/read_surface.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cstring>

#include "libsurf/base/error.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/verify.h"
#include "tests/surf/io/scratch_folder.h"
#include "tests/surf/mesh/check_shapes.h"

namespace surf::io {
namespace {

using namespace surf::test;

const std::string kAsciiStl =
    "solid t SPACE=RAS\n"
    " facet normal 0 0 -1\n  outer loop\n   vertex 0 0 0\n   vertex 0 1e0 0\n   vertex 1 0 0\n"
    "  endloop\n endfacet\n"
    " facet normal 0 0 0\n  outer loop\n   vertex 0 -0 0\n   vertex 1 0 0\n   vertex 0 0 +1\n"
    "  endloop\n endfacet\n"
    "endsolid t\n";
const std::string kObj =
    "# made by hand\n# SPACE=RAS\nmtllib no.mtl\no thing\n"
    "v 0 0 0\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1 0\r\nvt 0 0\nvn 0 0 1\ng part\nusemtl m\n"
    "f 1/1/1 2//1 3/1 -1\n";
const std::string kPlyHeader =
    "ply\nformat ascii 1.0\ncomment SPACE=RAS\nobj_info x\nelement vertex 4\n"
    "property double x\nproperty float y\nproperty float z\nproperty uchar red\n";
const std::string kPlyFaces =
    "element face 1\nproperty uchar flags\nproperty list uchar uint vertex_index\n"
    "element edge 1\nproperty int v1\nproperty int v2\nend_header\n";
const std::string kPlyPoints = "0 0 0 255\n1 0 0 255\n1 1 0 255\n0 1 0 255\n";
const std::string kPly = kPlyHeader + kPlyFaces + kPlyPoints + "7 4 0 1 2 3\n0 1\n";
const std::string kVtp =
    "<?xml version=\"1.0\"?>\n"
    "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\">\n<PolyData>\n"
    "<FieldData><Array type=\"String\" Name=\"SPACE\" NumberOfTuples=\"1\" format=\"ascii\">"
    "82 65 83 0</Array></FieldData>\n"
    "<Piece NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" "
    "NumberOfPolys=\"1\">\n<Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
    "format=\"ascii\">0 0 0 1 0 0 1 1 0 0 1 0</DataArray></Points>\n"
    "<Polys><DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\n"
    "<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">4</DataArray></Polys>\n"
    "</Piece>\n</PolyData>\n</VTKFile>\n";

std::string replaced(std::string text, const std::string& from, const std::string& to) {
  const std::size_t at = text.find(from);
  EXPECT_NE(at, std::string::npos) << from;
  return text.replace(at, from.size(), to);
}

class ReadSurface : public ScratchFolder {};

/// The unit square as a fan of two triangles, its first corner at 0.
void expect_square(const Triangles& surface) {
  EXPECT_EQ(surface.points, (Points<3>(4, 3) << 0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0).finished());
  EXPECT_EQ(surface.elements, (Elements<3>(2, 3) << 0, 1, 2, 0, 2, 3).finished());
}

TEST_F(ReadSurface, AsciiStlIsWelded) {
  const Triangles surface = read_surface(write("t.stl", kAsciiStl));
  EXPECT_EQ(surface.points, (Points<3>(4, 3) << 0, 0, 0, 0, 1, 0, 1, 0, 0, 0, 0, 1).finished());
  EXPECT_EQ(surface.elements, (Elements<3>(2, 3) << 0, 1, 2, 0, 2, 3).finished());
}

TEST_F(ReadSurface, SquaresBecomeFans) {
  expect_square(read_surface(write("t.obj", kObj)));
  expect_square(read_surface(write("t.ply", kPly)));
  expect_square(read_surface(write("t.vtp", kVtp)));
}

TEST_F(ReadSurface, WithoutAStatementIsLps) {
  const std::pair<const char*, std::string> files[] = {
      {"t.stl", replaced(kAsciiStl, " SPACE=RAS", "")},
      {"t.obj", replaced(kObj, "# SPACE=RAS\n", "")},
      {"t.ply", replaced(kPly, "comment SPACE=RAS\n", "")},
      {"t.vtp", replaced(kVtp, "\"SPACE\"", "\"OTHER\"")}};
  for (const auto& [name, content] : files) {
    const Triangles surface = read_surface(write(name, content));
    EXPECT_EQ(surface.points.leftCols<2>().maxCoeff(), 0) << name;
    EXPECT_EQ(surface.points.leftCols<2>().minCoeff(), -1) << name;
    EXPECT_EQ(surface.points.col(2).minCoeff(), 0) << name;
  }
}

TEST_F(ReadSurface, OptionsSpeakOnlyWhereTheFileDoesNot) {
  const ReadOptions as_ras{.unstated_space = Space::kRas};
  expect_square(read_surface(write("t.obj", replaced(kObj, "# SPACE=RAS\n", "")), as_ras));
  const std::string lps = write("u.obj", replaced(kObj, "RAS", "LPS"));
  EXPECT_EQ(read_surface(lps, as_ras).points.col(0).minCoeff(), -1);
}

TEST_F(ReadSurface, BinaryPlyOfBothEndiansIsRead) {
  for (const bool is_big : {false, true}) {
    std::string bytes = replaced(kPlyHeader + kPlyFaces, "ascii",
                                 is_big ? "binary_big_endian" : "binary_little_endian");
    const auto put = [&](auto value) {
      char raw[sizeof value];
      std::memcpy(raw, &value, sizeof value);
      if (is_big) std::reverse(raw, raw + sizeof value);
      bytes.append(raw, sizeof value);
    };
    for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}}) {
      put(double(x));
      put(float(y));
      put(0.0f);
      bytes += '\xff';
    }
    bytes += "\7\4";
    for (std::uint32_t vertex = 0; vertex < 4; ++vertex) put(vertex);
    put(0);
    put(1);
    expect_square(read_surface(write("t.ply", bytes)));
    for (const std::size_t length : {bytes.size() - 10, bytes.size() - 40, bytes.size() - 90})
      EXPECT_THROW(read_surface(write("u.ply", bytes.substr(0, length))), InputError);
  }
}

TEST_F(ReadSurface, BinaryStlThatBeginsWithSolidIsBinary) {
  write_surface(path("t.stl"), tetrahedron());
  std::string bytes = read(path("t.stl"));
  bytes.replace(0, 5, "solid");
  EXPECT_EQ(read_surface(write("t.stl", bytes)).elements.rows(), 4);
}

TEST_F(ReadSurface, ReadsWhatIsNotASolid) {
  const Triangles open = without_triangle(sphere({1, 2, 3}, 4, 2), 3);
  for (const char* name : {"t.stl", "t.obj", "t.ply", "t.vtp"}) {
    write_surface(path(name), open);
    EXPECT_EQ(mesh::verify(read_surface(path(name))).n_border_edges, 3) << name;
  }
}

struct Broken {
  const char* name;
  std::string content;
  const char* message;  ///< a part of it
};

class BrokenSurface : public ScratchFolder, public ::testing::WithParamInterface<int> {};

std::vector<Broken> broken_files() {
  std::string stl(84, ' ');
  stl[80] = 2;
  stl[81] = stl[82] = stl[83] = 0;
  const std::string facet(50, '\0');
  const std::string nan_facet = replaced(facet, std::string(16, '\0'),
                                         std::string(12, '\0') + std::string("\0\0\xc0\x7f", 4));
  std::string empty_stl = stl;
  empty_stl[80] = 0;
  return {
      {"none.xyz", "x", "not a surface file by its ending"},
      {"empty.stl", "", "the file is empty"},
      {"empty.vtp", "", "the file is empty"},
      {"short.stl", "abc", "3 bytes are too few"},
      {"truncated.stl", stl + facet, "truncated: 2 triangles need 184 bytes, the file has 134"},
      {"faceless.stl", empty_stl, "holds no faces"},
      {"nan.stl", stl + facet + nan_facet, "has the coordinate nan"},
      {"truncated_ascii.stl", replaced(kAsciiStl, "endsolid t\n", ""), "truncated: no endsolid"},
      {"word.stl", replaced(kAsciiStl, "1e0", "one"), "word.stl:5: expected three coordinates"},
      {"missing.stl", replaced(kAsciiStl, "0 1e0 0", "0 1e0"), "missing.stl:5: expected three"},
      {"edge.stl", replaced(kAsciiStl, "   vertex 0 0 0\n", ""), "edge.stl:7: a facet with 2"},
      {"inf.stl", replaced(kAsciiStl, "1e0", "inf"), "has the coordinate inf"},
      {"far.obj", replaced(kObj, "v 1 1 0", "v 1 1e200 0"), "vertex 3 has the coordinate 1e+200"},
      {"space.stl", replaced(kAsciiStl, "RAS", "LAS"), "states SPACE=LAS; expected LPS or RAS"},
      {"faceless.obj", "v 0 0 0\n", "holds no faces"},
      {"binary.obj", std::string("\0\1\2\3 not text", 13), "holds no faces"},
      {"range.obj", replaced(kObj, "3/1", "5/1"), "range.obj:13: face names vertex 4"},
      {"negative.obj", replaced(kObj, "-1", "-5"), "negative.obj:13: face names vertex -1"},
      {"zero.obj", replaced(kObj, "3/1", "0"), "zero.obj:13: expected vertex numbers from 1"},
      {"huge.obj", replaced(kObj, "3/1", "99999999999999999999"), "huge.obj:13: expected vertex"},
      {"word.obj", replaced(kObj, "v 1 1 0", "v 1 a 0"), "word.obj:7: expected three coordinates"},
      {"nan.obj", replaced(kObj, "v 1 1 0", "v 1 nan 0"), "vertex 3 has the coordinate nan"},
      {"edge.obj", "v 0 0 0\nv 1 0 0\nf 1 2\n", "edge.obj:3: a face with 2 vertices"},
      {"space.obj", replaced(kObj, "RAS", "ijk"), "states SPACE=ijk"},
      {"not.ply", "plyx\n", "not a PLY file"},
      {"header.ply", kPlyHeader, "truncated: no end_header"},
      {"format.ply", replaced(kPly, "ascii", "text"), "format 'text'"},
      {"type.ply", replaced(kPly, "float y", "real y"), "'real' is not a type"},
      {"count.ply", replaced(kPly, "vertex 4", "vertex -4"), "expected a number of elements"},
      {"axis.ply", replaced(kPly, "double x", "double u"), "vertices have no property x"},
      {"list.ply", replaced(kPly, "vertex_index", "points"), "faces have no list"},
      {"strips.ply", replaced(kPly, "element edge", "element tristrips"), "triangle strips"},
      {"noproperty.ply", "ply\nformat ascii 1.0\nelement vertex 1\nend_header\n1\n",
       "no properties"},
      {"early.ply", "ply\nformat ascii 1.0\nproperty int x\n", "before the first element"},
      {"truncated.ply", kPlyHeader + kPlyFaces + kPlyPoints, "truncated: the header states more"},
      {"many.ply", replaced(kPly, "vertex 4", "vertex 4000000000000"), "expected a number; got ''"},
      {"word.ply", replaced(kPly, "1 1 0 255", "1 b 0 255"), "word.ply:19: expected a number"},
      {"range.ply", replaced(kPly, "0 1 2 3", "0 1 4 3"), "range.ply:21: face names vertex 4"},
      {"negative.ply", replaced(kPly, "0 1 2 3", "0 1 -2 3"),
       "negative.ply:21: face names vertex -2"},
      {"fraction.ply", replaced(kPly, "0 1 2 3", "0 1 1.5 3"), "names vertex 1.5"},
      {"edge.ply", replaced(kPly, "4 0 1 2 3", "2 0 1"), "a face with 2 vertices"},
      {"listcount.ply", replaced(kPly, "4 0 1 2 3", "-3 0 1 2"), "a list of -3 values"},
      {"nan.ply", replaced(kPly, "1 1 0 255", "1 nan 0 255"), "vertex 3 has the coordinate nan"},
      {"faceless.ply", replaced(replaced(kPly, "face 1", "face 0"), "7 4 0 1 2 3\n", ""),
       "holds no faces"},
      {"not.vtp", "hello", "broken"},
      {"truncated.vtp", kVtp.substr(0, 500), "truncated or damaged: a tag does not end"},
      {"range.vtp", replaced(kVtp, ">0 1 2 3<", ">0 1 2 9<"), "names vertex 9"},
      {"nan.vtp", replaced(kVtp, "0 0 0 1 0", "0 0 nan 1 0"), ""},
      {"offset.vtp", replaced(kVtp, ">4<", ">9<"), ""},
      {"offset2.vtp", replaced(kVtp, ">4<", ">-3<"), ""},
      {"offset3.vtp",
       replaced(replaced(kVtp, "NumberOfPolys=\"1\"", "NumberOfPolys=\"2\""), ">4<", ">900 4<"),
       "not monotonically increasing"},
      // VTK makes room for so many, 2^62, in 64 bits.
      {"offset4.vtp", replaced(kVtp, ">4<", ">4611686018427387904<"),
       "its offsets promise 4.61169e+18 corners"},
      {"offset5.vtp", replaced(kVtp, ">4<", ">4000000000<"), "its offsets promise 4e+09 corners"},
      {"space.vtp", replaced(kVtp, "82 65 83", "65 65 65"), "states SPACE=AAA"},
      {"image.vtp", replaced(kVtp, "<PolyData>", "<ImageData>"), ""},
  };
}

TEST_P(BrokenSurface, IsRefusedInOneLineThatNamesIt) {
  const Broken broken = broken_files()[GetParam()];
  const std::string file = write(broken.name, broken.content);
  ::testing::internal::CaptureStderr();
  try {
    read_surface(file);
    ADD_FAILURE() << broken.name << " was read";
  } catch (const InputError& error) {
    const std::string message = error.what();
    EXPECT_TRUE(message.starts_with(file)) << message;
    EXPECT_NE(message.find(broken.message), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
}

INSTANTIATE_TEST_SUITE_P(Files, BrokenSurface,
                         ::testing::Range(0, static_cast<int>(broken_files().size())),
                         [](const auto& instance) {
                           std::string name = broken_files()[instance.param].name;
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

TEST_F(ReadSurface, ValuesMayBeCalledOffsets) {
  const std::string values =
      "<PointData><DataArray type=\"Float64\" Name=\"offsets\" format=\"ascii\">0 1 2 1e9"
      "</DataArray></PointData>\n";
  const std::string file = write("t.vtp", replaced(kVtp, "<Points>", values + "<Points>"));
  expect_square(read_surface(file));
  EXPECT_EQ(read_point_array(file, "offsets"), Eigen::Vector4d(0, 1, 2, 1e9));
  const std::string points = replaced(kVtp, "<DataArray type=\"Float64\" Num",
                                      "<DataArray Name=\"offsets\" type=\"Float64\" Num");
  expect_square(read_surface(write("t.vtp", points)));
  const std::string field =
      "<DataArray type=\"Int64\" Name=\"offsets\" NumberOfTuples=\"1\" "
      "format=\"ascii\">1000000000000</DataArray></FieldData>";
  expect_square(read_surface(write("t.vtp", replaced(kVtp, "</FieldData>", field))));
}

TEST_F(ReadSurface, MissingFilesAndFoldersAreRefused) {
  EXPECT_THROW(read_surface(path("missing.stl")), InputError);
  std::filesystem::create_directory(path("folder.stl"));
  EXPECT_THROW(read_surface(path("folder.stl")), InputError);
}

// Every prefix of every format is refused or read, never worse.
TEST_F(ReadSurface, TruncationAnywhereIsHarmless) {
  write_surface(path("whole.vtp"), sphere({0, 0, 0}, 1, 1));
  const std::pair<const char*, std::string> files[] = {{"t.stl", kAsciiStl},
                                                       {"t.obj", kObj},
                                                       {"t.ply", kPly},
                                                       {"t.vtp", kVtp},
                                                       {"t.vtp", read(path("whole.vtp"))}};
  for (const auto& [name, content] : files)
    for (std::size_t length = 0; length < content.size(); length += 7) {
      ::testing::internal::CaptureStderr();
      try {
        read_surface(write(name, content.substr(0, length)));
      } catch (const InputError&) {
      }
      EXPECT_EQ(::testing::internal::GetCapturedStderr(), "") << name << ' ' << length;
    }
}

}  // namespace
}  // namespace surf::io
