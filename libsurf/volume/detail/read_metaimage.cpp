#include "libsurf/volume/detail/read_metaimage.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <bit>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <sstream>

#include "libsurf/base/error.h"
#include "libsurf/volume/detail/byte_stream.h"
#include "libsurf/volume/detail/raw_scalars.h"

// The header is a list of "Key = Value" lines, parsed here: the metaio library fills arrays of ten
// axes without looking at NDims, holds compressed and inflated voxels in memory at once, and
// prints what is wrong on the terminal.

namespace surf::volume {
namespace {

constexpr std::size_t kLongestHeader = 1 << 20;

struct Header {
  std::string path;
  std::map<std::string, std::string> fields;
  std::uint64_t n_bytes = 0;  ///< the data of LOCAL begin here

  /// The value of the first of these keys the header has; "" if none.
  std::string text(const std::vector<std::string>& keys) const {
    for (const std::string& key : keys)
      if (const auto at = fields.find(key); at != fields.end()) return at->second;
    return {};
  }

  bool flag(const std::vector<std::string>& keys, bool otherwise) const {
    const std::string value = text(keys);
    if (value.empty()) return otherwise;
    return value[0] == 'T' || value[0] == 't' || value[0] == '1' || value[0] == 'Y';
  }

  /// n numbers; `otherwise` if no key is there.
  std::vector<double> numbers(const std::vector<std::string>& keys, std::size_t n,
                              std::vector<double> otherwise = {}) const {
    const std::string value = text(keys);
    if (value.empty() && !otherwise.empty()) return otherwise;
    std::istringstream stream(value);
    std::vector<double> result;
    for (std::string word; stream >> word;) {
      double number;
      const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), number);
      if (status != std::errc() || end != word.data() + word.size()) break;
      result.push_back(number);
    }
    if (result.size() < n)
      throw InputError(fmt::format("{}: {} needs {} numbers, has '{}'; mend the header", path,
                                   keys.front(), n, value.substr(0, 60)));
    result.resize(n);
    return result;
  }
};

std::string trimmed(const std::string& text) {
  const auto first = text.find_first_not_of(" \t\r");
  if (first == std::string::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

/// ElementDataFile is the last line; the data of LOCAL follow it.
Header read_header(const std::string& path) {
  Header header;
  header.path = path;
  ByteStream stream(path, 0, ByteStream::Encoding::kRaw);
  std::error_code status;
  const auto n_bytes = std::filesystem::file_size(path, status);
  std::string text(std::min<std::uintmax_t>(kLongestHeader, status ? 0 : n_bytes), '\0');
  text.resize(stream.read_some(text.data(), text.size()));
  while (header.n_bytes < text.size()) {
    const auto end = std::min(text.find('\n', header.n_bytes), text.size());
    const std::string line = text.substr(header.n_bytes, end - header.n_bytes);
    header.n_bytes = std::min(end + 1, text.size());
    const auto equals = line.find_first_of("=:");
    if (equals == std::string::npos) {
      if (trimmed(line).empty()) continue;
      throw InputError(
          fmt::format("{}: not a MetaImage header: a line without '=' before "
                      "ElementDataFile",
                      path));
    }
    const std::string key = trimmed(line.substr(0, equals));
    header.fields[key] = trimmed(line.substr(equals + 1));
    if (key == "ElementDataFile") return header;
  }
  throw InputError(
      fmt::format("{}: truncated: the header ends without its line ElementDataFile", path));
}

ScalarType scalar_type(const Header& header) {
  static const std::map<std::string, ScalarType> kTypes = {
      {"MET_CHAR", ScalarType::kInt8},       {"MET_UCHAR", ScalarType::kUint8},
      {"MET_SHORT", ScalarType::kInt16},     {"MET_USHORT", ScalarType::kUint16},
      {"MET_INT", ScalarType::kInt32},       {"MET_UINT", ScalarType::kUint32},
      {"MET_LONG", ScalarType::kInt32},      {"MET_ULONG", ScalarType::kUint32},
      {"MET_LONG_LONG", ScalarType::kInt64}, {"MET_ULONG_LONG", ScalarType::kUint64},
      {"MET_FLOAT", ScalarType::kFloat32},   {"MET_DOUBLE", ScalarType::kFloat64}};
  const std::string type = header.text({"ElementType"});
  const auto found = kTypes.find(type);
  if (found == kTypes.end())
    throw InputError(fmt::format(
        "{}: ElementType '{}' is not a scalar surfseg reads; convert the file", header.path, type));
  return found->second;
}

/// The whole number of a header's field, which is kept as double.
std::int64_t whole(const Header& header, const char* key, double value) {
  if (!(std::abs(value) < 0x1p53) || value != std::floor(value))
    throw InputError(
        fmt::format("{}: {} = {} is not a whole number; mend the header", header.path, key, value));
  return static_cast<std::int64_t>(value);
}

RawLayout layout_of(const Header& header, const ReadOptions& options) {
  const std::int64_t n_dims = whole(header, "NDims", header.numbers({"NDims"}, 1)[0]);
  if (n_dims < 3 || n_dims > 4)
    throw InputError(fmt::format("{}: has {} dimensions; surfseg reads volumes of 3 (or 4)",
                                 header.path, n_dims));
  if (const double n = header.numbers({"ElementNumberOfChannels"}, 1, {1})[0]; n != 1)
    throw InputError(fmt::format(
        "{}: has {} values per voxel; surfseg reads scalars, extract one channel", header.path, n));
  if (!header.flag({"BinaryData"}, true))
    throw InputError(fmt::format("{}: voxels as text; write the file as binary", header.path));
  const std::vector<double> dim_size = header.numbers({"DimSize"}, n_dims);
  RawLayout layout;
  layout.size = checked_size(
      header.path, {whole(header, "DimSize", dim_size[0]), whole(header, "DimSize", dim_size[1]),
                    whole(header, "DimSize", dim_size[2])});
  if (n_dims == 4)
    layout.n_frames = checked_size(header.path, {whole(header, "DimSize", dim_size[3]), 1, 1})[0];
  layout.frame = options.frame_index;
  layout.type = scalar_type(header);
  layout.is_big_endian = header.flag({"BinaryDataByteOrderMSB", "ElementByteOrderMSB"}, false);
  layout.slope = header.numbers({"ElementToIntensityFunctionSlope"}, 1, {1})[0];
  layout.intercept = header.numbers({"ElementToIntensityFunctionOffset"}, 1, {0})[0];
  if (layout.slope == 0) layout.slope = 1;
  return layout;
}

/// TransformMatrix lists the direction of each axis in turn; LPS. CenterOfRotation is not
/// applied, as in ITK.
Eigen::Matrix4d index_to_world(const Header& header, int n_dims) {
  std::vector<double> identity(n_dims * n_dims, 0.0);
  for (int axis = 0; axis < n_dims; ++axis) identity[axis * n_dims + axis] = 1;
  const std::vector<double> axes =
      header.numbers({"TransformMatrix", "Rotation", "Orientation"}, n_dims * n_dims, identity);
  const std::vector<double> spacing =
      header.numbers({"ElementSpacing", "ElementSize"}, n_dims, std::vector<double>(n_dims, 1.0));
  const std::vector<double> offset =
      header.numbers({"Offset", "Position", "Origin"}, n_dims, std::vector<double>(n_dims, 0.0));
  Eigen::Matrix4d lps = Eigen::Matrix4d::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    for (int row = 0; row < 3; ++row) lps(row, axis) = axes[axis * n_dims + row] * spacing[axis];
    lps(axis, 3) = offset[axis];
  }
  return Eigen::Vector4d(-1, -1, 1, 1).asDiagonal() * lps;
}

std::string data_path(const Header& header) {
  const std::string name = header.text({"ElementDataFile"});
  if (name == "LOCAL" || name == "Local" || name == "local") return header.path;
  if (name.starts_with("LIST") || name.find('%') != std::string::npos)
    throw InputError(fmt::format("{}: one data file per slice ('{}'); write the volume as one file",
                                 header.path, name));
  const std::filesystem::path path = std::filesystem::path(header.path).parent_path() / name;
  std::error_code status;
  if (name.empty() || !std::filesystem::is_regular_file(path, status))
    throw InputError(fmt::format("{}: its data file '{}' is missing; put it beside the header",
                                 header.path, name));
  return path.string();
}

std::uint64_t data_offset(const Header& header, const RawLayout& layout, const std::string& path) {
  if (path == header.path) return header.n_bytes;
  const std::int64_t n = whole(header, "HeaderSize", header.numbers({"HeaderSize"}, 1, {0})[0]);
  if (n >= 0) return n;
  // -1: the voxels are the end of the file.
  const double n_data = 1.0 * layout.size[0] * layout.size[1] * layout.size[2] * layout.n_frames *
                        static_cast<double>(n_bytes(layout.type));
  const double n_file = static_cast<double>(std::filesystem::file_size(path));
  return n_data < n_file ? static_cast<std::uint64_t>(n_file - n_data) : 0;
}

}  // namespace

Volume read_metaimage(const std::string& path, const ReadOptions& options) {
  const Header header = read_header(path);
  if (const std::string type = header.text({"ObjectType"}); !type.empty() && type != "Image")
    throw InputError(
        fmt::format("{}: a MetaIO file of a {}, not of an image; give a volume", path, type));
  const RawLayout layout = layout_of(header, options);
  Source source;
  source.path = path;
  source.format = "MetaImage";
  source.orientation_source = header.text({"TransformMatrix", "Rotation", "Orientation"}).empty()
                                  ? "none"
                                  : "TransformMatrix";
  if (source.orientation_source == "none")
    source.notes.emplace_back("no TransformMatrix: axes taken as L, P, S");
  const Eigen::Matrix4d affine =
      index_to_world(header, static_cast<int>(header.numbers({"NDims"}, 1)[0]));
  const std::string data = data_path(header);
  ByteStream stream(data, data_offset(header, layout, data),
                    header.flag({"CompressedData"}, false) ? ByteStream::Encoding::kDeflate
                                                           : ByteStream::Encoding::kRaw);
  return read_raw(stream, layout, affine, std::move(source));
}

std::vector<std::string> metaimage_files(const std::string& path) {
  const std::string data = data_path(read_header(path));
  if (data == path) return {path};
  return {path, data};
}

}  // namespace surf::volume
