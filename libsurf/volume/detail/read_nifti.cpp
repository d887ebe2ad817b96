#include "libsurf/volume/detail/read_nifti.h"

#include <fmt/format.h>
#include <nifti/nifti1.h>
#include <nifti/nifti2.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <utility>

#include "libsurf/base/error.h"
#include "libsurf/volume/detail/byte_stream.h"
#include "libsurf/volume/detail/raw_scalars.h"

// The header is parsed here and the voxels stream through zlib: vtkNIFTIImageReader and nifticlib
// read the whole file into memory before it can be refused, and print what is wrong on stderr.

namespace surf::volume {
namespace {

constexpr int kSize1 = 348, kSize2 = 540;  // sizeof_hdr of NIfTI-1 and NIfTI-2
static_assert(sizeof(nifti_1_header) == kSize1 && sizeof(nifti_2_header) == kSize2);

/// What both versions and Analyze say, in one type and in this machine's byte order.
struct Header {
  std::string format;
  bool is_analyze = false, is_pair = false, is_swapped = false;
  std::array<std::int64_t, 8> dim;
  std::array<double, 8> pixdim;
  int datatype, qform_code, sform_code, xyzt_units;
  double vox_offset, scl_slope, scl_inter;
  Eigen::Vector3d quatern, qoffset;
  Eigen::Matrix<double, 3, 4> srow;
};

template <class T>
T swapped(T value, bool is_swapped) {
  if (!is_swapped) return value;
  auto* bytes = reinterpret_cast<unsigned char*>(&value);
  std::reverse(bytes, bytes + sizeof value);
  return value;
}

/// Both structs name their fields alike.
template <class Struct>
Header decode(const Struct& raw, bool is_swapped) {
  const auto get = [&](auto value) { return swapped(value, is_swapped); };
  Header header;
  header.is_swapped = is_swapped;
  for (int n = 0; n < 8; ++n) {
    header.dim[n] = get(raw.dim[n]);
    header.pixdim[n] = get(raw.pixdim[n]);
  }
  header.datatype = get(raw.datatype);
  header.qform_code = get(raw.qform_code);
  header.sform_code = get(raw.sform_code);
  header.xyzt_units = get(raw.xyzt_units);
  header.vox_offset = static_cast<double>(get(raw.vox_offset));
  header.scl_slope = get(raw.scl_slope);
  header.scl_inter = get(raw.scl_inter);
  header.quatern = {get(raw.quatern_b), get(raw.quatern_c), get(raw.quatern_d)};
  header.qoffset = {get(raw.qoffset_x), get(raw.qoffset_y), get(raw.qoffset_z)};
  for (int n = 0; n < 4; ++n)
    header.srow.col(n) << get(raw.srow_x[n]), get(raw.srow_y[n]), get(raw.srow_z[n]);
  return header;
}

Header decode_version_1(const nifti_1_header& raw, bool is_swapped, const std::string& path) {
  Header header = decode(raw, is_swapped);
  header.format = "NIfTI-1";
  if (std::memcmp(raw.magic, "ni1", 4) == 0) {
    header.is_pair = true;
  } else if (std::memcmp(raw.magic, "n+1", 4) != 0) {
    if (std::memcmp(raw.magic, "n", 1) == 0)
      throw InputError(fmt::format("{}: not NIfTI-1: the magic is neither 'n+1' nor 'ni1'", path));
    // Analyze 7.5 has other fields where NIfTI keeps orientation and scaling.
    header.format = "Analyze 7.5";
    header.is_analyze = header.is_pair = true;
    header.qform_code = header.sform_code = header.xyzt_units = 0;
    header.scl_slope = 0;
    header.vox_offset = std::max(header.vox_offset, 0.0);
  }
  return header;
}

Header decode_version_2(const nifti_2_header& raw, bool is_swapped, const std::string& path) {
  Header header = decode(raw, is_swapped);
  header.format = "NIfTI-2";
  header.is_pair = std::memcmp(raw.magic, "ni2", 4) == 0;
  if (!header.is_pair && std::memcmp(raw.magic, "n+2", 4) != 0)
    throw InputError(fmt::format("{}: not NIfTI-2: the magic is neither 'n+2' nor 'ni2'", path));
  return header;
}

Header read_header(ByteStream& stream, const std::string& path) {
  std::array<unsigned char, kSize2> bytes = {};
  stream.read(bytes.data(), kSize1);
  std::int32_t size;
  std::memcpy(&size, bytes.data(), sizeof size);
  const bool is_swapped = size != kSize1 && size != kSize2;
  size = swapped(size, is_swapped);
  if (size == kSize1) {
    nifti_1_header raw;
    std::memcpy(&raw, bytes.data(), sizeof raw);
    return decode_version_1(raw, is_swapped, path);
  }
  if (size != kSize2)
    throw InputError(fmt::format(
        "{}: not a NIfTI file: its first field is neither 348 (NIfTI-1) nor 540 (NIfTI-2)", path));
  stream.read(bytes.data() + kSize1, kSize2 - kSize1);
  nifti_2_header raw;
  std::memcpy(&raw, bytes.data(), sizeof raw);
  return decode_version_2(raw, is_swapped, path);
}

constexpr std::pair<int, ScalarType> kScalars[] = {
    {NIFTI_TYPE_UINT8, ScalarType::kUint8},     {NIFTI_TYPE_INT8, ScalarType::kInt8},
    {NIFTI_TYPE_INT16, ScalarType::kInt16},     {NIFTI_TYPE_UINT16, ScalarType::kUint16},
    {NIFTI_TYPE_INT32, ScalarType::kInt32},     {NIFTI_TYPE_UINT32, ScalarType::kUint32},
    {NIFTI_TYPE_INT64, ScalarType::kInt64},     {NIFTI_TYPE_UINT64, ScalarType::kUint64},
    {NIFTI_TYPE_FLOAT32, ScalarType::kFloat32}, {NIFTI_TYPE_FLOAT64, ScalarType::kFloat64}};
constexpr std::pair<int, const char*> kRefused[] = {
    {DT_BINARY, "binary, 1 bit"},       {NIFTI_TYPE_FLOAT128, "128-bit float"},
    {NIFTI_TYPE_COMPLEX64, "complex"},  {NIFTI_TYPE_COMPLEX128, "complex"},
    {NIFTI_TYPE_COMPLEX256, "complex"}, {NIFTI_TYPE_RGB24, "colour"},
    {NIFTI_TYPE_RGBA32, "colour"}};

ScalarType scalar_type(int datatype, const std::string& path) {
  for (const auto& [code, type] : kScalars)
    if (code == datatype) return type;
  const char* refused = "unknown";
  for (const auto& [code, words] : kRefused)
    if (code == datatype) refused = words;
  throw InputError(
      fmt::format("{}: voxels of datatype {} ({}) are not scalars surfseg reads; convert the file",
                  path, datatype, refused));
}

std::array<int, 3> volume_size(const Header& header, const std::string& path) {
  const std::int64_t n_dims = header.dim[0];
  if (n_dims < 1 || n_dims > 7)
    throw InputError(
        fmt::format("{}: dim[0] = {} is not from 1 to 7; the header is broken", path, n_dims));
  std::array<std::int64_t, 3> size = {1, 1, 1};
  for (int axis = 0; axis < std::min<std::int64_t>(n_dims, 3); ++axis)
    size[axis] = header.dim[axis + 1];
  return checked_size(path, size);
}

int n_frames(const Header& header, const std::string& path) {
  std::int64_t n = 1;
  for (int axis = 4; axis <= header.dim[0]; ++axis) {
    const std::int64_t size = header.dim[axis];
    if (size < 1 || size > std::numeric_limits<int>::max() ||
        (n *= size) > std::numeric_limits<int>::max())
      throw InputError(
          fmt::format("{}: dim[{}] = {} frames; the header is broken", path, axis, size));
  }
  return static_cast<int>(n);
}

/// Method 2 of nifti1.h: quaternion, spacing and offset.
Eigen::Matrix4d qform(const Header& header) {
  const double squared = header.quatern.squaredNorm();
  Eigen::Quaterniond q(std::sqrt(std::max(0.0, 1 - squared)), header.quatern[0], header.quatern[1],
                       header.quatern[2]);
  q.normalize();
  Eigen::Vector3d spacing(header.pixdim[1], header.pixdim[2], header.pixdim[3]);
  if (header.pixdim[0] < 0) spacing[2] *= -1;
  Eigen::Matrix4d result = Eigen::Matrix4d::Identity();
  result.topLeftCorner<3, 3>() = q.toRotationMatrix() * spacing.asDiagonal();
  result.topRightCorner<3, 1>() = header.qoffset;
  return result;
}

/// Millimetres per unit of the header's lengths.
double unit_mm(const Header& header, Source& source) {
  const int unit = header.xyzt_units & 7;
  if (unit != NIFTI_UNITS_METER && unit != NIFTI_UNITS_MICRON) return 1;
  const bool is_meter = unit == NIFTI_UNITS_METER;
  source.notes.push_back(
      fmt::format("lengths in the file are {}, converted to mm", is_meter ? "m" : "micrometres"));
  return is_meter ? 1e3 : 1e-3;
}

Eigen::Matrix4d index_to_world(const Header& header, Source& source) {
  Eigen::Matrix4d result = Eigen::Matrix4d::Identity();
  if (header.sform_code > 0) {
    source.orientation_source = "sform";
    result.topRows<3>() = header.srow;
  } else if (header.qform_code > 0) {
    source.orientation_source = "qform";
    result = qform(header);
  } else {
    source.orientation_source = "pixdim";
    source.notes.push_back(fmt::format(
        "{} gives no orientation: axes taken as R, A, S; left and right may be exchanged",
        header.is_analyze ? "Analyze" : "the file"));
    for (int axis = 0; axis < 3; ++axis) result(axis, axis) = std::abs(header.pixdim[axis + 1]);
  }
  result.topRows<3>() *= unit_mm(header, source);
  return result;
}

/// The first of `stem` with one of the endings that exists, in either case.
std::string find_beside(const std::string& path, const std::vector<std::string>& endings) {
  std::string stem = path;
  if (stem.ends_with(".gz")) stem.resize(stem.size() - 3);
  stem.resize(stem.size() - std::min<std::size_t>(4, stem.size()));
  std::error_code status;
  for (const std::string& ending : endings)
    if (std::filesystem::is_regular_file(stem + ending, status)) return stem + ending;
  throw InputError(fmt::format("{}: its other half {}{} is missing; put it beside", path, stem,
                               endings.front()));
}

bool is_data_half(const std::string& path) {
  return path.ends_with(".img") || path.ends_with(".IMG") || path.ends_with(".img.gz");
}

std::uint64_t data_offset(const Header& header, const std::string& path) {
  const double offset = header.vox_offset;
  if (!(offset >= 0 && offset < 0x1p53 && offset == std::floor(offset)))
    throw InputError(fmt::format("{}: vox_offset = {} is no place in a file; the header is broken",
                                 path, offset));
  return static_cast<std::uint64_t>(offset);
}

RawLayout layout_of(const Header& header, const ReadOptions& options, const std::string& path,
                    Source& source) {
  RawLayout layout;
  layout.size = volume_size(header, path);
  layout.type = scalar_type(header.datatype, path);
  layout.is_big_endian = header.is_swapped != (std::endian::native == std::endian::big);
  layout.n_frames = n_frames(header, path);
  layout.frame = options.frame_index;
  if (std::isfinite(header.scl_slope) && header.scl_slope != 0) {
    layout.slope = header.scl_slope;
    layout.intercept = std::isfinite(header.scl_inter) ? header.scl_inter : 0;
  }
  for (int axis = 5; axis <= header.dim[0]; ++axis)
    if (header.dim[axis] > 1)
      source.notes.push_back(fmt::format("dim[{}] = {} counted as frames", axis, header.dim[axis]));
  return layout;
}

/// Of a file, or of the pair that it is half of.
std::string header_of(const std::string& path) {
  return is_data_half(path) ? find_beside(path, {".hdr", ".HDR", ".hdr.gz"}) : path;
}

/// Of a pair.
std::string data_of(const std::string& path) {
  return is_data_half(path) ? path : find_beside(path, {".img", ".IMG", ".img.gz"});
}

}  // namespace

Volume read_nifti(const std::string& path, const ReadOptions& options) {
  const std::string header_path = header_of(path);
  auto stream = std::make_unique<ByteStream>(header_path, 0, ByteStream::Encoding::kDetect);
  const Header header = read_header(*stream, header_path);
  Source source;
  source.path = path;
  source.format = header.format;
  const Eigen::Matrix4d affine = index_to_world(header, source);
  const RawLayout layout = layout_of(header, options, header_path, source);
  std::uint64_t offset = data_offset(header, header_path);
  if (header.is_pair) {
    stream = std::make_unique<ByteStream>(data_of(path), 0, ByteStream::Encoding::kDetect);
  } else {
    // Behind the header come four bytes for extensions; some writers leave vox_offset at 0.
    const std::uint64_t n_read = header.format == "NIfTI-2" ? kSize2 : kSize1;
    offset = std::max(offset, n_read + 4) - n_read;
  }
  stream->skip(offset);
  return read_raw(*stream, layout, affine, std::move(source));
}

std::vector<std::string> nifti_files(const std::string& path) {
  const std::string header_path = header_of(path);
  ByteStream stream(header_path, 0, ByteStream::Encoding::kDetect);
  if (read_header(stream, header_path).is_pair) return {header_path, data_of(path)};
  return {header_path};
}

}  // namespace surf::volume
