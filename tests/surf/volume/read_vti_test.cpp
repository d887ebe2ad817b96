#include "libsurf/volume/detail/read_vti.h"

#include <vtkCellData.h>
#include <vtkFloatArray.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkShortArray.h>
#include <vtkXMLImageDataWriter.h>

#include "tests/surf/volume/files.h"

namespace surf::volume {
namespace {

void set_grid(vtkImageData& image, const Grid& grid, const std::array<int, 3>& first) {
  image.SetExtent(first[0], first[0] + grid.size[0] - 1, first[1], first[1] + grid.size[1] - 1,
                  first[2], first[2] + grid.size[2] - 1);
  const Eigen::Vector3d spacing = grid.index_to_world.linear().colwise().norm();
  const Eigen::Matrix<double, 3, 3, Eigen::RowMajor> direction =
      grid.index_to_world.linear().colwise().normalized();
  const Eigen::Vector3d origin =
      grid.index_to_world * Eigen::Vector3d(-first[0], -first[1], -first[2]);
  image.SetSpacing(spacing.data());
  image.SetDirectionMatrix(direction.data());
  image.SetOrigin(origin.data());
}

template <class Array>
void fill(Array& array, const Grid& grid) {
  for (const float value : values(grid.size))
    array.InsertNextValue(static_cast<typename Array::ValueType>(value));
}

/// An image of shorts; index (0, 0, 0) of the grid is `first` of the image.
vtkNew<vtkImageData> image_of(const Grid& grid, const std::array<int, 3>& first = {0, 0, 0}) {
  vtkNew<vtkImageData> image;
  set_grid(*image, grid, first);
  vtkNew<vtkShortArray> array;
  array->SetName("intensity");
  fill(*array, grid);
  image->GetPointData()->SetScalars(array);
  return image;
}

class ReadVti : public Files {
 protected:
  void save(vtkImageData& image, const std::string& file, int mode, bool is_compressed) const {
    vtkNew<vtkXMLImageDataWriter> writer;
    writer->SetInputData(&image);
    writer->SetFileName(file.c_str());
    writer->SetDataMode(mode);
    if (!is_compressed) writer->SetCompressorTypeToNone();
    ASSERT_EQ(writer->Write(), 1);
  }
};

TEST_F(ReadVti, DirectionAndFirstIndexAreKeptInEveryEncoding) {
  for (const Grid& grid : grids())
    for (const int mode : {vtkXMLWriter::Ascii, vtkXMLWriter::Binary, vtkXMLWriter::Appended})
      for (const bool is_compressed : {false, true}) {
        SCOPED_TRACE(grid.name);
        const vtkNew<vtkImageData> image = image_of(grid, {0, 4, -3});
        save(*image, path("a.vti"), mode, is_compressed);
        const Volume volume = read_volume(path("a.vti"));
        expect_volume(volume, grid);
        EXPECT_EQ(volume.source().scalar_type, "int16");
        EXPECT_EQ(volume.source().notes.size(), 1u);
      }
}

TEST_F(ReadVti, LargeVolumeIsReadInSlabs) {
  const Grid grid = {"large", {1024, 1024, 6}, grids()[0].index_to_world};
  for (const int mode : {vtkXMLWriter::Ascii, vtkXMLWriter::Appended}) {
    const vtkNew<vtkImageData> image = image_of(grid, {0, 0, 5});
    save(*image, path("a.vti"), mode, false);
    expect_volume(read_volume(path("a.vti")), grid);
  }
}

TEST_F(ReadVti, CellsOrVectorsOnlyAreRefused) {
  const Grid grid = grids()[0];
  vtkNew<vtkImageData> image;
  set_grid(*image, grid, {0, 0, 0});
  vtkNew<vtkFloatArray> vectors;
  vectors->SetNumberOfComponents(3);
  vectors->SetNumberOfTuples(static_cast<vtkIdType>(grid.n_voxels()));
  vectors->Fill(1);
  vectors->SetName("v");
  image->GetPointData()->AddArray(vectors);
  save(*image, path("a.vti"), vtkXMLWriter::Appended, false);
  EXPECT_NE(failure(path("a.vti")).find("has 3 values per voxel"), std::string::npos);

  vtkNew<vtkImageData> cells;
  set_grid(*cells, grid, {0, 0, 0});
  vtkNew<vtkFloatArray> array;
  array->SetNumberOfTuples(cells->GetNumberOfCells());
  array->Fill(1);
  array->SetName("c");
  cells->GetCellData()->SetScalars(array);
  save(*cells, path("b.vti"), vtkXMLWriter::Appended, false);
  EXPECT_NE(failure(path("b.vti")).find("values at cells only"), std::string::npos);
}

TEST_F(ReadVti, TruncatedAtAnyPlaceIsOneMessage) {
  const Grid grid = grids()[0];
  const vtkNew<vtkImageData> image = image_of(grid);
  for (const int mode : {vtkXMLWriter::Ascii, vtkXMLWriter::Binary, vtkXMLWriter::Appended}) {
    save(*image, path("a.vti"), mode, false);
    const std::string bytes = read(path("a.vti"));
    for (const double part : {0.1, 0.5, 0.8}) {
      write("b.vti", bytes.substr(0, static_cast<std::size_t>(part * double(bytes.size()))));
      const std::string message = failure(path("b.vti"));
      EXPECT_TRUE(message.starts_with(path("b.vti") + ": "))
          << "mode " << mode << ", " << part << ": " << message;
      EXPECT_EQ(message.find('\n'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace surf::volume
