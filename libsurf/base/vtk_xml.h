// What a file of VTK's XML promises, before VTK makes room for it.
#pragma once

#include <string>
#include <string_view>

namespace surf {

/// Checks every number of points, cells or values, every extent and the sizes of compressed blocks
/// against the bytes that there are (is_borne_out()), and that what lies in field data are arrays
/// of a type that VTK knows.
/// @param path     for the message
/// @param content  of the file
/// @throws InputError
void check_vtk_xml(const std::string& path, std::string_view content);

/// The same of a file, whose bytes are looked at where they lie on the disk.
/// @throws InputError  also: it cannot be read
void check_vtk_xml_file(const std::string& path);

}  // namespace surf
