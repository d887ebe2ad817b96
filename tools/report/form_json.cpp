#include "tools/report/report.h"

namespace surfseg::report {
namespace {

using nlohmann::ordered_json;

ordered_json point_json(const surf::Vector<3>& point) { return {point[0], point[1], point[2]}; }

ordered_json statistics_json(const surf::mesh::IntensityStatistics& of) {
  if (of.n_voxels == 0) return {{"voxels", 0}};
  return {{"voxels", of.n_voxels},
          {"mean", of.mean},
          {"standard_deviation", of.standard_deviation},
          {"median", of.median},
          {"percentile_5", of.percentile_5},
          {"percentile_95", of.percentile_95}};
}

}  // namespace

ordered_json form_json(const surf::mesh::Form& form) {
  ordered_json directions = ordered_json::array();
  for (int k = 0; k < 3; ++k) directions.push_back(point_json(form.axes.directions.col(k)));
  return {{"sphericity", form.sphericity},
          {"semi_axes_mm", point_json(form.axes.semi_axes_mm)},
          {"axes_ras", directions},
          {"elongation", form.axes.elongation()},
          {"flatness", form.axes.flatness()},
          {"feret_largest_mm", form.feret.largest_mm},
          {"feret_largest_ras_mm",
           {point_json(form.feret.largest_from_mm), point_json(form.feret.largest_to_mm)}},
          {"feret_smallest_mm", form.feret.smallest_mm},
          {"feret_smallest_direction_ras", point_json(form.feret.smallest_direction)}};
}

ordered_json intensities_json(const surf::mesh::RegionIntensities& intensities) {
  return {{"inside", statistics_json(intensities.inside)},
          {"shell", statistics_json(intensities.shell)},
          {"shell_mm", intensities.shell_mm}};
}

}  // namespace surfseg::report
