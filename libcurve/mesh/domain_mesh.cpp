#include "libcurve/mesh/domain_mesh.h"

#include <CGAL/Constrained_Delaunay_triangulation_2.h>
#include <CGAL/Delaunay_mesh_face_base_2.h>
#include <CGAL/Delaunay_mesh_size_criteria_2.h>
#include <CGAL/Delaunay_mesh_vertex_base_2.h>
#include <CGAL/Delaunay_mesher_2.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Triangulation_face_base_with_info_2.h>
#include <CGAL/Triangulation_vertex_base_with_info_2.h>
#include <CGAL/spatial_sort.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <numeric>
#include <stdexcept>

#include "libcurve/mesh/distance.h"
#include "libsurf/base/error.h"
#include "libsurf/base/products.h"

namespace surf::curve {
namespace {

struct NodeInfo {
  int index = -1;
};

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using VertexBase = CGAL::Delaunay_mesh_vertex_base_2<
    Kernel, CGAL::Triangulation_vertex_base_with_info_2<NodeInfo, Kernel>>;
struct FaceInfo {
  int index = -1;
};
using FaceBase = CGAL::Delaunay_mesh_face_base_2<
    Kernel, CGAL::Constrained_triangulation_face_base_2<
                Kernel, CGAL::Triangulation_face_base_with_info_2<FaceInfo, Kernel>>>;
using Cdt = CGAL::Constrained_Delaunay_triangulation_2<
    Kernel, CGAL::Triangulation_data_structure_2<VertexBase, FaceBase>,
    CGAL::No_constraint_intersection_requiring_constructions_tag>;
using Point = Kernel::Point_2;

constexpr double kSquaredSine = 0.125;  // of 20.7 degrees, for which refinement is known to end

/// A triangle is bad if an edge is longer than the size at its centroid, or an angle too small.
class Criteria : public CGAL::Delaunay_mesh_size_criteria_2<Cdt> {
 public:
  explicit Criteria(const SizeField& sizes)
      : CGAL::Delaunay_mesh_size_criteria_2<Cdt>(kSquaredSine, 0), sizes_(&sizes) {}

  class Is_bad {  // NOLINT(readability-identifier-naming): as CGAL asks for it
   public:
    explicit Is_bad(const SizeField& sizes) : sizes_(&sizes) {}

    CGAL::Mesh_2::Face_badness operator()(const Quality& q) const {
      if (q.size() > 1) return CGAL::Mesh_2::IMPERATIVELY_BAD;
      return q.sine() < kSquaredSine ? CGAL::Mesh_2::BAD : CGAL::Mesh_2::NOT_BAD;
    }
    CGAL::Mesh_2::Face_badness operator()(const Cdt::Face_handle& face, Quality& q) const {
      std::array<Vector<2>, 3> p;
      for (int i = 0; i < 3; ++i)
        p[i] = {face->vertex(i)->point().x(), face->vertex(i)->point().y()};
      std::array<double, 3> squares;
      for (int i = 0; i < 3; ++i) squares[i] = (p[(i + 1) % 3] - p[i]).squaredNorm();
      std::sort(squares.begin(), squares.end());
      const double size = sizes_->at((p[0] + p[1] + p[2]) / 3);
      const Vector<2> a = p[1] - p[0], b = p[2] - p[0];
      const double twice_area = cross(a, b);
      q.second = squares[2] / (size * size);
      q.first = q.second > 1 ? 1 : twice_area * twice_area / (squares[2] * squares[1]);
      return (*this)(q);
    }

   private:
    const SizeField* sizes_;
  };
  Is_bad is_bad_object() const { return Is_bad(*sizes_); }

 private:
  const SizeField* sizes_;
};

class Mesher {
 public:
  Mesher(const Segments& curves, const Points<2>& outer) : curves_(curves) {
    for (Eigen::Index i = 0; i < curves.points.rows(); ++i) {
      nodes_.push_back(insert(curves.points.row(i)));
      nodes_.back()->info().index = int(i);
    }
    for (Eigen::Index i = 0; i < outer.rows(); ++i) corners_.push_back(insert(outer.row(i)));
    if (cdt_.number_of_vertices() != std::size_t(curves.points.rows() + outer.rows()))
      throw InvalidMesh(
          "domain mesh: curves have nodes at the same place, or on the box's corners");
    try {
      for (const auto e : curves.elements.rowwise())
        cdt_.insert_constraint(nodes_[e[0]], nodes_[e[1]]);
      for (std::size_t i = 0; i < corners_.size(); ++i)
        cdt_.insert_constraint(corners_[i], corners_[(i + 1) % corners_.size()]);
    } catch (const Cdt::Intersection_of_constraints_exception&) {
      throw InvalidMesh("domain mesh: curves meet one another or the border of the box");
    }
    for (const auto v : cdt_.finite_vertex_handles())
      if (v->info().index < 0 && !is_corner(v))
        throw InvalidMesh("domain mesh: curves meet one another or the border of the box");
  }

  void keep(const Points<2>& points) {
    std::vector<Point> sorted;
    for (const auto p : points.rowwise()) sorted.emplace_back(p[0], p[1]);
    CGAL::spatial_sort(sorted.begin(), sorted.end());
    for (const Point& p : sorted) last_ = cdt_.insert(p, hint());
  }

  DomainMesh refined(const SizeField& sizes) {
    CGAL::Delaunay_mesher_2<Cdt, Criteria> mesher(cdt_, Criteria(sizes));
    mesher.refine_mesh();
    number_nodes();
    copy_points();
    copy_triangles();
    for (Eigen::Index e = 0; e < curves_.elements.rows(); ++e) follow(int(e));
    mark_sides();
    return std::move(mesh_);
  }

 private:
  Cdt::Face_handle hint() const {
    return last_ == Cdt::Vertex_handle() ? Cdt::Face_handle() : last_->face();
  }
  Cdt::Vertex_handle insert(const Vector<2>& p) {
    return last_ = cdt_.insert({p[0], p[1]}, hint());
  }
  bool is_corner(Cdt::Vertex_handle v) const {
    return std::find(corners_.begin(), corners_.end(), v) != corners_.end();
  }

  void number_nodes() {
    int n = int(nodes_.size());
    for (const auto v : cdt_.finite_vertex_handles())
      if (v->info().index < 0) v->info().index = n++;
  }

  void copy_points() {
    mesh_.points.resize(Eigen::Index(cdt_.number_of_vertices()), 2);
    for (const auto v : cdt_.finite_vertex_handles())
      mesh_.points.row(v->info().index) << v->point().x(), v->point().y();
    mesh_.is_on_border.assign(cdt_.number_of_vertices(), 0);
    auto around = cdt_.incident_vertices(cdt_.infinite_vertex());
    const auto end = around;
    do mesh_.is_on_border[around->info().index] = 1;
    while (++around != end);
  }

  void copy_triangles() {
    mesh_.triangles.resize(Eigen::Index(cdt_.number_of_faces()), 3);
    int n = 0;
    for (const auto face : cdt_.finite_face_handles()) {
      for (int i = 0; i < 3; ++i) mesh_.triangles(n, i) = face->vertex(i)->info().index;
      face->info().index = n++;
      faces_.push_back(face);
    }
  }

  /// The edges that element e has become: a chain of constrained edges through new nodes, each of
  /// which has two.
  void follow(int e) {
    const auto start = nodes_[curves_.elements(e, 0)], end = nodes_[curves_.elements(e, 1)];
    std::vector<Cdt::Edge> first;
    cdt_.incident_constraints(start, std::back_inserter(first));
    for (const Cdt::Edge& edge : first) {
      std::vector<Cdt::Vertex_handle> chain = {start, other(edge, start)};
      while (is_new(chain.back())) chain.push_back(next(chain.back(), chain[chain.size() - 2]));
      if (chain.back() != end) continue;
      add_chain(e, chain);
      return;
    }
    throw InvalidMesh(fmt::format("domain mesh: element {} runs through a node of another", e));
  }

  bool is_new(Cdt::Vertex_handle v) const { return v->info().index >= int(nodes_.size()); }

  static Cdt::Vertex_handle other(const Cdt::Edge& edge, Cdt::Vertex_handle v) {
    const auto a = edge.first->vertex(Cdt::cw(edge.second));
    return a == v ? edge.first->vertex(Cdt::ccw(edge.second)) : a;
  }

  Cdt::Vertex_handle next(Cdt::Vertex_handle v, Cdt::Vertex_handle from) const {
    std::vector<Cdt::Edge> edges;
    cdt_.incident_constraints(v, std::back_inserter(edges));
    for (const Cdt::Edge& edge : edges)
      if (other(edge, v) != from) return other(edge, v);
    throw std::logic_error("domain mesh: a constraint ends in the middle of an element");
  }

  void add_chain(int e, const std::vector<Cdt::Vertex_handle>& chain) {
    const Vector<2> a = curves_.points.row(curves_.elements(e, 0)),
                    side = curves_.points.row(curves_.elements(e, 1)).transpose() - a;
    const auto place = [&](Cdt::Vertex_handle v) {
      return (Vector<2>(v->point().x(), v->point().y()) - a).dot(side) / side.squaredNorm();
    };
    for (std::size_t i = 1; i < chain.size(); ++i) {
      TraceEdge edge;
      edge.start = chain[i - 1]->info().index;
      edge.end = chain[i]->info().index;
      edge.element = e;
      edge.from = i == 1 ? 0 : place(chain[i - 1]);
      edge.to = i + 1 == chain.size() ? 1 : place(chain[i]);
      Cdt::Face_handle face;
      int at = 0;
      if (!cdt_.is_edge(chain[i - 1], chain[i], face, at))
        throw std::logic_error("domain mesh: a constraint is no edge");
      const bool is_left = face->vertex(Cdt::ccw(at)) == chain[i - 1];
      const auto opposite = face->neighbor(at);
      edge.inside = (is_left ? face : opposite)->info().index;
      edge.outside = (is_left ? opposite : face)->info().index;
      mesh_.trace.push_back(edge);
    }
  }

  /// From the triangles at the curves to all that no curve parts from them.
  void mark_sides() {
    std::vector<signed char> side(mesh_.triangles.rows(), -1);
    std::vector<int> open;
    const auto mark = [&](int triangle, signed char value) {
      if (side[triangle] == 1 - value)
        throw InvalidMesh("domain mesh: the curves do not bound a domain: both sides of one meet");
      if (side[triangle] >= 0) return;
      side[triangle] = value;
      open.push_back(triangle);
    };
    for (const TraceEdge& edge : mesh_.trace) {
      mark(edge.inside, 1);
      mark(edge.outside, 0);
    }
    while (!open.empty()) {
      const int triangle = open.back();
      open.pop_back();
      const auto face = faces_[triangle];
      for (int i = 0; i < 3; ++i)
        if (!face->is_constrained(i) && !cdt_.is_infinite(face->neighbor(i)))
          mark(face->neighbor(i)->info().index, side[triangle]);
    }
    for (const signed char value : side) mesh_.is_inside.push_back(value == 1);
  }

  const Segments& curves_;
  Cdt cdt_;
  Cdt::Vertex_handle last_;
  std::vector<Cdt::Vertex_handle> nodes_, corners_;
  std::vector<Cdt::Face_handle> faces_;
  DomainMesh mesh_;
};

}  // namespace

SizeField::SizeField(const Points<2>& outer, double max_size, double cell)
    : lower_(outer.colwise().minCoeff().transpose()), max_size_(max_size), cell_(cell) {
  const Vector<2> extent = outer.colwise().maxCoeff().transpose() - lower_;
  n_ = (extent / cell).array().ceil().max(1).cast<int>();
  sizes_.assign(std::size_t(n_[0]) * n_[1], max_size);
  before_.resize(sizes_.size());
}

Eigen::Array2i SizeField::cell_of(const Vector<2>& x) const {
  return ((x - lower_) / cell_).array().floor().cast<int>().max(0).min(n_.array() - 1);
}

std::size_t SizeField::index(const Vector<2>& x) const {
  const Eigen::Array2i at = cell_of(x);
  return std::size_t(at[1]) * n_[0] + at[0];
}

void SizeField::limit(const Vector<2>& x, double size, double error) {
  const std::size_t cell = index(x);
  if (size >= sizes_[cell]) return;
  // Several triangles of a cell are one lowering.
  if (std::vector<Bound>& before = before_[cell]; before.empty() || size <= sizes_[cell] / 2)
    before.push_back({sizes_[cell], error});
  else
    before.back().error = std::max(before.back().error, error);
  sizes_[cell] = size;
}

/// The cells that the boxes of these triangles meet.
std::vector<char> SizeField::touched(const DomainMesh& mesh,
                                     const std::vector<char>& triangles) const {
  std::vector<char> out(sizes_.size(), 0);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    if (!triangles[t]) continue;
    Eigen::AlignedBox2d box;
    for (int i = 0; i < 3; ++i) box.extend(mesh.points.row(mesh.triangles(t, i)).transpose());
    const Eigen::Array2i first = cell_of(box.min()), last = cell_of(box.max());
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i) out[std::size_t(j) * n_[0] + i] = 1;
  }
  return out;
}

int SizeField::raise(const DomainMesh& mesh, const std::vector<char>& is_held, double budget) {
  const std::vector<char> is_fixed = touched(mesh, is_held);
  std::vector<std::pair<double, std::size_t>> costs;
  for (std::size_t cell = 0; cell < sizes_.size(); ++cell)
    if (!before_[cell].empty() && !is_fixed[cell])
      costs.emplace_back(before_[cell].back().error * cell_ * cell_, cell);
  std::sort(costs.begin(), costs.end());
  int n_raised = 0;
  for (const auto& [cost, cell] : costs) {
    budget -= cost;
    if (budget < 0) break;
    sizes_[cell] = before_[cell].back().size;
    before_[cell].pop_back();
    ++n_raised;
  }
  return n_raised;
}

DomainMesh mesh_domain(const Segments& curves, const Points<2>& outer, const SizeField& sizes,
                       const Points<2>& kept) {
  Mesher mesher(curves, outer);
  mesher.keep(kept);
  return mesher.refined(sizes);
}

Points<2> reusable_nodes(const DomainMesh& mesh, const Segments& curves, const SizeField& sizes) {
  constexpr double kClearance = 0.8;  // of the distance to the nearest node
  constexpr double kGrading = 0.25;   // spacing by distance to the curves
  const DistanceToCurves distance(curves);
  std::vector<double> spacing(mesh.points.rows(), std::numeric_limits<double>::infinity());
  for (const auto t : mesh.triangles.rowwise())
    for (int i = 0; i < 3; ++i) {
      const double length = (mesh.points.row(t[i]) - mesh.points.row(t[(i + 1) % 3])).norm();
      for (const int node : {t[i], t[(i + 1) % 3]}) spacing[node] = std::min(spacing[node], length);
    }
  std::vector<char> is_free(mesh.points.rows(), 1);
  for (const TraceEdge& edge : mesh.trace) is_free[edge.start] = is_free[edge.end] = 0;
  std::vector<int> kept;
  for (Eigen::Index i = 0; i < mesh.points.rows(); ++i) {
    if (!is_free[i] || mesh.is_on_border[i]) continue;
    const double d = distance(mesh.points.row(i));
    const double size = sizes.at(mesh.points.row(i));
    if (d >= kClearance * spacing[i] && spacing[i] >= kGrading * std::min(d, size))
      kept.push_back(int(i));
  }
  return mesh.points(kept, Eigen::all);
}

TriangleFinder::TriangleFinder(const DomainMesh& mesh)
    : mesh_(mesh), lower_(mesh.points.colwise().minCoeff().transpose()) {
  const Vector<2> extent = mesh.points.colwise().maxCoeff().transpose() - lower_;
  cell_ = std::sqrt(extent.prod() / double(mesh.triangles.rows()));
  n_ = (extent / cell_).array().ceil().max(1).cast<int>();
  in_cell_.resize(std::size_t(n_[0]) * n_[1]);
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    Eigen::AlignedBox2d box;
    for (int i = 0; i < 3; ++i) box.extend(mesh.points.row(mesh.triangles(t, i)).transpose());
    const Eigen::Array2i first = cell_of(box.min()), last = cell_of(box.max());
    for (int j = first[1]; j <= last[1]; ++j)
      for (int i = first[0]; i <= last[0]; ++i)
        in_cell_[std::size_t(j) * n_[0] + i].push_back(int(t));
  }
}

Eigen::Array2i TriangleFinder::cell_of(const Vector<2>& x) const {
  return ((x - lower_) / cell_).array().floor().cast<int>().max(0).min(n_ - 1);
}

TriangleFinder::Place TriangleFinder::operator()(const Vector<2>& x) const {
  const Eigen::Array2i cell = cell_of(x);
  const std::vector<int>& near = in_cell_[std::size_t(cell[1]) * n_[0] + cell[0]];
  if (!near.empty()) return among(near, x);
  std::vector<int> all(mesh_.triangles.rows());  // the corners of the grid round an oblique box
  std::iota(all.begin(), all.end(), 0);
  return among(all, x);
}

TriangleFinder::Place TriangleFinder::among(const std::vector<int>& triangles,
                                            const Vector<2>& x) const {
  constexpr double kRounding = 1e-12;
  Place best{-1, {}};
  for (const int t : triangles) {
    const Vector<2> p = mesh_.points.row(mesh_.triangles(t, 0)),
                    a = mesh_.points.row(mesh_.triangles(t, 1)).transpose() - p,
                    b = mesh_.points.row(mesh_.triangles(t, 2)).transpose() - p, d = x - p;
    const double twice = cross(a, b);
    Eigen::Vector3d at;
    at[1] = cross(d, b) / twice;
    at[2] = cross(a, d) / twice;
    at[0] = 1 - at[1] - at[2];
    if (best.triangle < 0 || at.minCoeff() > best.barycentric.minCoeff()) best = {t, at};
    if (at.minCoeff() >= -kRounding) return {t, at};
  }
  return best;
}

double smallest_angle(const DomainMesh& mesh) {
  double smallest = std::numbers::pi;
  for (const auto t : mesh.triangles.rowwise())
    for (int i = 0; i < 3; ++i) {
      const Vector<2> p = mesh.points.row(t[i]),
                      a = mesh.points.row(t[(i + 1) % 3]).transpose() - p,
                      b = mesh.points.row(t[(i + 2) % 3]).transpose() - p;
      smallest = std::min(smallest, std::atan2(cross(a, b), a.dot(b)));
    }
  return smallest * 180 / std::numbers::pi;
}

}  // namespace surf::curve
