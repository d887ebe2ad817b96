// The studies of thesis 5.2 that run the model, on phantoms or on an image with a mask: tables on
// stdout, pictures if asked for. Lengths are in pixels.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "libcurve/segment/segment.h"
#include "tests/bench/montage.h"
#include "tests/bench/subject.h"

namespace surf::bench {

struct Outcome {
  curve::CurveResult result;
  curve::CurveOptions options;
  int n_steps = 0, n_trials = 0;
  double seconds = 0;

  bool is_empty() const { return result.shape.elements.rows() == 0; }
};

Outcome run(const curve::Image& image, const Segments& start, curve::CurveOptions options);
curve::CurveOptions options_of(double mu, double gamma);
/// From the subject's start, without the coarse stages.
Outcome run_flow(const Subject& subject, flow::ScalarProduct product, flow::Scheme scheme);

/// Where pictures go: DIRECTORY/PREFIX-STUDY.png; no directory, no pictures.
struct Pictures {
  std::string directory, prefix = "mumford-shah";
  int width = 0;  ///< of a panel; 0: what the study takes

  void write(const std::string& study, const std::vector<std::vector<Panel>>& rows,
             int study_width) const;
};

/// Explicit L2, semi-implicit L2 and H1 without the coarse stages. A row of curves per subject.
void study_flows(const std::vector<Subject>& subjects, const Pictures& pictures);
/// The H1 flow and Newton's method to two tolerances of |dJ|, without the coarse stages.
void study_newton(const std::vector<Subject>& subjects);
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
