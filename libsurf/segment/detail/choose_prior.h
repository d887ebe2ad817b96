// Below which length the moves of a shape are taken for smooth.
#pragma once

#include <array>
#include <stop_token>

#include "libsurf/segment/detail/smooth_moves.h"

namespace surf::segment {

/// The prior refers to the bending matrices that it was chosen with.
template <int Dim>
struct PriorChoice {
  double length_mm = 0;
  SmoothMoves<Dim> prior;
};

/// The prior of the length L that predicts one half of the observations best
/// from the other: found from the middle of those that are compared, to the side where it gets
/// better. A shorter one is better only if both halves say so: what they do not agree on is noise,
/// and a longer one tells more of it from the shape. Of a large shape it
/// predicts four patches: the inside of a skull, 20,000 vertices, 1.1 CPU s in place of 2.0
/// @param bending  of the geometry; must outlive what is chosen
/// @param normals  of the vertices, (n, Dim)
/// @param halves   of the observations, at the moves u
/// @param u        (n) [mm]
/// @param most_mm  moves further than that say nothing of the length
/// @param stop     heard between factorisations; the length means nothing then
template <int Dim>
PriorChoice<Dim> choose_prior(const fem::Geometry<Dim>& geometry, const BendingMatrices& bending,
                              const Points<Dim>& normals, const std::array<Observations, 2>& halves,
                              const Eigen::VectorXd& u, double cell_mm, double most_mm,
                              const std::stop_token& stop = {});

}  // namespace surf::segment
