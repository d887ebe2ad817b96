#include "libcurve/read_image.h"

#include <fmt/format.h>
#include <vtkDataArray.h>
#include <vtkImageData.h>
#include <vtkJPEGReader.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>
#include <vtkPointData.h>
#include <vtkSmartPointer.h>
#include <vtkTIFFReader.h>

#include <cerrno>
#include <cmath>
#include <cstring>
#include <fstream>

#include "libsurf/base/error.h"
#include "libsurf/base/vtk_messages.h"

namespace surf::curve {
namespace {

enum class Format { kNone, kPng, kJpeg, kTiff };

Format format_of(const std::string& bytes) {
  const auto begins = [&](const char* magic, std::size_t n) {
    return bytes.size() >= n && bytes.compare(0, n, magic, n) == 0;
  };
  if (begins("\x89PNG\r\n\x1a\n", 8)) return Format::kPng;
  if (begins("\xff\xd8\xff", 3)) return Format::kJpeg;
  if (begins("II*\0", 4) || begins("MM\0*", 4)) return Format::kTiff;
  return Format::kNone;
}

std::string first_bytes(const std::string& path) {
  std::ifstream stream(path, std::ios::binary);
  std::string bytes(8, '\0');
  stream.read(bytes.data(), std::streamsize(bytes.size()));
  bytes.resize(std::size_t(stream.gcount()));
  return bytes;
}

const char* name(Format format) {
  return format == Format::kPng ? "PNG" : format == Format::kJpeg ? "JPEG" : "TIFF";
}

vtkSmartPointer<vtkImageReader2> make_reader(Format format) {
  if (format == Format::kJpeg) return vtkSmartPointer<vtkJPEGReader>::New();
  if (format == Format::kTiff) return vtkSmartPointer<vtkTIFFReader>::New();
  const auto reader = vtkSmartPointer<vtkPNGReader>::New();
  reader->ReadSpacingFromFileOn();
  return reader;
}

/// Rec. 709 luminance of the first components, or the first alone.
double grey(const double* components, int n) {
  if (n < 3) return components[0];
  return 0.2126 * components[0] + 0.7152 * components[1] + 0.0722 * components[2];
}

/// VTK counts rows from the bottom.
std::vector<float> values_of(vtkImageData& data, int page, const std::array<int, 2>& size) {
  vtkDataArray& scalars = *data.GetPointData()->GetScalars();
  const int n = scalars.GetNumberOfComponents();
  std::vector<double> tuple(n);
  std::vector<float> values;
  values.reserve(std::size_t(size[0]) * size[1]);
  for (int j = 0; j < size[1]; ++j) {
    const vtkIdType row = (vtkIdType(page) * size[1] + size[1] - 1 - j) * size[0];
    for (int i = 0; i < size[0]; ++i) {
      scalars.GetTuple(row + i, tuple.data());
      values.push_back(static_cast<float>(grey(tuple.data(), n)));
    }
  }
  return values;
}

void add_notes(ImageSource& source, int n_components, int n_pages) {
  if (n_components >= 3)
    source.notes.push_back("colors are turned into luminance: 0.2126 R + 0.7152 G + 0.0722 B");
  if (n_components == 2 || n_components == 4) source.notes.push_back("transparency is dropped");
  if (n_pages > 1)
    source.notes.push_back(fmt::format("the file has {} pages; --page chooses another", n_pages));
}

Eigen::Vector2d spacing_of(const vtkImageReader2& reader, Format format, ImageSource& source,
                           const ReadImageOptions& options) {
  if (options.spacing_mm) {
    source.spacing_source = "options";
    return *options.spacing_mm;
  }
  const double* spacing = const_cast<vtkImageReader2&>(reader).GetDataSpacing();
  const bool is_stated = spacing[0] > 0 && spacing[1] > 0 && std::isfinite(spacing[0]) &&
                         std::isfinite(spacing[1]) && (spacing[0] != 1 || spacing[1] != 1);
  if (format == Format::kJpeg || !is_stated) {
    source.spacing_source = "unknown";
    return {1, 1};
  }
  source.spacing_source = "file";
  return {spacing[0], spacing[1]};
}

}  // namespace

bool is_image_file(const std::string& path) {
  return format_of(first_bytes(path)) != Format::kNone;
}

Image read_image(const std::string& path, const ReadImageOptions& options) {
  if (!std::ifstream(path))
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  const std::string bytes = first_bytes(path);
  if (bytes.empty()) throw InputError(fmt::format("{}: is empty; get the file again", path));
  const Format format = format_of(bytes);
  if (format == Format::kNone)
    throw InputError(fmt::format("{}: not a PNG, JPEG or TIFF image", path));
  const VtkMessages messages;
  const auto reader = make_reader(format);
  const auto check = [&](const char* what) {
    if (messages.has_error() || reader->GetErrorCode() != 0)
      throw InputError(fmt::format("{}: {} {}; get the file again", path, name(format), what));
  };
  reader->SetFileName(path.c_str());
  reader->UpdateInformation();
  check("header is damaged or of an unsupported kind");
  const int* extent = reader->GetDataExtent();
  const std::array<int, 2> size = {extent[1] - extent[0] + 1, extent[3] - extent[2] + 1};
  const int n_pages = extent[5] - extent[4] + 1;
  check_image_size({size[0], size[1]}, path);
  if (options.page < 0 || options.page >= n_pages)
    throw InputError(fmt::format("{}: there is no page {}; the file has {}, counted from 0", path,
                                 options.page, n_pages));
  reader->Update();
  check("is truncated or damaged");
  vtkImageData& data = *reader->GetOutput();
  if (!data.GetPointData()->GetScalars() ||
      data.GetNumberOfPoints() != vtkIdType(size[0]) * size[1] * n_pages)
    throw InputError(
        fmt::format("{}: {} is truncated or damaged; get the file again", path, name(format)));
  ImageSource source;
  source.path = path;
  source.format = name(format);
  source.scalar_type = data.GetScalarTypeAsString();
  add_notes(source, data.GetNumberOfScalarComponents(), n_pages);
  const Eigen::Vector2d spacing = spacing_of(*reader, format, source, options);
  return Image(size, pixel_to_plane(spacing), values_of(data, options.page, size),
               std::move(source));
}

}  // namespace surf::curve
