// What an evolution gives.
#pragma once

#include "libsurf/segment/stage.h"

namespace surf::segment {

template <int Dim>
struct Result : Lengths {
  Simplices<Dim> shape;
  std::optional<Certainty<Dim>> certainty;  ///< of its vertices, if they were located
  /// That of the last stage that minimised an energy; kProposed, kNoObject or kStopped if none did.
  Outcome outcome = Outcome::kEmpty;
  std::string message;                   ///< one sentence for a person: how that stage ended
  Simplices<Dim> start;                  ///< that the evolution began with
  ClickSearchPointer<Dim> search;        ///< what the proposals come from; null if none were made
  std::vector<Proposal<Dim>> proposals;  ///< best first
  std::size_t chosen = 0;
  std::optional<Verdict<Dim>> verdict;  ///< of the automatic way
  /// The same before the surface was looked at: it goes with the region to what evolves on.
  std::optional<Verdict<Dim>> verdict_of_region;
  std::vector<StageReport> stages;
  std::vector<EnergyTerm> energies;   ///< that the shape minimises, every parameter filled in
  std::vector<std::string> notes;     ///< what a user should know
  std::vector<Removed<Dim>> removed;  ///< see ComponentOptions
  double border_share = 0;            ///< share of the length or area on the image's border

  /// The stage whose outcome counts; null before the first one.
  const StageReport* main_stage() const;
  /// The one that says how it ended: that one, or a later one that was stopped.
  const StageReport* ending_stage() const;
  /// Its flow. Needs a stage.
  const flow::FlowSummary& last() const { return main_stage()->flow; }
  int n_steps() const;  ///< of all stages that move the shape
};

}  // namespace surf::segment
