#include "tools/common/surface_scores.h"

#include <cmath>

#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/overlap.h"
#include "libsurf/mesh/verify.h"

namespace surfseg {
namespace {

using nlohmann::ordered_json;
using surf::Triangles;
using surf::mesh::Overlap;
using surf::mesh::Verification;

/// Exact, but of a surface of which some shells, but not all, are inside out: it would take theirs
/// from that of the others.
/// @param sampled_mm3  by its samples, whichever way they are wound round
double volume_of(const Triangles& surface, const Verification& verification, double sampled_mm3) {
  const int n_inverted = verification.n_inverted_components;
  const bool are_alike = n_inverted == 0 || n_inverted == verification.n_components;
  return are_alike ? std::abs(surf::mesh::volume_mm3(surface)) : sampled_mm3;
}

/// Null for all if one of the two encloses no volume.
ordered_json overlap_json(const Triangles& surface, const Verification& verification,
                          const Reference& reference, const std::optional<int>& label) {
  ordered_json scores = {{"dice", nullptr},
                         {"jaccard", nullptr},
                         {"volume_mm3", nullptr},
                         {"reference_volume_mm3", nullptr},
                         {"volume_difference_percent", nullptr}};
  const Verification of_reference =
      reference.labels ? Verification() : surf::mesh::verify(reference.surface);
  if (!verification.is_solid() || (!reference.labels && !of_reference.is_solid())) return scores;
  const Overlap overlap = reference.labels ? surf::mesh::overlap(surface, *reference.labels, label)
                                           : surf::mesh::overlap(surface, reference.surface);
  const double volume = volume_of(surface, verification, overlap.first_mm3);
  // A label's volume is that of its voxels, not of the surface between their centres.
  const double reference_volume =
      reference.labels ? overlap.second_mm3
                       : volume_of(reference.surface, of_reference, overlap.second_mm3);
  if (overlap.first_mm3 + overlap.second_mm3 > 0) {  // else both lie between the grid's points
    scores["dice"] = overlap.dice();
    scores["jaccard"] = overlap.jaccard();
  }
  scores["volume_mm3"] = volume;
  scores["reference_volume_mm3"] = reference_volume;
  scores["volume_difference_percent"] = 100 * (volume - reference_volume) / reference_volume;
  return scores;
}

ordered_json json_of(const surf::mesh::DistanceStatistics& distances) {
  return {{"mean_mm", distances.mean_mm},
          {"rms_mm", distances.rms_mm},
          {"p95_mm", distances.p95_mm},
          {"max_mm", distances.max_mm}};
}

ordered_json json_of(const surf::mesh::SurfaceDistances& distances) {
  return {{"mean_mm", distances.mean_mm},
          {"rms_mm", distances.rms_mm},
          {"p95_mm", distances.p95_mm},
          {"max_mm", distances.max_mm},
          {"surface_to_reference", json_of(distances.forward)},
          {"reference_to_surface", json_of(distances.backward)}};
}

ordered_json json_of(const Verification& verification, const Triangles& surface) {
  const surf::mesh::Quality quality = surf::mesh::quality(surface);
  ordered_json genera = ordered_json::array();
  for (const auto& part : surf::mesh::measure_components(surface)) genera.push_back(part.genus());
  return {{"passed", verification.passed()},
          {"message", verification.message()},
          {"closed", verification.closed},
          {"manifold", verification.manifold},
          {"outward", verification.outward},
          {"self_intersections", verification.n_self_intersections},
          {"degenerate", verification.n_degenerate},
          {"components", verification.n_components},
          {"genus", verification.closed && verification.manifold ? genera : ordered_json()},
          {"vertices", surface.points.rows()},
          {"triangles", surface.elements.rows()},
          {"area_mm2", surf::mesh::area_mm2(surface)},
          {"min_angle_deg", quality.min_angle_deg},
          {"max_angle_deg", quality.max_angle_deg},
          {"share_above_25_deg", quality.share_above_25_deg},
          {"min_edge_mm", quality.min_edge_mm},
          {"mean_edge_mm", quality.mean_edge_mm},
          {"max_edge_mm", quality.max_edge_mm}};
}

}  // namespace

ordered_json surface_scores(const Triangles& surface, const Reference& reference,
                            const std::optional<int>& label) {
  const Verification verification = surf::mesh::verify(surface);
  ordered_json scores = overlap_json(surface, verification, reference, label);
  scores["distance"] = json_of(surf::mesh::surface_distances(surface, reference.surface));
  scores["quality"] = json_of(verification, surface);
  return scores;
}

}  // namespace surfseg
