// The last step of several objects of one image: none overlaps another.
#pragma once

#include <cstdint>
#include <exception>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "libsurf/segment/finish.h"

namespace surf::segment {

/// Of the gap between two objects that met [cells]: what is aimed at, and what it never exceeds.
constexpr double kGapOfWalls = 0.02, kMostGapOfWalls = 0.05;

/// Where an object ends because an earlier one is there.
struct Wall {
  std::size_t other = 0;    ///< number of the earlier object, from 0
  double removed = 0;       ///< of this object [mm^Dim]
  double measure = 0;       ///< of its elements within kMostGapOfWalls of the other [mm^(Dim-1)]
  double greatest_gap = 0;  ///< of these [mm]
  int n_crumbs = 0;         ///< pieces that were too small or too thin to stay
};

template <int Dim>
struct FinishedObject {
  std::optional<Finished<Dim>> finished;
  std::exception_ptr failure;  ///< why there is none: NoObject or InvalidMesh
  std::vector<Wall> walls;
  Simplices<Dim> whole;  ///< before others were taken from it, if any were
};

/// finish() of each, in their order; what lies in an earlier object, or nearer to it than the gap,
/// is taken from the later one (Setting::parted), so that a wall on which they do not agree is that
/// of the earlier. Gaps that are wider stay as they are. Pieces that a cut leaves go if they
/// enclose less than one cell or are thinner than half a cell. The files are checked against each
/// other (Setting::do_overlap): of two that would overlap the later one fails.
///
/// @param extension  as of finish(), the same for all
/// @param names      of the objects, for messages; none = "object 1", ...
template <int Dim>
std::vector<FinishedObject<Dim>> finish_objects(const Setting<Dim>& setting,
                                                std::span<const Result<Dim>* const> results,
                                                const std::string& extension,
                                                std::span<const std::string> names = {});

/// On the cells of a grid: 0 outside all, n + 1 in object n; first index fastest. Cells whose
/// centres lie in the gap at a wall are the later object's, to which they belonged.
/// @param grid  that of the image's file, say; the setting's own extent() may have its axes in
///              another order
/// @pre  no more than 255
template <int Dim>
std::vector<std::uint8_t> label_map(const Setting<Dim>& setting, const ImageBox<Dim>& grid,
                                    std::span<const FinishedObject<Dim>> objects);

}  // namespace surf::segment
