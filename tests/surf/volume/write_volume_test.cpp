#include "libsurf/volume/write_volume.h"

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

class WriteNifti : public Files {};

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
