#include "libsurf/volume/phantom.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/base/random.h"

namespace surf::volume {
namespace {

using Eigen::Vector3d;

constexpr double kEdgeWidthUnits = 0.05;
constexpr double kRodRadius = 0.022, kRodDistance = 0.07, kRodOffset = 0.45, kRodEnd = 0.66;

double ball(const Vector3d& u, const Vector3d& center, double radius) {
  return (u - center).norm() - radius;
}

double box(const Vector3d& u, const Vector3d& half_sides) {
  const Vector3d beyond = u.cwiseAbs() - half_sides;
  return beyond.cwiseMax(0).norm() + std::min(beyond.maxCoeff(), 0.0);
}

double torus(const Vector3d& u, double radius, double tube_radius) {
  return std::hypot(u.head<2>().norm() - radius, u[2]) - tube_radius;
}

double capsule(const Vector3d& u, const Capsule& c) {
  const Vector3d axis = c.end - c.start;
  const double at = std::clamp((u - c.start).dot(axis) / axis.squaredNorm(), 0.0, 1.0);
  return (u - c.start - at * axis).norm() - c.radius;
}

template <std::size_t N>
double capsules(const Vector3d& u, const std::array<Capsule, N>& all) {
  double distance = capsule(u, all[0]);
  for (std::size_t n = 1; n < N; ++n) distance = std::min(distance, capsule(u, all[n]));
  return distance;
}

double vessel(const Vector3d& u) {
  // Radii fall from branch to branch by about 2^(1/3) (Murray's law) and stay above the edge's
  // width, so that every branch reaches the value 1.
  static const std::array<Capsule, 8> kBranches = {{
      {{0, 0, -0.75}, {0, 0, 0}, 0.14},
      {{0, 0, 0}, {0.35, 0, 0.35}, 0.11},
      {{0, 0, 0}, {-0.35, 0.05, 0.3}, 0.11},
      {{0.35, 0, 0.35}, {0.45, 0.3, 0.65}, 0.08},
      {{0.35, 0, 0.35}, {0.5, -0.3, 0.6}, 0.08},
      {{-0.35, 0.05, 0.3}, {-0.4, 0.3, 0.65}, 0.08},
      {{-0.35, 0.05, 0.3}, {-0.7, -0.2, 0.4}, 0.08},
      {{0, 0, -0.4}, {0, -0.6, -0.15}, 0.07},
  }};
  return capsules(u, kBranches);
}

double shell(const Vector3d& u) {
  const double radius = u.norm();
  return std::max(radius - 0.6, 0.3 - radius);
}

double rods(const Vector3d& u) {
  const double outside = ball(u, Vector3d::Zero(), 0.6);
  if (outside >= kRodRadius) return outside;  // no rod is deeper
  return std::max(outside, -capsules(u, rod_capsules()));
}

double edge_profile(double distance, double width) {
  const double t = std::clamp(-distance / width, -1.0, 1.0);
  return 0.5 * (1 + t + std::sin(std::numbers::pi * t) / std::numbers::pi);
}

/// Chord `n` of a sequence: its direction is uniform on the sphere, its middle uniform in the disk
/// of radius kRodOffset across it.
Capsule random_rod(std::uint64_t n) {
  const auto random = [n](int k) { return uniform_random(0, 4 * n + k); };
  const double z = 2 * random(0) - 1, turn = 2 * std::numbers::pi * random(1);
  const double r = std::sqrt(1 - z * z);
  const Vector3d axis(r * std::cos(turn), r * std::sin(turn), z);
  const Vector3d across = axis.unitOrthogonal();
  const double offset = kRodOffset * std::sqrt(random(2)), angle = 2 * std::numbers::pi * random(3);
  const Vector3d middle =
      offset * (std::cos(angle) * across + std::sin(angle) * axis.cross(across));
  const double half_length = std::sqrt(kRodEnd * kRodEnd - offset * offset);
  return {middle - half_length * axis, middle + half_length * axis, kRodRadius};
}

/// Distance of two segments.
double axis_distance(const Capsule& a, const Capsule& b) {
  const Vector3d u = a.end - a.start, v = b.end - b.start, w = b.start - a.start;
  const Vector3d normal = u.cross(v);
  const double s = w.cross(v).dot(normal) / normal.squaredNorm(),
               t = w.cross(u).dot(normal) / normal.squaredNorm();
  if (s >= 0 && s <= 1 && t >= 0 && t <= 1) return std::abs(normal.dot(w)) / normal.norm();
  return std::min({capsule(b.start, a) + a.radius, capsule(b.end, a) + a.radius,
                   capsule(a.start, b) + b.radius, capsule(a.end, b) + b.radius});
}

}  // namespace

const std::map<std::string, PhantomKind>& phantom_kinds() {
  static const std::map<std::string, PhantomKind> kinds = {
      {"ball", PhantomKind::kBall},     {"two-balls", PhantomKind::kTwoBalls},
      {"box", PhantomKind::kBox},       {"torus", PhantomKind::kTorus},
      {"vessel", PhantomKind::kVessel}, {"separate-balls", PhantomKind::kSeparateBalls},
      {"shell", PhantomKind::kShell},   {"tree", PhantomKind::kTree},
      {"rods", PhantomKind::kRods}};
  return kinds;
}

std::string PhantomOptions::error() const {
  for (const int n : size)
    if (n < 2 || n > 4096)
      return fmt::format("PhantomOptions::size = {} violates 2 <= size <= 4096", n);
  if (spacing_mm && !(spacing_mm->allFinite() && spacing_mm->minCoeff() > 0))
    return fmt::format("PhantomOptions::spacing_mm = ({}, {}, {}) violates 0 < spacing < Inf",
                       (*spacing_mm)[0], (*spacing_mm)[1], (*spacing_mm)[2]);
  const double boxiness = std::abs(direction.determinant()) / direction.colwise().norm().prod();
  if (!direction.allFinite() || !(boxiness > 1e-6))
    return "PhantomOptions::direction is singular or not finite";
  if (origin_ras_mm && !origin_ras_mm->allFinite())
    return "PhantomOptions::origin_ras_mm is not finite";
  if (edge_width_mm && !(std::isfinite(*edge_width_mm) && *edge_width_mm > 0))
    return fmt::format("PhantomOptions::edge_width_mm = {} violates 0 < width < Inf",
                       *edge_width_mm);
  if (!(std::isfinite(noise) && noise >= 0))
    return fmt::format("PhantomOptions::noise = {} violates 0 <= noise < Inf", noise);
  return {};
}

Eigen::Affine3d PhantomOptions::index_to_world() const {
  const int shortest = *std::min_element(size.begin(), size.end());
  const Vector3d spacing = spacing_mm.value_or(Vector3d::Constant(2.0 / (shortest - 1)));
  Eigen::Affine3d result = Eigen::Affine3d::Identity();
  result.linear() = direction * spacing.asDiagonal();
  const Vector3d middle(0.5 * (size[0] - 1), 0.5 * (size[1] - 1), 0.5 * (size[2] - 1));
  result.translation() = origin_ras_mm.value_or(-(result.linear() * middle));
  return result;
}

double PhantomOptions::unit_mm() const {
  // Index i = const are parallel planes, 1 / |grad i| apart; grad i is a row of the inverse.
  const Eigen::Matrix3d inverse = index_to_world().linear().inverse();
  double least = std::numeric_limits<double>::max();
  for (int axis = 0; axis < 3; ++axis)
    least = std::min(least, (size[axis] - 1) / inverse.row(axis).norm());
  return 0.5 * least;
}

Vector3d PhantomOptions::center_ras_mm() const {
  return index_to_world() * Vector3d(0.5 * (size[0] - 1), 0.5 * (size[1] - 1), 0.5 * (size[2] - 1));
}

const std::array<Capsule, 6>& tree_capsules() {
  static const std::array<Capsule, 6> kCapsules = {{
      {{0, 0, -0.7}, {0, 0, 0.25}, 0.15},
      {{0, 0, 0.25}, {0.38, 0.1, 0.6}, 0.11},
      {{0, 0, 0.25}, {-0.36, 0.18, 0.6}, 0.11},
      {{0, 0, 0}, {0.1, -0.65, 0.25}, 0.1},
      {{0, 0, -0.2}, {-0.65, -0.1, 0.05}, 0.1},
      {{0, 0, -0.4}, {0.35, 0.55, -0.25}, 0.1},
  }};
  return kCapsules;
}

const std::array<Capsule, 40>& rod_capsules() {
  // The first lines of the sequence that keep the distance from those before them.
  static const std::array<Capsule, 40> kRods = [] {
    std::array<Capsule, 40> rods;
    std::size_t n_rods = 0;
    for (std::uint64_t n = 0; n_rods < rods.size(); ++n) {
      const Capsule rod = random_rod(n);
      const bool is_clear = std::all_of(
          rods.begin(), rods.begin() + n_rods,
          [&](const Capsule& other) { return axis_distance(rod, other) >= kRodDistance; });
      if (is_clear) rods[n_rods++] = rod;
    }
    return rods;
  }();
  return kRods;
}

double phantom_distance(PhantomKind kind, const Vector3d& point) {
  switch (kind) {
    case PhantomKind::kBall:
      return ball(point, Vector3d::Zero(), 0.6);
    case PhantomKind::kTwoBalls:
      return ball({std::abs(point[0]), point[1], point[2]}, {0.4, 0, 0}, 0.4);
    case PhantomKind::kBox:
      return box(point, {0.6, 0.4, 0.3});
    case PhantomKind::kTorus:
      return torus(point, 0.5, 0.2);
    case PhantomKind::kVessel:
      return vessel(point);
    case PhantomKind::kSeparateBalls:
      return ball({std::abs(point[0]), point[1], point[2]}, {0.5, 0, 0}, 0.3);
    case PhantomKind::kShell:
      return shell(point);
    case PhantomKind::kTree:
      return capsules(point, tree_capsules());
    case PhantomKind::kRods:
      break;
  }
  return rods(point);
}

double phantom_distance_mm(const PhantomOptions& options, const Vector3d& point_ras_mm) {
  const double unit = options.unit_mm();
  return unit * phantom_distance(options.kind, (point_ras_mm - options.center_ras_mm()) / unit);
}

Volume make_phantom(const PhantomOptions& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  const Eigen::Affine3d index_to_world = options.index_to_world();
  const double unit = options.unit_mm();
  const double width = options.edge_width_mm ? *options.edge_width_mm / unit : kEdgeWidthUnits;
  const auto& [nx, ny, nz] = options.size;

  // Index to units, so that the inner loop adds one column per voxel.
  const Eigen::Matrix3d step = index_to_world.linear() / unit;
  const Vector3d first = (index_to_world.translation() - options.center_ras_mm()) / unit;

  Source source;
  source.path = "phantom";
  source.format = "phantom";
  source.scalar_type = "float32";
  source.orientation_source = "options";
  Volume::Builder builder(options.size, index_to_world.matrix(), std::move(source));
  std::vector<float> slice(std::size_t(nx) * ny);
  std::uint64_t voxel = 0;
  for (int k = 0; k < nz; ++k) {
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i, ++voxel) {
        const Vector3d u = first + step * Vector3d(i, j, k);
        double value = edge_profile(phantom_distance(options.kind, u), width);
        if (options.noise > 0) value += options.noise * normal_random(options.random_seed, voxel);
        slice[std::size_t(j) * nx + i] = static_cast<float>(value);
      }
    builder.append_slice(slice);
  }
  return builder.finish();
}

}  // namespace surf::volume
