#include "libsurf/volume/detail/dicom_structure.h"

#include <fmt/format.h>

#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <string_view>
#include <utility>

#include "libsurf/base/error.h"

namespace surf::volume {
namespace {

constexpr std::uint32_t kUndefined = 0xffffffff;
constexpr std::uint32_t kItem = 0xfffee000, kItemEnd = 0xfffee00d, kSequenceEnd = 0xfffee0dd;
constexpr std::uint32_t kTransferSyntax = 0x00020010, kPixelData = 0x7fe00010;
constexpr int kDeepest = 16;  // sequences in sequences

/// Thrown and caught here: the file ends, or an element is none.
struct Cut {};

/// Whether the two letters are one of such pairs with a blank between them.
bool is_one_of(std::string_view types, std::string_view vr) {
  const std::size_t at = types.find(vr);
  return at != std::string_view::npos && at % 3 == 0;
}

struct Element {
  std::uint32_t tag = 0, length = 0;
  std::string vr;  ///< "" if implicit
};

class Walker {
 public:
  explicit Walker(const std::string& path)
      : file_(path, std::ios::binary), n_left_(std::filesystem::file_size(path)) {
    if (!file_) throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(errno)));
  }

  DicomFile walk() {
    if (!begin()) return out_;
    try {
      read_meta();
      out_.structure = read_data();
    } catch (const Cut&) {
      out_.structure = DicomStructure::kCut;
    }
    return out_;
  }

 private:
  /// Stands at the first element; false if there is none.
  bool begin() {
    char preamble[132] = {};
    if (n_left_ >= sizeof preamble) file_.read(preamble, sizeof preamble);
    if (std::memcmp(preamble + 128, "DICM", 4) == 0) {
      n_left_ -= sizeof preamble;
      return true;
    }
    // Files of before the standard begin with group 8.
    if (std::memcmp(preamble, "\x08\0", 2) != 0) return false;
    file_.seekg(0);
    is_explicit_ = std::isupper(static_cast<unsigned char>(preamble[4])) != 0;
    return true;
  }

  void read_meta() {
    while (n_left_ > 0 && group() == 2) {
      const Element element = read_element(/*is_explicit=*/true, /*is_big=*/false);
      const std::string value = take(element.length);
      if (element.tag == kTransferSyntax) set_syntax(value.substr(0, value.find('\0')));
    }
  }

  void set_syntax(std::string_view uid) {
    while (uid.ends_with(' ')) uid.remove_suffix(1);
    if (uid == "1.2.840.10008.1.2.1.99") throw Cut();  // all deflated: GDCM would have to inflate
    is_explicit_ = uid != "1.2.840.10008.1.2";
    is_big_ = uid == "1.2.840.10008.1.2.2";
  }

  DicomStructure read_data() {
    std::uint32_t previous = 0;
    bool has_pixels = false;
    while (n_left_ > 0) {
      const Element element = read_element(is_explicit_, is_big_);
      if (element.tag <= previous) throw Cut();  // tags ascend
      previous = element.tag;
      skip_value(element, 0);
      has_pixels |= element.tag == kPixelData;
    }
    return has_pixels ? DicomStructure::kImage : DicomStructure::kNone;
  }

  void skip_value(const Element& element, int depth) {
    if (element.length != kUndefined) {
      if (element.tag == kPixelData) out_.n_pixel_bytes = element.length;
      skip(element.length);
    } else if (element.tag == kPixelData) {
      skip_fragments();
    } else if (element.vr == "UN") {
      // Made of what was implicit and is not known to who has made it (PS3.5, 6.2.2), whatever the
      // syntax of the rest.
      const bool is_explicit = std::exchange(is_explicit_, false);
      const bool is_big = std::exchange(is_big_, false);
      skip_items(depth);
      is_explicit_ = is_explicit;
      is_big_ = is_big;
    } else {
      skip_items(depth);
    }
  }

  void skip_items(int depth) {
    if (depth == kDeepest) throw Cut();
    for (;;) {
      const Element item = read_element(/*is_explicit=*/false, is_big_);
      if (item.tag == kSequenceEnd) return;
      if (item.tag != kItem) throw Cut();
      if (item.length != kUndefined) {
        skip(item.length);
        continue;
      }
      for (;;) {
        const Element element = read_element(is_explicit_, is_big_);
        if (element.tag == kItemEnd) break;
        skip_value(element, depth + 1);
      }
    }
  }

  void skip_fragments() {
    out_.is_compressed = true;
    for (;;) {
      const Element item = read_element(/*is_explicit=*/false, is_big_);
      if (item.tag == kSequenceEnd) return;
      if (item.tag != kItem || item.length == kUndefined) throw Cut();
      skip(item.length);
      out_.n_pixel_bytes += item.length;
    }
  }

  Element read_element(bool is_explicit, bool is_big) {
    Element element;
    const std::uint32_t high = number(2, is_big), low = number(2, is_big);
    element.tag = high << 16 | low;
    // Items have no type, whatever the syntax.
    if (!is_explicit || high == 0xfffe) {
      element.length = number(4, is_big);
      const bool is_end = element.tag == kItemEnd || element.tag == kSequenceEnd;
      if (is_end && element.length != 0) throw Cut();  // GDCM makes room for it
      return element;
    }
    constexpr std::string_view kShort =
        "AE AS AT CS DA DS DT FL FD IS LO LT PN SH SL SS ST TM UI UL US";
    constexpr std::string_view kLong = "OB OD OF OL OV OW SQ SV UC UN UR UT UV";
    element.vr = take(2);
    if (is_one_of(kShort, element.vr)) {
      element.length = number(2, is_big);
    } else if (is_one_of(kLong, element.vr)) {
      skip(2);
      element.length = number(4, is_big);
    } else {
      throw Cut();
    }
    return element;
  }

  std::uint32_t group() {
    char bytes[2];
    const auto place = file_.tellg();
    if (n_left_ < sizeof bytes || !file_.read(bytes, sizeof bytes)) throw Cut();
    file_.seekg(place);
    return static_cast<unsigned char>(bytes[0]) | static_cast<unsigned char>(bytes[1]) << 8;
  }

  std::uint32_t number(int n_bytes, bool is_big) {
    const std::string bytes = take(n_bytes);
    std::uint32_t result = 0;
    for (int n = 0; n < n_bytes; ++n)
      result = result << 8 | static_cast<unsigned char>(bytes[is_big ? n : n_bytes - 1 - n]);
    return result;
  }

  std::string take(std::uint32_t n_bytes) {
    if (n_bytes > n_left_) throw Cut();
    std::string bytes(n_bytes, '\0');
    if (!file_.read(bytes.data(), n_bytes)) throw Cut();
    n_left_ -= n_bytes;
    return bytes;
  }

  void skip(std::uint32_t n_bytes) {
    if (n_bytes > n_left_) throw Cut();
    file_.seekg(n_bytes, std::ios::cur);
    n_left_ -= n_bytes;
  }

  std::ifstream file_;
  std::uintmax_t n_left_;
  DicomFile out_;
  bool is_explicit_ = false, is_big_ = false;
};

}  // namespace

DicomFile dicom_structure(const std::string& path) { return Walker(path).walk(); }

}  // namespace surf::volume
