// Random evolutions of surfaces that merge, split and change genus, against a level set that is
// moved by the same field on a fine grid.
#pragma once

#include <openvdb/openvdb.h>
#include <openvdb/tools/Composite.h>
#include <openvdb/tools/LevelSetAdvect.h>
#include <openvdb/tools/LevelSetFilter.h>
#include <openvdb/tools/LevelSetMeasure.h>
#include <openvdb/tools/LevelSetSphere.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "libsurf/fem/geometry.h"
#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/moving_surface.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/mesh/verify.h"

namespace surf::mesh::fuzz {

constexpr double kEdge = 0.1, kResolution = 0.7 * kEdge;
constexpr int kSteps = 30;

/// A sum of waves and a shear, and a speed along the normal.
struct Flow {
  Eigen::Matrix3d frequency, shear;
  Eigen::Vector3d phase;
  double amplitude, normal_speed;

  explicit Flow(std::mt19937& random) {
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (double& value : frequency.reshaped()) value = 2 * uniform(random);
    for (double& value : shear.reshaped()) value = 0.3 * uniform(random);
    for (double& value : phase) value = 3 * uniform(random);
    amplitude = 0.5 * std::abs(uniform(random));
    normal_speed = uniform(random);
    if (std::abs(normal_speed) < 0.3) normal_speed = std::copysign(0.3, normal_speed);
  }
  Eigen::Vector3d velocity(const Eigen::Vector3d& x) const {
    return shear * x + amplitude * ((frequency * x + phase).array().sin()).matrix();
  }
};

/// What OpenVDB asks of a velocity.
class VelocityField {
 public:
  using VectorType = openvdb::Vec3s;
  using ValueType = float;
  VelocityField(const Flow& flow, openvdb::math::Transform::Ptr transform)
      : flow_(flow), transform_(std::move(transform)) {}
  const openvdb::math::Transform& transform() const { return *transform_; }
  VectorType operator()(const openvdb::Vec3d& x, float) const {
    const Eigen::Vector3d v = flow_.velocity({x[0], x[1], x[2]});
    return VectorType(float(v[0]), float(v[1]), float(v[2]));
  }
  VectorType operator()(const openvdb::Coord& node, float time) const {
    return (*this)(transform_->indexToWorld(node), time);
  }

 private:
  const Flow& flow_;
  openvdb::math::Transform::Ptr transform_;
};

struct Ball {
  Eigen::Vector3d center;
  double radius;
};

inline Triangles surface_of(const std::vector<Ball>& balls) {
  std::vector<Triangles> parts;
  for (const Ball& b : balls) parts.push_back(mesh::ball(b.center, b.radius, kEdge));
  return mesh::joined(parts);
}

inline openvdb::FloatGrid::Ptr level_set(const std::vector<Ball>& balls, double voxel) {
  openvdb::FloatGrid::Ptr all;
  for (const Ball& b : balls) {
    auto grid = openvdb::tools::createLevelSetSphere<openvdb::FloatGrid>(
        float(b.radius), {float(b.center[0]), float(b.center[1]), float(b.center[2])},
        float(voxel));
    if (all)
      openvdb::tools::csgUnion(*all, *grid);
    else
      all = grid;
  }
  return all;
}

/// Volume in which the two domains differ.
inline double difference(const Triangles& surface, const openvdb::FloatGrid& grid, double voxel,
                         double& volume) {
  openvdb::CoordBBox box = grid.evalActiveVoxelBoundingBox();
  for (const auto point : surface.points.rowwise())
    box.expand(openvdb::Coord(int(std::floor(point[0] / voxel)), int(std::floor(point[1] / voxel)),
                              int(std::floor(point[2] / voxel))));
  box.expand(2);
  const std::array<int, 3> size = {box.dim().x(), box.dim().y(), box.dim().z()};
  const Eigen::Affine3d to_world =
      Eigen::Scaling(voxel) * Eigen::Translation3d(box.min().x(), box.min().y(), box.min().z());
  const auto inside = mesh::rasterize(surface, size, to_world);
  const auto values = grid.getConstAccessor();
  std::size_t at = 0, n = 0, n_inside = 0;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i, ++at) {
        const bool is_inside = values.getValue(box.min() + openvdb::Coord(i, j, k)) < 0;
        n += is_inside != (inside[at] != 0);
        n_inside += is_inside;
      }
  volume = double(n_inside) * voxel * voxel * voxel;
  return double(n) * voxel * voxel * voxel;
}

struct Outcome {
  bool is_valid = true, keeps_promise = true, has_vanished = false;
  double difference = 0;      // in units of resolution times the area of the larger of the two
  double own_difference = 0;  // of the surface's own area
  double left = 0;            // of a vanished one: volume of the level set, mm^3
  double surgery_change = 0;  // largest of a volume by an event, of area times resolution
  int n_events = 0;
  std::map<std::string, int> kinds;
};

struct Topologies {
  std::vector<int> genera;
  explicit Topologies(const Triangles& surface) {
    for (const auto& part : mesh::measure_components(surface)) genera.push_back(part.genus());
    std::sort(genera.begin(), genera.end());
  }
};

/// One evolution from up to ten balls.
inline Outcome run(int seed, mesh::Topology topology) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> place(-1, 1), radius(0.2, 0.5);
  const int n_balls = 1 + seed % 10;
  std::vector<Ball> balls;
  for (int attempt = 0; attempt < 200 && int(balls.size()) < n_balls; ++attempt) {
    const Ball b{{place(random), place(random), place(random)}, radius(random)};
    const bool is_free =
        topology == mesh::Topology::kFree ||
        std::none_of(balls.begin(), balls.end(), [&](const Ball& other) {
          return (other.center - b.center).norm() < other.radius + b.radius + kEdge;
        });
    if (is_free) balls.push_back(b);
  }
  const Flow flow(random);
  mesh::MovingSurfaceOptions options;
  options.edge_length_mm = kEdge;
  options.topology = topology;
  options.coarseness = seed % 3 == 0 ? 2 : 1;
  if (options.coarseness > 1) options.adaptivity.geometry_tolerance_mm = 0.3 * kEdge;
  const bool has_reference = topology == mesh::Topology::kFree;
  mesh::MovingSurface surface(surface_of(balls), options);
  const Topologies initial(surface.simplices());

  const double voxel = kEdge / 2;
  auto grid = level_set(balls, voxel);
  const double dt = 0.4 * kEdge / 1.5;  // velocities are about 1.5 at most
  Outcome out;
  for (int step = 0; step < kSteps && !out.has_vanished; ++step) {
    const fem::Geometry<3> shape = surface.geometry();
    Points<3> to = shape.points();
    for (Eigen::Index i = 0; i < to.rows(); ++i) {
      const Vector<3> normal = Vector<3>(shape.nodal_normals().row(i)).normalized();
      const Vector<3> v = flow.velocity(to.row(i)) + flow.normal_speed * normal;
      to.row(i) += dt * v.transpose();
    }
    surface.restrict_move(to);
    surface.move_to(to);
    surface.mend();
    for (const auto& event : surface.take_events()) {
      ++out.n_events;
      ++out.kinds[to_string(event.kind)];
      out.surgery_change = std::max(
          out.surgery_change, std::abs(event.enclosed_change) / (shape.measure() * kResolution));
    }
    out.has_vanished = !surface.obstacle().empty() || surface.simplices().elements.rows() < 60;
    if (!has_reference || !grid) continue;
    {
      openvdb::tools::LevelSetAdvection<openvdb::FloatGrid, VelocityField> advection(
          *grid, VelocityField(flow, grid->transformPtr()));
      advection.setSpatialScheme(openvdb::math::HJWENO5_BIAS);
      advection.setTemporalScheme(openvdb::math::TVD_RK2);
      advection.advect(0, float(dt));
    }
    openvdb::tools::LevelSetFilter<openvdb::FloatGrid> filter(*grid);
    filter.offset(float(-flow.normal_speed * dt));
  }
  const Triangles end = surface.simplices();
  if (out.has_vanished && has_reference)
    difference({Points<3>(0, 3), Elements<3>(0, 3)}, *grid, voxel, out.left);
  out.is_valid = mesh::verify(end).passed();
  if (topology == mesh::Topology::kFixed)
    out.keeps_promise = Topologies(end).genera == initial.genera;
  if (topology == mesh::Topology::kGenus0) out.keeps_promise = Topologies(end).genera.back() == 0;
  if (has_reference && !out.has_vanished) {
    double volume = 0;
    const double differing = difference(end, *grid, voxel, volume), area = mesh::area_mm2(end);
    out.own_difference = differing / (area * kResolution);
    out.difference =
        differing / (std::max(area, openvdb::tools::levelSetArea(*grid)) * kResolution);
  }
  return out;
}

}  // namespace surf::mesh::fuzz
