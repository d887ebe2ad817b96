// Has the shape of a fitted energy come to rest?
#pragma once

#include <deque>
#include <functional>
#include <string>

#include "libsurf/segment/setting.h"

namespace surf::segment {

/// Fitted energies begin near their minimum, so that no decrease can be called small by the whole
/// one. The shape rests when
/// - the energy hardly falls: the last kGainSteps steps gained less than kLeastGain cells times its
///   length or area, or
/// - it moved by less than kStill cells in the mean over a window, or
/// - it goes nowhere: over 3 windows it moved hardly further than over the last one. On
///   intensities that vary from cell to cell, steps and mending undo each other without end; then
///   the energy that steps gain is lost again in mending, which nobody counts.
template <int Dim>
class RestRule {
 public:
  /// @param measure  of what moves
  /// @param window   steps, > 0
  /// @param region   where the shape moves, null = everywhere; must outlive this object
  RestRule(const Setting<Dim>& setting, double measure, int window,
           const mesh::Neighbourhood<Dim>* region = nullptr);

  /// After step number `n_steps`; the sentence that says why, else empty.
  /// @param shape_now  called after each window
  std::string check(int n_steps, double energy, const std::function<Simplices<Dim>()>& shape_now);

 private:
  std::string goes_nowhere(const Simplices<Dim>& now);

  const Setting<Dim>& setting_;
  double least_gain_;
  int window_;
  const mesh::Neighbourhood<Dim>* region_;
  std::deque<double> energies_;        // of the last kGainSteps and before them
  std::deque<Simplices<Dim>> shapes_;  // at the ends of windows
};

}  // namespace surf::segment
