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
