#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <memory>

#include "libsurf/base/names.h"
#include "libsurf/io/detail/surface_formats.h"

// VTK's reader of PLY keeps only floats and does not say where a file is broken.
namespace surf::io {
namespace {

enum class Type { kInt8, kUint8, kInt16, kUint16, kInt32, kUint32, kFloat32, kFloat64 };

std::optional<Type> type_of(std::string_view word) {
  using enum Type;
  return value_of<Type>(word, {{kInt8, "char"},
                               {kInt8, "int8"},
                               {kUint8, "uchar"},
                               {kUint8, "uint8"},
                               {kInt16, "short"},
                               {kInt16, "int16"},
                               {kUint16, "ushort"},
                               {kUint16, "uint16"},
                               {kInt32, "int"},
                               {kInt32, "int32"},
                               {kUint32, "uint"},
                               {kUint32, "uint32"},
                               {kFloat32, "float"},
                               {kFloat32, "float32"},
                               {kFloat64, "double"},
                               {kFloat64, "float64"}});
}

struct Property {
  std::string name;
  Type type;
  std::optional<Type> count;  // of a list
};

struct Element {
  std::string name;
  std::uint64_t n = 0;
  std::vector<Property> properties;

  std::optional<std::size_t> find(std::string_view property) const {
    for (std::size_t i = 0; i < properties.size(); ++i)
      if (properties[i].name == property) return i;
    return std::nullopt;
  }
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  std::optional<Space> space;
};

/// The values of the body one after the other, whatever their coding.
class Body {
 public:
  virtual ~Body() = default;
  /// Begins a row of an element; text bodies hold each on its own line.
  virtual void next_row() = 0;
  virtual double value(Type type) = 0;
  virtual std::size_t line() const = 0;  ///< 0 in a binary body
};

class TextBody : public Body {
 public:
  TextBody(const std::string& path, const Lines& lines) : path_(path), lines_(lines) {}

  void next_row() override {
    do {
      if (!lines_.next())
        throw InputError(
            fmt::format("{}:{}: truncated: the header states more rows", path_, lines_.number()));
    } while (lines_.line().find_first_not_of(" \t\r") == std::string_view::npos);
  }
  double value(Type) override {
    const std::string_view word = lines_.word();
    if (const auto number = to_number<double>(word)) return *number;
    throw InputError(
        fmt::format("{}:{}: expected a number; got '{}'", path_, lines_.number(), word));
  }
  std::size_t line() const override { return lines_.number(); }

 private:
  const std::string& path_;
  Lines lines_;
};

class BinaryBody : public Body {
 public:
  BinaryBody(const std::string& path, std::string_view bytes, bool is_big_endian)
      : path_(path), bytes_(bytes), is_swapped_(is_big_endian) {}

  void next_row() override {}
  double value(Type type) override {
    using Take = double (BinaryBody::*)();
    constexpr Take kOfTypes[] = {// in the order of Type
                                 &BinaryBody::take<std::int8_t>,  &BinaryBody::take<std::uint8_t>,
                                 &BinaryBody::take<std::int16_t>, &BinaryBody::take<std::uint16_t>,
                                 &BinaryBody::take<std::int32_t>, &BinaryBody::take<std::uint32_t>,
                                 &BinaryBody::take<float>,        &BinaryBody::take<double>};
    return (this->*kOfTypes[std::size_t(type)])();
  }
  std::size_t line() const override { return 0; }

 private:
  template <class T>
  double take() {
    static_assert(std::endian::native == std::endian::little);
    if (bytes_.size() < sizeof(T))
      throw InputError(fmt::format("{}: truncated: the header states more values", path_));
    char bytes[sizeof(T)];
    std::copy_n(bytes_.data(), sizeof(T), bytes);
    bytes_.remove_prefix(sizeof(T));
    if (is_swapped_) std::reverse(bytes, bytes + sizeof(T));
    T value;
    std::memcpy(&value, bytes, sizeof(T));
    return double(value);
  }

  const std::string& path_;
  std::string_view bytes_;
  bool is_swapped_;
};

class Reader {
 public:
  Reader(const std::string& path, const std::string& content) : path_(path), lines_(content) {}

  FileSurface read() {
    read_header();
    check_header();
    surface_.space = header_.space;
    if (header_.format == "ascii")
      body_ = std::make_unique<TextBody>(path_, lines_);
    else
      body_ =
          std::make_unique<BinaryBody>(path_, lines_.rest(), header_.format == "binary_big_endian");
    for (const Element& element : header_.elements) read_element(element);
    return std::move(surface_);
  }

 private:
  InputError error(const std::string& message) const {
    return InputError(fmt::format("{}:{}: {}", path_, lines_.number(), message));
  }

  void read_header() {
    if (!lines_.next() || lines_.word() != "ply")
      throw InputError(fmt::format("{}: not a PLY file: it does not begin with 'ply'", path_));
    for (;;) {
      if (!lines_.next()) throw error("truncated: no end_header");
      const std::string_view keyword = lines_.word();
      if (keyword == "end_header") return;
      if (keyword == "comment" && !header_.space)
        header_.space = stated_space(lines_.line(), path_);
      if (keyword == "format") header_.format = lines_.word();
      if (keyword == "element") read_element_line();
      if (keyword == "property") read_property_line();
    }
  }

  void read_element_line() {
    Element element;
    element.name = lines_.word();
    const std::string_view word = lines_.word();
    const auto n = to_number<std::uint64_t>(word);
    if (!n) throw error(fmt::format("expected a number of elements; got '{}'", word));
    element.n = *n;
    header_.elements.push_back(element);
  }

  Type read_type() {
    const std::string_view word = lines_.word();
    if (const auto type = type_of(word)) return *type;
    throw error(fmt::format("'{}' is not a type of PLY", word));
  }

  void read_property_line() {
    if (header_.elements.empty()) throw error("a property before the first element");
    Lines at_type = lines_;
    Property property;
    if (at_type.word() == "list") {
      lines_.word();
      property.count = read_type();
    }
    property.type = read_type();
    property.name = lines_.word();
    header_.elements.back().properties.push_back(property);
  }

  void check_header() const {
    if (header_.format != "ascii" && header_.format != "binary_little_endian" &&
        header_.format != "binary_big_endian")
      throw InputError(fmt::format("{}: format '{}' is not one of PLY", path_, header_.format));
    for (const Element& element : header_.elements) {
      if (element.n > 0 && element.properties.empty())
        throw InputError(fmt::format("{}: element {} has no properties", path_, element.name));
      if (element.name == "vertex")
        for (const char* axis : {"x", "y", "z"})
          if (const auto at = element.find(axis); !at || element.properties[*at].count)
            throw InputError(fmt::format("{}: vertices have no property {}", path_, axis));
    }
  }

  void read_element(const Element& element) {
    if (element.name == "tristrips" && element.n > 0)
      throw InputError(fmt::format("{}: triangle strips; save the surface as triangles", path_));
    const bool is_vertex = element.name == "vertex", is_face = element.name == "face";
    auto corners = element.find("vertex_indices");
    if (!corners) corners = element.find("vertex_index");
    if (is_face && element.n > 0 && (!corners || !element.properties[*corners].count))
      throw InputError(fmt::format("{}: faces have no list vertex_indices", path_));
    std::vector<std::pair<std::size_t, std::vector<double>*>> arrays;
    for (std::size_t at = 0; is_vertex && at < element.properties.size(); ++at)
      if (const Property& p = element.properties[at];
          !p.count && p.name != "x" && p.name != "y" && p.name != "z")
        arrays.emplace_back(at, &surface_.arrays[p.name]);
    std::vector<std::vector<double>> row(element.properties.size());
    for (std::uint64_t i = 0; i < element.n; ++i) {
      read_row(element, row);
      if (is_vertex) {
        surface_.points.push_back(
            {row[*element.find("x")][0], row[*element.find("y")][0], row[*element.find("z")][0]});
        for (const auto& [at, values] : arrays) values->push_back(row[at][0]);
      }
      if (is_face) add_face(row[*corners]);
    }
  }

  void read_row(const Element& element, std::vector<std::vector<double>>& row) {
    body_->next_row();
    for (std::size_t at = 0; at < row.size(); ++at) {
      const Property& property = element.properties[at];
      const double n = property.count ? body_->value(*property.count) : 1;
      if (!(n >= 0) || n != std::floor(n))
        throw InputError(fmt::format("{}: a list of {} values", place(), n));
      row[at].clear();
      for (double k = 0; k < n; ++k) row[at].push_back(body_->value(property.type));
    }
  }

  void add_face(const std::vector<double>& corners) {
    if (corners.size() < 3)
      throw InputError(
          fmt::format("{}: a face with {} vertices; expected 3 or more", place(), corners.size()));
    std::vector<std::int64_t> polygon;
    for (const double corner : corners) {
      if (corner != std::floor(corner) || std::abs(corner) > 1e15)
        throw InputError(fmt::format("{}: a face names vertex {}", place(), corner));
      polygon.push_back(static_cast<std::int64_t>(corner));
    }
    surface_.add_polygon(polygon);
    if (body_->line() > 0) surface_.lines.resize(surface_.elements.size(), body_->line());
  }

  std::string place() const {
    return body_->line() > 0 ? fmt::format("{}:{}", path_, body_->line()) : path_;
  }

  const std::string& path_;
  Lines lines_;
  Header header_;
  std::unique_ptr<Body> body_;
  FileSurface surface_;
};

}  // namespace

FileSurface read_ply(const std::string& path, const std::string& content) {
  return Reader(path, content).read();
}

}  // namespace surf::io
