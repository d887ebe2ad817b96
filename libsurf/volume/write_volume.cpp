#include "libsurf/volume/write_volume.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nifti/nifti1.h>
#include <zlib.h>

#include <Eigen/LU>
#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstring>
#include <functional>
#include <iterator>
#include <memory>
#include <vector>

#include "libsurf/base/detail/late_library.h"
#include "libsurf/base/error.h"
#include "libsurf/base/escaped.h"
#include "libsurf/base/file.h"
#include "libsurf/volume/detail/dicom_segmentation.h"

namespace surf::volume {
namespace {

constexpr int kSlab = 8;  // slices taken at once: an OpenVDB leaf is 8^3

enum class Scalar { kUint8, kFloat32 };

/// What is written: a grid, and a function that gives slice after slice as bytes.
struct Image {
  std::array<int, 3> size;
  Eigen::Affine3d index_to_world;
  Scalar scalar;
  std::function<void(const std::function<void(const void*, std::size_t)>&)> send;
};

/// A file through zlib, compressed or plain; every failure is an OutputError naming `path`.
class Sink {
 public:
  Sink(const std::string& file, const std::string& path, bool is_compressed)
      : file_(gzopen(file.c_str(), is_compressed ? kCompressed : "wbT")), path_(path) {
    if (!file_) fail();
    gzbuffer(file_, 1 << 18);
  }
  ~Sink() {
    if (file_) gzclose(file_);
  }
  Sink(const Sink&) = delete;
  Sink& operator=(const Sink&) = delete;

  void write(const void* data, std::size_t n_bytes) {
    if (gzfwrite(data, 1, n_bytes, file_) != n_bytes) fail();
  }
  void close() {
    const int status = gzclose(file_);
    file_ = nullptr;
    if (status != Z_OK) fail();
  }

 private:
  // Level 1 takes a third of the default level's time; noisy floats hardly shrink anyway.
  static constexpr const char* kCompressed = "wb1";

  [[noreturn]] void fail() const {
    throw OutputError(fmt::format("{}: cannot be written: {}", path_, std::strerror(errno)));
  }

  gzFile file_;
  std::string path_;
};

bool is_rotation_times_spacing(const Eigen::Matrix3d& linear) {
  const Eigen::Matrix3d cosines = linear.colwise().normalized();
  constexpr double kTolerance = 1e-5;  // a quaternion of floats holds no more
  return (cosines.transpose() * cosines - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff() <
         kTolerance;
}

/// The qform of nifti1.h: quaternion, offset, and in pixdim[0] the sign of a mirrored k axis.
void set_qform(nifti_1_header& header, const Eigen::Affine3d& index_to_world) {
  Eigen::Matrix3d rotation = index_to_world.linear().colwise().normalized();
  if (rotation.determinant() < 0) {
    header.pixdim[0] = -1;
    rotation.col(2) *= -1;
  }
  Eigen::Quaterniond q(rotation);
  if (q.w() < 0) q.coeffs() *= -1;
  header.qform_code = NIFTI_XFORM_SCANNER_ANAT;
  header.quatern_b = static_cast<float>(q.x());
  header.quatern_c = static_cast<float>(q.y());
  header.quatern_d = static_cast<float>(q.z());
  header.qoffset_x = static_cast<float>(index_to_world.translation()[0]);
  header.qoffset_y = static_cast<float>(index_to_world.translation()[1]);
  header.qoffset_z = static_cast<float>(index_to_world.translation()[2]);
}

nifti_1_header nifti_header(const Image& image, const std::string& path) {
  nifti_1_header header = {};
  header.sizeof_hdr = 348;
  header.regular = 'r';
  header.dim[0] = 3;
  for (int axis = 1; axis < 8; ++axis) header.dim[axis] = 1;
  for (float& value : header.pixdim) value = 1;
  for (int axis = 0; axis < 3; ++axis) {
    if (image.size[axis] > 32767)
      throw OutputError(fmt::format("{}: NIfTI-1 holds at most 32767 voxels along an axis, not {}",
                                    path, image.size[axis]));
    header.dim[axis + 1] = static_cast<short>(image.size[axis]);
    header.pixdim[axis + 1] = static_cast<float>(image.index_to_world.linear().col(axis).norm());
  }
  header.datatype = image.scalar == Scalar::kUint8 ? DT_UINT8 : DT_FLOAT32;
  header.bitpix = image.scalar == Scalar::kUint8 ? 8 : 32;
  header.vox_offset = 352;
  header.scl_slope = 1;
  header.xyzt_units = NIFTI_UNITS_MM;
  header.sform_code = NIFTI_XFORM_SCANNER_ANAT;
  for (int column = 0; column < 4; ++column) {
    header.srow_x[column] = static_cast<float>(image.index_to_world.matrix()(0, column));
    header.srow_y[column] = static_cast<float>(image.index_to_world.matrix()(1, column));
    header.srow_z[column] = static_cast<float>(image.index_to_world.matrix()(2, column));
  }
  if (is_rotation_times_spacing(image.index_to_world.linear()))
    set_qform(header, image.index_to_world);
  std::memcpy(header.magic, "n+1", 4);
  return header;
}

std::string nifti_bytes(const Image& image, const std::string& path) {
  const nifti_1_header header = nifti_header(image, path);
  std::string bytes(352, '\0');  // the last four: no extension follows
  std::memcpy(bytes.data(), &header, sizeof header);
  return bytes;
}

/// The affine as LPS: MetaImage's only convention, and what readers of NRRD know best.
Eigen::Affine3d to_lps(const Eigen::Affine3d& index_to_ras) {
  return Eigen::Scaling(-1.0, -1.0, 1.0) * index_to_ras;
}

std::string metaimage_bytes(const Image& image, const std::string&) {
  const Eigen::Affine3d lps = to_lps(image.index_to_world);
  std::string matrix, spacing;
  for (int axis = 0; axis < 3; ++axis) {
    const double length = lps.linear().col(axis).norm();
    const Eigen::Vector3d d = lps.linear().col(axis) / length;
    matrix += fmt::format(" {} {} {}", d[0], d[1], d[2]);
    spacing += fmt::format(" {}", length);
  }
  const Eigen::Vector3d offset = lps.translation();
  return fmt::format(
      "ObjectType = Image\nNDims = 3\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
      "CompressedData = False\nTransformMatrix ={}\nOffset = {} {} {}\nCenterOfRotation = 0 0 0\n"
      "ElementSpacing ={}\nDimSize = {} {} {}\nElementType = {}\nElementDataFile = LOCAL\n",
      matrix, offset[0], offset[1], offset[2], spacing, image.size[0], image.size[1], image.size[2],
      image.scalar == Scalar::kUint8 ? "MET_UCHAR" : "MET_FLOAT");
}

std::string nrrd_bytes(const Image& image, const std::string&) {
  const Eigen::Affine3d lps = to_lps(image.index_to_world);
  std::string directions;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3d d = lps.linear().col(axis);
    directions += fmt::format(" ({},{},{})", d[0], d[1], d[2]);
  }
  const Eigen::Vector3d origin = lps.translation();
  return fmt::format(
      "NRRD0004\ntype: {}\ndimension: 3\nspace: left-posterior-superior\nsizes: {} {} {}\n"
      "space directions:{}\nkinds: domain domain domain\nendian: little\nencoding: raw\n"
      "space origin: ({},{},{})\n\n",
      image.scalar == Scalar::kUint8 ? "uint8" : "float", image.size[0], image.size[1],
      image.size[2], directions, origin[0], origin[1], origin[2]);
}

/// A value of a key as NRRD wants it.
std::string as_value(const std::string& text) {
  return escaped(text, {{'\\', "\\\\"}, {'\n', "\\n"}});
}

/// First and last index of a label along each axis; 0 -1 where there is none, as Slicer has it.
std::array<int, 6> extent_of(const std::array<int, 3>& size, std::span<const std::uint8_t> labels,
                             std::uint8_t label) {
  std::array<int, 6> out = {size[0], -1, size[1], -1, size[2], -1};
  std::size_t at = 0;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i, ++at) {
        if (labels[at] != label) continue;
        const int index[] = {i, j, k};
        for (int axis = 0; axis < 3; ++axis) {
          out[2 * axis] = std::min(out[2 * axis], index[axis]);
          out[2 * axis + 1] = std::max(out[2 * axis + 1], index[axis]);
        }
      }
  if (out[1] < 0) out = {0, -1, 0, -1, 0, -1};
  return out;
}

/// The keys of Slicer's vtkMRMLSegmentationStorageNode.
std::string slicer_keys(const std::array<int, 3>& size, std::span<const std::uint8_t> labels,
                        std::span<const LabelName> names) {
  std::string out =
      "Segmentation_ContainedRepresentationNames:=Binary labelmap|\n"
      "Segmentation_MasterRepresentation:=Binary labelmap\n"
      "Segmentation_ReferenceImageExtentOffset:=0 0 0\n";
  for (std::size_t n = 0; n < names.size(); ++n) {
    const LabelName& name = names[n];
    const auto key = [&](const char* field, const std::string& value) {
      out += fmt::format("Segment{}_{}:={}\n", n, field, as_value(value));
    };
    const auto& c = name.colour;
    key("ID", fmt::format("Segment_{}", n + 1));
    key("Name", name.name.empty() ? fmt::format("Segment_{}", n + 1) : name.name);
    key("NameAutoGenerated", "0");
    key("Color", fmt::format("{:.6g} {:.6g} {:.6g}", c[0] / 255.0, c[1] / 255.0, c[2] / 255.0));
    key("ColorAutoGenerated", "0");
    key("LabelValue", fmt::format("{}", name.label));
    key("Layer", "0");
    key("Extent", fmt::format("{}", fmt::join(extent_of(size, labels, name.label), " ")));
    key("Tags", "");
  }
  return out;
}

bool is_slicer_segmentation(const std::string& path) {
  std::string name = path;
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return char(std::tolower(c)); });
  return name.ends_with(".seg.nrrd");
}

using HeaderWriter = std::string (*)(const Image&, const std::string& path);

void write_image(const std::string& path, const Image& image, const std::string& header) {
  write_atomically(path, [&](const std::string& temporary) {
    Sink sink(temporary, path, extension(path) == ".nii.gz");
    sink.write(header.data(), header.size());
    image.send([&](const void* data, std::size_t n_bytes) { sink.write(data, n_bytes); });
    sink.close();
  });
}

struct Format {
  const char* extension;
  HeaderWriter header;
};
constexpr Format kFormats[] = {{".nii.gz", nifti_bytes},
                               {".nii", nifti_bytes},
                               {".mha", metaimage_bytes},
                               {".nrrd", nrrd_bytes}};
// What label maps can be besides: of a kind that has names for them.
constexpr const char* kSlicer = ".seg.nrrd";
constexpr const char* kDicom = ".seg.dcm";

/// Null if the ending names no format.
HeaderWriter find_writer(const std::string& ending) {
  for (const Format& format : kFormats)
    if (ending == format.extension) return format.header;
  return nullptr;
}

bool is_dicom(const std::string& path) { return extension(path) == ".dcm"; }

HeaderWriter writer_of(const std::string& path) {
  const std::string ending = extension(path);
  if (const HeaderWriter writer = find_writer(ending)) return writer;
  throw UsageError(
      fmt::format("{}: the ending '{}' names no volume format; use .nii.gz, .nii, .mha or .nrrd",
                  path, ending));
}

void check_size(const std::string& path, const std::array<int, 3>& size,
                std::span<const std::uint8_t> labels) {
  if (labels.size() != std::size_t(size[0]) * size[1] * size[2])
    throw OutputError(fmt::format("{}: {} labels for {} x {} x {} voxels", path, labels.size(),
                                  size[0], size[1], size[2]));
}

Image image_of(const Volume& volume) {
  return {volume.size(), volume.index_to_world(), Scalar::kFloat32, [&volume](const auto& sink) {
            const auto [nx, ny, nz] = volume.size();
            std::vector<float> slab(std::size_t(nx) * ny * kSlab);
            for (int k = 0; k < nz; k += kSlab) {
              const int end = std::min(k + kSlab, nz);
              volume.copy_box({0, 0, k}, {nx, ny, end}, slab.data());
              sink(slab.data(), std::size_t(nx) * ny * (end - k) * sizeof(float));
            }
          }};
}

}  // namespace

bool is_writable_volume(const std::string& path) { return find_writer(extension(path)) != nullptr; }

std::vector<std::string> label_map_endings() {
  std::vector<std::string> out = {kFormats[0].extension, kSlicer, kDicom};
  for (const Format& format : kFormats)
    if (format.extension != out[0]) out.emplace_back(format.extension);
  return out;
}

bool is_writable_label_map(const std::string& path) {
  return is_writable_volume(path) || is_dicom(path);
}

std::string writable_label_maps() {
  const std::vector<std::string> endings = label_map_endings();
  return fmt::format("{} or {}", fmt::join(endings.begin(), endings.end() - 1, ", "),
                     endings.back());
}

void write_volume(const std::string& path, const Volume& volume) {
  const Image image = image_of(volume);
  write_image(path, image, writer_of(path)(image, path));
}

void write_nifti(const std::string& path, const Volume& volume) {
  const Image image = image_of(volume);
  write_image(path, image, nifti_bytes(image, path));
}

void write_label_map(const std::string& path, const std::array<int, 3>& size,
                     const Eigen::Affine3d& index_to_world, std::span<const std::uint8_t> labels,
                     std::span<const LabelName> names) {
  check_size(path, size, labels);
  if (is_dicom(path))
    throw InputError(
        fmt::format("{}: a DICOM object refers to the images it was made of; there are none, "
                    "write another format",
                    path));
  const Image image = {size, index_to_world, Scalar::kUint8,
                       [labels](const auto& sink) { sink(labels.data(), labels.size()); }};
  std::string header = writer_of(path)(image, path);
  if (is_slicer_segmentation(path)) {
    const LabelName alone;  // of a map of 0 and 1
    header.insert(header.size() - 1,
                  slicer_keys(size, labels, names.empty() ? std::span(&alone, 1) : names));
  }
  write_image(path, image, header);
}

void write_label_map(const std::string& path, const Volume& grid,
                     std::span<const std::uint8_t> labels, std::span<const LabelName> names) {
  if (!is_dicom(path)) {
    write_label_map(path, grid.size(), grid.index_to_world(), labels, names);
    return;
  }
  check_size(path, grid.size(), labels);
  check_dicom_output(path, grid);
  const LabelName alone;
  write_bytes(path, SURF_LATE(surf_dicom, surf_dicom_segmentation)(
                        path, grid.size(), *grid.dicom(), labels,
                        names.empty() ? std::span(&alone, 1) : names));
}

}  // namespace surf::volume
