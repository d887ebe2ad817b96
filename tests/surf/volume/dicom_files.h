// DICOM files written for tests: one slice per file, or frames of an enhanced object.
#pragma once

#include <fmt/format.h>
#include <gdcmImageChangeTransferSyntax.h>
#include <gdcmImageReader.h>
#include <gdcmImageWriter.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmWriter.h>

#include <cstdint>
#include <string>
#include <vector>

#include "tests/surf/volume/files.h"

namespace surf::volume {

struct ImageFile {
  int rows = 0, columns = 0;
  std::vector<Eigen::Vector3d> positions_lps;  ///< one per frame
  Eigen::Vector3d along_row, along_column;     ///< LPS
  double pixel_width = 1, pixel_height = 1;
  std::string slope = "1", intercept = "0";
  std::string series = "1.2.3.4";
  std::string instance = "1";
  std::vector<std::int16_t> pixels;
};

inline void set(gdcm::DataSet& data, const gdcm::Tag& tag, gdcm::VR vr, const std::string& value) {
  gdcm::DataElement element(tag);
  element.SetVR(vr);
  std::string even = value;
  if (even.size() % 2 != 0) even += vr == gdcm::VR::UI ? '\0' : ' ';
  element.SetByteValue(even.data(), static_cast<std::uint32_t>(even.size()));
  data.Replace(element);
}

inline void set_short(gdcm::DataSet& data, const gdcm::Tag& tag, int value) {
  set(data, tag, gdcm::VR::US, raw_bytes(std::vector<std::uint16_t>{std::uint16_t(value)}));
}

inline std::string text(const Eigen::Vector3d& v) {
  return fmt::format("{:.8g}\\{:.8g}\\{:.8g}", v[0], v[1], v[2]);
}

inline std::string little_endian(std::uint32_t value, int n_bytes) {
  std::string out;
  for (int n = 0; n < n_bytes; ++n) out += static_cast<char>(value >> 8 * n & 0xff);
  return out;
}

/// An element as implicit syntax has it.
inline std::string implicit_bytes(const gdcm::Tag& tag, const std::string& value) {
  return little_endian(tag.GetGroup(), 2) + little_endian(tag.GetElement(), 2) +
         little_endian(std::uint32_t(value.size()), 4) + value;
}

/// How sequences are written: with types and delimiters, or with neither, but lengths.
enum class Syntax { kExplicit, kImplicit };

/// A sequence with these items.
inline void set_items(gdcm::DataSet& data, const gdcm::Tag& tag,
                      const std::vector<gdcm::DataSet>& items, Syntax syntax) {
  if (syntax == Syntax::kImplicit) {
    std::string bytes;
    for (const gdcm::DataSet& nested : items) {
      std::string elements;
      for (const gdcm::DataElement& each : nested.GetDES())
        elements += implicit_bytes(
            each.GetTag(), {each.GetByteValue()->GetPointer(), each.GetByteValue()->GetLength()});
      bytes += implicit_bytes({0xfffe, 0xe000}, elements);
    }
    return set(data, tag, gdcm::VR::SQ, bytes);
  }
  auto sequence = gdcm::SequenceOfItems::New();
  sequence->SetLengthToUndefined();
  for (const gdcm::DataSet& nested : items) {
    gdcm::Item item;
    item.SetVLToUndefined();
    item.SetNestedDataSet(nested);
    sequence->AddItem(item);
  }
  gdcm::DataElement element(tag);
  element.SetVR(gdcm::VR::SQ);
  element.SetValue(*sequence);
  element.SetVLToUndefined();
  data.Replace(element);
}

inline void set_pixels(gdcm::DataSet& data, const ImageFile& image) {
  set_short(data, {0x0028, 0x0002}, 1);
  set(data, {0x0028, 0x0004}, gdcm::VR::CS, "MONOCHROME2");
  set_short(data, {0x0028, 0x0010}, image.rows);
  set_short(data, {0x0028, 0x0011}, image.columns);
  set_short(data, {0x0028, 0x0100}, 16);
  set_short(data, {0x0028, 0x0101}, 16);
  set_short(data, {0x0028, 0x0102}, 15);
  set_short(data, {0x0028, 0x0103}, 1);
  set(data, {0x7fe0, 0x0010}, gdcm::VR::OW, raw_bytes(image.pixels));
}

inline void set_identity(gdcm::DataSet& data, const ImageFile& image, const char* sop_class) {
  set(data, {0x0008, 0x0016}, gdcm::VR::UI, sop_class);
  set(data, {0x0008, 0x0018}, gdcm::VR::UI, image.series + "." + image.instance);
  set(data, {0x0008, 0x0060}, gdcm::VR::CS, "CT");
  set(data, {0x0008, 0x103e}, gdcm::VR::LO, "phantom");
  set(data, {0x0020, 0x000d}, gdcm::VR::UI, "1.2.3");
  set(data, {0x0020, 0x000e}, gdcm::VR::UI, image.series);
}

inline void save(gdcm::Writer& writer, const std::string& file, Syntax syntax = Syntax::kExplicit) {
  writer.GetFile().GetHeader().SetDataSetTransferSyntax(
      syntax == Syntax::kExplicit ? gdcm::TransferSyntax::ExplicitVRLittleEndian
                                  : gdcm::TransferSyntax::ImplicitVRLittleEndian);
  writer.SetFileName(file.c_str());
  ASSERT_TRUE(writer.Write()) << file;
}

inline std::string spacing_text(const ImageFile& image) {
  return fmt::format("{:.8g}\\{:.8g}", image.pixel_height, image.pixel_width);
}

/// A classic CT slice, Explicit VR Little Endian.
inline void write_slice(const std::string& file, const ImageFile& image) {
  gdcm::Writer writer;
  gdcm::DataSet& data = writer.GetFile().GetDataSet();
  set_identity(data, image, "1.2.840.10008.5.1.4.1.1.2");
  set(data, {0x0020, 0x0032}, gdcm::VR::DS, text(image.positions_lps[0]));
  set(data, {0x0020, 0x0037}, gdcm::VR::DS,
      text(image.along_row) + "\\" + text(image.along_column));
  set(data, {0x0028, 0x0030}, gdcm::VR::DS, spacing_text(image));
  set(data, {0x0028, 0x1052}, gdcm::VR::DS, image.intercept);
  set(data, {0x0028, 0x1053}, gdcm::VR::DS, image.slope);
  set_pixels(data, image);
  save(writer, file);
}

/// An enhanced CT with one frame per position.
inline void write_enhanced(const std::string& file, const ImageFile& image, bool has_places,
                           Syntax syntax = Syntax::kExplicit) {
  using gdcm::DataSet;
  gdcm::Writer writer;
  DataSet& data = writer.GetFile().GetDataSet();
  set_identity(data, image, "1.2.840.10008.5.1.4.1.1.2.1");
  set(data, {0x0028, 0x0008}, gdcm::VR::IS, std::to_string(image.positions_lps.size()));
  set_pixels(data, image);
  if (has_places) {
    DataSet orientation, measures, values, shared;
    set(orientation, {0x0020, 0x0037}, gdcm::VR::DS,
        text(image.along_row) + "\\" + text(image.along_column));
    set(measures, {0x0028, 0x0030}, gdcm::VR::DS, spacing_text(image));
    set(values, {0x0028, 0x1052}, gdcm::VR::DS, image.intercept);
    set(values, {0x0028, 0x1053}, gdcm::VR::DS, image.slope);
    set_items(shared, {0x0020, 0x9116}, {orientation}, syntax);
    set_items(shared, {0x0028, 0x9110}, {measures}, syntax);
    set_items(shared, {0x0028, 0x9145}, {values}, syntax);
    set_items(data, {0x5200, 0x9229}, {shared}, syntax);
    std::vector<DataSet> frames;
    for (const Eigen::Vector3d& position : image.positions_lps) {
      DataSet plane, frame;
      set(plane, {0x0020, 0x0032}, gdcm::VR::DS, text(position));
      set_items(frame, {0x0020, 0x9113}, {plane}, syntax);
      frames.push_back(frame);
    }
    set_items(data, {0x5200, 0x9230}, frames, syntax);
  }
  save(writer, file, syntax);
}

/// A binary DICOM Segmentation of three frames.
inline void write_segmentation(const std::string& file, const Grid& grid,
                               const std::string& series) {
  gdcm::Writer writer;
  gdcm::DataSet& data = writer.GetFile().GetDataSet();
  ImageFile image;
  image.columns = grid.size[0];
  image.rows = grid.size[1];
  image.series = series;
  set_identity(data, image, "1.2.840.10008.5.1.4.1.1.66.4");
  set_pixels(data, image);
  set(data, {0x0028, 0x0008}, gdcm::VR::IS, "3");
  set_short(data, {0x0028, 0x0100}, 1);
  set_short(data, {0x0028, 0x0101}, 1);
  set_short(data, {0x0028, 0x0102}, 0);
  set_short(data, {0x0028, 0x0103}, 0);
  set(data, {0x7fe0, 0x0010}, gdcm::VR::OB,
      std::string((3 * std::size_t(image.rows) * image.columns + 7) / 8, '\x55'));
  save(writer, file);
}

/// The file again, in another transfer syntax.
inline void compress(const std::string& file, gdcm::TransferSyntax::TSType syntax) {
  gdcm::ImageReader reader;
  reader.SetFileName(file.c_str());
  ASSERT_TRUE(reader.Read());
  gdcm::ImageChangeTransferSyntax change;
  change.SetTransferSyntax(syntax);
  change.SetInput(reader.GetImage());
  ASSERT_TRUE(change.Change());
  gdcm::ImageWriter writer;
  writer.SetFile(reader.GetFile());
  writer.SetImage(change.GetOutput());
  writer.SetFileName(file.c_str());
  ASSERT_TRUE(writer.Write());
}

/// What slice k of a grid is as DICOM: LPS, the normal's sign as the grid has it.
inline ImageFile slice_of(const Grid& grid, int k) {
  const Eigen::Affine3d lps = Eigen::Scaling(-1.0, -1.0, 1.0) * grid.index_to_world;
  ImageFile image;
  image.columns = grid.size[0];
  image.rows = grid.size[1];
  image.positions_lps = {lps * Eigen::Vector3d(0, 0, k)};
  image.pixel_width = lps.linear().col(0).norm();
  image.pixel_height = lps.linear().col(1).norm();
  image.along_row = lps.linear().col(0) / image.pixel_width;
  image.along_column = lps.linear().col(1) / image.pixel_height;
  image.instance = std::to_string(k + 1);
  for (int j = 0; j < grid.size[1]; ++j)
    for (int i = 0; i < grid.size[0]; ++i)
      image.pixels.push_back(static_cast<std::int16_t>(value_at(i, j, k) - 1000));
  return image;
}

/// Writes the slices under names whose order is not that of their positions.
inline std::vector<std::string> write_series(const std::string& folder, const Grid& grid,
                                             const std::string& series = "1.2.3.4") {
  std::filesystem::create_directories(folder);
  std::vector<std::string> files;
  for (int k = 0; k < grid.size[2]; ++k) {
    ImageFile image = slice_of(grid, k);
    image.series = series;
    // Slopes differ from slice to slice, as in PET.
    image.slope = k % 2 == 0 ? "2" : "0.5";
    image.intercept = "2000";
    for (auto& pixel : image.pixels)
      pixel = static_cast<std::int16_t>(pixel * (k % 2 == 0 ? 1 : 4));
    files.push_back(fmt::format("{}/i{:02}-{}.dcm", folder, (7 * k + 3) % 20, series.back()));
    write_slice(files.back(), image);
  }
  return files;
}

}  // namespace surf::volume
