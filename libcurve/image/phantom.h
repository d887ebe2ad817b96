// Test images whose contour is known exactly: a smooth step across simple curves.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>

#include "libcurve/image/image.h"
#include "libsurf/base/types.h"

namespace surf::curve {

/// The objects, in units u where the image's shortest side is [-1, 1], y downwards.
enum class PhantomKind {
  kBlob,     ///< r(t) = 0.5 (1 + 0.15 cos 3t)
  kDiscs12,  ///< twelve separate discs of radius 0.12 to 0.26
  kRing,     ///< radii 0.6 and 0.3 about (0.05, -0.03)
  kBay       ///< corners, a cusp at (0.8, 0) and a concavity 0.6 deep
};

const std::map<std::string, PhantomKind>& phantom_kinds();

struct PhantomOptions {
  PhantomKind kind = PhantomKind::kBlob;
  std::array<int, 2> size = {256, 256};
  Eigen::Vector2d spacing_mm{1, 1};
  /// Width eps of the edge in units.
  double edge_width = 0.05;
  /// Standard deviation of the Gaussian noise, where the object's contrast is 1.
  double noise = 0;
  std::uint64_t random_seed = 0;
  /// m of the background (m / 4) (2 + x + y), thesis 5.1.1.3.
  double linear_background = 0;
  /// A and N of the background A cos(pi x / (N eps)), (5.3); it is not added where A = 0.
  double wave_amplitude = 0, wave_periods = 2;

  std::string error() const;  ///< empty if valid
  /// Units to mm: the image's centre is 0, one unit half the length of its shortest side.
  Eigen::Affine2d unit_to_plane() const;
};

/// The boundary as polygons in units, domain on the left, chords within 1e-5 of the curve.
Segments phantom_outline(PhantomKind kind);

/// Signed distance to the boundary at u, positive inside, in units.
double phantom_depth(PhantomKind kind, const Segments& outline, const Eigen::Vector2d& point);

/// I = (1 + erf(2 s / eps)) / 2 with s the signed distance, positive inside: 1 inside, 0 outside,
/// 1/2 on the boundary. Backgrounds are added in proportion to 1 - I. The noise of a pixel depends
/// on its index and the seed only.
/// @throws UsageError  options.error() is not empty
Image make_phantom(const PhantomOptions& options);

/// The exact contour in the image's plane [mm].
Segments phantom_contour(const PhantomOptions& options);

}  // namespace surf::curve
