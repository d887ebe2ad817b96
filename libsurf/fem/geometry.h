// The geometry of a polygon (Dim = 2) or a triangle surface (Dim = 3): what every matrix,
// load and energy needs, computed once per position of the vertices.
#pragma once

#include <cassert>
#include <cstdint>
#include <memory>
#include <mutex>
#include <vector>

#include "libsurf/base/types.h"

namespace surf::fem {

/// The elements of a shape and the sparsity they imply, shared by all its positions: built
/// once, when a matrix first asks for it, reused between steps while the mesh stands. Thread-safe.
template <int Dim>
class Topology {
 public:
  /// @throws InvalidMesh  no elements, or T names a vertex outside 0..n_vertices-1
  Topology(Elements<Dim> T, Eigen::Index n_vertices);

  const Elements<Dim>& elements() const { return T_; }
  Eigen::Index n_vertices() const { return n_vertices_; }
  /// Matrix of zeros with an entry for each pair of vertices of an element, (n, n).
  const SparseMatrix& pattern() const;
  /// Where entry (i, j) of element t lies in the pattern's values. @pre pattern() was asked for
  int slot(Eigen::Index t, int i, int j) const {
    assert(!slots_.empty());
    return slots_[(t * Dim + i) * Dim + j];
  }

 private:
  void make_pattern() const;

  Elements<Dim> T_;
  Eigen::Index n_vertices_;
  mutable std::once_flag is_made_;
  mutable SparseMatrix pattern_;
  mutable std::vector<int> slots_;
};

/// Planes that bound the part of space where something is known, as those of an image's border, and
/// which of them the vertices of a shape lie on.
template <int Dim>
struct Border {
  Points<Dim> normals;               ///< unit normals of the planes, (p, Dim), p <= 8
  std::vector<std::uint8_t> planes;  ///< one bit for each plane, of each vertex, (n)
};

/// What is known of a shape of which a geometry is a part: the other elements are left out, and
/// stay where they are.
struct WholeShape {
  std::vector<char> is_held;  ///< of the vertices of the part that others need where they are, (n)
  double radius_mm = 0;       ///< of the ball (disc) with the whole one's content
};

/// How an element lies to the border.
enum class Place : std::uint8_t {
  kFree,   ///< touches no element on the border
  kRim,    ///< has a vertex with such an element, where the shape ends on the border
  kBorder  ///< lies in one of its planes
};

/// Measures, normals and basis gradients of a closed polyhedral shape Gamma.
///
/// Element t has vertices x_1..x_Dim and the P1 basis functions phi_1..phi_Dim; its outward
/// unit normal nu_t is (dy, -dx) / length for a segment and (x2 - x1) x (x3 - x1) / (2 area)
/// for a triangle. Holds copies of the arrays: later changes of the mesh do not reach it.
///
/// A shape that a border cuts off ends there as if it went on: elements on the border close it, but
/// they do not move, and boundary integrals leave them out. To these the rim adds what lies in it,
/// not its stretching: its measures are held (charged_measures), so that nothing pulls the line
/// where the shape meets the border along it.
template <int Dim>
class Geometry {
 public:
  using Gradients = Eigen::Matrix<double, Dim, Dim>;  ///< row i: tangential gradient of phi_i

  /// @param X  vertex positions [mm], (n, Dim)
  /// @param T  vertex indices per element, (m, Dim)
  /// @throws InvalidMesh  an element has no measure, or T points outside X
  Geometry(Points<Dim> X, Elements<Dim> T);
  /// @param border  its planes bound the shape
  Geometry(Points<Dim> X, Elements<Dim> T, const Border<Dim>& border);
  /// A part of a shape, open where the rest goes on: what is held does not move (directions()), and
  /// has no curvature. There is no enclosed().
  Geometry(Points<Dim> X, Elements<Dim> T, const Border<Dim>& border, const WholeShape& whole);
  /// The same elements with other vertex positions. The border's vertices are taken to stay on it.
  Geometry moved_to(Points<Dim> X) const;

  Eigen::Index n_vertices() const { return X_.rows(); }
  Eigen::Index n_elements() const { return elements().rows(); }
  const Points<Dim>& points() const { return X_; }
  const Elements<Dim>& elements() const { return topology_->elements(); }
  const Topology<Dim>& topology() const { return *topology_; }

  /// Length or area of each element [mm^(Dim-1)], (m).
  const Eigen::VectorXd& measures() const { return measures_; }
  /// Unit normals of the elements, (m, Dim).
  const Points<Dim>& normals() const { return normals_; }
  /// Tangential gradients of the basis functions of element t [1/mm]: J (J^T J)^-1 grad.
  const Gradients& basis_gradients(Eigen::Index t) const { return gradients_[t]; }
  /// Lumped mass of each vertex [mm^(Dim-1)], (n): integral of phi_i.
  const Eigen::VectorXd& lumped_mass() const { return lumped_mass_; }
  /// Nodal normals n_i = (1/m_i) integral of phi_i nu: row i of M^-1 N of (3.53) with lumped
  /// masses, (n, Dim). Shorter than 1 where the shape bends.
  const Points<Dim>& nodal_normals() const { return nodal_normals_; }

  /// Whether the same elements lie on the border and in its rim.
  bool has_border_of(const Geometry& other) const;
  /// Whether elements lie on the border, or it is a part.
  bool has_border() const { return border_ != nullptr; }
  Place place(Eigen::Index t) const { return border_ ? border_->places[t] : Place::kFree; }
  /// Whether a vertex has an element on the border, or is held.
  bool is_on_border(Eigen::Index i) const {
    return border_ && (border_->held[i] != 0 || is_fixed(i));
  }
  /// Whether the rest of a larger shape is left out.
  bool is_part() const { return border_ && !border_->is_fixed.empty(); }
  /// Length or area of each element as boundary integrals count it, (m): of the rim that at the
  /// positions where the border was given, of elements on the border 0.
  const Eigen::VectorXd& charged_measures() const {
    return border_ ? charged_measures_ : measures_;
  }
  /// The move of each vertex for a normal velocity of 1, (n, Dim): the nodal normals, but on the
  /// border a vector d in its planes with d . n = 1 for the normal n of the other elements (shorter
  /// where these are nearly tangential to the border), and 0 if there are none; 0 where it is held.
  const Points<Dim>& directions() const { return border_ ? directions_ : nodal_normals_; }
  /// Derivative of the enclosed content by the normal velocity of each vertex, (n): 0 of those that
  /// do not move.
  Eigen::VectorXd content_derivative() const;

  /// Length or area of Gamma.
  double measure() const { return measures_.sum(); }
  /// Area or volume enclosed, positive if the normals point outward:
  /// (1/Dim) integral of (x - c) . nu with c the first vertex.
  double enclosed() const;
  /// Radius of the ball (disc) with the enclosed volume (area): the shape's own length scale, of a
  /// part that of the whole.
  double radius() const;

 private:
  struct OnBorder {
    Points<Dim> normals;             // of the planes
    std::vector<Place> places;       // (m)
    std::vector<std::uint8_t> held;  // planes of the elements on the border that a vertex has, (n)
    Eigen::VectorXd rim_measures;    // (m), 0 elsewhere
    std::vector<char> is_fixed;      // of a part: does not move; empty if all may
    double whole_radius = 0;         // of a part
  };

  Geometry(Points<Dim> X, std::shared_ptr<const Topology<Dim>> topology,
           std::shared_ptr<const OnBorder> border);
  std::shared_ptr<OnBorder> on_border(const Border<Dim>& border) const;
  void set_border();
  bool is_fixed(Eigen::Index i) const { return is_part() && border_->is_fixed[i]; }

  Points<Dim> X_;
  std::shared_ptr<const Topology<Dim>> topology_;
  Eigen::VectorXd measures_;
  Points<Dim> normals_;
  std::vector<Gradients> gradients_;
  Eigen::VectorXd lumped_mass_;
  Points<Dim> nodal_normals_;
  std::shared_ptr<const OnBorder> border_;  // none if nothing lies on it and nothing is left out
  Eigen::VectorXd charged_measures_;
  Points<Dim> directions_;
};

/// Quadrature points of all elements, (m * q, Dim), element by element; `barycentric` (q, Dim).
template <int Dim>
Points<Dim> quadrature_points(
    const Points<Dim>& X, const Elements<Dim>& T,
    const Eigen::Matrix<double, Eigen::Dynamic, Dim, Eigen::RowMajor>& barycentric);

}  // namespace surf::fem
