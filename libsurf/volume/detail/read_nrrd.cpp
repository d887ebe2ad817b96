#include "libsurf/volume/detail/read_nrrd.h"

#include <fmt/format.h>
#include <teem/biff.h>
#include <teem/nrrd.h>

#include <Eigen/Geometry>
#include <bit>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include "libsurf/base/decimal_points.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/volume/detail/byte_stream.h"
#include "libsurf/volume/detail/raw_scalars.h"

// teem parses the header. Voxels as raw bytes or gzip, nearly all there are, stream past it; the
// other encodings and lists of data files go through teem's memory.

namespace surf::volume {
namespace {

struct DeleteNrrd {
  void operator()(Nrrd* nrrd) const { nrrdNuke(nrrd); }
};
struct DeleteState {
  void operator()(NrrdIoState* state) const { nrrdIoStateNix(state); }
};

/// The last line of teem's trace of messages: where it began.
std::string last_message() {
  char* text = biffGetDone(NRRD);
  std::string message = text ? text : "";
  free(text);
  while (!message.empty() && message.back() == '\n') message.pop_back();
  message = message.substr(message.find_last_of('\n') + 1);
  if (message.starts_with("[nrrd] ")) message.erase(0, 7);
  if (const auto colon = message.find(": "); colon != std::string::npos)
    message.erase(0, colon + 2);  // the name of teem's function
  return message;
}

struct Loaded {
  std::unique_ptr<Nrrd, DeleteNrrd> nrrd{nrrdNew()};
  std::unique_ptr<NrrdIoState, DeleteState> state{nrrdIoStateNew()};
};

enum class Load { kHeader, kAll };

Loaded load(const std::string& path, Load what) {
  Loaded result;
  result.state->skipData = what == Load::kHeader;
  result.state->keepNrrdDataFileOpen = what == Load::kHeader;
  nrrdStateVerboseIO = 0;
  const DecimalPoints points;  // teem reads by sscanf()
  if (nrrdLoad(result.nrrd.get(), path.c_str(), result.state.get()) != 0) {
    const std::string message = last_message();
    const char* advice = message.find("open") != std::string::npos
                             ? "put the data file beside the header"
                             : "mend the header or get the file again";
    throw InputError(fmt::format("{}: not a readable NRRD: {}; {}", path, message, advice));
  }
  return result;
}

ScalarType scalar_type(int type, const std::string& path) {
  const ScalarKind kind = !nrrdTypeIsIntegral[type]  ? ScalarKind::kFloat
                          : nrrdTypeIsUnsigned[type] ? ScalarKind::kUnsigned
                                                     : ScalarKind::kSigned;
  const auto found =
      type == nrrdTypeBlock ? std::nullopt : find_scalar_type(kind, nrrdTypeSize[type]);
  if (found) return *found;
  throw InputError(
      fmt::format("{}: voxels of type '{}' are not scalars surfseg reads; convert the file", path,
                  airEnumStr(nrrdType, type)));
}

bool is_domain(const NrrdAxisInfo& axis) {
  return axis.kind == nrrdKindUnknown || axis.kind == nrrdKindDomain || axis.kind == nrrdKindSpace;
}

bool is_frames(const NrrdAxisInfo& axis) {
  return axis.kind == nrrdKindTime || axis.kind == nrrdKindList || axis.kind == nrrdKindStub ||
         axis.kind == nrrdKindScalar || is_domain(axis);
}

bool has_direction(const Nrrd& nrrd, unsigned axis) {
  return nrrd.spaceDim > 0 && airExists(nrrd.axis[axis].spaceDirection[0]);
}

/// The axis that counts frames: 0 (fastest) or 3; nothing if there are three axes.
std::optional<unsigned> frame_axis(const Nrrd& nrrd, const std::string& path) {
  if (nrrd.dim == 3) {
    for (unsigned axis = 0; axis < 3; ++axis)
      if (!is_domain(nrrd.axis[axis]) || (nrrd.spaceDim > 0 && !has_direction(nrrd, axis)))
        throw InputError(fmt::format(
            "{}: axis {} of 3 is no axis of space, this is a 2-D image; surfseg reads volumes",
            path, axis));
    return std::nullopt;
  }
  if (nrrd.dim != 4)
    throw InputError(
        fmt::format("{}: has {} dimensions; surfseg reads volumes of 3 (or 4)", path, nrrd.dim));
  const bool is_first = nrrd.spaceDim > 0 ? !has_direction(nrrd, 0) : !is_domain(nrrd.axis[0]);
  const unsigned result = is_first ? 0 : 3;
  if (!is_frames(nrrd.axis[result]))
    throw InputError(fmt::format(
        "{}: has several values per voxel (kind '{}'); surfseg reads scalars, extract one", path,
        airEnumStr(nrrdKind, nrrd.axis[result].kind)));
  for (unsigned axis = 0; axis < 4; ++axis)
    if (axis != result && nrrd.spaceDim > 0 && !has_direction(nrrd, axis))
      throw InputError(
          fmt::format("{}: axis {} has no space direction; mend the header", path, axis));
  return result;
}

/// Signs that take the file's space to RAS.
Eigen::Vector3d signs_to_ras(const Nrrd& nrrd, Source& source) {
  switch (nrrd.space) {
    case nrrdSpaceRightAnteriorSuperior:
      return {1, 1, 1};
    case nrrdSpaceLeftAnteriorSuperior:
      return {-1, 1, 1};
    case nrrdSpaceLeftPosteriorSuperior:
      return {-1, -1, 1};
  }
  if (nrrd.spaceDim != 0 && nrrd.spaceDim != 3)
    throw InputError(fmt::format(
        "{}: a space of {} dimensions ('{}') is not supported; use left-posterior-superior",
        source.path, nrrd.spaceDim, nrrd.space ? airEnumStr(nrrdSpace, nrrd.space) : "no name"));
  source.notes.push_back(fmt::format(
      "{}: coordinates taken as LPS, as ITK does",
      nrrd.space ? fmt::format("space '{}' is not anatomical", airEnumStr(nrrdSpace, nrrd.space))
                 : "no anatomical space in the file"));
  return {-1, -1, 1};
}

/// Millimetres per unit of the space's axis.
double unit_mm(const Nrrd& nrrd, int axis, const std::string& path) {
  static const std::map<std::string, double> kUnits = {
      {"mm", 1},    {"millimeter", 1}, {"millimetre", 1}, {"cm", 10},       {"m", 1e3},
      {"um", 1e-3}, {"\u00b5m", 1e-3}, {"\u03bcm", 1e-3}, {"micron", 1e-3}, {"nm", 1e-6},
      {"", 1}};
  const char* unit = nrrd.spaceUnits[axis];
  if (!unit) return 1;
  const auto found = kUnits.find(unit);
  if (found == kUnits.end())
    throw InputError(
        fmt::format("{}: space unit '{}' is not a length surfseg knows; use mm", path, unit));
  return found->second;
}

/// As it is stated, or else as the ends of the axis have it.
/// @param is_cell  the ends are edges of voxels, not centres
std::optional<double> spacing_of(const Nrrd& nrrd, unsigned axis, bool is_cell) {
  double spacing;
  double direction[NRRD_SPACE_DIM_MAX];
  if (nrrdSpacingCalculate(&nrrd, axis, &spacing, direction) != nrrdSpacingStatusNone)
    return spacing;
  const NrrdAxisInfo& info = nrrd.axis[axis];
  const double length = info.max - info.min;  // NaN if one of them is missing
  const double n_steps = double(info.size) - (is_cell ? 0 : 1);
  if (!std::isfinite(length) || n_steps < 1) return std::nullopt;
  return length / n_steps;
}

Eigen::Matrix4d without_directions(const Nrrd& nrrd, unsigned first, Source& source) {
  source.orientation_source = "spacings";
  Eigen::Matrix4d result = Eigen::Matrix4d::Identity();
  bool is_guessed = false;
  for (unsigned n = 0; n < 3; ++n) {
    const NrrdAxisInfo& axis = nrrd.axis[first + n];
    const bool is_cell = axis.center != nrrdCenterNode;
    const std::optional<double> spacing = spacing_of(nrrd, first + n, is_cell);
    if (!spacing)
      source.notes.push_back(fmt::format("no spacing of axis {}: taken as 1 mm", first + n));
    result(n, n) = spacing.value_or(1);
    if (!airExists(axis.min)) continue;
    result(n, 3) = axis.min + (is_cell ? result(n, n) / 2 : 0);
    is_guessed |= axis.center == nrrdCenterUnknown;
  }
  if (is_guessed)
    source.notes.emplace_back(
        "no centers in the file: axis mins taken as edges of voxels (cell), as ITK does");
  return result;
}

Eigen::Matrix4d index_to_world(const Nrrd& nrrd, unsigned first, Source& source) {
  const Eigen::Vector3d signs = signs_to_ras(nrrd, source);
  Eigen::Matrix4d result = Eigen::Matrix4d::Identity();
  if (nrrd.spaceDim == 3) {
    source.orientation_source = "space directions";
    for (unsigned row = 0; row < 3; ++row) {
      const double unit = unit_mm(nrrd, row, source.path);
      for (unsigned n = 0; n < 3; ++n)
        result(row, n) = unit * nrrd.axis[first + n].spaceDirection[row];
      const double origin = nrrd.spaceOrigin[row];
      result(row, 3) = airExists(origin) ? unit * origin : 0;
    }
    if (!airExists(nrrd.spaceOrigin[0]))
      source.notes.emplace_back("no space origin: taken as 0, 0, 0");
  } else {
    result = without_directions(nrrd, first, source);
  }
  result.topRows<3>() = signs.asDiagonal() * result.topRows<3>();
  return result;
}

/// A name in the header as seen from here.
std::string beside(const NrrdIoState& state, const std::string& name) {
  if (name.starts_with("/") || !state.path || !*state.path) return name;
  return std::string(state.path) + "/" + name;
}

/// Name of the one file that holds the voxels; nothing if there are several.
std::optional<std::string> data_path(const NrrdIoState& state, const std::string& path) {
  if (state.dataFNFormat || state.dataFNArr->len > 1) return std::nullopt;
  return state.dataFNArr->len == 0 ? path : beside(state, state.dataFN[0]);
}

/// Those in the folder of a pattern such as slices/s%03d.raw that it may name.
std::vector<std::string> files_like(const std::string& pattern) {
  const std::filesystem::path path(pattern);
  const std::string name = path.filename().string();
  const std::size_t percent = name.find('%');
  if (percent == std::string::npos) return {};
  const std::string start = name.substr(0, percent),
                    end = name.substr(name.find_first_of("diu", percent) + 1);
  std::vector<std::string> out;
  const std::string folder = path.parent_path().string();
  for (const std::string& file : files_in(folder.empty() ? "." : folder)) {
    const std::string own = std::filesystem::path(file).filename().string();
    if (own.size() > start.size() + end.size() && own.starts_with(start) && own.ends_with(end))
      out.push_back(file);
  }
  return out;
}

/// A part of memory that reads like a file: what teem has decoded.
Volume volume_from_memory(const Nrrd& nrrd, const RawLayout& layout,
                          const Eigen::Matrix4d& index_to_world, Source source) {
  source.scalar_type = name(layout.type);
  source.n_frames = layout.n_frames;
  source.frame = layout.frame;
  const std::size_t n_values = std::size_t(layout.size[0]) * layout.size[1];
  const std::size_t stride = layout.has_frames_fastest ? layout.n_frames : 1;
  const std::size_t scalar = n_bytes(layout.type);
  const auto* stored =
      static_cast<const std::byte*>(nrrd.data) +
      layout.frame * scalar * (layout.has_frames_fastest ? 1 : n_values * layout.size[2]);
  Volume::Builder builder(layout.size, index_to_world, std::move(source));
  std::vector<float> slice(n_values);
  for (int k = 0; k < layout.size[2]; ++k) {
    convert(layout.type, false, stored + k * n_values * stride * scalar, stride, 1, 0, slice.data(),
            n_values);
    builder.append_slice(slice);
  }
  return builder.finish();
}

RawLayout layout_of(const Nrrd& nrrd, const NrrdIoState& state, const ReadOptions& options,
                    const std::string& path) {
  const std::optional<unsigned> frames = frame_axis(nrrd, path);
  const unsigned first = frames == 0u ? 1 : 0;
  RawLayout layout;
  std::array<std::int64_t, 3> size;
  for (unsigned n = 0; n < 3; ++n) size[n] = static_cast<std::int64_t>(nrrd.axis[first + n].size);
  layout.size = checked_size(path, size);
  layout.type = scalar_type(nrrd.type, path);
  layout.is_big_endian = state.endian == airEndianBig;
  layout.frame = options.frame_index;
  layout.has_frames_fastest = frames == 0u;
  if (frames)
    layout.n_frames =
        checked_size(path, {static_cast<std::int64_t>(nrrd.axis[*frames].size), 1, 1})[0];
  check_frame(path, layout.frame, layout.n_frames);
  return layout;
}

/// Closes the data file that teem leaves open, and says where its voxels begin.
std::uint64_t take_data_offset(NrrdIoState& state) {
  if (!state.dataFile) return 0;
  const long offset = std::ftell(state.dataFile);
  airFclose(state.dataFile);
  state.dataFile = nullptr;
  return offset > 0 ? static_cast<std::uint64_t>(offset) : 0;
}

/// teem keeps its messages and settings in globals.
std::mutex& teem_mutex() {
  static std::mutex mutex;
  return mutex;
}

}  // namespace

Volume read_nrrd(const std::string& path, const ReadOptions& options) {
  const std::scoped_lock lock(teem_mutex());
  Loaded header = load(path, Load::kHeader);
  const std::uint64_t offset = take_data_offset(*header.state);
  Source source;
  source.path = path;
  source.format = "NRRD";
  const RawLayout layout = layout_of(*header.nrrd, *header.state, options, path);
  const Eigen::Matrix4d affine =
      index_to_world(*header.nrrd, layout.has_frames_fastest ? 1 : 0, source);

  const std::optional<std::string> data = data_path(*header.state, path);
  const bool is_raw = header.state->encoding == nrrdEncodingRaw;
  const bool is_gzip = header.state->encoding == nrrdEncodingGzip;
  if (!data || (!is_raw && !is_gzip)) {
    const double gigabytes = 8e-9 * layout.size[0] * layout.size[1] * layout.size[2];
    if (gigabytes > 16)
      throw InputError(fmt::format(
          "{}: too large for this encoding; store the voxels as raw or gzip in one file", path));
    const Loaded all = load(path, Load::kAll);
    return volume_from_memory(*all.nrrd, layout, affine, std::move(source));
  }
  ByteStream stream(*data, offset,
                    is_raw ? ByteStream::Encoding::kRaw : ByteStream::Encoding::kDeflate);
  if (is_gzip && header.state->byteSkip > 0) stream.skip(header.state->byteSkip);
  return read_raw(stream, layout, affine, std::move(source));
}

std::vector<std::string> nrrd_files(const std::string& path) {
  const std::scoped_lock lock(teem_mutex());
  const Loaded header = load(path, Load::kHeader);
  NrrdIoState& state = *header.state;
  take_data_offset(state);
  std::vector<std::string> out = {path};
  for (unsigned n = 0; n < state.dataFNArr->len; ++n) out.push_back(beside(state, state.dataFN[n]));
  if (state.dataFNFormat) {
    const std::vector<std::string> files = files_like(beside(state, state.dataFNFormat));
    out.insert(out.end(), files.begin(), files.end());
  }
  return out;
}

}  // namespace surf::volume
