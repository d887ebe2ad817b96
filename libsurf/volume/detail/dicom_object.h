// What DICOM objects that are made of a series have in common; within the library surf_dicom.
#pragma once

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dctk.h>

#include <string>
#include <vector>

#include "libsurf/volume/dicom_origin.h"

namespace surf::volume {

/// @throws OutputError  "path: not written: what (DCMTK's reason)" if it is bad
void check_dcmtk(const OFCondition& status, const std::string& path, const std::string& what);

/// Silences DCMTK's log, and makes sure that it knows its attributes.
/// @throws OutputError  its dictionary is not installed
void prepare_dcmtk(const std::string& path);

/// Patient, study and frame of reference of the series, in its character set, or in UTF-8 if `text`
/// is not ASCII.
/// @param text  that will stand beside them, in UTF-8
void insert_origin(DcmDataset& data, const DicomOrigin& origin, const std::string& text,
                   const std::string& path);

/// Of a new series of the same study with one instance.
struct NewSeries {
  std::string modality, description;
  /// Digits that tell this object from others: with the time of day, all its UIDs follow from them,
  /// so that the same object has the same bytes if SOURCE_DATE_EPOCH says what time it is.
  std::string content_hash;
};

/// Series, instance, dates, equipment, and which images it was made of.
/// @param images  without doubles
void insert_series(DcmDataset& data, const DicomOrigin& origin, const NewSeries& series,
                   const std::vector<DicomImage>& images);

/// One item of a code sequence.
void insert_code(DcmItem& data, const DcmTagKey& sequence, const char* value, const char* scheme,
                 const char* meaning);

/// As DICOM's decimal strings: the shortest digits that give the number again, in 16 characters.
std::string decimal_string(double value);

/// Text for a value of at most 64 characters: no control characters, no backslash.
std::string long_string(const std::string& utf8);

/// "2.25." and the number of a UUID that follows from the text.
std::string uid_of(const std::string& text);

/// The bytes of a file with this data set, explicit VR, little endian.
std::string dicom_bytes(DcmDataset& data, const std::string& path);

}  // namespace surf::volume
