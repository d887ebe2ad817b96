// The two world frames a surface file can hold, and how files state theirs.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "libsurf/base/types.h"

namespace surf::io {

/// LPS: x to the left, y to the back (DICOM, ITK; what Slicer takes surface files for when
/// they state nothing). RAS: surfseg's own frame. Millimetres both; two axes flip between
/// them, so that triangles keep their orientation.
enum class Space { kLps, kRas };

/// "LPS" or "RAS".
std::string_view name(Space space);

/// The space a header or comment states by "SPACE=LPS" or "SPACE=RAS" anywhere in its text;
/// nothing if it states none.
/// @throws InputError  another word after SPACE=; `path` names the file
std::optional<Space> stated_space(std::string_view header, const std::string& path);

/// Points in the given space from points in RAS, and as well back. Exact.
Points<3> converted(const Points<3>& points, Space space);

}  // namespace surf::io
