#include "libsurf/io/picture.h"

#include <fmt/format.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <cstring>
#include <mutex>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"

namespace surf::io {
namespace {

std::string png_bytes(const Picture& picture) {
  static std::mutex mutex;  // VTK makes its objects by factories that all threads share
  const std::scoped_lock lock(mutex);
  vtkNew<vtkImageData> image;
  image->SetDimensions(picture.width(), picture.height(), 1);
  image->AllocateScalars(VTK_UNSIGNED_CHAR, 3);
  for (int y = 0; y < picture.height(); ++y)  // VTK counts rows from the bottom
    std::memcpy(image->GetScalarPointer(0, picture.height() - 1 - y, 0), &picture.at(0, y),
                std::size_t(picture.width()) * sizeof(Color));
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(image);
  writer->WriteToMemoryOn();
  writer->Write();
  const vtkUnsignedCharArray& bytes = *writer->GetResult();
  const auto* begin =
      reinterpret_cast<const char*>(const_cast<vtkUnsignedCharArray&>(bytes).GetPointer(0));
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
  write_bytes(path, png_bytes(picture));
}

}  // namespace surf::io
