// The studies of thesis 5.2 that run the model, on phantoms or on an image with a mask: tables on
// stdout, pictures if asked for. Lengths are in pixels.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "libcurve/image/phantom.h"
#include "libcurve/segment/segment.h"
#include "tests/bench/montage.h"

namespace surf::bench {

/// An image, what is to be found in it, and how.
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

/// An image file and a mask of its size, not 0 in the object. The contour is the pixels' staircase;
/// contrast is that of the two classes of the whole image.
/// @throws InputError  a file that cannot be read, other sizes, an empty mask
Subject image_subject(const std::string& name, const std::string& image, const std::string& mask);

struct Outcome {
  curve::CurveResult result;
  curve::CurveOptions options;
  int n_steps = 0, n_trials = 0;
  double seconds = 0;

  bool is_empty() const { return result.shape.elements.rows() == 0; }
};

Outcome run(const curve::Image& image, const Segments& start, curve::CurveOptions options);
curve::CurveOptions options_of(double mu, double gamma);
/// "regions | Dice | mean px" of the curves.
std::string found(const Outcome& out, const Subject& subject);

/// Where pictures go: DIRECTORY/PREFIX-STUDY.png; no directory, no pictures.
struct Pictures {
  std::string directory, prefix = "mumford-shah";
  int width = 0;  ///< of a panel; 0: what the study takes

  void write(const std::string& study, const std::vector<std::vector<Panel>>& rows,
             int study_width) const;
};

/// Explicit L2, semi-implicit L2 and H1 without the coarse stages. A row of curves per subject.
void study_flows(const std::vector<Subject>& subjects, const Pictures& pictures);
/// Noise 0.1, 0.25 and 0.5 of the contrast. Per subject a row of noisy images and one of u.
void study_noise(const std::vector<Subject>& subjects, const Pictures& pictures);
/// Pairs of mu and gamma. A row of u.
void study_values(const std::string& study, const Subject& subject,
                  const std::vector<std::pair<double, double>>& pairs, const Pictures& pictures);
/// One row with initial and final curves.
void study_starts(const Subject& subject,
                  const std::vector<std::pair<std::string, Segments>>& starts,
                  const Pictures& pictures);

}  // namespace surf::bench
