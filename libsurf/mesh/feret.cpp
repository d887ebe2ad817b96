#include "libsurf/mesh/feret.h"

#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_mesh.h>
#include <CGAL/convex_hull_3.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numeric>
#include <vector>

#include "libsurf/base/error.h"

namespace surf::mesh {
namespace {

using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
using HullMesh = CGAL::Surface_mesh<Kernel::Point_3>;
using Box = Eigen::AlignedBox3d;

/// An edge with the outward normals of its two faces.
struct HullEdge {
  int from, to;
  Vector<3> first_normal, second_normal;
};

struct Hull {
  std::vector<Vector<3>> points;
  std::vector<std::vector<int>> neighbours;  ///< of each point
  std::vector<HullEdge> edges;
};

/// @param number  of each vertex of the mesh among the points
Vector<3> face_normal(const HullMesh& mesh, HullMesh::Face_index face,
                      const std::vector<int>& number, const std::vector<Vector<3>>& points) {
  std::vector<int> vertices;
  for (const auto vertex : mesh.vertices_around_face(mesh.halfedge(face)))
    vertices.push_back(number[vertex.idx()]);
  std::rotate(vertices.begin(), std::min_element(vertices.begin(), vertices.end()), vertices.end());
  std::vector<Vector<3>> corners;
  for (const int vertex : vertices) corners.push_back(points[vertex]);
  Vector<3> normal = Vector<3>::Zero();
  for (std::size_t k = 2; k < corners.size(); ++k)
    normal += (corners[k - 1] - corners[0]).cross(corners[k] - corners[0]);
  return normal.stableNormalized();
}

bool is_flat(const std::vector<Kernel::Point_3>& points) {
  std::size_t third = 2;
  while (third < points.size() && CGAL::collinear(points[0], points[1], points[third])) ++third;
  return third >= points.size() ||
         std::all_of(points.begin(), points.end(), [&](const Kernel::Point_3& point) {
           return CGAL::coplanar(points[0], points[1], points[third], point);
         });
}

Hull convex_hull(const Triangles& surface) {
  std::vector<Kernel::Point_3> points;
  for (const auto element : surface.elements.rowwise())
    for (const int vertex : element)
      points.emplace_back(surface.points(vertex, 0), surface.points(vertex, 1),
                          surface.points(vertex, 2));
  std::sort(points.begin(), points.end());
  points.erase(std::unique(points.begin(), points.end()), points.end());
  if (is_flat(points))
    throw InvalidMesh("Feret diameters: the points of the surface lie in a plane");
  HullMesh mesh;
  CGAL::convex_hull_3(points.begin(), points.end(), mesh);
  Hull hull;
  // The order in which CGAL gives vertices and edges changes from run to run.
  std::vector<int> order, number(mesh.number_of_vertices());
  for (const auto vertex : mesh.vertices()) order.push_back(int(vertex.idx()));
  const auto point = [&](int k) { return mesh.point(HullMesh::Vertex_index(std::uint32_t(k))); };
  std::sort(order.begin(), order.end(), [&](int a, int b) { return point(a) < point(b); });
  for (const int k : order) {
    number[k] = int(hull.points.size());
    hull.points.emplace_back(point(k).x(), point(k).y(), point(k).z());
  }
  std::vector<Vector<3>> normals;
  for (const auto face : mesh.faces())
    normals.push_back(face_normal(mesh, face, number, hull.points));
  for (const auto edge : mesh.edges()) {
    auto side = mesh.halfedge(edge);
    if (number[mesh.source(side).idx()] > number[mesh.target(side).idx()])
      side = mesh.opposite(side);
    hull.edges.push_back({number[mesh.source(side).idx()], number[mesh.target(side).idx()],
                          normals[mesh.face(side).idx()],
                          normals[mesh.face(mesh.opposite(side)).idx()]});
  }
  std::sort(hull.edges.begin(), hull.edges.end(), [](const HullEdge& a, const HullEdge& b) {
    return std::pair(a.from, a.to) < std::pair(b.from, b.to);
  });
  hull.neighbours.resize(hull.points.size());
  for (const HullEdge& edge : hull.edges) {
    hull.neighbours[edge.from].push_back(edge.to);
    hull.neighbours[edge.to].push_back(edge.from);
  }
  return hull;
}

/// The two points that are farthest apart: halves of boxes, those that are farthest apart first,
/// as long as there may be better ones in them.
class Farthest {
 public:
  explicit Farthest(const std::vector<Vector<3>>& points) : points_(points), order_(points.size()) {
    std::iota(order_.begin(), order_.end(), 0);
    build(0, int(order_.size()));
    int from = 0;
    for (int sweep = 0; sweep < 3; ++sweep) {
      int to = from;
      for (int k = 0; k < int(points.size()); ++k)
        if (squared(from, k) > squared(from, to)) to = k;
      keep(from, to);
      from = to;
    }
    search(0, 0);
  }
  int from() const { return from_; }
  int to() const { return to_; }

 private:
  struct Node {
    Box box;
    int begin, end, left = -1, right = -1;
  };
  static constexpr int kLeaf = 8;

  double squared(int a, int b) const { return (points_[a] - points_[b]).squaredNorm(); }
  void keep(int a, int b) {
    if (squared(a, b) > best_) best_ = squared(a, b), from_ = a, to_ = b;
  }

  int build(int begin, int end) {
    const int own = int(nodes_.size());
    nodes_.push_back({Box(), begin, end});
    Box box;
    for (int k = begin; k < end; ++k) box.extend(points_[order_[k]]);
    nodes_[own].box = box;
    if (end - begin <= kLeaf) return own;
    Eigen::Index axis;
    box.sizes().maxCoeff(&axis);
    const int middle = (begin + end) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](int a, int b) { return points_[a][axis] < points_[b][axis]; });
    const int left = build(begin, middle), right = build(middle, end);
    nodes_[own].left = left;
    nodes_[own].right = right;
    return own;
  }

  double bound(int a, int b) const {
    const Box &p = nodes_[a].box, &q = nodes_[b].box;
    return (p.max() - q.min()).cwiseAbs().cwiseMax((q.max() - p.min()).cwiseAbs()).squaredNorm();
  }

  void search(int a, int b) {
    if (bound(a, b) <= best_) return;
    const Node &p = nodes_[a], &q = nodes_[b];
    if (p.left < 0 && q.left < 0) {
      for (int i = p.begin; i < p.end; ++i)
        for (int j = q.begin; j < q.end; ++j) keep(order_[i], order_[j]);
      return;
    }
    std::array<std::pair<int, int>, 2> parts = {{{p.left, b}, {p.right, b}}};
    if (p.left < 0 || (q.left >= 0 && q.end - q.begin > p.end - p.begin))
      parts = {{{a, q.left}, {a, q.right}}};
    if (bound(parts[0].first, parts[0].second) < bound(parts[1].first, parts[1].second))
      std::swap(parts[0], parts[1]);
    for (const auto& [first, second] : parts) search(first, second);
  }

  const std::vector<Vector<3>>& points_;
  std::vector<int> order_;
  std::vector<Node> nodes_;
  double best_ = -1;
  int from_ = 0, to_ = 0;
};

/// The least of n . p - min n . v over all directions n, p being the point farthest along n.
class Width {
 public:
  explicit Width(const Hull& hull) : hull_(hull) {
    Box box;
    for (const auto& point : hull.points) box.extend(point);
    rounding_mm_ = 1e-12 * (box.sizes().norm() + box.max().cwiseAbs().maxCoeff());
    int vertex = 0;
    for (const HullEdge& edge : hull.edges) {
      vertex = support(edge.first_normal, vertex);
      const int other = support(edge.second_normal, vertex);
      keep(edge.from, edge.first_normal, vertex);
      keep(edge.from, edge.second_normal, other);
      follow(edge.from, edge.first_normal, vertex, edge.second_normal, other);
    }
  }
  double width_mm() const { return width_mm_; }
  const Vector<3>& direction() const { return direction_; }

 private:
  /// The vertex with the least n . v; downhill from `start`, which on a convex body ends there.
  int support(const Vector<3>& n, int start) const {
    for (int at = start;;) {
      int next = at;
      for (const int other : hull_.neighbours[at])
        if (n.dot(hull_.points[other]) < n.dot(hull_.points[next])) next = other;
      if (next == at) return at;
      at = next;
    }
  }

  void keep(int p, const Vector<3>& n, int v) {
    const double width = n.dot(hull_.points[p] - hull_.points[v]);
    if (width < width_mm_ - rounding_mm_) width_mm_ = width, direction_ = n;
  }

  /// Between the normals `a` and `b` of an edge's faces the width is least where the support on the
  /// other side changes from one vertex to another.
  void follow(int p, const Vector<3>& a, int at_a, const Vector<3>& b, int at_b) {
    if (at_a == at_b) return;
    const Vector<3> way = hull_.points[at_b] - hull_.points[at_a];
    const double share_a = -b.dot(way), share_b = a.dot(way);
    if (!(share_a > 0 && share_b > 0)) return;  // the change is at an end
    const Vector<3> n = (share_a * a + share_b * b).stableNormalized();
    const int at_n = support(n, at_a);
    if (n.dot(hull_.points[at_a] - hull_.points[at_n]) <= rounding_mm_) {
      keep(p, n, at_n);
      return;
    }
    follow(p, a, at_a, n, at_n);
    follow(p, n, at_n, b, at_b);
  }

  const Hull& hull_;
  double rounding_mm_ = 0;
  double width_mm_ = std::numeric_limits<double>::infinity();
  Vector<3> direction_ = Vector<3>::Zero();
};

/// Planes with more than three points of the hull have many triangulations, whose normals differ by
/// rounding.
double rounded(double x) { return std::round(x * 1e9) / 1e9; }

}  // namespace

FeretDiameters feret_diameters(const Triangles& surface) {
  const Hull hull = convex_hull(surface);
  const Farthest farthest(hull.points);
  const Width width(hull);
  FeretDiameters out;
  out.largest_from_mm = hull.points[farthest.from()];
  out.largest_to_mm = hull.points[farthest.to()];
  out.largest_mm = (out.largest_to_mm - out.largest_from_mm).norm();
  out.smallest_mm = rounded(width.width_mm());
  Eigen::Index axis;
  width.direction().cwiseAbs().maxCoeff(&axis);
  const double sign = width.direction()[axis] < 0 ? -1 : 1;
  out.smallest_direction = (sign * width.direction()).unaryExpr(&rounded);
  return out;
}

}  // namespace surf::mesh
