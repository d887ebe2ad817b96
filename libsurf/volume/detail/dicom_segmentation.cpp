#include "libsurf/volume/detail/dicom_segmentation.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmfg/fgderimg.h>
#include <dcmtk/dcmfg/fgfracon.h>
#include <dcmtk/dcmfg/fgpixmsr.h>
#include <dcmtk/dcmfg/fgplanor.h>
#include <dcmtk/dcmfg/fgplanpo.h>
#include <dcmtk/dcmiod/cielabutil.h>
#include <dcmtk/dcmseg/segdoc.h>
#include <dcmtk/dcmseg/segment.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <limits>
#include <map>
#include <memory>

#include "libsurf/base/content_hash.h"
#include "libsurf/base/error.h"
#include "libsurf/volume/detail/dicom_object.h"

// DCMTK's strings are those of C++ in some builds of it, Debian's among them.
// NOLINTBEGIN(readability-redundant-string-cstr)
namespace surf::volume {
namespace {

std::string name_of(const LabelName& label) {
  const std::string name = long_string(label.name);
  return name.empty() ? fmt::format("Segment {}", label.label) : name;
}

/// Writes one segmentation; the functional groups are DICOM's words for what frames have.
class Writer {
 public:
  Writer(const std::string& path, const std::array<int, 3>& size, const DicomOrigin& origin,
         std::span<const std::uint8_t> labels, std::span<const LabelName> names)
      : path_(path), size_(size), origin_(origin), labels_(labels), names_(used(names, labels)) {}

  std::string bytes() {
    prepare_dcmtk(path_);
    find_slices();
    create();
    import_origin();
    add_shared_groups();
    add_dimensions();
    for (const LabelName& name : names_) add_segment(name);
    DcmDataset data;
    // They are as this class makes them; the check takes longer than all the rest.
    segmentation_->setCheckFGOnWrite(OFFalse);
    segmentation_->setCheckDimensionsOnWrite(OFFalse);
    check(segmentation_->writeDataset(data), "the segmentation");
    name_segments(data);
    put_in_as_they_are(data);
    insert_series(data, origin_, {"SEG", "surfseg", hash()}, images_);
    return dicom_bytes(data, path_);
  }

 private:
  /// Those that some voxel has: a segment has a frame at least.
  static std::vector<LabelName> used(std::span<const LabelName> names,
                                     std::span<const std::uint8_t> labels) {
    std::array<bool, 256> is_there{};
    for (const std::uint8_t label : labels) is_there[label] = true;
    std::vector<LabelName> out;
    std::copy_if(names.begin(), names.end(), std::back_inserter(out),
                 [&](const LabelName& name) { return is_there[name.label]; });
    return out;
  }

  void check(const OFCondition& status, const std::string& what) const {
    check_dcmtk(status, path_, what);
  }

  std::span<const std::uint8_t> slice(int k) const {
    const std::size_t n = std::size_t(size_[0]) * size_[1];
    return labels_.subspan(k * n, n);
  }

  bool is_in(int k, std::uint8_t label) const {
    const auto values = slice(k);
    return std::find(values.begin(), values.end(), label) != values.end();
  }

  /// Slices with a segment, numbered from 1, and the images that they were made of.
  void find_slices() {
    for (int k = 0; k < size_[2]; ++k) {
      if (std::none_of(names_.begin(), names_.end(),
                       [&](const LabelName& name) { return is_in(k, name.label); }))
        continue;
      place_.emplace(k, int(place_.size()) + 1);
      const DicomImage& image = origin_.images[std::size_t(k)];
      if (images_.empty() || images_.back().sop_instance_uid != image.sop_instance_uid)
        images_.push_back(image);
    }
    if (place_.empty())
      throw OutputError(fmt::format("{}: not written: no voxel's centre is inside", path_));
  }

  void create() {
    constexpr int kMost = std::numeric_limits<Uint16>::max();
    if (size_[0] > kMost || size_[1] > kMost)
      throw OutputError(
          fmt::format("{}: not written: DICOM has at most {} columns and rows", path_, kMost));
    DcmSegmentation* made = nullptr;
    check(DcmSegmentation::createBinarySegmentation(
              made, Uint16(size_[1]), Uint16(size_[0]),
              IODGeneralEquipmentModule::EquipmentInfo("surfseg", "surfseg", "0", SURFSEG_VERSION),
              ContentIdentificationMacro("1", "SEGMENTATION", "surfaces as voxels", "surfseg")),
          "the segmentation");
    segmentation_.reset(made);
  }

  void import_origin() {
    std::string all_names;
    for (const LabelName& name : names_) all_names += name.name;
    insert_origin(own_, origin_, all_names, path_);
    DcmDataset data;
    for (unsigned long n = 0; n < own_.card(); ++n) {
      DcmElement* const element = own_.getElement(n);
      std::unique_ptr<DcmElement> copy(OFstatic_cast(DcmElement*, element->clone()));
      check(data.insert(copy.get(), OFTrue), "the scan's patient and study");
      DcmElement* const here = copy.release();     // insert() has taken it
      if (here->checkValue("1").good()) continue;  // in the character set, which comes first
      OFString value;
      here->getOFStringArray(value);
      check(here->putString(here->ident() == EVR_UI ? sound_uid(value.c_str()).c_str() : ""),
            "the scan's patient and study");
    }
    check(segmentation_->importFromSourceImage(data), "the scan's patient and study");
    check(segmentation_->getSeries().setSeriesNumber("1"), "a number");  // insert_series() has it
  }

  /// DCMTK makes no segmentation of values that DICOM does not allow, which many scans have:
  /// another UID stands for such a one meanwhile.
  std::string sound_uid(const std::string& uid) {
    DcmUniqueIdentifier element(DCM_StudyInstanceUID);
    element.putString(uid.c_str());
    if (element.checkValue("1").good()) return uid;
    const std::string out = uid_of("stands for " + uid);
    stand_ins_[out] = uid;
    return out;
  }

  /// Patient, study and UIDs of the scan, whether DICOM allows them or not.
  void put_in_as_they_are(DcmDataset& data) {
    DcmStack stack;
    while (!stand_ins_.empty() && data.nextObject(stack, OFTrue).good()) {
      if (stack.top()->ident() != EVR_UI) continue;
      auto* const element = OFstatic_cast(DcmElement*, stack.top());
      OFString uid;
      element->getOFStringArray(uid);
      if (const auto found = stand_ins_.find(uid.c_str()); found != stand_ins_.end())
        check(element->putString(found->second.c_str()), "a UID");
    }
    for (unsigned long n = 0; n < own_.card(); ++n) {
      std::unique_ptr<DcmElement> copy(OFstatic_cast(DcmElement*, own_.getElement(n)->clone()));
      check(data.insert(copy.get(), OFTrue), "the scan's patient and study");
      static_cast<void>(copy.release());
    }
  }

  void add_shared_groups() {
    const Eigen::Vector3d row = origin_.along_row_lps, column = origin_.along_column_lps;
    FGPlaneOrientationPatient orientation;
    check(orientation.setImageOrientationPatient(
              decimal_string(row[0]).c_str(), decimal_string(row[1]).c_str(),
              decimal_string(row[2]).c_str(), decimal_string(column[0]).c_str(),
              decimal_string(column[1]).c_str(), decimal_string(column[2]).c_str()),
          "ImageOrientationPatient");
    check(segmentation_->addForAllFrames(orientation), "ImageOrientationPatient");
    const Eigen::Vector3d step =
        (origin_.images.back().position_lps_mm - origin_.images.front().position_lps_mm) /
        double(origin_.images.size() - 1);
    // Across the slices: with a tilted gantry the first pixels are further apart than the slices.
    const std::string between = decimal_string(std::abs(step.dot(row.cross(column).normalized())));
    FGPixelMeasures measures;
    check(measures.setPixelSpacing((decimal_string(origin_.pixel_height_mm) + "\\" +
                                    decimal_string(origin_.pixel_width_mm))
                                       .c_str()),
          "PixelSpacing");
    check(measures.setSliceThickness(between.c_str()), "SliceThickness");
    check(measures.setSpacingBetweenSlices(between.c_str()), "SpacingBetweenSlices");
    check(segmentation_->addForAllFrames(measures), "the pixels' size");
  }

  void add_dimensions() {
    const std::string uid = uid_of("dimensions " + hash());
    auto& dimensions = segmentation_->getDimensions();
    check(dimensions.addDimensionIndex(DCM_ReferencedSegmentNumber, uid.c_str(),
                                       DCM_SegmentIdentificationSequence, "Segment"),
          "the frames' order");
    check(dimensions.addDimensionIndex(DCM_ImagePositionPatient, uid.c_str(),
                                       DCM_PlanePositionSequence, "Slice"),
          "the frames' order");
  }

  void add_segment(const LabelName& label) {
    DcmSegment* made = nullptr;
    // What Slicer calls a segment that nobody has named by its own terms.
    const CodeSequenceMacro tissue("85756007", "SCT", "Tissue");
    check(DcmSegment::create(made, "segment", tissue, tissue, DcmSegTypes::SAT_SEMIAUTOMATIC,
                             "surfseg"),
          "a segment");
    std::unique_ptr<DcmSegment> owned(made);
    double L = 0, a = 0, b = 0;
    IODCIELabUtil::rgb2DicomLab(L, a, b, label.colour[0] / 255.0, label.colour[1] / 255.0,
                                label.colour[2] / 255.0);
    const auto whole = [](double x) { return Uint16(std::lround(std::clamp(x, 0.0, 65535.0))); };
    check(owned->setRecommendedDisplayCIELabValue(whole(L), whole(a), whole(b)), "a colour");
    Uint16 number = 0;
    check(segmentation_->addSegment(owned.get(), number), "a segment");
    static_cast<void>(owned.release());  // addSegment() has taken it
    std::vector<Uint8> mask(slice(0).size());
    for (const auto& [k, place] : place_) {
      if (!is_in(k, label.label)) continue;
      std::transform(slice(k).begin(), slice(k).end(), mask.begin(),
                     [&](std::uint8_t value) { return Uint8(value == label.label); });
      add_frame(mask, number, k, place);
    }
  }

  /// Afterwards: DCMTK checks a segmentation's text as if it were ASCII whatever the character set.
  void name_segments(DcmDataset& data) const {
    for (std::size_t n = 0; n < names_.size(); ++n) {
      DcmItem* segment = nullptr;
      check(data.findAndGetSequenceItem(DCM_SegmentSequence, segment, long(n)), "a segment");
      check(segment->putAndInsertString(DCM_SegmentLabel, name_of(names_[n]).c_str()), "a name");
    }
  }

  void add_frame(std::vector<Uint8>& mask, Uint16 segment, int k, int place) {
    FGFrameContent content;
    check(content.setDimensionIndexValues(segment, 0), "a frame's order");
    check(content.setDimensionIndexValues(Uint32(place), 1), "a frame's order");
    const DicomImage& image = origin_.images[std::size_t(k)];
    const Eigen::Vector3d& at = image.position_lps_mm;
    FGPlanePosPatient position;
    check(position.setImagePositionPatient(decimal_string(at[0]).c_str(),
                                           decimal_string(at[1]).c_str(),
                                           decimal_string(at[2]).c_str()),
          "ImagePositionPatient");
    FGDerivationImage derivation;
    add_source(derivation, image);
    const OFVector<FGBase*> groups = [&] {
      OFVector<FGBase*> out;
      out.push_back(&content);
      out.push_back(&position);
      out.push_back(&derivation);
      return out;
    }();
    check(segmentation_->addFrame(mask.data(), segment, groups), "a frame");
  }

  void add_source(FGDerivationImage& derivation, const DicomImage& image) {
    DerivationImageItem* item = nullptr;
    check(derivation.addDerivationImageItem(CodeSequenceMacro("113076", "DCM", "Segmentation"), "",
                                            item),
          "a frame's derivation");
    auto source = std::make_unique<SourceImageItem>();
    check(source->getPurposeOfReferenceCode().set("121322", "DCM",
                                                  "Source image for image processing operation"),
          "a frame's derivation");
    auto& reference = source->getImageSOPInstanceReference();
    check(reference.setReferencedSOPClassUID(sound_uid(image.sop_class_uid).c_str()),
          "a SOPClassUID");
    check(reference.setReferencedSOPInstanceUID(sound_uid(image.sop_instance_uid).c_str()),
          "a SOPInstanceUID");
    if (image.frame > 0) {
      OFVector<Uint16> frames;
      frames.push_back(Uint16(image.frame));
      check(reference.setReferencedFrameNumber(frames), "a frame's number");
    }
    item->getSourceImageItems().push_back(source.release());
  }

  std::string hash() const {
    ContentHash hash;
    hash.add_bytes({reinterpret_cast<const char*>(labels_.data()), labels_.size()});
    for (const LabelName& name : names_)
      hash.add_bytes(fmt::format("{} {} {} {} {}\n", name.label, name.colour[0], name.colour[1],
                                 name.colour[2], name.name));
    return hash.digits();
  }

  const std::string& path_;
  const std::array<int, 3> size_;
  const DicomOrigin& origin_;
  std::span<const std::uint8_t> labels_;
  const std::vector<LabelName> names_;
  DcmDataset own_;                                ///< the scan's patient and study, as they are
  std::map<std::string, std::string> stand_ins_;  ///< for UIDs that DICOM does not allow, and these
  std::map<int, int> place_;                      ///< among the slices that are used, by k
  std::vector<DicomImage> images_;
  std::unique_ptr<DcmSegmentation> segmentation_;
};

std::string bytes_of(const std::string& path, const std::array<int, 3>& size,
                     const DicomOrigin& origin, std::span<const std::uint8_t> labels,
                     std::span<const LabelName> names) {
  return Writer(path, size, origin, labels, names).bytes();
}

}  // namespace

extern "C" {
std::string (*const surf_dicom_segmentation)(const std::string&, const std::array<int, 3>&,
                                             const DicomOrigin&, std::span<const std::uint8_t>,
                                             std::span<const LabelName>) = bytes_of;
}

}  // namespace surf::volume
// NOLINTEND(readability-redundant-string-cstr)
