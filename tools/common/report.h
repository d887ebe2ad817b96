// What programs print and write beside their main output.
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace surfseg {

/// Writes the document to a temporary file beside `path` and renames it.
/// @throws surf::OutputError
void write_json(const std::string& path, const nlohmann::ordered_json& document);

/// @throws surf::InputError  unreadable, or not JSON, with the place
nlohmann::ordered_json read_json(const std::string& path);

}  // namespace surfseg
