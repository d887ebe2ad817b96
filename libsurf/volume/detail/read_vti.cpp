#include "libsurf/volume/detail/read_vti.h"

#include <fmt/format.h>
#include <vtkCellData.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkInformation.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkStreamingDemandDrivenPipeline.h>
#include <vtkXMLImageDataReader.h>

#include <algorithm>
#include <filesystem>
#include <fstream>

#include "libsurf/base/error.h"
#include "libsurf/base/vtk_xml.h"
#include "libsurf/volume/detail/raw_scalars.h"
#include "libsurf/volume/detail/vtk_messages.h"

namespace surf::volume {
namespace {

ScalarType scalar_type(int type, const std::string& path) {
  const bool is_float = type == VTK_FLOAT || type == VTK_DOUBLE;
  // Plain characters are signed here, whatever they are on this machine.
  const bool is_signed = type == VTK_CHAR || vtkDataArray::GetDataTypeMin(type) < 0;
  const ScalarKind kind = is_float    ? ScalarKind::kFloat
                          : is_signed ? ScalarKind::kSigned
                                      : ScalarKind::kUnsigned;
  const auto found = find_scalar_type(kind, std::size_t(vtkDataArray::GetDataTypeSize(type)));
  if (found) return *found;
  throw InputError(
      fmt::format("{}: voxels of VTK's type {} are not scalars surfseg reads", path, type));
}

/// Voxels read at once. Each slab of a file that keeps its voxels inside the XML costs another
/// pass over the text, so slabs are large.
constexpr std::size_t kSlabValues = std::size_t(1) << 22;

struct Geometry {
  std::array<int, 6> extent;
  std::array<int, 3> size;
  Eigen::Matrix4d index_to_world = Eigen::Matrix4d::Identity();
};

/// What the header says, before any voxel is read.
Geometry geometry_of(vtkXMLImageDataReader& reader, const std::string& path) {
  reader.UpdateInformation();
  vtkInformation* information = reader.GetOutputInformation(0);
  if (reader.GetErrorCode() != 0 ||
      !information->Has(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT()))
    throw InputError(fmt::format("{}: not readable VTK image data; get the file again", path));
  Geometry geometry;
  information->Get(vtkStreamingDemandDrivenPipeline::WHOLE_EXTENT(), geometry.extent.data());
  std::array<std::int64_t, 3> size;
  for (int axis = 0; axis < 3; ++axis)
    size[axis] = std::int64_t(geometry.extent[2 * axis + 1]) - geometry.extent[2 * axis] + 1;
  geometry.size = checked_size(path, size);

  Eigen::Vector3d spacing(1, 1, 1), origin(0, 0, 0);
  Eigen::Matrix3d direction = Eigen::Matrix3d::Identity();
  if (information->Has(vtkDataObject::SPACING()))
    information->Get(vtkDataObject::SPACING(), spacing.data());
  if (information->Has(vtkDataObject::ORIGIN()))
    information->Get(vtkDataObject::ORIGIN(), origin.data());
  if (information->Has(vtkDataObject::DIRECTION()))
    direction = Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(
        information->Get(vtkDataObject::DIRECTION()));
  const Eigen::Matrix3d linear = direction * spacing.asDiagonal();
  const Eigen::Vector3d first(geometry.extent[0], geometry.extent[2], geometry.extent[4]);
  geometry.index_to_world.topLeftCorner<3, 3>() = linear;
  geometry.index_to_world.topRightCorner<3, 1>() = origin + linear * first;
  return geometry;
}

/// The active scalars, else the first array with one component.
vtkDataArray* scalars_of(vtkImageData& image, const std::string& path) {
  vtkPointData& data = *image.GetPointData();
  vtkDataArray* array = data.GetScalars();
  for (int n = 0; !array && n < data.GetNumberOfArrays(); ++n) array = data.GetArray(n);
  if (!array && image.GetCellData()->GetNumberOfArrays() > 0)
    throw InputError(fmt::format("{}: has values at cells only; convert them to point data", path));
  if (!array || array->GetNumberOfTuples() == 0)
    throw InputError(fmt::format("{}: holds no voxels that can be read; get the file again", path));
  if (array->GetNumberOfComponents() != 1)
    throw InputError(fmt::format("{}: has {} values per voxel; surfseg reads scalars, extract one",
                                 path, array->GetNumberOfComponents()));
  return array;
}

/// Reads slices [begin, end).
vtkDataArray* read_slab(vtkXMLImageDataReader& reader, const Geometry& geometry, int begin, int end,
                        const VtkMessages& messages, const std::string& path) {
  std::array<int, 6> extent = geometry.extent;
  extent[4] = geometry.extent[4] + begin;
  extent[5] = geometry.extent[4] + end - 1;
  const bool is_updated = reader.vtkAlgorithm::UpdateExtent(extent.data()) != 0;
  const bool is_read = is_updated && reader.GetErrorCode() == 0 && !messages.has_error();
  vtkDataArray* array = is_read ? scalars_of(*reader.GetOutput(), path) : nullptr;
  const auto n_values = vtkIdType(geometry.size[0]) * geometry.size[1] * (end - begin);
  if (!array || array->GetNumberOfTuples() != n_values)
    throw InputError(fmt::format(
        "{}: truncated or damaged: its voxels cannot be read; get the file again", path));
  return array;
}

/// VTK fills in what is missing at the end of appended data without a word.
void check_end(const std::string& path) {
  constexpr std::streamoff kTail = 256;
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff n_bytes = file.tellg();
  file.seekg(std::max<std::streamoff>(0, n_bytes - kTail));
  const std::string tail(std::istreambuf_iterator<char>(file), {});
  if (tail.find("</VTKFile>") == std::string::npos)
    throw InputError(
        fmt::format("{}: truncated: it does not end with </VTKFile>; get the file again", path));
}

/// Text and raw data take at least a byte per value; zlib shrinks by 1032 at most.
void check_plausible(const Geometry& geometry, const std::string& path) {
  const double n_voxels = 1.0 * geometry.size[0] * geometry.size[1] * geometry.size[2];
  std::error_code status;
  const double n_file = static_cast<double>(std::filesystem::file_size(path, status));
  if (!status && n_voxels > 1032 * n_file)
    throw InputError(fmt::format(
        "{}: truncated: the header promises {} voxels, the file has {} bytes; get the file again",
        path, n_voxels, n_file));
}

Volume read_vti(const std::string& path, const ReadOptions& options) {
  check_frame(path, options.frame_index, 1);
  check_vtk_xml_file(path);
  const VtkMessages messages;
  vtkNew<vtkXMLImageDataReader> reader;
  reader->SetFileName(path.c_str());
  if (!reader->CanReadFile(path.c_str()))
    throw InputError(fmt::format("{}: not VTK image data (.vti); give a volume", path));
  check_end(path);
  const Geometry geometry = geometry_of(*reader, path);
  check_plausible(geometry, path);

  Source source;
  source.path = path;
  source.format = "VTK image data";
  source.orientation_source = "Origin, Spacing, Direction";
  source.notes.emplace_back("VTI has no anatomical convention: coordinates taken as RAS mm");
  const auto& size = geometry.size;
  const std::size_t n_values = std::size_t(size[0]) * size[1];
  const int depth = static_cast<int>(std::clamp<std::size_t>(kSlabValues / n_values, 1, size[2]));
  vtkDataArray* array = read_slab(*reader, geometry, 0, depth, messages, path);
  const ScalarType type = scalar_type(array->GetDataType(), path);
  source.scalar_type = name(type);
  Volume::Builder builder(size, geometry.index_to_world, std::move(source));
  std::vector<float> slice(n_values);
  for (int begin = 0; begin < size[2]; begin += depth) {
    const int end = std::min(begin + depth, size[2]);
    if (begin > 0) array = read_slab(*reader, geometry, begin, end, messages, path);
    for (int k = 0; k < end - begin; ++k) {
      const auto* stored = static_cast<const std::byte*>(
          array->GetVoidPointer(static_cast<vtkIdType>(k) * static_cast<vtkIdType>(n_values)));
      convert(type, /*swap=*/false, stored, 1, 1, 0, slice.data(), n_values);
      builder.append_slice(slice);
    }
  }
  return builder.finish();
}

}  // namespace

extern "C" {
Volume (*const surf_read_vti)(const std::string&, const ReadOptions&) = read_vti;
}

}  // namespace surf::volume
