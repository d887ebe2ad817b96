#include <vtkImageData.h>
#include <vtkJPEGReader.h>
#include <vtkNew.h>

#include <algorithm>
#include <fstream>

#include "libcurve/image/detail/raster.h"
#include "libsurf/base/vtk_messages.h"

namespace surf::curve {
namespace {

/// libjpeg fills what is missing with grey; only the end's mark tells.
void check_end(const std::string& path) {
  constexpr std::streamoff kTail = 4096;  // some cameras append a few bytes
  std::ifstream stream(path, std::ios::binary | std::ios::ate);
  const std::streamoff n = std::min<std::streamoff>(kTail, stream.tellg());
  stream.seekg(-n, std::ios::end);
  std::string tail(std::size_t(n), '\0');
  stream.read(tail.data(), n);
  if (tail.rfind("\xff\xd9") == std::string::npos)
    throw damaged(path, "JPEG", "its end is missing");
}

}  // namespace

Raster read_jpeg(const std::string& path) {
  check_end(path);
  const VtkMessages messages;
  vtkNew<vtkJPEGReader> reader;
  reader->SetFileName(path.c_str());
  reader->UpdateInformation();
  if (messages.has_error() || reader->GetErrorCode() != 0)
    throw damaged(path, "JPEG", messages.first());
  const int* extent = reader->GetDataExtent();
  Raster out;
  out.size = {extent[1] - extent[0] + 1, extent[3] - extent[2] + 1};
  check_image_size({out.size[0], out.size[1]}, path);
  check_promised(path, "JPEG",
                 double(out.size[0]) * out.size[1] * reader->GetNumberOfScalarComponents());
  reader->Update();
  vtkImageData& data = *reader->GetOutput();
  if (messages.has_error() || reader->GetErrorCode() != 0 ||
      data.GetNumberOfPoints() != vtkIdType(out.size[0]) * out.size[1])
    throw damaged(path, "JPEG", messages.first());
  out.n_components = data.GetNumberOfScalarComponents();
  out.scalar_type = "uint8";
  const int n = out.size[0] * out.n_components;
  for (int j = 0; j < out.size[1]; ++j) {  // VTK counts rows from the bottom
    const auto* row = static_cast<const unsigned char*>(
        data.GetScalarPointer(extent[0], extent[3] - j, extent[4]));
    out.values.insert(out.values.end(), row, row + n);
  }
  return out;
}

}  // namespace surf::curve
