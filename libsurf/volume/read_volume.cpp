#include "libsurf/volume/read_volume.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <filesystem>

#include "libsurf/base/detail/late_library.h"
#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/volume/detail/byte_stream.h"
#include "libsurf/volume/detail/read_dicom.h"
#include "libsurf/volume/detail/read_metaimage.h"
#include "libsurf/volume/detail/read_nifti.h"
#include "libsurf/volume/detail/read_nrrd.h"
#include "libsurf/volume/detail/read_vdb.h"
#include "libsurf/volume/detail/read_vti.h"

namespace surf::volume {
namespace {

using Reader = Volume (*)(const std::string&, const ReadOptions&);

constexpr const char* kFormats =
    "surfseg reads NIfTI, MetaImage, NRRD, DICOM, VTI and OpenVDB volumes";

/// The file's first bytes, inflated if it is gzip.
std::string first_bytes(const std::string& path) {
  constexpr std::size_t kEnough = 1024;
  std::string bytes(kEnough, '\0');
  ByteStream stream(path, 0, ByteStream::Encoding::kDetect);
  bytes.resize(stream.read_some(bytes.data(), bytes.size()));
  return bytes;
}

bool has_at(const std::string& bytes, std::size_t place, const std::string& magic) {
  return bytes.size() >= place + magic.size() && bytes.compare(place, magic.size(), magic) == 0;
}

/// NIfTI and Analyze begin with the size of their header, in either byte order.
bool is_nifti(const std::string& bytes) {
  for (const char* size : {"\x5c\x01\0\0", "\0\0\x01\x5c", "\x1c\x02\0\0", "\0\0\x02\x1c"})
    if (has_at(bytes, 0, std::string(size, 4))) return true;
  return false;
}

bool is_metaimage(const std::string& bytes) {
  return bytes.find('\0') > 40 && (bytes.find("ObjectType") < 200 || bytes.find("NDims") < 200) &&
         bytes.find('=') != std::string::npos;
}

Volume read_dicom(const std::string& path, const ReadOptions& options) {
  return SURF_LATE(surf_dicom, surf_read_dicom)(path, options);
}

Volume read_vti(const std::string& path, const ReadOptions& options) {
  return SURF_LATE(surf_vtk, surf_read_vti)(path, options);
}

Volume read_vdb(const std::string& path, const ReadOptions& options) {
  return SURF_LATE(surf_vdb, surf_read_vdb)(path, options);
}

Reader by_content(const std::string& bytes) {
  if (has_at(bytes, 0, "NRRD")) return read_nrrd;
  if (has_at(bytes, 128, "DICM")) return read_dicom;
  if (has_at(bytes, 0, " BDV")) return read_vdb;
  if (is_nifti(bytes)) return read_nifti;
  if (bytes.find("<VTKFile") != std::string::npos) return read_vti;
  if (is_metaimage(bytes)) return read_metaimage;
  return nullptr;
}

/// For broken files, whose reader knows best what to say, and the data halves of pairs.
Reader by_extension(const std::string& path) {
  const std::string ending = extension(path);
  if (ending == ".nii" || ending == ".nii.gz" || ending == ".hdr" || ending == ".img")
    return read_nifti;
  if (ending == ".mha" || ending == ".mhd") return read_metaimage;
  if (ending == ".nrrd" || ending == ".nhdr") return read_nrrd;
  if (ending == ".dcm" || ending == ".ima") return read_dicom;
  if (ending == ".vti") return read_vti;
  if (ending == ".vdb") return read_vdb;
  return nullptr;
}

Reader reader_of(const std::string& path) {
  std::error_code status;
  if (std::filesystem::is_directory(path, status)) return read_dicom;
  const std::string bytes = first_bytes(path);
  if (bytes.empty()) throw InputError(fmt::format("{}: is empty; get the file again", path));
  const bool may_be_half = path.ends_with(".img") || path.ends_with(".img.gz");
  if (const Reader reader = by_content(bytes); reader && (!may_be_half || reader == read_dicom))
    return reader;
  if (path.ends_with(".img.gz") || path.ends_with(".hdr.gz")) return read_nifti;
  if (const Reader reader = by_extension(path)) return reader;
  throw NotAVolume(fmt::format("{}: not a volume; {}", path, kFormats));
}

/// A folder stands for all files in it.
std::vector<std::string> files_and_folders(const std::string& path) {
  const Reader reader = reader_of(path);
  if (reader == read_nifti) return nifti_files(path);
  if (reader == read_metaimage) return metaimage_files(path);
  if (reader == read_nrrd) return nrrd_files(path);
  std::error_code status;
  if (reader != read_dicom || std::filesystem::is_directory(path, status)) return {path};
  if (!is_dicom_image(path)) return {path};  // a segmentation, which is no slice of anything
  const std::string folder = std::filesystem::path(path).parent_path().string();
  return {folder.empty() ? "." : folder};
}

}  // namespace

Volume read_volume(const std::string& path, const ReadOptions& options) {
  const Reader reader = reader_of(path);
  if (options.series_uid && reader != read_dicom)
    throw UsageError(
        fmt::format("ReadOptions::series_uid: {} is no DICOM image, which alone has series", path));
  return reader(path, options);
}

std::vector<std::string> volume_files(const std::string& path) {
  std::vector<std::string> out;
  for (const std::string& named : files_and_folders(path)) {
    std::error_code status;
    if (!std::filesystem::is_directory(named, status)) {
      out.push_back(named);
      continue;
    }
    const std::vector<std::string> files = files_in(named);
    out.insert(out.end(), files.begin(), files.end());
  }
  return out;
}

bool is_dicom_image(const std::string& path) {
  return SURF_LATE(surf_dicom, surf_is_dicom_image)(path);
}

std::vector<DicomSeries> dicom_series(const std::string& folder) {
  return SURF_LATE(surf_dicom, surf_dicom_series)(folder);
}

}  // namespace surf::volume
