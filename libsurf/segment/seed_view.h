// A search grid as seen from clicks.
#pragma once

#include <span>
#include <vector>

#include "libsurf/segment/node_set.h"
#include "libsurf/segment/search_grid.h"
#include "libsurf/segment/seed_model.h"

namespace surf::segment {

/// A seed: the nodes nearest to it, and what the image is like there.
template <int Dim>
struct SeedNodes {
  std::vector<typename NodeBox<Dim>::Index> nodes;
  SeedModel model;
};

/// The nodes of a cube round those nearest to a point, as far as the grid goes.
template <int Dim>
NodeBox<Dim> cube_round(const SearchGrid<Dim>& grid, const Vector<Dim>& point, int half_width);

/// Of one point; no node farther than 18 from it is looked at.
/// @param seed  world mm
template <int Dim>
SeedNodes<Dim> seed_nodes(const SearchGrid<Dim>& grid, const Vector<Dim>& seed);

template <int Dim>
struct SeedView {
  const SearchGrid<Dim>& grid;  ///< referred to
  std::vector<SeedNodes<Dim>> seeds;
  double noise = 0;      ///< largest of the seeds' [intensity per node]
  double deviation = 0;  ///< least of the seeds' [intensity]
  NodeSet<Dim> edge;     ///< nodes on edges above the noise

  SeedView(const SearchGrid<Dim>& grid, std::span<const Vector<Dim>> seeds_mm);
  /// Of seeds that have been looked at before.
  /// @param noise  [intensity per node]
  SeedView(const SearchGrid<Dim>& grid, std::vector<SeedNodes<Dim>> seeds, double noise);

  /// The nodes of a set nearest to each seed, within reach [nodes]: of equally near ones all.
  std::vector<typename NodeBox<Dim>::Index> starts(const NodeSet<Dim>& nodes, int reach) const;

 private:
  void flag_edges();
};

}  // namespace surf::segment
