// surfseg segment --report: one page for people, in one file that loads nothing from elsewhere.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libsurf/mesh/form.h"
#include "libsurf/mesh/region_intensities.h"
#include "libsurf/volume/volume.h"
#include "tools/common/segment_command.h"

namespace surfseg::report {

struct Case {
  std::string command_line;
  int exit_code = 0;
  const surf::volume::Volume& volume;
  std::string volume_hash;
  const std::vector<ReportedObject<3>>& objects;
};

/// The page (docs/report.md). Numbers are those of the summary's entries. The same case gives the
/// same bytes.
std::string page(const Case& of);

/// Entries of the summary.
nlohmann::ordered_json form_json(const surf::mesh::Form& form);
nlohmann::ordered_json intensities_json(const surf::mesh::RegionIntensities& intensities);

}  // namespace surfseg::report
