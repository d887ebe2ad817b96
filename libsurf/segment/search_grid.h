// What an image shows at the nodes of a grid: made once for an image, kept for every further click.
#pragma once

#include <optional>
#include <stop_token>
#include <vector>

#include "libsurf/base/field.h"
#include "libsurf/segment/energy_model.h"
#include "libsurf/segment/node_box.h"

namespace surf::segment {

/// An isotropic grid over an image, from the first pixel or voxel to the last along each axis.
template <int Dim>
struct SearchLattice {
  NodeBox<Dim> box;
  Eigen::Transform<double, Dim, Eigen::Affine> node_to_world;
  double node_mm = 0;  ///< distance of nodes, up to rounding to whole numbers of them
  /// Standard deviation [mm] of the Gaussian blur before the C^2 spline that make 0.55 nodes in
  /// all: less would be aliased, more would hide thin walls.
  double sigma_mm = 0;
  /// The faces, the first and the last one of each axis, beyond which the object cannot be, since a
  /// box was drawn round it: not those of the image.
  std::array<std::array<bool, 2>, Dim> is_outside_beyond{};

  /// @param max_nodes  the grid is as fine as cells of the image's content, or as about so many
  ///                   nodes allow. Then what is found depends on the field of view, by a fraction
  ///                   of a node.
  /// @param cells  the box round the object; none = the whole image
  SearchLattice(const ImageExtent<Dim>& extent, double max_nodes,
                const std::optional<NodeBox<Dim>>& cells = {});
};

template <int Dim>
class SearchGrid {
 public:
  /// @param I  intensities, blurred by about 0.55 nodes
  /// @param stop  ends it with a grid that is not whole
  SearchGrid(const Field<Dim>& I, const ImageExtent<Dim>& extent, const SearchLattice<Dim>& lattice,
             const std::stop_token& stop = {});
  /// A part of another one, whose own nodes count from 0. Its levels are those of the whole, and
  /// the faces that they share are the same.
  SearchGrid(const SearchGrid& whole, const NodeBox<Dim>& part);
  bool is_whole() const { return is_whole_; }

  const NodeBox<Dim>& box() const { return lattice_.box; }
  const Eigen::Transform<double, Dim, Eigen::Affine>& node_to_world() const {
    return lattice_.node_to_world;
  }
  double node_mm() const { return lattice_.node_mm; }
  bool is_outside_beyond(int axis, bool is_last) const {
    return lattice_.is_outside_beyond[axis][is_last];
  }
  bool has_outside_faces() const;
  /// Highest less lowest intensity of the image.
  double range() const { return range_; }
  const std::vector<float>& intensity() const { return intensity_; }
  /// The intensity in steps of 1 / (kLevels - 1) of that between the lowest and highest one.
  const std::vector<std::uint16_t>& level() const { return level_; }
  static constexpr int kLevels = 1 << 14;
  /// |grad I| [intensity / mm].
  const std::vector<float>& slope() const { return slope_; }
  /// |grad I| [intensity / mm] where it is no less than one node up and down its direction, else 0.
  const std::vector<float>& edge_slope() const { return edge_slope_; }
  std::size_t memory_bytes() const {
    return (intensity_.capacity() + slope_.capacity() + edge_slope_.capacity()) * sizeof(float) +
           level_.capacity() * sizeof(std::uint16_t);
  }

 private:
  void keep_edges(const std::vector<Eigen::Matrix<float, Dim, 1>>& direction);

  SearchLattice<Dim> lattice_;
  double range_;
  bool is_whole_ = true;
  std::vector<float> intensity_, slope_, edge_slope_;
  std::vector<std::uint16_t> level_;
};

}  // namespace surf::segment
