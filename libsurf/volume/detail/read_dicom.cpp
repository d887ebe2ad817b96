#include "libsurf/volume/detail/read_dicom.h"

#include <fmt/format.h>
#include <gdcmReader.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTrace.h>

#include <algorithm>
#include <charconv>
#include <cstring>
#include <filesystem>
#include <map>
#include <optional>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/base/memory.h"
#include "libsurf/volume/detail/dicom_pixels.h"
#include "libsurf/volume/detail/dicom_structure.h"
#include "libsurf/volume/detail/raw_scalars.h"
#include "libsurf/volume/detail/slice_stack.h"

namespace surf::volume {
namespace {

namespace fs = std::filesystem;
using gdcm::DataSet;
using gdcm::Tag;

const Tag kSopClassUid(0x0008, 0x0016), kSopInstanceUid(0x0008, 0x0018),
    kSeriesNumber(0x0020, 0x0011), kModality(0x0008, 0x0060), kSeriesDescription(0x0008, 0x103e),
    kSeriesUid(0x0020, 0x000e), kPosition(0x0020, 0x0032), kOrientation(0x0020, 0x0037),
    kSamplesPerPixel(0x0028, 0x0002), kPhotometric(0x0028, 0x0004), kFrames(0x0028, 0x0008),
    kRows(0x0028, 0x0010), kColumns(0x0028, 0x0011), kPixelSpacing(0x0028, 0x0030),
    kBitsAllocated(0x0028, 0x0100), kBitsStored(0x0028, 0x0101), kHighBit(0x0028, 0x0102),
    kPixelRepresentation(0x0028, 0x0103), kIntercept(0x0028, 0x1052), kSlope(0x0028, 0x1053),
    kPixelData(0x7fe0, 0x0010),
    // Enhanced objects: groups shared by all frames and of each frame, and what they hold.
    kSharedGroups(0x5200, 0x9229), kFrameGroups(0x5200, 0x9230), kPlanePosition(0x0020, 0x9113),
    kPlaneOrientation(0x0020, 0x9116), kPixelMeasures(0x0028, 0x9110),
    kValueTransformation(0x0028, 0x9145);

constexpr const char* kSegmentation = "1.2.840.10008.5.1.4.1.1.66.4";  // of SOPClassUID

/// Of patient, study and frame of reference, and the character set that they are in; what tells who
/// was examined when, and nothing of how.
constexpr std::uint32_t kOfOrigin[] = {
    0x00080005,  // SpecificCharacterSet
    0x00080020,  // StudyDate
    0x00080030,  // StudyTime
    0x00080050,  // AccessionNumber
    0x00080090,  // ReferringPhysicianName
    0x00081030,  // StudyDescription
    0x00100010,  // PatientName
    0x00100020,  // PatientID
    0x00100021,  // IssuerOfPatientID
    0x00100030,  // PatientBirthDate
    0x00100040,  // PatientSex
    0x00101010,  // PatientAge
    0x00101020,  // PatientSize
    0x00101030,  // PatientWeight
    0x00120062,  // PatientIdentityRemoved
    0x00120063,  // DeidentificationMethod
    0x0020000d,  // StudyInstanceUID
    0x00200010,  // StudyID
    0x00200052,  // FrameOfReferenceUID
    0x00201040,  // PositionReferenceIndicator
};

/// GDCM prints on stderr what is wrong with a file; our messages come from its return values.
class SilenceGdcm {
 public:
  SilenceGdcm() : warnings_(gdcm::Trace::GetWarningFlag()), errors_(gdcm::Trace::GetErrorFlag()) {
    gdcm::Trace::WarningOff();
    gdcm::Trace::ErrorOff();
  }
  ~SilenceGdcm() {
    gdcm::Trace::SetWarning(warnings_);
    gdcm::Trace::SetError(errors_);
  }
  SilenceGdcm(const SilenceGdcm&) = delete;
  SilenceGdcm& operator=(const SilenceGdcm&) = delete;

 private:
  bool warnings_, errors_;
};

std::string text(const DataSet& data, const Tag& tag) {
  if (!data.FindDataElement(tag)) return {};
  const gdcm::ByteValue* bytes = data.GetDataElement(tag).GetByteValue();
  if (!bytes) return {};
  std::string result(bytes->GetPointer(), bytes->GetLength());
  while (!result.empty() && (result.back() == ' ' || result.back() == '\0')) result.pop_back();
  return result;
}

/// The numbers of a decimal string; empty if there are not exactly n, or something else is in it.
std::vector<double> numbers(const std::string& all, std::size_t n) {
  std::vector<double> result;
  for (std::size_t at = 0; at < all.size();) {
    const std::size_t end = std::min(all.find('\\', at), all.size());
    while (at < end && (all[at] == ' ' || all[at] == '+')) ++at;
    double value;
    const auto [rest, error] = std::from_chars(all.data() + at, all.data() + end, value);
    const auto is_padding = [](char c) { return c == ' ' || c == '\0'; };
    if (error != std::errc() || !std::all_of(rest, all.data() + end, is_padding)) return {};
    result.push_back(value);
    at = end + 1;
  }
  return result.size() == n ? result : std::vector<double>();
}

std::vector<double> decimals(const DataSet& data, const Tag& tag, std::size_t n) {
  return numbers(text(data, tag), n);
}

int unsigned_short(const DataSet& data, const Tag& tag) {
  if (!data.FindDataElement(tag)) return 0;
  const gdcm::ByteValue* bytes = data.GetDataElement(tag).GetByteValue();
  std::uint16_t value = 0;
  if (!bytes || bytes->GetLength() < sizeof value) return 0;
  std::memcpy(&value, bytes->GetPointer(), sizeof value);
  return value;
}

/// The items of a sequence; null if there is none. Of one whose length is given, and of those in
/// it, GDCM has the bytes alone where the syntax is implicit: they are parsed here, and nothing but
/// what is returned holds them.
using Items = gdcm::SmartPointer<gdcm::SequenceOfItems>;
Items items_of(const DataSet& data, const Tag& sequence) {
  return data.FindDataElement(sequence) ? data.GetDataElement(sequence).GetValueAsSQ() : Items();
}

/// The functional groups of a file of many frames; null where there are none.
struct FunctionalGroups {
  Items frames, shared;
};

/// What `tag` says in a macro of item n (from 1) of functional groups; empty if it is not there.
std::string macro_text(const Items& groups, std::size_t n_item, const Tag& macro, const Tag& tag) {
  if (!groups || groups->GetNumberOfItems() < n_item) return {};
  const Items items = items_of(groups->GetItem(n_item).GetNestedDataSet(), macro);
  if (!items || items->GetNumberOfItems() < 1) return {};
  return text(items->GetItem(1).GetNestedDataSet(), tag);
}

struct FileHeader {
  std::string file, series_uid, description, modality;
  bool is_segmentation = false;
  std::vector<DicomSlice> slices;  ///< one per frame
  std::string fault;  ///< why the file's slices have no place in space; empty if they have
};

/// What `tag` says in the macro `group` of a frame: of its own groups, else of the shared ones;
/// without functional groups, in the data set itself.
std::string frame_text(const DataSet& data, const FunctionalGroups& groups, int frame,
                       const Tag& group, const Tag& tag) {
  std::string result = macro_text(groups.frames, std::size_t(frame) + 1, group, tag);
  if (result.empty()) result = macro_text(groups.shared, 1, group, tag);
  return result.empty() ? text(data, tag) : result;
}

/// Empty if the slice has its place and its values, else what is missing.
std::string place(const DataSet& data, const FunctionalGroups& groups, int frame,
                  DicomSlice& slice) {
  std::string unreadable;
  const auto of_frame = [&](const Tag& group, const Tag& tag, std::size_t n, const char* name) {
    const std::string stated = frame_text(data, groups, frame, group, tag);
    auto result = numbers(stated, n);
    if (result.empty() && !stated.empty()) unreadable = fmt::format("readable {}", name);
    return result;
  };
  const auto position = of_frame(kPlanePosition, kPosition, 3, "ImagePositionPatient");
  const auto orientation = of_frame(kPlaneOrientation, kOrientation, 6, "ImageOrientationPatient");
  const auto spacing = of_frame(kPixelMeasures, kPixelSpacing, 2, "PixelSpacing");
  const auto slope = of_frame(kValueTransformation, kSlope, 1, "RescaleSlope");
  const auto intercept = of_frame(kValueTransformation, kIntercept, 1, "RescaleIntercept");
  if (!unreadable.empty()) return unreadable;
  if (position.empty()) return "ImagePositionPatient";
  if (orientation.empty()) return "ImageOrientationPatient";
  if (spacing.empty()) return "PixelSpacing";
  slice.position_lps_mm = Eigen::Vector3d::Map(position.data());
  slice.along_row_lps = Eigen::Vector3d::Map(orientation.data());
  slice.along_column_lps = Eigen::Vector3d::Map(orientation.data() + 3);
  slice.pixel_height_mm = spacing[0];
  slice.pixel_width_mm = spacing[1];
  if (!slope.empty() && slope[0] != 0) slice.slope = slope[0];
  if (!intercept.empty()) slice.intercept = intercept[0];
  return {};
}

FileHeader header_of(const DataSet& data, const std::string& file) {
  FileHeader header;
  header.file = file;
  header.series_uid = text(data, kSeriesUid);
  header.description = text(data, kSeriesDescription);
  header.modality = text(data, kModality);
  header.is_segmentation = text(data, kSopClassUid) == kSegmentation;
  if (const int n = unsigned_short(data, kSamplesPerPixel); n != 1) {
    header.fault = fmt::format("has {} samples per pixel, not 1", n);
    return header;
  }
  if (text(data, kPhotometric) == "PALETTE COLOR") {
    header.fault = "has a colour palette";
    return header;
  }
  // GDCM asserts that these make sense.
  const int allocated = unsigned_short(data, kBitsAllocated);
  const int stored = unsigned_short(data, kBitsStored);
  const int high = unsigned_short(data, kHighBit);
  if ((allocated != 8 && allocated != 16 && allocated != 32 && allocated != 64) || stored < 1 ||
      stored > allocated || high >= allocated || high + 1 < stored ||
      unsigned_short(data, kPixelRepresentation) > 1) {
    header.fault = fmt::format("has pixels of {} bits in {} up to bit {}: no scalars surfseg reads",
                               stored, allocated, high);
    return header;
  }
  const auto frames = decimals(data, kFrames, 1);
  if (frames.empty() && !text(data, kFrames).empty()) {
    header.fault = "has no readable NumberOfFrames";
    return header;
  }
  const int n_frames = frames.empty() ? 1 : static_cast<int>(std::clamp(frames[0], 1.0, 1e5));
  if (n_frames > 1 && !data.FindDataElement(kFrameGroups)) {
    header.fault = fmt::format("has {} frames without a place of each in space", n_frames);
    return header;
  }
  const FunctionalGroups groups{items_of(data, kFrameGroups), items_of(data, kSharedGroups)};
  for (int frame = 0; frame < n_frames && header.fault.empty(); ++frame) {
    DicomSlice slice;
    slice.file = file;
    slice.frame = frame;
    slice.rows = unsigned_short(data, kRows);
    slice.columns = unsigned_short(data, kColumns);
    slice.sop_class_uid = text(data, kSopClassUid);
    slice.sop_instance_uid = text(data, kSopInstanceUid);
    slice.n_frames = n_frames;
    if (const std::string missing = place(data, groups, frame, slice); !missing.empty())
      header.fault = fmt::format("has no {}: it is no slice of a volume", missing);
    header.slices.push_back(slice);
  }
  return header;
}

/// What rows, columns and frames promise is believed as far as the pixel data bear it out: GDCM
/// makes room for all of it.
void check_pixels(const DataSet& data, const DicomFile& stored, const std::string& file) {
  const auto frames = decimals(data, kFrames, 1);
  const double n_sample_bytes = unsigned_short(data, kBitsAllocated) / 8.0;  // a segmentation: 1/8
  const double n_promised = double(unsigned_short(data, kRows)) * unsigned_short(data, kColumns) *
                            std::max(1, unsigned_short(data, kSamplesPerPixel)) * n_sample_bytes *
                            (frames.empty() ? 1 : std::max(1.0, frames[0]));
  const auto n_stored = double(stored.n_pixel_bytes);
  if (stored.is_compressed ? is_borne_out(n_promised, n_stored) : n_promised <= n_stored) return;
  throw InputError(
      fmt::format("{}: truncated or damaged: the header promises {:.0f} bytes of pixels, the file "
                  "holds {:.0f}{}; get the file again",
                  file, n_promised, n_stored, stored.is_compressed ? " compressed" : ""));
}

/// Nothing if the file is not DICOM, or holds no image (a report, a directory of files, ...).
std::optional<FileHeader> read_header(const std::string& file) {
  const DicomFile stored = dicom_structure(file);
  if (stored.structure == DicomStructure::kNone) return std::nullopt;
  if (stored.structure == DicomStructure::kCut)
    throw InputError(fmt::format(
        "{}: truncated or damaged DICOM (or deflated as a whole); get the file again or "
        "remove it from its folder",
        file));
  gdcm::Reader reader;
  reader.SetFileName(file.c_str());
  if (!reader.ReadUpToTag(kPixelData)) return std::nullopt;
  const DataSet& data = reader.GetFile().GetDataSet();
  if (unsigned_short(data, kRows) == 0 || unsigned_short(data, kColumns) == 0) return std::nullopt;
  check_pixels(data, stored, file);
  return header_of(data, file);
}

using Series = std::map<std::string, std::vector<FileHeader>>;  // by SeriesInstanceUID

Series read_folder(const std::string& folder, const std::string& path, int& n_skipped) {
  const std::vector<std::string> files = files_in(folder);
  Series series;
  for (const std::string& file : files) {
    auto header = read_header(file);
    if (header && !header->is_segmentation)  // it lies beside the images that it was made of
      series[header->series_uid].push_back(std::move(*header));
    else
      ++n_skipped;
  }
  if (series.empty())
    throw InputError(
        fmt::format("{}: {} files, no DICOM image among them; give the folder of a "
                    "series",
                    path, files.size()));
  return series;
}

std::vector<DicomSeries> described(const Series& series) {
  std::vector<DicomSeries> out;
  for (const auto& [uid, files] : series)
    out.push_back({uid, files[0].modality, files[0].description, files.size()});
  return out;
}

std::string list(const Series& series) {
  std::string result;
  for (const DicomSeries& one : described(series))
    result += fmt::format("{} {} ({}{}{}, {} file{})", result.empty() ? "" : ";", one.uid,
                          one.modality, one.description.empty() ? "" : " ", one.description,
                          one.n_files, one.n_files == 1 ? "" : "s");
  return result;
}

std::vector<FileHeader> choose_series(Series series, const std::optional<std::string>& uid,
                                      const std::string& path) {
  if (uid) {
    const auto found = series.find(*uid);
    if (found == series.end())
      throw InputError(fmt::format("{}: no series {} in it, only{}", path, *uid, list(series)));
    return std::move(found->second);
  }
  if (series.size() > 1)
    throw InputError(
        fmt::format("{}: holds {} series; give a file of one, or its UID as "
                    "ReadOptions::series_uid:{}",
                    path, series.size(), list(series)));
  return std::move(series.begin()->second);
}

std::vector<FileHeader> files_of(const std::string& path, const ReadOptions& options,
                                 int& n_skipped) {
  if (fs::is_directory(path))
    return choose_series(read_folder(path, path, n_skipped), options.series_uid, path);
  const auto header = read_header(path);
  if (!header)
    throw InputError(
        fmt::format("{}: not a DICOM image, or truncated in its header; give a volume", path));
  if (header->slices.size() > 1 || header->is_segmentation)
    return choose_series({{header->series_uid, {*header}}}, options.series_uid, path);
  const fs::path parent = fs::path(path).parent_path();
  return choose_series(read_folder(parent.empty() ? "." : parent.string(), path, n_skipped),
                       options.series_uid.value_or(header->series_uid), path);
}

std::vector<DicomSlice> slices_of(const std::vector<FileHeader>& files) {
  std::vector<DicomSlice> slices;
  for (const FileHeader& file : files) {
    if (!file.fault.empty())
      throw InputError(fmt::format("{}: {}; give a CT or MR series", file.file, file.fault));
    slices.insert(slices.end(), file.slices.begin(), file.slices.end());
  }
  return slices;
}

Source source_of(const std::string& path, const std::vector<FileHeader>& files,
                 const SliceStack& stack, int n_skipped) {
  Source source;
  source.path = path;
  source.format = files.size() == 1 ? "DICOM, multi-frame" : "DICOM series";
  source.orientation_source = "ImagePositionPatient, ImageOrientationPatient";
  if (!files[0].description.empty())
    source.notes.push_back(fmt::format("series '{}'", files[0].description));
  constexpr double kSmallestTiltDeg = 0.1;
  if (stack.tilt_deg > kSmallestTiltDeg)
    source.notes.push_back(
        fmt::format("gantry tilt of {:.2f} degrees, kept as shear", stack.tilt_deg));
  if (n_skipped > 0)
    source.notes.push_back(fmt::format("{} files in the folder are no DICOM images", n_skipped));
  return source;
}

/// From the header of the first slice, and of all what tells them apart.
DicomOrigin origin_of(const SliceStack& stack, const std::string& series_uid) {
  DicomOrigin origin;
  const DicomSlice& first = stack.slices[0];
  gdcm::Reader reader;
  reader.SetFileName(first.file.c_str());
  if (reader.ReadUpToTag(kPixelData)) {
    const DataSet& data = reader.GetFile().GetDataSet();
    for (const std::uint32_t tag : kOfOrigin)
      if (const Tag at(tag); data.FindDataElement(at))
        origin.attributes.push_back({at.GetGroup(), at.GetElement(), text(data, at)});
    if (const auto number = decimals(data, kSeriesNumber, 1); !number.empty())
      origin.series_number = int(std::clamp(number[0], 0.0, 1e9));
  }
  origin.series_uid = series_uid;
  origin.along_row_lps = first.along_row_lps;
  origin.along_column_lps = first.along_column_lps;
  origin.pixel_width_mm = first.pixel_width_mm;
  origin.pixel_height_mm = first.pixel_height_mm;
  for (const DicomSlice& slice : stack.slices)
    origin.images.push_back({slice.sop_class_uid, slice.sop_instance_uid,
                             slice.n_frames > 1 ? slice.frame + 1 : 0, slice.position_lps_mm});
  return origin;
}

Volume read_dicom(const std::string& path, const ReadOptions& options) {
  check_frame(path, options.frame_index, 1);
  const SilenceGdcm silence;
  int n_skipped = 0;
  const std::vector<FileHeader> files = files_of(path, options, n_skipped);
  const SliceStack stack = stack_slices(slices_of(files), path);
  Source source = source_of(path, files, stack, n_skipped);

  const std::size_t n_pixels = std::size_t(stack.size[0]) * stack.size[1];
  std::vector<DicomFrames> stored;
  for (const DicomSlice& slice : stack.slices)
    if (stored.empty() || stored.back().file != slice.file)
      stored.push_back({slice.file, n_pixels, std::size_t(slice.n_frames)});
  DicomPixels pixels(std::move(stored));
  ScalarType type = pixels.load_next();
  source.scalar_type = name(type);
  Volume::Builder builder(stack.size, stack.index_to_world, std::move(source));
  builder.set_dicom(origin_of(stack, files[0].series_uid));
  std::vector<float> values(n_pixels);
  for (std::size_t n = 0; n < stack.slices.size(); ++n) {
    const DicomSlice& slice = stack.slices[n];
    if (n > 0 && slice.file != stack.slices[n - 1].file) type = pixels.load_next();
    convert(type, /*swap=*/false, pixels.frame(slice.frame), 1, slice.slope, slice.intercept,
            values.data(), n_pixels);
    builder.append_slice(values);
  }
  return builder.finish();
}

std::vector<DicomSeries> series_in(const std::string& folder) {
  const SilenceGdcm silence;
  int n_skipped = 0;
  return described(read_folder(folder, folder, n_skipped));
}

bool is_image(const std::string& path) {
  const SilenceGdcm silence;
  const auto header = read_header(path);
  return header && !header->is_segmentation;
}

}  // namespace

extern "C" {
Volume (*const surf_read_dicom)(const std::string&, const ReadOptions&) = read_dicom;
bool (*const surf_is_dicom_image)(const std::string&) = is_image;
std::vector<DicomSeries> (*const surf_dicom_series)(const std::string&) = series_in;
}

}  // namespace surf::volume
