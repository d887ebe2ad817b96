// Points that someone has clicked: Slicer's .fcsv and .mrk.json, and plain text.
#pragma once

#include <Eigen/Core>
#include <string>

namespace surf::io {

struct Landmarks {
  Eigen::MatrixXd points;  ///< (n, 3), or (n, 2) of a plain text
  /// The file says in which space the points are, and they are in RAS mm now; else as written.
  bool is_ras = false;
};

/// Reads landmarks by the ending of `path`:
/// - .mrk.json, .json: Slicer's markups, the control points of all its lists, LPS if a list states
///   no coordinateSystem; those that are not placed are left out.
/// - .fcsv: Slicer's older lists. "# CoordinateSystem = LPS", or RAS, 0 (RAS) or 1 (LPS); without
///   one RAS, as Slicer wrote then.
/// - anything else: plain text, two or three numbers a line, divided by blanks, commas or
///   semicolons; lines that begin with # are comments, one with SPACE=RAS or SPACE=LPS states the
///   space.
/// @throws InputError  missing, empty or malformed; lengths in another unit than mm
Landmarks read_landmarks(const std::string& path);

}  // namespace surf::io
