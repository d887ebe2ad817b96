#include "libsurf/volume/detail/dicom_object.h"

#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/oflog/oflog.h>
#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <ctime>
#include <mutex>

#include "libsurf/base/content_hash.h"
#include "libsurf/base/error.h"

namespace surf::volume {
namespace {

constexpr const char* kUtf8 = "ISO_IR 192";
constexpr int kOwnSeriesNumbers = 1000;  // on top of the scan's, as other programs number results

bool is_ascii(const std::string& text) {
  return std::all_of(text.begin(), text.end(), [](unsigned char c) { return c < 128; });
}

struct DateAndTime {
  std::string date, time;  ///< as DICOM's DA and TM
};

/// Now; or what SOURCE_DATE_EPOCH says, in UTC, for files that have to be the same again.
DateAndTime date_and_time() {
  const char* given = std::getenv("SOURCE_DATE_EPOCH");
  const std::time_t now = given ? std::time_t(std::atoll(given)) : std::time(nullptr);
  std::tm parts = {};
  given ? ::gmtime_r(&now, &parts) : ::localtime_r(&now, &parts);
  char date[16], time[16];
  std::strftime(date, sizeof date, "%Y%m%d", &parts);
  std::strftime(time, sizeof time, "%H%M%S", &parts);
  return {date, time};
}

void insert(DcmItem& data, const DcmTagKey& tag, const std::string& value) {
  data.putAndInsertString(DcmTag(tag), value.c_str());
}

/// CommonInstanceReference: the scan's series and the images of it.
void insert_referenced_series(DcmDataset& data, const DicomOrigin& origin,
                              const std::vector<DicomImage>& images) {
  DcmItem* series = nullptr;
  data.findOrCreateSequenceItem(DCM_ReferencedSeriesSequence, series, 0);
  if (!series) throw OutputError("DICOM: the referenced series cannot be made");
  insert(*series, DCM_SeriesInstanceUID, origin.series_uid);
  for (std::size_t n = 0; n < images.size(); ++n) {
    DcmItem* image = nullptr;
    series->findOrCreateSequenceItem(DCM_ReferencedInstanceSequence, image, long(n));
    if (!image) throw OutputError("DICOM: a referenced image cannot be made");
    insert(*image, DCM_ReferencedSOPClassUID, images[n].sop_class_uid);
    insert(*image, DCM_ReferencedSOPInstanceUID, images[n].sop_instance_uid);
  }
}

}  // namespace

void check_dcmtk(const OFCondition& status, const std::string& path, const std::string& what) {
  if (status.bad())
    throw OutputError(fmt::format("{}: not written: {} ({})", path, what, status.text()));
}

void prepare_dcmtk(const std::string& path) {
  static std::once_flag once;
  std::call_once(once, [] { OFLog::configure(OFLogger::OFF_LOG_LEVEL); });
  if (!dcmDataDict.isDictionaryLoaded())
    throw OutputError(fmt::format("{}: not written: DCMTK's dictionary {} is not installed", path,
                                  DCM_DICT_DEFAULT_PATH));
}

void insert_origin(DcmDataset& data, const DicomOrigin& origin, const std::string& text,
                   const std::string& path) {
  for (const DicomAttribute& attribute : origin.attributes)
    check_dcmtk(data.putAndInsertString(DcmTag(attribute.group, attribute.element),
                                        attribute.value.c_str()),
                path, "the scan's patient and study");
  for (const DcmTagKey& tag :  // that every object has, if only empty (type 2)
       {DCM_PatientName, DCM_PatientID, DCM_PatientBirthDate, DCM_PatientSex, DCM_StudyDate,
        DCM_StudyTime, DCM_ReferringPhysicianName, DCM_StudyID, DCM_AccessionNumber,
        DCM_PositionReferenceIndicator})
    if (!data.tagExists(tag))
      check_dcmtk(data.insertEmptyElement(tag), path, "the patient and study");
  if (is_ascii(text)) return;
  const std::string charset = origin.value(0x0008, 0x0005);
  if (!charset.empty() && charset != kUtf8)
    check_dcmtk(data.convertToUTF8(), path, "the scan's text in UTF-8");
  insert(data, DCM_SpecificCharacterSet, kUtf8);
}

void insert_series(DcmDataset& data, const DicomOrigin& origin, const NewSeries& series,
                   const std::vector<DicomImage>& images) {
  const auto [date, time] = date_and_time();
  const std::string seed = series.content_hash + origin.series_uid + date + time;
  insert(data, DCM_SOPInstanceUID, uid_of("instance " + seed));
  insert(data, DCM_InstanceCreationDate, date);
  insert(data, DCM_InstanceCreationTime, time);
  insert(data, DCM_Modality, series.modality);
  insert(data, DCM_SeriesInstanceUID, uid_of("series " + seed));
  insert(data, DCM_SeriesNumber, std::to_string(kOwnSeriesNumbers + origin.series_number));
  insert(data, DCM_SeriesDescription, series.description);
  insert(data, DCM_SeriesDate, date);
  insert(data, DCM_SeriesTime, time);
  insert(data, DCM_InstanceNumber, "1");
  insert(data, DCM_ContentDate, date);
  insert(data, DCM_ContentTime, time);
  insert(data, DCM_Manufacturer, "surfseg");
  insert(data, DCM_ManufacturerModelName, "surfseg");
  insert(data, DCM_DeviceSerialNumber, "0");
  insert(data, DCM_SoftwareVersions, SURFSEG_VERSION);
  insert_referenced_series(data, origin, images);
}

void insert_code(DcmItem& data, const DcmTagKey& sequence, const char* value, const char* scheme,
                 const char* meaning) {
  DcmItem* item = nullptr;
  data.findOrCreateSequenceItem(DcmTag(sequence), item, 0);
  if (!item) throw OutputError("DICOM: a code cannot be made");
  insert(*item, DCM_CodeValue, value);
  insert(*item, DCM_CodingSchemeDesignator, scheme);
  insert(*item, DCM_CodeMeaning, meaning);
}

std::string decimal_string(double value) {
  constexpr int kMost = 16, kDigits = 17;
  char digits[32];
  if (value == 0) value = 0;  // no -0
  auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
  for (int precision = kDigits; end - digits > kMost; --precision)
    end =
        std::to_chars(digits, digits + sizeof digits, value, std::chars_format::general, precision)
            .ptr;
  return {digits, end};
}

std::string long_string(const std::string& utf8) {
  constexpr int kMost = 64;
  std::string out;
  int n = 0;
  for (const char c : utf8) {
    const bool begins = (static_cast<unsigned char>(c) & 0xc0) != 0x80;
    if (begins && ++n > kMost) break;
    if (static_cast<unsigned char>(c) >= ' ' && c != 0x7f) out += c == '\\' ? '/' : c;
  }
  return out;
}

std::string uid_of(const std::string& text) {
  ContentHash hash;
  hash.add_bytes(text);
  const std::string digits = hash.digits();
  __extension__ unsigned __int128 number = 0;
  for (int n = 0; n < 32; ++n)
    number = number << 4 | unsigned(std::stoi(digits.substr(std::size_t(n), 1), nullptr, 16));
  // Version 5 and variant of a UUID (RFC 4122): the name's hash.
  number = (number & ~(decltype(number)(0xf) << 76)) | decltype(number)(5) << 76;
  number = (number & ~(decltype(number)(3) << 62)) | decltype(number)(2) << 62;
  std::string decimal;
  for (; number > 0; number /= 10) decimal.insert(decimal.begin(), char('0' + int(number % 10)));
  return "2.25." + decimal;
}

std::string dicom_bytes(DcmDataset& data, const std::string& path) {
  constexpr E_TransferSyntax kSyntax = EXS_LittleEndianExplicit;
  DcmFileFormat file(&data);
  check_dcmtk(file.validateMetaInfo(kSyntax), path, "the file's header");
  std::string out(file.calcElementLength(kSyntax, EET_ExplicitLength) + 1024, '\0');
  DcmOutputBufferStream stream(out.data(), offile_off_t(out.size()));
  file.transferInit();
  const OFCondition status = file.write(stream, kSyntax, EET_ExplicitLength, nullptr);
  file.transferEnd();
  check_dcmtk(status, path, "the object");
  void* begin = nullptr;
  offile_off_t n_bytes = 0;
  stream.flushBuffer(begin, n_bytes);
  out.resize(std::size_t(n_bytes));
  return out;
}

}  // namespace surf::volume
