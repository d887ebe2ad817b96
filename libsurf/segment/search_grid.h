// What an image shows at the nodes of a grid.
#pragma once

#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <stdexcept>
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
  /// Likewise, those beyond which the grid goes on that this is a part of.
  std::array<std::array<bool, 2>, Dim> goes_on_beyond{};

  /// @param max_nodes  the grid is as fine as cells of the image's content, or as about so many
  ///                   nodes allow. Then what is found depends on the field of view, by a fraction
  ///                   of a node.
  /// @param cells  the box round the object; none = the whole image
  SearchLattice(const ImageExtent<Dim>& extent, double max_nodes,
                const std::optional<NodeBox<Dim>>& cells = {});
};

/// part() makes the nodes of a small box alone, each time; make_all() all of them, which stay. One
/// thread at a time may call these two.
template <int Dim>
class SearchGrid {
 public:
  /// All nodes at once.
  /// @param I  intensities, blurred by about 0.55 nodes
  SearchGrid(const Field<Dim>& I, const ImageExtent<Dim>& extent,
             const SearchLattice<Dim>& lattice);
  /// None yet. The field is kept until all are made.
  SearchGrid(std::shared_ptr<const Field<Dim>> I, const ImageExtent<Dim>& extent,
             const SearchLattice<Dim>& lattice);

  /// False after a stop: then it is as before.
  bool make_all(const std::stop_token& stop = {}) const;
  /// A box of it as a grid of its own, whose nodes count from 0 and are all made: the same to the
  /// bit, whether those of the whole are made or not. The faces that they share are the same;
  /// beyond the others the image goes on.
  /// A box of more than 0.3 of the grid, or one by which as many nodes as the grid has have been
  /// made so, makes all.
  /// @param stop  ends it with values that mean nothing
  SearchGrid part(const NodeBox<Dim>& box, const std::stop_token& stop = {}) const;

  const NodeBox<Dim>& box() const { return lattice_.box; }
  const Eigen::Transform<double, Dim, Eigen::Affine>& node_to_world() const {
    return lattice_.node_to_world;
  }
  double node_mm() const { return lattice_.node_mm; }
  bool is_outside_beyond(int axis, bool is_last) const {
    return lattice_.is_outside_beyond[axis][is_last];
  }
  bool has_outside_faces() const;
  /// Whether something in a box of its nodes may be cut off by a face of this part of a grid.
  bool is_cut_off(const NodeBox<Dim>& object) const;
  /// Of the image's usual intensities, see ImageExtent.
  double width() const { return double(usual_[1]) - usual_[0]; }
  /// Deviation of what the image's values were rounded by.
  double rounding() const { return rounded_to_ / std::sqrt(12.0); }

  // Of all nodes. std::logic_error if they have not been made.

  const std::vector<float>& intensity() const { return values().intensity; }
  /// The intensity in steps of 1 / (kLevels - 1) of that between the lowest and highest usual one
  /// of these nodes; what is beyond is at the first or last step.
  const std::vector<std::uint16_t>& level() const { return values().level; }
  static constexpr int kLevels = 1 << 14;
  /// |grad I| [intensity / mm].
  const std::vector<float>& slope() const { return values().slope; }
  /// |grad I| [intensity / mm] where it is no less than one node up and down its direction, else 0.
  const std::vector<float>& edge_slope() const { return values().edge_slope; }
  std::size_t memory_bytes() const;

 private:
  struct Values {
    std::vector<float> intensity, slope, edge_slope;
    std::vector<std::uint16_t> level;
  };
  using Directions = std::vector<Eigen::Matrix<float, Dim, 1>>;

  /// A part of another one.
  SearchGrid(const SearchGrid& whole, const SearchLattice<Dim>& lattice,
             std::shared_ptr<const Values> values);
  const Values& values() const {
    if (!values_) throw std::logic_error("SearchGrid: its nodes are asked for before make_all()");
    return *values_;
  }
  std::vector<std::uint16_t> levels(const std::vector<float>& intensity) const;
  std::shared_ptr<Values> made(const Field<Dim>& I, const NodeBox<Dim>& part,
                               const std::stop_token& stop) const;
  void keep_edges(const NodeBox<Dim>& part, const Directions& direction, Values& values) const;

  SearchLattice<Dim> lattice_;
  std::array<float, 2> usual_;
  double rounded_to_;
  mutable std::shared_ptr<const Field<Dim>> I_;
  mutable std::shared_ptr<const Values> values_;  ///< null until all are made
  mutable std::size_t n_alone_ = 0;               ///< nodes of parts that were made alone
};

}  // namespace surf::segment
