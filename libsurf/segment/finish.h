// The last step before a file: rounded, checked, measured, told about.
#pragma once

#include <string>

#include "libsurf/io/write_surface.h"
#include "libsurf/segment/result.h"

namespace surf::segment {

/// A shape exactly as a file will hold it.
template <int Dim>
struct Finished {
  Simplices<Dim> shape;
  Measures<Dim> measures;                        ///< of that shape
  std::optional<Certainty<Dim>> certainty = {};  ///< of its vertices, if they were located
};

/// Rounds the result to the numbers of a file of this kind (".stl", ...; "" = not at all), and
/// makes the final check on what came out.
/// @throws NoObject     the result has no shape: nothing was found, or it vanished
/// @throws InvalidMesh  the shape fails a guarantee, or the options left nothing of it
template <int Dim>
Finished<Dim> finish(const Setting<Dim>& setting, const Result<Dim>& result,
                     const std::string& extension);

/// The same of a proposal.
/// @throws InvalidMesh  the shape fails a guarantee
template <int Dim>
Finished<Dim> finish(const Setting<Dim>& setting, const Proposal<Dim>& proposal,
                     const std::string& extension);

/// kappa of each vertex [1/mm]: the sum of the principal curvatures, positive on a ball
/// (fem::mean_curvature).
Eigen::VectorXd curvature(const Finished<3>& surface);

/// io::write_surface(), for results only: what was not finished cannot be written by mistake. To
/// the arrays of the options it adds curvature_per_mm, and those of the certainty: deviation_mm,
/// edge_strength and has_edge.
void write(const std::string& path, const Finished<3>& surface, io::WriteOptions options);

/// What happened, as JSON text: outcome, measures, components, what was removed, events, notes,
/// what was chosen, proposals, stages (docs/file-formats.md). The energies and lengths under
/// `chosen` give the same bytes again from the same start.
/// @param finished  null if there is no shape. The certainty is that of its vertices, not of the
///                  result's: an object that was cut at the wall of another has none
template <int Dim>
std::string summary_json(const Result<Dim>& result, const Finished<Dim>* finished);

/// The same where the shape fails a guarantee.
/// @param failed  its measures
template <int Dim>
std::string summary_json(const Result<Dim>& result, const Measures<Dim>& failed);

}  // namespace surf::segment
