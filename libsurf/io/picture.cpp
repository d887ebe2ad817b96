#include "libsurf/io/picture.h"

#include <fmt/format.h>
#include <vtkImageData.h>
#include <vtkJPEGWriter.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <functional>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/detail/vtk_mutex.h"

namespace surf::io {
namespace {

/// What a writer makes of it, in memory.
template <class Writer>
std::string bytes_of(const Picture& picture, const std::function<void(Writer&)>& prepare = {}) {
  const std::scoped_lock lock(detail::vtk_mutex());
  vtkNew<vtkImageData> image;
  image->SetDimensions(picture.width(), picture.height(), 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int y = 0; y < picture.height(); ++y)  // VTK counts rows from the bottom
    std::memcpy(image->GetScalarPointer(0, picture.height() - 1 - y, 0), &picture.at(0, y),
                std::size_t(picture.width()) * sizeof(Color));
  vtkNew<Writer> writer;
  if (prepare) prepare(*writer);
  writer->SetInputData(image);
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray& bytes = *writer->GetResult();
  const auto* begin = reinterpret_cast<const char*>(bytes.GetPointer(0));
  return {begin, begin + bytes.GetNumberOfValues()};
}

}  // namespace

void Picture::blend(int x, int y, Color color, double weight) {
  if (!contains(x, y)) return;
  weight = std::clamp(weight, 0.0, 1.0);
  Color& pixel = at(x, y);
  for (int channel = 0; channel < 3; ++channel)
    pixel[channel] = static_cast<std::uint8_t>(
        std::lround((1 - weight) * pixel[channel] + weight * color[channel]));
}

void Picture::paste(const Picture& other, int x, int y) {
  assert(x >= 0 && y >= 0 && x + other.width() <= width_ && y + other.height() <= height_);
  for (int row = 0; row < other.height(); ++row)
    std::copy_n(&other.at(0, row), other.width(), &at(x, y + row));
}

void write_png(const std::string& path, const Picture& picture) {
  if (extension(path) != ".png")
    throw UsageError(fmt::format("{}: pictures are written as .png only", path));
  write_bytes(path, bytes_of<vtkPNGWriter>(picture));
}

std::string jpeg_bytes(const Picture& picture, int quality) {
  return bytes_of<vtkJPEGWriter>(picture,
                                 [&](vtkJPEGWriter& writer) { writer.SetQuality(quality); });
}

}  // namespace surf::io
