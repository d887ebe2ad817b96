// From a volume and seeds to a surface.
#pragma once

#include <string>
#include <vector>

#include "libsurf/mesh/hierarchy.h"
#include "libsurf/segment/run.h"
#include "libsurf/volume/volume.h"

namespace surf::segment {

struct SegmentOptions : RunOptions<3> {
  /// What stays of the final surface; `solids.seeds_ras_mm` is ignored, the seeds count.
  mesh::SolidFilter solids;

  std::string error() const;  ///< empty if valid
};

using Candidate = CandidateOf<3>;

struct SegmentResult : RunResult<3> {
  std::vector<mesh::Removal> removed;  ///< of the final surface, see SegmentOptions::solids
};

using Progress = ProgressOf<3>;

/// @throws UsageError  options.error() is not empty, a seed lies outside the volume, an energy
///                     or one of its parameters is unknown
SegmentResult segment(const volume::Volume& volume, const SegmentOptions& options,
                      const Progress& progress = {});

}  // namespace surf::segment
