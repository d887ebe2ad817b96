// What studies of images look for: an image, the object in it, and how near curves come to it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "libcurve/image/phantom.h"

namespace surf::bench {

/// An image, what is to be found in it, and how. Lengths are in pixels.
struct Subject {
  std::string name;
  curve::Image clean;                ///< without added noise
  curve::Image image;                ///< what all studies but that of noise run on
  double contrast = 1;               ///< unit of added noise
  Segments contour;                  ///< the truth; its elements need not be joined
  std::vector<std::uint8_t> object;  ///< and its pixels
  Segments start;
  double mu = 1000, gamma = 0.5;
  bool open_cavities = false;
};

Subject phantom_subject(const std::string& name, const curve::PhantomOptions& phantom,
                        const Segments& start);

/// An image and a mask of its size, not 0 in the object. The contour is the pixels' staircase;
/// contrast is that of the two classes of the whole image.
/// @throws InputError  other sizes, an empty mask
Subject image_subject(const std::string& name, const curve::Image& image, const curve::Image& mask);
/// The same of two files, whatever pixel sizes they state.
/// @throws InputError  a file that cannot be read
Subject image_subject(const std::string& name, const std::string& image, const std::string& mask);

/// The clean image with noise of this share of the contrast.
curve::Image with_noise(const Subject& subject, double sigma);
/// Of an image against that without noise [dB], the contrast as peak.
double psnr(const curve::Image& image, const Subject& subject);

/// Of curves with a subject's object.
struct Agreement {
  std::size_t n_regions = 0;
  double dice = 0;
  double mean_px = 0;  ///< mean distance of curves and contour
};
/// @param curves  not empty
Agreement agreement(const Segments& curves, const Subject& subject);
/// "regions | Dice | mean px" of the curves.
std::string found(const Segments& curves, const Subject& subject);

}  // namespace surf::bench
