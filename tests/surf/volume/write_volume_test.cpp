#include "libsurf/volume/write_volume.h"

#include <teem/nrrd.h>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

class WriteVolume : public Files, public ::testing::WithParamInterface<std::string> {};

TEST_P(WriteVolume, IsReadBackWithTheSameValuesAndAffine) {
  for (const Grid& grid : grids()) {
    SCOPED_TRACE(grid.name);
    const std::string file = path("volume" + GetParam());
    write_volume(file, volume_of(grid));
    expect_volume(read_volume(file), grid);
  }
}

TEST_P(WriteVolume, LabelMapIsReadBackAsBytes) {
  for (const Grid& grid : grids()) {
    SCOPED_TRACE(grid.name);
    const std::string file = path("labels" + GetParam());
    write_label_map(file, grid.size, grid.index_to_world, values<std::uint8_t>(grid.size));
    const Volume volume = read_volume(file);
    EXPECT_EQ(volume.source().scalar_type, "uint8");
    expect_volume(volume, grid);
  }
}

TEST_P(WriteVolume, SameVolumeGivesTheSameBytes) {
  const Grid grid = grids()[0];
  write_volume(path("a" + GetParam()), volume_of(grid));
  write_volume(path("b" + GetParam()), volume_of(grid));
  EXPECT_EQ(read(path("a" + GetParam())), read(path("b" + GetParam())));
}

INSTANTIATE_TEST_SUITE_P(Formats, WriteVolume,
                         ::testing::Values(".nii", ".nii.gz", ".mha", ".nrrd"),
                         [](const auto& test) {
                           std::string name = test.param.substr(1);
                           std::replace(name.begin(), name.end(), '.', '_');
                           return name;
                         });

class WriteSegmentation : public Files {};

/// What teem reads under a key.
std::string key_value(const Nrrd& nrrd, const std::string& key) {
  char* found = nrrdKeyValueGet(&nrrd, key.c_str());
  const std::string out = found ? found : "(none)";
  std::free(found);
  return out;
}

TEST_F(WriteSegmentation, HasSlicersKeysForEachLabel) {
  const Grid grid = grids().back();
  std::vector<std::uint8_t> labels(std::size_t(grid.size[0]) * grid.size[1] * grid.size[2], 0);
  labels[0] = 1;
  labels[std::size_t(grid.size[0]) + 2] = 2;                 // 2 1 0
  labels[std::size_t(grid.size[0]) * grid.size[1] + 3] = 2;  // 3 0 1
  const std::vector<LabelName> names = {{1, "liver", {51, 102, 255}}, {2, "a \\ b", {0, 0, 0}}};
  const std::string file = path("organs.seg.nrrd");
  write_label_map(file, grid.size, grid.index_to_world, labels, names);
  Nrrd* nrrd = nrrdNew();
  ASSERT_EQ(nrrdLoad(nrrd, file.c_str(), nullptr), 0);
  EXPECT_EQ(key_value(*nrrd, "Segmentation_MasterRepresentation"), "Binary labelmap");
  EXPECT_EQ(key_value(*nrrd, "Segment0_Name"), "liver");
  EXPECT_EQ(key_value(*nrrd, "Segment0_Color"), "0.2 0.4 1");
  EXPECT_EQ(key_value(*nrrd, "Segment0_LabelValue"), "1");
  EXPECT_EQ(key_value(*nrrd, "Segment0_Extent"), "0 0 0 0 0 0");
  EXPECT_EQ(key_value(*nrrd, "Segment1_Name"), "a \\ b");
  EXPECT_EQ(key_value(*nrrd, "Segment1_Extent"), "2 3 0 1 0 1");
  EXPECT_EQ(key_value(*nrrd, "Segment2_Name"), "(none)");
  const auto* values = static_cast<const std::uint8_t*>(nrrd->data);
  EXPECT_TRUE(std::equal(labels.begin(), labels.end(), values));
  nrrdNuke(nrrd);
  // And by our own reader, with its affine.
  EXPECT_TRUE(read_volume(file).index_to_world().isApprox(grid.index_to_world, 1e-6));
}

TEST_F(WriteSegmentation, DicomNeedsTheSeriesItBelongsTo) {
  const Grid grid = grids()[0];
  const std::vector<std::uint8_t> labels(std::size_t(grid.size[0]) * grid.size[1] * grid.size[2],
                                         1);
  EXPECT_THROW(write_label_map(path("a.dcm"), grid.size, grid.index_to_world, labels), InputError);
  EXPECT_THROW(write_label_map(path("a.dcm"), volume_of(grid), labels), Error);
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(path("a")).parent_path()));
}

TEST_F(WriteSegmentation, EveryEndingThatIsOfferedCanBeWritten) {
  const Grid grid = grids()[0];
  const std::vector<std::uint8_t> labels(std::size_t(grid.size[0]) * grid.size[1] * grid.size[2],
                                         1);
  for (const std::string& ending : label_map_endings()) {
    EXPECT_TRUE(is_writable_label_map("liver" + ending)) << ending;
    if (ending != ".seg.dcm") {
      EXPECT_NO_THROW(write_label_map(path("a" + ending), volume_of(grid), labels));
    }
  }
}

class WriteNifti : public Files {};

TEST_F(WriteNifti, IsCompressedByAnEndingInCapitalsToo) {
  const Volume volume = volume_of(grids()[0]);
  write_volume(path("a.nii.gz"), volume);
  write_volume(path("a.nii.GZ"), volume);
  EXPECT_EQ(read(path("a.nii.GZ")), read(path("a.nii.gz")));
}

TEST_F(WriteNifti, QformAloneGivesTheSameAffineUnlessSheared) {
  for (const Grid& grid : grids()) {
    SCOPED_TRACE(grid.name);
    write_nifti(path("a.nii"), volume_of(grid));
    std::string bytes = read(path("a.nii"));
    nifti_1_header header;
    std::memcpy(&header, bytes.data(), sizeof header);
    EXPECT_EQ(header.qform_code, grid.name == "sheared" ? 0 : NIFTI_XFORM_SCANNER_ANAT);
    header.sform_code = 0;
    std::memcpy(bytes.data(), &header, sizeof header);
    const Volume volume = read_volume(write("b.nii", bytes));
    if (grid.name == "sheared") {
      EXPECT_EQ(volume.source().orientation_source, "pixdim");
    } else {
      EXPECT_EQ(volume.source().orientation_source, "qform");
      expect_volume(volume, grid);
    }
  }
}

TEST_F(WriteNifti, UnwritablePlacesAndUnknownEndingsAreNamed) {
  const Volume volume = volume_of(grids()[0]);
  EXPECT_THROW(write_volume(path("a.tiff"), volume), UsageError);
  EXPECT_THROW(write_volume(path("no/such/folder/a.nii"), volume), OutputError);
  EXPECT_THROW(write_label_map(path("a.nii"), {3, 3, 3}, Eigen::Affine3d::Identity(),
                               std::vector<std::uint8_t>(26)),
               OutputError);
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(path("a")).parent_path()));
}

}  // namespace
}  // namespace surf::volume
