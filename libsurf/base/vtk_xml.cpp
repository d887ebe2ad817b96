#include "libsurf/base/vtk_xml.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/escaped.h"
#include "libsurf/base/memory.h"

namespace surf {
namespace {

constexpr std::string_view kBlank = " \t\r\n";

std::string_view without_blanks(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(kBlank), text.size()));
  return text;
}

/// The numbers of a text, up to the first word that is none.
std::vector<double> numbers(std::string_view text) {
  std::vector<double> out;
  for (text = without_blanks(text); !text.empty(); text = without_blanks(text)) {
    double value = 0;
    if (text[0] == '+') text.remove_prefix(1);  // as VTK takes it
    const auto [end, status] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (status != std::errc()) break;
    out.push_back(value);
    text.remove_prefix(std::size_t(end - text.data()));
  }
  return out;
}

/// Where the markup ends that begins there: of a tag its '>' that is in no attribute.
std::size_t end_of_tag(std::string_view content, std::size_t begin) {
  const std::string_view rest = content.substr(begin);
  for (const auto& [first, last] : {std::pair<std::string_view, std::string_view>{"<!--", "-->"},
                                    {"<![CDATA[", "]]>"},
                                    {"<?", "?>"}}) {
    if (!rest.starts_with(first)) continue;
    const std::size_t end = rest.find(last, first.size());
    return end == std::string_view::npos ? end : begin + end + last.size() - 1;
  }
  char quote = 0;
  for (std::size_t at = begin; at < content.size(); ++at) {
    if (quote != 0)
      quote = content[at] == quote ? 0 : quote;
    else if (content[at] == '"' || content[at] == '\'')
      quote = content[at];
    else if (content[at] == '>')
      return at;
  }
  return std::string_view::npos;
}

/// Whether a word is one number, with a sign at most before it.
bool is_number(std::string_view word) {
  if (word.starts_with('+')) word.remove_prefix(1);
  double value = 0;
  const auto [end, status] = std::from_chars(word.data(), word.data() + word.size(), value);
  return status == std::errc() && end == word.data() + word.size();
}

/// The first bytes of base64.
std::string decoded(std::string_view text, std::size_t n_bytes) {
  constexpr std::string_view kDigits =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  std::uint32_t bits = 0;
  int n_bits = 0;
  for (const char letter : text) {
    const std::size_t digit = kDigits.find(letter);
    if (digit == std::string_view::npos || out.size() == n_bytes) break;
    bits = bits << 6 | std::uint32_t(digit);
    n_bits += 6;
    if (n_bits < 8) continue;
    n_bits -= 8;
    out.push_back(char(bits >> n_bits));
  }
  return out;
}

class Checker {
 public:
  Checker(const std::string& path, std::string_view content) : path_(path), content_(content) {}

  void check() {
    for (std::size_t at = 0; (at = content_.find('<', at)) != std::string_view::npos;) {
      const std::size_t end = end_of_tag(content_, at);
      if (end == std::string_view::npos)
        throw InputError(
            fmt::format("{}: truncated or damaged: a tag does not end; get the file again", path_));
      const std::string_view tag = content_.substr(at + 1, end - at - 1);
      if (tag.starts_with("!DOCTYPE"))
        throw InputError(fmt::format("{}: damaged: VTK's files have no DOCTYPE", path_));
      if (tag.starts_with("AppendedData")) return check_appended(tag, end + 1);
      if (tag.starts_with("VTKFile")) read_kind(tag);
      check_counts(tag);
      check_field_data(tag);
      if (tag.starts_with("DataArray") || tag.starts_with("Array")) check_array(tag, end + 1);
      at = end;
    }
  }

 private:
  [[noreturn]] void fail(std::string_view what, double n) const {
    throw InputError(fmt::format(
        "{}: truncated or damaged: it promises {} of {:.4g}, the file has {} bytes; get "
        "the file again",
        path_, what, n, content_.size()));
  }

  void check_number(std::string_view what, double n) const {
    // Of four bytes each at least in memory, as text of one.
    if (!(n >= 0) || !is_borne_out(n, double(content_.size()))) fail(what, n);
  }

  static std::string_view attribute(std::string_view tag, std::string_view name) {
    for (std::size_t at = 0; (at = tag.find(name, at)) != std::string_view::npos; ++at) {
      const bool begins = at > 0 && kBlank.find(tag[at - 1]) != std::string_view::npos;
      std::string_view rest = without_blanks(tag.substr(at + name.size()));
      if (!begins || !rest.starts_with('=')) continue;
      rest = without_blanks(rest.substr(1));
      if (rest.empty() || (rest[0] != '"' && rest[0] != '\'')) continue;
      return rest.substr(1, std::max<std::size_t>(rest.find(rest[0], 1), 1) - 1);
    }
    return {};
  }

  /// All of an attribute: VTK reads on, in its own way, where this one does not.
  std::vector<double> counts(std::string_view tag, std::string_view name) const {
    const std::string_view text = attribute(tag, name);
    for (std::string_view rest = without_blanks(text); !rest.empty();) {
      const std::string_view word = rest.substr(0, rest.find_first_of(kBlank));
      if (!is_number(word))
        throw InputError(fmt::format("{}: damaged: {}=\"{}\" is no number; get the file again",
                                     path_, name, one_line(std::string(text))));
      rest = without_blanks(rest.substr(word.size()));
    }
    return numbers(text);
  }

  void read_kind(std::string_view tag) {
    n_word_ = attribute(tag, "header_type") == "UInt64" ? 8 : 4;
    is_big_ = attribute(tag, "byte_order") == "BigEndian";
    is_compressed_ = !attribute(tag, "compressor").empty();
  }

  void check_counts(std::string_view tag) {
    for (const std::string_view name :
         {"NumberOfPoints", "NumberOfVerts", "NumberOfLines", "NumberOfStrips", "NumberOfPolys",
          "NumberOfCells", "NumberOfTuples"})
      for (const double n : counts(tag, name)) {
        check_number(name, n);
        n_most_ = std::max(n_most_, n);
      }
    for (const std::string_view name : {"WholeExtent", "Extent"}) {
      const auto extent = counts(tag, name);
      if (extent.size() != 6) continue;
      double n = 1;
      for (int axis = 0; axis < 3; ++axis)
        n *= std::max(0.0, extent[2 * axis + 1] - extent[2 * axis] + 1);
      check_number(name, n);
      n_most_ = std::max(n_most_, n);
    }
    for (const double n : counts(tag, "NumberOfComponents"))
      check_number("components", n * std::max(1.0, n_most_));
  }

  /// What lies directly in field data are arrays of a known type: VTK 9.1 takes each for one
  /// without a look whether it is.
  void check_field_data(std::string_view tag) {
    if (tag.empty() || tag[0] == '?' || tag[0] == '!') return;
    if (tag[0] == '/') {
      depth_ = std::max(0, depth_ - 1);
      return;
    }
    if (depth_ == 1) {
      constexpr std::array<std::string_view, 12> kTypes = {"Int8",    "UInt8",   "Int16",  "UInt16",
                                                           "Int32",   "UInt32",  "Int64",  "UInt64",
                                                           "Float32", "Float64", "String", "Bit"};
      const std::string_view type = attribute(tag, "type");
      if (std::find(kTypes.begin(), kTypes.end(), type) == kTypes.end())
        throw InputError(fmt::format(
            "{}: damaged: its field data hold something without a type that VTK knows; get the "
            "file again, or leave its FieldData out",
            path_));
    }
    if ((depth_ > 0 || tag.starts_with("FieldData")) && !tag.ends_with('/')) ++depth_;
  }

  void check_array(std::string_view tag, std::size_t end) {
    const std::string_view format = attribute(tag, "format");
    if (format == "appended") {
      for (const double offset : counts(tag, "offset")) offsets_.push_back(offset);
    } else if (format == "binary" && is_compressed_) {
      check_blocks(without_blanks(content_.substr(end)), /*is_raw=*/false);
    }
  }

  void check_appended(std::string_view tag, std::size_t end) {
    if (!is_compressed_) return;
    std::string_view data = without_blanks(content_.substr(end));
    // VTK takes what follows for the data where this is missing.
    if (!data.starts_with('_'))
      throw InputError(fmt::format(
          "{}: damaged: its appended data do not begin with '_'; get the file again", path_));
    data.remove_prefix(1);
    const bool is_raw = attribute(tag, "encoding") == "raw";
    for (const double offset : offsets_) {
      if (!(offset >= 0 && offset < double(data.size()))) continue;
      check_blocks(data.substr(std::size_t(offset)), is_raw);
    }
  }

  /// The first words of data that are raw, or else base64; fewer if there are not so many.
  std::vector<double> words(std::string_view data, bool is_raw, std::size_t count) const {
    const std::string bytes =
        is_raw ? std::string(data.substr(0, count * n_word_)) : decoded(data, count * n_word_);
    std::vector<double> out(bytes.size() / n_word_, 0.0);
    for (std::size_t w = 0; w < out.size(); ++w)
      for (std::size_t n = 0; n < n_word_; ++n) {
        const std::size_t at = w * n_word_ + (is_big_ ? n : n_word_ - 1 - n);
        out[w] = 256 * out[w] + static_cast<unsigned char>(bytes[at]);
      }
    return out;
  }

  /// The number of blocks, the size of each, that of the last one, and how many bytes each is
  /// packed into.
  void check_blocks(std::string_view data, bool is_raw) {
    constexpr std::size_t kFixed = 3;
    const auto fixed = words(data, is_raw, kFixed);
    if (fixed.size() < kFixed) return;
    check_number("blocks", fixed[0]);
    // Room is made for all of a block, though the last one may be smaller.
    check_number("blocks", fixed[0] * fixed[1]);
    check_number("a last block", fixed[2]);
    check_number("a block", fixed[1]);
    const auto all = words(data, is_raw, kFixed + std::size_t(fixed[0]));
    n_words_ += double(all.size());  // of all arrays, so that none are looked at again and again
    if (n_words_ * double(n_word_) > double(content_.size())) fail("sizes of blocks", n_words_);
    for (std::size_t n = kFixed; n < all.size(); ++n)
      if (all[n] > double(content_.size())) fail("a packed block", all[n]);
  }

  const std::string& path_;
  std::string_view content_;
  std::size_t n_word_ = 4;
  bool is_big_ = false, is_compressed_ = false;
  double n_most_ = 0;
  int depth_ = 0;       // elements that are open, from field data on
  double n_words_ = 0;  ///< read from the heads of compressed data
  std::vector<double> offsets_;
};

}  // namespace

void check_vtk_xml(const std::string& path, std::string_view content) {
  Checker(path, content).check();
}

void check_vtk_xml_file(const std::string& path) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  struct stat status = {};
  void* bytes = MAP_FAILED;
  if (file >= 0 && ::fstat(file, &status) == 0 && status.st_size > 0)
    bytes = ::mmap(nullptr, std::size_t(status.st_size), PROT_READ, MAP_PRIVATE, file, 0);
  const int error = errno;
  if (file >= 0) ::close(file);
  if (bytes == MAP_FAILED)
    throw InputError(fmt::format("{}: cannot be read: {}", path, std::strerror(error)));
  const std::string_view content(static_cast<const char*>(bytes), std::size_t(status.st_size));
  try {
    check_vtk_xml(path, content);
  } catch (...) {
    ::munmap(bytes, content.size());
    throw;
  }
  ::munmap(bytes, content.size());
}

}  // namespace surf
