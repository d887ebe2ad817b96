#include "libsurf/mesh/detail/connected_surface.h"

#include <tbb/parallel_for.h>

#include <cmath>
#include <limits>

namespace surf::mesh {
namespace {

/// The face across the side of each corner and the next one, in the order of elements().
Elements<3> neighbours(const TriMesh& mesh) {
  Elements<3> out(mesh.n_faces(), 3);
  for (int t = 0; t < out.rows(); ++t) {
    auto side = mesh.halfedge_handle(OpenMesh::FaceHandle(t));
    for (int i = 0; i < 3; ++i, side = mesh.next_halfedge_handle(side))
      out(t, i) = mesh.face_handle(mesh.opposite_halfedge_handle(side)).idx();
  }
  return out;
}

float below(double x) { return std::nextafter(float(x), -std::numeric_limits<float>::infinity()); }
float above(double x) { return std::nextafter(float(x), std::numeric_limits<float>::infinity()); }

std::vector<FloatBox> boxes_of(const Triangles& surface) {
  std::vector<FloatBox> out(std::size_t(surface.elements.rows()));
  tbb::parallel_for(std::size_t(0), out.size(), [&](std::size_t t) {
    const Eigen::Matrix3d corners =
        surface.points(surface.elements.row(Eigen::Index(t)), Eigen::all);
    for (int axis = 0; axis < 3; ++axis)
      out[t][axis] = {below(corners.col(axis).minCoeff()), above(corners.col(axis).maxCoeff())};
  });
  return out;
}

}  // namespace

ConnectedSurface::ConnectedSurface(const TriMesh& mesh)
    : triangles(to_triangles(mesh)),
      stars(triangles.elements, triangles.points.rows()),
      across(neighbours(mesh)),
      boxes(boxes_of(triangles)) {}

std::vector<int> ConnectedSurface::triangles_near(const Eigen::AlignedBox3d& box,
                                                  int n_axes) const {
  FloatBox of;
  for (int axis = 0; axis < 3; ++axis) of[axis] = {below(box.min()[axis]), above(box.max()[axis])};
  std::vector<int> out;
  for (int t = 0; t < n_triangles(); ++t) {
    int n = 0;
    for (int axis = 0; axis < 3; ++axis)
      n += boxes[t][axis][0] <= of[axis][1] && boxes[t][axis][1] >= of[axis][0];
    if (n >= n_axes) out.push_back(t);
  }
  return out;
}

}  // namespace surf::mesh
