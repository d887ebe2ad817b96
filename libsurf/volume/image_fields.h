// The fields that energies use: smoothed intensity and edge indicator of a volume.
#pragma once

#include <memory>
#include <optional>

#include "libsurf/volume/spline_integral.h"
#include "libsurf/volume/tiled_field.h"
#include "libsurf/volume/volume.h"

namespace surf::volume {

/// How first differences at the voxels are averaged across their direction.
enum class DerivativeFilter {
  kBSpline,  ///< 1/6, 4/6, 1/6: the gradient of the C^2 approximant at the voxel centre
  kScharr    ///< 3/16, 10/16, 3/16: Scharr's filter, closer to rotation invariance
};

/// Values between the pixels of an image. Volumes have splines only.
enum class Interpolation {
  kSpline,  ///< C^2 cubic B-spline approximant, a blur of variance 1/3 pixel^2 (TiledField)
  kLinear   ///< bilinear, as the thesis 5.1.2: gradients jump at pixel borders, no second ones
};

struct SmoothingOptions {
  /// Standard deviation of the Gaussian [mm]; 0 = none. Truncated at 3 sigma and normalised.
  /// The fields' grid has its nodes at every n-th voxel, n <= 4, along an axis where sigma is at
  /// least 0.7 n voxels: as fine, compared with the blur, as the voxels are by default, and an
  /// eighth of the tiles at n = 2. The Gaussian is narrowed by what the wider spline adds, so that
  /// the intensities' blur is the same.
  double sigma_mm = 0;
  /// Selective Gaussian blur before it (thesis 5.1.2): each voxel becomes the Gaussian mean,
  /// radius 2 sigma, of those neighbours that differ from it by at most the threshold.
  /// Weak variations go, edges stay. (The thesis prints "if the variation exceeds"; the filter
  /// it names blurs where the variation does not exceed.)
  double selective_sigma_mm = 0;
  double selective_threshold = 0;  ///< in the volume's intensity unit

  bool operator==(const SmoothingOptions&) const = default;
  std::string error() const;  ///< empty if valid
};

/// How an image or a volume becomes a field.
struct FieldOptions {
  SmoothingOptions smoothing = {};
  DerivativeFilter filter = DerivativeFilter::kBSpline;
  Interpolation interpolation = Interpolation::kSpline;

  bool operator==(const FieldOptions&) const = default;
};

class Smoother;

/// Fields of a volume with one smoothing, computed on demand. Where the blur is so wide that they
/// have fewer nodes than voxels, what is smoothed for one of them is kept for all: a ball of 512^3
/// voxels, sigma 15 of them, in 0.9 s in place of 2.0 s.
class SmoothedVolume {
 public:
  /// @throws UsageError  where the options have an error()
  SmoothedVolume(const Volume& volume, const SmoothingOptions& smoothing);

  /// The nodes of the fields: the voxels, or every n-th one where sigma is wide.
  const Grid& grid() const;
  /// Smoothed intensities as a C^2 field.
  std::shared_ptr<const TiledField> intensity() const;
  /// Its integral along the first axis of the grid.
  std::shared_ptr<const SplineIntegral> intensity_integral() const;
  /// Edge indicator H = 1 / (1 + |grad I|^2 / lambda^2), thesis (5.1), as a C^2 field: H is
  /// computed at the grid's nodes from the smoothed intensities and then approximated by one cubic
  /// B-spline, whose own derivatives are grad H and D2H.
  /// @param lambda  edge strength [intensity / mm]
  /// @throws UsageError  unless lambda > 0
  std::shared_ptr<const TiledField> edge_indicator(
      double lambda, DerivativeFilter filter = DerivativeFilter::kBSpline) const;
  /// Of what is kept for all fields, without their own.
  std::size_t memory_bytes() const;

 private:
  NodalValues values() const;

  std::shared_ptr<const Smoother> smoother_;
};

/// SmoothedVolume::intensity() of a field that shares nothing.
std::shared_ptr<const TiledField> intensity_field(const Volume& volume,
                                                  const SmoothingOptions& smoothing);

/// The same of the volume's blocks, Volume::coarser(), where those are so fine that the blur by
/// them, and by a spline between them, is no wider than asked for; along axes of long voxels it may
/// be narrower. Edges lie where they are to a few hundredths of a block.
std::shared_ptr<const TiledField> rough_intensity_field(const Volume& volume,
                                                        const SmoothingOptions& smoothing);

/// SmoothedVolume::edge_indicator() of a field that shares nothing.
std::shared_ptr<const TiledField> edge_indicator(
    const Volume& volume, const SmoothingOptions& smoothing, double lambda,
    DerivativeFilter filter = DerivativeFilter::kBSpline);

}  // namespace surf::volume
