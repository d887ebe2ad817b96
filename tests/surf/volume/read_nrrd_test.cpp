#include "libsurf/volume/detail/read_nrrd.h"

#include <fmt/format.h>
#include <zlib.h>

#include "tests/surf/comma_locale.h"
#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

std::string vector_text(const Eigen::Vector3d& v) {
  return fmt::format("({},{},{})", v[0], v[1], v[2]);
}

/// Header up to, not including, encoding; signs take RAS to the space.
std::string header_of(const Grid& grid, const std::string& type, const std::string& space,
                      const Eigen::Vector3d& signs) {
  const Eigen::Matrix3d linear = signs.asDiagonal() * grid.index_to_world.linear();
  const Eigen::Vector3d origin = signs.asDiagonal() * grid.index_to_world.translation();
  return fmt::format(
      "NRRD0004\ntype: {}\ndimension: 3\nspace: {}\nsizes: {} {} {}\nspace directions: {} {} {}\n"
      "kinds: domain domain domain\nspace origin: {}\n",
      type, space, grid.size[0], grid.size[1], grid.size[2], vector_text(linear.col(0)),
      vector_text(linear.col(1)), vector_text(linear.col(2)), vector_text(origin));
}

const Eigen::Vector3d kLps(-1, -1, 1);
constexpr const char* kLpsName = "left-posterior-superior";

class ReadNrrd : public Files {
 protected:
  std::string gzipped(const std::string& bytes) const {
    gzFile file = gzopen(path("part.gz").c_str(), "wb");
    gzwrite(file, bytes.data(), static_cast<unsigned>(bytes.size()));
    gzclose(file);
    return read(path("part.gz"));
  }
};

TEST_F(ReadNrrd, EverySpaceBecomesRas) {
  const std::pair<const char*, Eigen::Vector3d> spaces[] = {{kLpsName, kLps},
                                                            {"right-anterior-superior", {1, 1, 1}},
                                                            {"left-anterior-superior", {-1, 1, 1}},
                                                            {"RAS", {1, 1, 1}}};
  for (const auto& [space, signs] : spaces)
    for (const Grid& grid : grids()) {
      SCOPED_TRACE(std::string(space) + " " + grid.name);
      const Volume volume = read_volume(write(
          "a.nrrd", header_of(grid, "short", space, signs) + "endian: little\nencoding: raw\n\n" +
                        raw_bytes(values<std::int16_t>(grid.size))));
      expect_volume(volume, grid);
      EXPECT_TRUE(volume.source().notes.empty());
    }
}

TEST_F(ReadNrrd, EveryScalarTypeIsReadInBothByteOrders) {
  const Grid grid = grids()[0];
  const auto check = [&](const char* type, auto scalar, const char* name) {
    for (const bool is_big : {false, true}) {
      SCOPED_TRACE(type);
      const Volume volume = read_volume(write(
          "a.nrrd", header_of(grid, type, kLpsName, kLps) +
                        fmt::format("endian: {}\nencoding: raw\n\n", is_big ? "big" : "little") +
                        raw_bytes(values<decltype(scalar)>(grid.size), is_big)));
      EXPECT_EQ(volume.source().scalar_type, name);
      expect_volume(volume, grid);
    }
  };
  check_scalar_types(
      {"int8", "uchar", "short", "ushort", "int", "uint", "int64", "uint64", "float", "double"},
      check);
}

TEST_F(ReadNrrd, GzipAndTextAreDecoded) {
  const Grid grid = grids()[1];
  const std::string header = header_of(grid, "short", kLpsName, kLps) + "endian: little\n";
  expect_volume(
      read_volume(write("a.nrrd", header + "encoding: gzip\n\n" +
                                      gzipped(raw_bytes(values<std::int16_t>(grid.size))))),
      grid);
  std::string text;
  for (const int value : values<int>(grid.size)) text += fmt::format("{} ", value);
  expect_volume(read_volume(write("b.nrrd", header + "encoding: ascii\n\n" + text)), grid);
}

TEST_F(ReadNrrd, NumbersHaveAPointWhateverTheProcessHas) {
  const Grid grid = grids()[0];
  const std::string header = header_of(grid, "float", kLpsName, kLps) + "endian: little\n";
  std::string text;
  for (const float value : values(grid.size)) text += fmt::format("{} ", value + 0.5f);
  write("raw.nrrd", header + "encoding: raw\n\n" + raw_bytes(values(grid.size)));
  write("text.nrrd", header + "encoding: ascii\n\n" + text);
  const test::CommaLocale comma(path("locale"));
  if (!comma.is_set()) GTEST_SKIP() << "no locale with a decimal comma, nor localedef and de_DE";
  expect_volume(read_volume(path("raw.nrrd")), grid);
  expect_volume(read_volume(path("text.nrrd")), grid, 1, 0.5);
  EXPECT_EQ(*std::localeconv()->decimal_point, ',');
}

TEST_F(ReadNrrd, DetachedDataAreFoundBesideTheHeaderAndSkipTheirOwn) {
  const Grid grid = grids()[2];
  const std::string data = raw_bytes(values<std::int16_t>(grid.size));
  const std::string header =
      header_of(grid, "short", kLpsName, kLps) + "endian: little\nencoding: ";
  write("a.raw", "one line\n12345" + data);
  expect_volume(
      read_volume(write("a.nhdr", header + "raw\nline skip: 1\nbyte skip: 5\ndata file: a.raw\n")),
      grid);
  expect_volume(read_volume(write("b.nhdr", header + "raw\nbyte skip: -1\ndata file: a.raw\n")),
                grid);
  write("a.raw.gz", gzipped("12345" + data));
  expect_volume(read_volume(write("c.nhdr", header + "gzip\nbyte skip: 5\ndata file: a.raw.gz\n")),
                grid);
  EXPECT_EQ(volume_files(path("b.nhdr")), (std::vector{path("b.nhdr"), path("a.raw")}));
  EXPECT_EQ(volume_files(path("c.nhdr")), (std::vector{path("c.nhdr"), path("a.raw.gz")}));
  write("d.nrrd", header + "raw\n\n" + data);
  EXPECT_EQ(volume_files(path("d.nrrd")), std::vector{path("d.nrrd")});
}

TEST_F(ReadNrrd, OneFilePerSliceIsRead) {
  const Grid grid = grids()[1];
  const std::string data = raw_bytes(values<std::int16_t>(grid.size));
  const std::size_t n = data.size() / grid.size[2];
  std::string list;
  std::vector<std::string> files = {path("a.nhdr")};
  for (int k = 0; k < grid.size[2]; ++k) {
    files.push_back(write(fmt::format("s{}.raw", k), data.substr(k * n, n)));
    list += fmt::format("s{}.raw\n", k);
  }
  const std::string header =
      header_of(grid, "short", kLpsName, kLps) + "endian: little\nencoding: raw\ndata file: ";
  expect_volume(read_volume(write("a.nhdr", header + "LIST\n" + list)), grid);
  EXPECT_EQ(volume_files(path("a.nhdr")), files);
  // By a pattern: what fits it.
  write("s.raw.stl", "of another kind");
  expect_volume(
      read_volume(write("a.nhdr", header + fmt::format("s%d.raw 0 {} 1\n", grid.size[2] - 1))),
      grid);
  EXPECT_EQ(volume_files(path("a.nhdr")), files);
}

TEST_F(ReadNrrd, FramesAreFoundOnTheFirstOrTheLastAxis) {
  const Grid grid{"4-D", {4, 3, 5}, affine(Eigen::Vector3d(2, 3, 4).asDiagonal(), {1, 2, 3})};
  const std::string start = "NRRD0004\ntype: short\ndimension: 4\nspace: RAS\n";
  const std::string end = "endian: little\nencoding: raw\nspace origin: (1,2,3)\n\n";
  const auto first = values<std::int16_t>(grid.size);
  const auto second = values<std::int16_t>(grid.size, 500);
  const std::string last = start +
                           "sizes: 4 3 5 2\nkinds: domain domain domain time\n"
                           "space directions: (2,0,0) (0,3,0) (0,0,4) none\n" +
                           end + raw_bytes(first) + raw_bytes(second);
  std::vector<std::int16_t> interleaved;
  for (std::size_t n = 0; n < first.size(); ++n) {
    interleaved.push_back(first[n]);
    interleaved.push_back(second[n]);
  }
  const std::string fastest = start +
                              "sizes: 2 4 3 5\nkinds: list domain domain domain\n"
                              "space directions: none (2,0,0) (0,3,0) (0,0,4)\n" +
                              end + raw_bytes(interleaved);
  for (const std::string& bytes : {last, fastest}) {
    const std::string file = write("a.nrrd", bytes);
    expect_volume(read_volume(file), grid);
    expect_volume(read_volume(file, {.frame_index = 1, .series_uid = {}}), grid, 1, 500);
    EXPECT_NE(failure(file, {.frame_index = 2, .series_uid = {}}).find("has 2 frames"),
              std::string::npos);
  }
}

TEST_F(ReadNrrd, NoSpaceIsLpsWithANote) {
  const Grid grid{"plain", {4, 3, 5}, affine(Eigen::Vector3d(-2, -3, 4).asDiagonal(), {0, 0, 0})};
  const Volume volume =
      read_volume(write("a.nrrd",
                        "NRRD0001\ntype: uchar\ndimension: 3\nsizes: 4 3 5\nspacings: 2 3 4\n"
                        "encoding: raw\n\n" +
                            raw_bytes(values<std::uint8_t>(grid.size))));
  expect_volume(volume, grid);
  EXPECT_EQ(volume.source().notes.size(), 1u);
}

// Of cells the ends of an axis are edges of voxels, of nodes centres.
TEST_F(ReadNrrd, EndsOfTheAxesGiveOriginAndSpacing) {
  const std::array<int, 3> size = {4, 3, 5};
  const auto read_with = [&](const std::string& fields) {
    return read_volume(write("a.nrrd", "NRRD0001\ntype: uchar\ndimension: 3\nsizes: 4 3 5\n" +
                                           fields + "encoding: raw\n\n" +
                                           raw_bytes(values<std::uint8_t>(size))));
  };
  const Volume by_ends =
      read_with("axis mins: -1 3 20\naxis maxs: 7 9 0\ncenters: cell node cell\n");
  expect_volume(by_ends,
                {"ends", size, affine(Eigen::Vector3d(-2, -3, -4).asDiagonal(), {0, -3, 18})});
  EXPECT_EQ(by_ends.source().notes.size(), 1u);  // of the space
  const Grid moved{"moved", size, affine(Eigen::Vector3d(-2, -3, 4).asDiagonal(), {-10, -20, 30})};
  const std::string spacings = "spacings: 2 3 4\naxis mins: ";
  expect_volume(read_with(spacings + "9 18.5 28\ncenters: cell cell cell\n"), moved);
  expect_volume(read_with(spacings + "10 20 30\ncenters: node node node\n"), moved);
  const Volume guessed = read_with(spacings + "9 18.5 28\n");
  expect_volume(guessed, moved);
  ASSERT_EQ(guessed.source().notes.size(), 2u);
  EXPECT_NE(guessed.source().notes[1].find("no centers"), std::string::npos);
}

}  // namespace
}  // namespace surf::volume
