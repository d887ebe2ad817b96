// What programs print and write beside their main output.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace surfseg {

/// Writes the document to a temporary file beside `path` and renames it.
/// @throws surf::OutputError
void write_json(const std::string& path, const nlohmann::ordered_json& document);

/// Lines of a key and a value, the values below each other.
class KeyValues {
 public:
  /// @param width  of the keys
  explicit KeyValues(int width) : width_(width) {}
  void add(const std::string& key, const std::string& value);
  const std::string& text() const { return text_; }

 private:
  int width_;
  std::string text_;
};

/// @throws surf::InputError  unreadable, or not JSON, with the place
nlohmann::ordered_json read_json(const std::string& path);

}  // namespace surfseg
