// Values as they are typed on the command line: lengths with their unit, points in a space.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <map>
#include <string>
#include <vector>

namespace surfseg {

/// A length with its unit: "12mm", or "3vox" or "3px": sides of a cube or square of a voxel's or
/// pixel's content.
struct Length {
  double value = 0;
  bool in_cells = false;

  /// Millimetres where a voxel or pixel has this side.
  double mm(double cell_mm) const { return in_cells ? value * cell_mm : value; }
};

/// @throws surf::UsageError  naming `option`, e.g. "--radius: expected a length with its
///                           unit, such as 12mm or 20vox; got '12'"
Length parse_length(const std::string& option, const std::string& text);
/// The same, and not zero.
Length parse_positive_length(const std::string& option, const std::string& text);

/// Spaces a point can be given in: RAS mm (NIfTI, Slicer's scene), LPS mm (DICOM, ITK), or
/// voxel indices of the volume.
enum class Space { kRas, kLps, kIjk };
/// @throws surf::UsageError
Space parse_space(const std::string& option, const std::string& text);

/// @throws surf::UsageError  not a finite number
double parse_number(const std::string& option, const std::string& text);

/// n comma-separated finite numbers.
/// @param expected  what to say is expected, such as "two numbers X,Y"
/// @throws surf::UsageError
std::vector<double> parse_numbers(const std::string& option, const std::string& text, int n,
                                  const std::string& expected);

/// The two corners of X,Y,Z,X,Y,Z (or X,Y,X,Y), each as the text of a point.
/// @throws surf::UsageError  not so many numbers, apart by commas
std::array<std::string, 2> split_box(const std::string& option, const std::string& text,
                                     int dimension);

/// Three comma-separated finite numbers.
/// @throws surf::UsageError
Eigen::Vector3d parse_point(const std::string& option, const std::string& text);

/// The keys, apart by commas.
template <class T>
std::string names_of(const std::map<std::string, T>& table) {
  std::string names;
  for (const auto& [name, value] : table) names += (names.empty() ? "" : ", ") + name;
  return names;
}

/// The point in RAS mm.
Eigen::Vector3d to_ras_mm(const Eigen::Vector3d& point, Space space,
                          const Eigen::Affine3d& index_to_world);

}  // namespace surfseg
