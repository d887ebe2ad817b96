#include "libsurf/volume/detail/read_dicom.h"

#include "libsurf/volume/orientation.h"
#include "tests/surf/volume/dicom_files.h"

namespace surf::volume {
namespace {

// write_series stores value_at - 1000 under slope 2, intercept 2000, or four times that under
// slope 0.5: both give 2 * value_at.
constexpr double kSlope = 2, kIntercept = 0;

/// Grids whose slices have the normal i x j, as slices of DICOM are sorted.
std::vector<Grid> dicom_grids() {
  std::vector<Grid> result;
  for (Grid grid : grids()) {
    if (grid.index_to_world.linear().determinant() < 0) {
      Eigen::Matrix3d linear = grid.index_to_world.linear();
      linear.col(2) *= -1;
      grid.index_to_world.linear() = linear;
    }
    result.push_back(grid);
  }
  return result;
}

class ReadDicom : public Files {
 protected:
  void expect_failure(const std::string& path_read, const std::string& piece) const {
    const std::string message = failure(path_read);
    EXPECT_NE(message.find(piece), std::string::npos) << message;
    EXPECT_EQ(message.find('\n'), std::string::npos);
  }
};

TEST_F(ReadDicom, ShuffledObliqueAndTiltedSeriesIsRead) {
  for (const Grid& grid : dicom_grids()) {
    SCOPED_TRACE(grid.name);
    const auto files = write_series(path(grid.name), grid);
    const Volume volume = read_volume(path(grid.name));
    expect_volume(volume, grid, kSlope, kIntercept);
    EXPECT_EQ(volume.source().format, "DICOM series");
    const bool is_tilted = orientation_of(grid.index_to_world).shear_deg > 1;
    bool has_note = false;
    for (const std::string& note : volume.source().notes)
      has_note |= note.find("gantry tilt") != std::string::npos;
    EXPECT_EQ(has_note, is_tilted);
    expect_volume(read_volume(files[1]), grid, kSlope, kIntercept);
  }
}

TEST_F(ReadDicom, CompressedTransferSyntaxesAreDecoded) {
  const Grid grid = dicom_grids()[0];
  using gdcm::TransferSyntax;
  for (const auto syntax :
       {TransferSyntax::RLELossless, TransferSyntax::JPEGLSLossless,
        TransferSyntax::JPEG2000Lossless, TransferSyntax::JPEGLosslessProcess14_1}) {
    SCOPED_TRACE(TransferSyntax::GetTSString(syntax));
    for (const std::string& file : write_series(path("series"), grid)) compress(file, syntax);
    expect_volume(read_volume(path("series")), grid, kSlope, kIntercept);
  }
}

TEST_F(ReadDicom, OtherFilesInTheFolderAreSkippedWithANote) {
  const Grid grid = dicom_grids()[0];
  write_series(path("series"), grid);
  write("series/notes.txt", "not an image");
  write("series/empty", "");
  const Volume volume = read_volume(path("series"));
  expect_volume(volume, grid, kSlope, kIntercept);
  ASSERT_FALSE(volume.source().notes.empty());
  EXPECT_NE(volume.source().notes.back().find("2 files"), std::string::npos);
}

TEST_F(ReadDicom, SeveralSeriesAreListedAndOneIsChosen) {
  const Grid one = dicom_grids()[0], two = dicom_grids()[2];
  write_series(path("both"), one, "1.2.3.4");
  const auto files = write_series(path("both"), two, "1.2.3.5");
  expect_failure(path("both"), "holds 2 series");
  expect_failure(path("both"), "1.2.3.4 (CT phantom, 10 files); 1.2.3.5 (CT phantom, 19 files)");
  expect_volume(read_volume(path("both"), {.frame_index = 0, .series_uid = "1.2.3.4"}), one, kSlope,
                kIntercept);
  expect_volume(read_volume(files[0]), two, kSlope, kIntercept);
  EXPECT_NE(failure(path("both"), {.frame_index = 0, .series_uid = "9.9"}).find("no series 9.9"),
            std::string::npos);
}

TEST_F(ReadDicom, ItsFilesAreThoseOfTheFolder) {
  auto files = write_series(path("series"), dicom_grids()[0]);
  std::sort(files.begin(), files.end());
  EXPECT_EQ(volume_files(path("series")), files);
  EXPECT_EQ(volume_files(files[1]), files);
}

TEST_F(ReadDicom, TheirContentTellsWhateverTheirNames) {
  const Grid grid = dicom_grids()[0];
  const auto files = write_series(path("series"), grid);
  for (const std::string& file : files) std::filesystem::rename(file, file + ".img");
  expect_volume(read_volume(files[1] + ".img"), grid, kSlope, kIntercept);
  EXPECT_EQ(volume_files(files[1] + ".img").size(), files.size());
}

// As `surfseg segment ct/ --mask ct/liver.seg.dcm` leaves one there.
TEST_F(ReadDicom, SegmentationsBesideASeriesAreLeftOut) {
  const Grid grid = dicom_grids()[0];
  const auto files = write_series(path("series"), grid);
  const std::string segmentation = path("series/liver.seg.dcm");
  write_segmentation(segmentation, grid, "1.2.3.9");
  const Volume volume = read_volume(path("series"));
  expect_volume(volume, grid, kSlope, kIntercept);
  ASSERT_FALSE(volume.source().notes.empty());
  EXPECT_NE(volume.source().notes.back().find("1 files"), std::string::npos);
  EXPECT_EQ(dicom_series(path("series")).size(), 1u);
  expect_volume(read_volume(files[0]), grid, kSlope, kIntercept);
  expect_failure(segmentation, segmentation + ": has pixels of 1 bits");
  EXPECT_FALSE(is_dicom_image(segmentation));
  EXPECT_TRUE(is_dicom_image(files[0]));
  EXPECT_FALSE(is_dicom_image(write("series/notes.txt", "no image")));
}

TEST_F(ReadDicom, NumbersAreReadWholeOrNotAtAll) {
  const Grid grid = dicom_grids()[0];
  const auto files = write_series(path("series"), grid);
  ImageFile image = slice_of(grid, 0);
  image.slope = " 2 ";
  image.intercept = "+2000 ";
  write_slice(files[0], image);
  expect_volume(read_volume(path("series")), grid, kSlope, kIntercept);

  image.slope = "2,5";
  write_slice(files[0], image);
  expect_failure(path("series"), files[0] + ": has no readable RescaleSlope");
  image.slope = "2";
  image.intercept = "2000 HU";
  write_slice(files[0], image);
  expect_failure(path("series"), files[0] + ": has no readable RescaleIntercept");
  image.intercept = "";  // says nothing, as where it is left out
  write_slice(files[0], image);
  EXPECT_EQ(failure(path("series")), "");

  write_slice(files[0], image);
  std::string bytes = read(files[0]), comma = spacing_text(image);
  const std::size_t at = bytes.find(comma);
  ASSERT_NE(at, std::string::npos);
  std::replace(comma.begin(), comma.end(), '.', ',');
  write("series/" + std::filesystem::path(files[0]).filename().string(),
        bytes.replace(at, comma.size(), comma));
  expect_failure(path("series"), files[0] + ": has no readable PixelSpacing");
}

TEST_F(ReadDicom, MissingSlicesAreReportedWithTheirPlaceAndNumber) {
  Grid grid = dicom_grids()[0];
  grid.index_to_world = affine(Eigen::Vector3d(-1, -1, 2).asDiagonal(), {0, 0, 40});
  const auto files = write_series(path("series"), grid);
  std::filesystem::remove(files[4]);
  expect_failure(path("series"), "4 mm between");
  expect_failure(path("series"), "at 46 mm along the normal, elsewhere 2 mm; 1 slice is missing");
  std::filesystem::remove(files[5]);
  expect_failure(path("series"), "6 mm between");
  expect_failure(path("series"), "2 slices are missing");
}

TEST_F(ReadDicom, UnevenDuplicateAndStraySlicesAreReported) {
  const Grid grid = dicom_grids()[0];
  auto files = write_series(path("uneven"), grid);
  ImageFile image = slice_of(grid, 3);
  const Eigen::Vector3d step = (slice_of(grid, 4).positions_lps[0] - image.positions_lps[0]);
  const Eigen::Vector3d position = image.positions_lps[0];
  image.positions_lps[0] = position + 0.3 * step;
  write_slice(files[3], image);
  expect_failure(path("uneven"), "uneven slices: 3.25 mm between");

  image.positions_lps[0] = position + step;
  write_slice(files[3], image);
  expect_failure(path("uneven"), "lie at the same position");

  image.positions_lps[0] = position + 0.5 * image.along_row;
  write_slice(files[3], image);
  expect_failure(path("uneven"), "0.5 mm off the line");

  image.positions_lps[0] = position;
  std::swap(image.along_row, image.along_column);
  write_slice(files[3], image);
  expect_failure(path("uneven"), "differ in their orientations");
}

TEST_F(ReadDicom, SlicesThatAreNoneAreReported) {
  const Grid grid = dicom_grids()[0];
  std::filesystem::create_directories(path("one"));
  write_slice(path("one/a.dcm"), slice_of(grid, 0));
  expect_failure(path("one"), "a single slice");
  std::filesystem::create_directories(path("none"));
  expect_failure(path("none"), "no DICOM image among them");
}

TEST_F(ReadDicom, FileCutAnywhereIsOneMessageThatNamesIt) {
  const Grid grid = {"small", {5, 4, 5}, dicom_grids()[0].index_to_world};
  for (const bool is_compressed : {false, true}) {
    const auto files = write_series(path("cut"), grid);
    if (is_compressed) compress(files[2], gdcm::TransferSyntax::JPEGLSLossless);
    const std::string bytes = read(files[2]);
    for (std::size_t n = 133; n < bytes.size(); ++n) {
      std::ofstream(files[2], std::ios::binary) << bytes.substr(0, n);
      const std::string message = failure(path("cut"));
      // Cut between two elements in front of the pixels, the file is none of the series.
      EXPECT_TRUE(message.find(files[2] + ": truncated or damaged DICOM") == 0 ||
                  message.find("1 slice is missing") != std::string::npos)
          << n << ": " << message;
    }
  }
}

// Slices are decoded side by side, and told of one after the other.
TEST_F(ReadDicom, TheFirstSliceThatCannotBeDecodedIsNamed) {
  const Grid grid = {"small", {5, 4, 12}, dicom_grids()[0].index_to_world};
  const auto files = write_series(path("spoiled"), grid);
  for (const std::string& file : files) compress(file, gdcm::TransferSyntax::JPEGLSLossless);
  const auto spoil = [&](const std::string& file) {
    std::string bytes = read(file);
    const std::size_t start = bytes.find("\xff\xd8\xff\xf7");  // of the code stream
    ASSERT_NE(start, std::string::npos);
    std::fill_n(bytes.begin() + std::ptrdiff_t(start), 16, '\0');
    std::ofstream(file, std::ios::binary) << bytes;
  };
  spoil(files[9]);
  expect_failure(path("spoiled"), files[9] + ": its pixels cannot be read");
  spoil(files[4]);
  spoil(files[5]);
  expect_failure(path("spoiled"), files[4] + ": its pixels cannot be read");
}

TEST_F(ReadDicom, AnySpoiledByteIsReadOrRefusedInOneLine) {
  const Grid grid = {"small", {5, 4, 4}, dicom_grids()[0].index_to_world};
  const auto files = write_series(path("spoiled"), grid);
  const std::string bytes = read(files[2]);
  for (std::size_t place = 132; place < bytes.size(); ++place)
    for (const int mask : {0x01, 0x5a, 0xff}) {
      std::string spoiled = bytes;
      spoiled[place] = static_cast<char>(spoiled[place] ^ mask);
      std::ofstream(files[2], std::ios::binary) << spoiled;
      const std::string message = failure(path("spoiled"));
      EXPECT_EQ(message.find('\n'), std::string::npos) << message;
    }
}

TEST_F(ReadDicom, UnknownSequencesAreImplicitInAnySyntax) {
  const Grid& grid = dicom_grids()[0];
  const std::string item_end = implicit_bytes({0xfffe, 0xe00d}, ""),
                    sequence_end = implicit_bytes({0xfffe, 0xe0dd}, ""), undefined(4, '\xff'),
                    item = implicit_bytes({0xfffe, 0xe000}, "").substr(0, 4);
  const std::string unknown = std::string("\x09\0\x10\x10UN\0\0", 8) + undefined + item +
                              undefined + implicit_bytes({0x0009, 0x1001}, "anything") + item_end +
                              sequence_end;
  for (const std::string& file : write_series(path("unknown"), grid)) {
    std::string bytes = read(file);
    bytes.insert(bytes.find(std::string("\x20\0\x0d\0UI", 6)), unknown);
    std::ofstream(file, std::ios::binary) << bytes;
  }
  expect_volume(read_volume(path("unknown")), grid, kSlope, kIntercept);
}

TEST_F(ReadDicom, FramesOfAnEnhancedObjectAreStacked) {
  for (const Grid& grid : dicom_grids()) {
    SCOPED_TRACE(grid.name);
    ImageFile all = slice_of(grid, 0);
    all.positions_lps.clear();
    all.pixels.clear();
    all.intercept = "1000";
    for (int k = grid.size[2] - 1; k >= 0; --k) {  // stored from the top down
      const ImageFile slice = slice_of(grid, k);
      all.positions_lps.push_back(slice.positions_lps[0]);
      all.pixels.insert(all.pixels.end(), slice.pixels.begin(), slice.pixels.end());
    }
    for (const Syntax syntax : {Syntax::kExplicit, Syntax::kImplicit}) {
      write_enhanced(path("a.dcm"), all, /*has_places=*/true, syntax);
      expect_volume(read_volume(path("a.dcm")), grid);
    }
    expect_volume(read_volume(path("a.dcm"), {.frame_index = 0, .series_uid = all.series}), grid);
    const std::string other = failure(path("a.dcm"), {.frame_index = 0, .series_uid = "9.9"});
    EXPECT_NE(other.find("no series 9.9 in it, only " + all.series), std::string::npos) << other;
    write_enhanced(path("b.dcm"), all, /*has_places=*/false);
    expect_failure(path("b.dcm"), "frames without a place of each in space");
  }
}

}  // namespace
}  // namespace surf::volume
