// Thesis 5.1.2: an image is smoothed, and curves descend the minimal surface model (5.1) in it.
#pragma once

#include <array>
#include <memory>

#include "tests/bench/descent.h"
#include "tests/bench/subject.h"

namespace surf::bench {

/// A row of the thesis' table of parameters.
struct RealImageParameters {
  std::array<double, 2> window{0, 1};  ///< what becomes 0 and 1; values beyond are cut off
  double selective_sigma_px = 0;       ///< of the selective Gaussian blur: rho_SG = 2 sigma
  double selective_threshold = 0;      ///< delta_SG, of intensities in [0, 1]
  double sigma_px = 0;                 ///< of the Gaussian blur after it
  double gamma_0 = 0.01, gamma = 1, lambda = 1;
  double tolerance_L2 = 1e-3, tolerance_H1 = 1e-6;
};

/// Intensities in [0, 1] on a plane in which the image's shortest side is [-1, 1].
struct Prepared {
  curve::Image image;
  std::shared_ptr<const Field<2>> intensity, H;  ///< smoothed
};

/// @param image  in pixels
Prepared prepare(const curve::Image& image, const RealImageParameters& parameters,
                 bool is_selective);

/// A field of the prepared image at its pixels' centres, in pixels.
curve::Image sampled(const Field<2>& field, const Prepared& prepared);

/// J is that of the prepared image; curves, those of `each_step` too, are in pixels.
Descended descend(const Prepared& prepared, const RealImageParameters& parameters,
                  const Segments& start, flow::ScalarProduct product,
                  const EachStep& each_step = {});

/// A vertebra as an axial slice of a CT shows it: body, pedicles, laminae round the canal,
/// transverse and spinous processes, contrast 0.5.
struct VertebraOptions {
  int n_pixels = 128;
  double noise = 0;    ///< standard deviation
  double texture = 0;  ///< amplitude of waves of 8 pixels, along rows times along columns
};
Subject vertebra_phantom(const VertebraOptions& options);
/// Those of the thesis' vertebra, but for blurs and gamma_0 that suit 128 to 192 pixels.
RealImageParameters vertebra_parameters();
/// A seed in the body of a vertebra of n_pixels, or three: one more in each lamina.
Segments vertebra_seeds(int n_pixels, int n_seeds);

}  // namespace surf::bench
