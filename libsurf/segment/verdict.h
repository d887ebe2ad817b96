// How far an answer to clicks is to be trusted, and why.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "libsurf/segment/certainty.h"
#include "libsurf/segment/click_search.h"

namespace surf::segment {

/// What is known of a region without a reference.
struct VerdictFeatures {
  double separation = 0;    ///< of inside and outside along the boundary, see RungFeatures
  double border_share = 0;  ///< of the area, on the image's border
  double kept = 1;          ///< by settling, see Rung
  /// Of the last corrections, see ClickSearch; a click that changes nothing makes none.
  std::optional<double> consent = {};
};

enum class Trust {
  kTrusted,  ///< nearly always right
  kCheck,    ///< more often right than wrong
  kDoubtful  ///< more often wrong than right
};

/// "trusted", "check", "doubtful"
std::string to_string(Trust trust);

/// Right is a Dice of 0.8 or more.
template <int Dim>
struct Verdict {
  Trust trust = Trust::kCheck;
  double likelihood = 0;         ///< of being right, by logistic regression
  int n_right = 0, n_cases = 0;  ///< of the cases with such a verdict it was measured on
  std::string reason;            ///< in words: what speaks most for or against it
  Vector<Dim> place_mm =
      Vector<Dim>::Zero();  ///< where to look: deepest in what is disputed near it, or see heed()

  /// "check: right in 31 of 46 such cases; another region fits nearly as well: look at (3, -4, 12)"
  std::string text() const;
  /// Without the trust and the place.
  std::string words() const;
  /// What the surface shows besides: one along more than half of which no edge is found is not
  /// trusted; the place is where a click would tell most.
  void heed(const Certainty<Dim>& certainty);
};

/// Likelihood of a Dice of 0.8 or more: a logistic function of
///
///   separation, kept (of the first region), consent (of corrections)
///
/// fitted to answers to one to three clicks in structures of CT and MRI scans (docs/clicks.md).
double likelihood_of_right(const VerdictFeatures& features);
/// What speaks most against it, in words.
std::string doubt(const VerdictFeatures& features);

/// Of the region that is chosen.
template <int Dim>
VerdictFeatures verdict_features(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search);

/// Nothing in the plane, for which it has not been measured, if nothing was found, or if a person
/// has chosen another region than the best one. Not trusted is what the border of the image cuts
/// off, and what heeds an inside click round which nothing stood out.
template <int Dim>
std::optional<Verdict<Dim>> verdict(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search);

}  // namespace surf::segment
