#include "libcurve/image/write_image.h"

#include <fmt/format.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGWriter.h>
#include <vtkTIFFWriter.h>
#include <vtkUnsignedCharArray.h>

#include <algorithm>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/vtk_messages.h"
#include "libsurf/io/draw.h"

namespace surf::curve {
namespace {

/// VTK counts rows from the bottom.
template <class T, class Value>
vtkSmartPointer<vtkImageData> to_vtk(const std::array<int, 2>& size, int type, const Value& value) {
  const auto data = vtkSmartPointer<vtkImageData>::New();
  data->SetDimensions(size[0], size[1], 1);
  data->AllocateScalars(type, 1);
  for (int j = 0; j < size[1]; ++j) {
    T* row = static_cast<T*>(data->GetScalarPointer(0, size[1] - 1 - j, 0));
    for (int i = 0; i < size[0]; ++i) row[i] = value(std::size_t(j) * size[0] + i);
  }
  return data;
}

void write_png_file(const std::string& path, vtkImageData* data) {
  if (extension(path) != ".png")
    throw UsageError(fmt::format("{}: expected a name that ends in .png", path));
  vtkNew<vtkPNGWriter> writer;
  writer->SetInputData(data);
  writer->WriteToMemoryOn();
  writer->Write();
  vtkUnsignedCharArray& bytes = *writer->GetResult();
  write_bytes(path, {reinterpret_cast<const char*>(bytes.GetPointer(0)),
                     std::size_t(bytes.GetNumberOfValues())});
}

bool is_tiff(const std::string& path) {
  return extension(path) == ".tif" || extension(path) == ".tiff";
}

void write_tiff(const std::string& path, const Image& image) {
  const auto data =
      to_vtk<float>(image.size(), VTK_FLOAT, [&](std::size_t at) { return image.values()[at]; });
  data->SetSpacing(image.spacing()[0], image.spacing()[1], 1);
  write_atomically(path, [&](const std::string& temporary) {
    const VtkMessages messages;
    vtkNew<vtkTIFFWriter> writer;
    writer->SetInputData(data);
    writer->SetFileName(temporary.c_str());
    writer->Write();
    if (messages.has_error() || writer->GetErrorCode() != 0)
      throw OutputError(fmt::format("{}: cannot be written", path));
  });
}

}  // namespace

bool is_writable_image(const std::string& path) {
  return is_tiff(path) || extension(path) == ".png";
}

void write_image(const std::string& path, const Image& image) {
  if (is_tiff(path)) return write_tiff(path, image);
  const auto [low, high] = image.range();
  const double scale = high > low ? 65535.0 / (double(high) - low) : 0;
  write_png_file(
      path, to_vtk<std::uint16_t>(image.size(), VTK_UNSIGNED_SHORT, [&, low = low](std::size_t at) {
        return static_cast<std::uint16_t>(std::lround(scale * (double(image.values()[at]) - low)));
      }));
}

void write_mask(const std::string& path, const std::array<int, 2>& size,
                std::span<const std::uint8_t> mask) {
  write_png_file(path, to_vtk<std::uint8_t>(size, VTK_UNSIGNED_CHAR, [&](std::size_t at) {
                   return static_cast<std::uint8_t>(mask[at] != 0 ? 255 : 0);
                 }));
}

void write_labels(const std::string& path, const std::array<int, 2>& size,
                  std::span<const std::uint8_t> labels) {
  write_png_file(path, to_vtk<std::uint8_t>(size, VTK_UNSIGNED_CHAR,
                                            [&](std::size_t at) { return labels[at]; }));
}

io::Picture draw_overlay(const Image& image, const Segments& curves,
                         const OverlayOptions& options) {
  constexpr int kLongSide = 800;
  const auto& size = image.size();
  const int scale = options.scale.value_or((kLongSide + std::max(size[0], size[1]) - 1) /
                                           std::max(size[0], size[1]));
  const auto [low, high] =
      options.window.value_or(io::automatic_window({image.values().begin(), image.values().end()}));
  io::Picture picture(size[0] * scale, size[1] * scale);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x) {
      const double share = (image.value(x / scale, y / scale) - low) / (high - low);
      picture.at(x, y).fill(
          static_cast<std::uint8_t>(std::lround(255 * std::clamp(share, 0.0, 1.0))));
    }
  const auto place = [&](int vertex) -> Eigen::Vector2d {
    const Eigen::Vector2d pixel =
        image.plane_to_pixel() * Eigen::Vector2d(curves.points.row(vertex).transpose());
    return scale * (pixel.array() + 0.5) - 0.5;
  };
  io::Lines lines(picture.width(), picture.height());
  for (const auto element : curves.elements.rowwise())
    lines.add(place(element[0]), place(element[1]));
  lines.draw(picture, io::kOutline);
  return picture;
}

}  // namespace surf::curve
