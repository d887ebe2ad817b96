#include "libcurve/segment/stack.h"

#include <fmt/format.h>

#include "libcurve/mesh/rasterize.h"
#include "libcurve/mesh/verify.h"
#include "libsurf/segment/energy_assembly.h"

namespace surf::curve {
namespace {

/// The options of a slice behind the first one.
CurveOptions continued(CurveOptions options, const StackResult& result, const Image& image) {
  options.seeds_mm.clear();
  options.outside_mm.clear();
  options.click_order.clear();
  options.samples_mm.clear();
  options.box_mm.reset();
  if (options.components.keep == mesh::Keep::kSeeded) options.components.keep = mesh::Keep::kAll;
  const SliceContours& before = result.slices.back();
  options.initial = carried(before.curves, before.plane_to_ras, *image.plane_to_ras());
  options.energies = result.energies;
  return options;
}

/// An energy that is fitted to a slice says nothing of the next one: the window of the object does.
std::vector<segment::EnergyTerm> for_other_slices(const CurveResult& result) {
  if (!segment::are_fitted<2>(result.energies) || result.proposals.empty()) return result.energies;
  const segment::Proposal<2>& proposal = result.proposals[result.chosen];
  return {{"window", 1, {{"mean", proposal.mean}, {"half-width", proposal.half_width}}},
          {"area", proposal.neck_radius_mm / 2, {}}};
}

/// Why there is no object in a slice; empty if there is.
std::string missing(const CurveResult& result) {
  if (!segment::has_shape(result.outcome)) return result.message;
  const bool is_empty = result.shape.elements.rows() == 0;
  return is_empty && result.outcome == segment::Outcome::kStopped
             ? "interrupted before there was a first contour"
             : "";
}

/// What guarantee its contours fail; empty if none.
std::string failed(const CurveResult& result) {
  const auto verification = verify(result.shape);
  return verification.passed() ? "" : verification.message();
}

}  // namespace

StackResult segment_stack(const VoxelSlices& slices, int first, int last,
                          const CurveOptions& options, const StackProgress& progress) {
  StackResult out;
  bool go_on = true;
  slices.slice(last);  // refused before any is worked
  const int step = first <= last ? 1 : -1;
  for (int k = first; k != last + step && go_on; k += step) {
    const Image image = slices.slice(k);
    const CurveResult result =
        segment(image, out.slices.empty() ? options : continued(options, out, image),
                [&](const std::string& stage, const flow::StepRecord& record, const auto&) {
                  go_on = !progress || progress(k, stage, record);
                  return go_on;
                });
    if (result.outcome == segment::Outcome::kAtLimit) {
      ++out.n_limited;
      out.notes.push_back(fmt::format("slice {}: {}", k, result.message));
    }
    std::string why = missing(result);
    if (why.empty()) {
      why = failed(result);
      out.is_invalid = !why.empty();
    }
    if (!why.empty()) {
      out.notes.push_back(fmt::format("slice {}: {}; the stack ends before it", k, why));
      break;
    }
    if (out.energies.empty()) out.energies = for_other_slices(result);
    out.slices.push_back({k, result.shape, *image.plane_to_ras()});
  }
  return out;
}

std::vector<std::uint8_t> rasterized(const std::vector<SliceContours>& stack,
                                     const VoxelSlices& slices) {
  const auto& size = slices.volume().size();
  std::vector<std::uint8_t> labels(slices.volume().n_voxels(), 0);
  for (const SliceContours& contours : stack) {
    const Image image = slices.slice(contours.slice);
    const auto mask = rasterize(contours.curves, image.size(), image.pixel_to_plane());
    for (int j = 0; j < image.size()[1]; ++j)
      for (int i = 0; i < image.size()[0]; ++i) {
        const auto v = slices.voxel(i, j, contours.slice);
        labels[(std::size_t(v[2]) * size[1] + v[1]) * size[0] + v[0]] =
            mask[std::size_t(j) * image.size()[0] + i];
      }
  }
  return labels;
}

}  // namespace surf::curve
