// The result may not depend on accidents of the volume: its field of view, frame, unit of length,
// unit of intensity, nor on the seed ball's radius, the number of threads or the run.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <functional>
#include <optional>

#include "libsurf/base/error.h"
#include "libsurf/base/threads.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/segment.h"

namespace surf::segment {
namespace {

using Eigen::Vector3d;

/// A turned ellipsoid with semi-axes of 11, 9 and 8 mm about (2, -1, 1), contrast 1.
double body(const Vector3d& x) {
  static const Eigen::Matrix3d to_unit =
      Vector3d(1 / 11.0, 1 / 9.0, 1 / 8.0).asDiagonal() *
      Eigen::AngleAxisd(0.7, Vector3d(1, 2, 1).normalized()).toRotationMatrix();
  return 0.5 * (1 - std::tanh(8 * ((to_unit * (x - Vector3d(2, -1, 1))).norm() - 1)));
}

/// A volume that samples the body, and where a world point of the plain scene lies in it.
struct Scene {
  std::array<int, 3> size = {36, 34, 33};
  Eigen::Affine3d affine{Eigen::Translation3d(-16, -18, -15)};
  Eigen::Affine3d to_plain = Eigen::Affine3d::Identity();  ///< its world -> plain world
  double slope = 1, offset = 0;                            ///< of the intensities
  double seed_radius_mm = 4;                               ///< of the plain world
  bool is_automatic = false;

  double unit() const { return std::cbrt(std::abs(1 / to_plain.linear().determinant())); }

  volume::Volume volume() const {
    std::vector<float> values;
    for (int k = 0; k < size[2]; ++k)
      for (int j = 0; j < size[1]; ++j)
        for (int i = 0; i < size[0]; ++i) {
          const Vector3d x = to_plain * (affine * Vector3d(i, j, k));
          // Rounded to 2^-12 first, so that frames that differ by rounding give the same values.
          const double value = std::round(4096 * body(x)) / 4096;
          values.push_back(static_cast<float>(slope * value + offset));
        }
    return {size, affine, values};
  }

  SegmentResult result() const {
    SegmentOptions options;
    options.seeds_mm = {to_plain.inverse() * Vector3d(3, -2, 2)};
    if (!is_automatic) {
      options.seed_radius_mm = seed_radius_mm * unit();
      options.energies = {{"minimal-surface", 1, {{"gamma", -0.7 / unit()}}}};
    }
    return segment(volume(), options);
  }

  /// The verified surface, brought back to the plain world, where a voxel is 1 mm.
  Triangles surface() const {
    Triangles out = result().shape;
    const mesh::Verification check = mesh::verify(out);
    EXPECT_TRUE(check.passed()) << check.message();
    for (Eigen::Index i = 0; i < out.points.rows(); ++i)
      out.points.row(i) = to_plain * Vector3d(out.points.row(i));
    return out;
  }
};

const Triangles& plain(bool is_automatic) {
  const auto run = [](bool automatic) {
    Scene scene;
    scene.is_automatic = automatic;
    return scene.surface();
  };
  static const Triangles explicitly = run(false), automatically = run(true);
  return is_automatic ? automatically : explicitly;
}

struct Tolerance {
  double distance;               ///< mean [voxels]
  std::optional<double> volume;  ///< relative
};
/// Two meshes of one shape with edges h = 1.5 voxels and radius 9 differ by about the sagitta
/// h^2 / (8 R) of their triangles.
constexpr Tolerance kOtherMesh = {0.03, {}};
/// The same cells in another frame: sagittas are the same in the mean, whatever the mesh.
constexpr Tolerance kOtherFrame = {kOtherMesh.distance, 1e-3};
/// The same mesh: rounding of intensities and coordinates, grown over the steps of a run.
constexpr Tolerance kSameMesh = {1e-3, 1e-3};

void expect_same(Scene scene, const Tolerance& tolerance, const std::string& name,
                 const std::vector<bool>& ways = {false, true}) {
  for (const bool is_automatic : ways) {
    scene.is_automatic = is_automatic;
    const Triangles surface = scene.surface();
    const auto distances =
        mesh::surface_distances(plain(is_automatic), surface, {.n_samples = 20000});
    const double more = mesh::volume_mm3(surface) / mesh::volume_mm3(plain(is_automatic)) - 1;
    fmt::print("{:<28} {:<16} mean {:.2e}, max {:.2e} voxel, volume {:+.1e}\n", name,
               is_automatic ? "automatic" : "minimal-surface", distances.mean_mm, distances.max_mm,
               more);
    EXPECT_LT(distances.mean_mm, tolerance.distance) << name << (is_automatic ? ", automatic" : "");
    if (tolerance.volume) {
      EXPECT_LT(std::abs(more), *tolerance.volume) << name << (is_automatic ? ", automatic" : "");
    }
  }
}

/// A box of voxels of which the first lies at `first` [voxels].
void expect_same_in_box(const std::array<int, 3>& size, const Vector<3>& first,
                        const std::string& name) {
  Scene scene;
  scene.size = size;
  scene.affine = Eigen::Translation3d(first);
  expect_same(scene, kSameMesh, name, {false});
  expect_same(scene, kOtherMesh, name, {true});  // from the start that the search found there
}

TEST(Invariance, OfAVolumeThatIsCroppedAwayFromTheObject) {
  expect_same_in_box({32, 29, 30}, {-14, -15, -13}, "cropped");
}

TEST(Invariance, OfAVolumeThatIsPaddedAwayFromTheObject) {
  expect_same_in_box({50, 45, 41}, {-20, -25, -22}, "padded");
}

// The seed ball is not invariant under turns, so the meshes differ; the grid of the automatic
// search turns with the volume. The last one is turned on, so that it lies obliquely.
TEST(Invariance, OfADirectionMatrixThatIsRotated) {
  const Eigen::Matrix3d oblique =
      Eigen::AngleAxisd(0.4, Vector3d(1, 3, -2).normalized()).toRotationMatrix();
  for (int axis = 0; axis < 3; ++axis) {
    Scene scene;
    Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
    turn(axis, axis) = 1;
    turn((axis + 1) % 3, (axis + 2) % 3) = -1;
    turn((axis + 2) % 3, (axis + 1) % 3) = 1;
    if (axis == 2) turn = oblique * turn;
    scene.affine = Eigen::Affine3d(turn) * scene.affine;
    scene.to_plain = Eigen::Affine3d(turn.transpose());
    // Other axes of the voxels come to lie along R, A and S: all is computed in another order.
    expect_same(scene, kOtherFrame, fmt::format("turned about axis {}", axis));
  }
}

// The body does not move, but the grid that samples it has other index axes: what is computed from
// it is computed in RAS order.
TEST(Invariance, OfAVolumeWithItsAxesPermuted) {
  const Scene original;
  Scene scene;
  Eigen::Matrix3d permutation = Eigen::Matrix3d::Zero();
  for (int axis = 0; axis < 3; ++axis) {  // new axis `axis` is old axis `axis + 1`
    scene.size[axis] = original.size[(axis + 1) % 3];
    permutation((axis + 1) % 3, axis) = 1;
  }
  scene.affine = original.affine * Eigen::Affine3d(permutation);
  expect_same(scene, kSameMesh, "permuted");
}

TEST(Invariance, OfAVolumeWithMirroredAxes) {
  Scene scene;
  for (int axis = 0; axis < 3; ++axis) {
    Vector3d scale = Vector3d::Ones(), shift = Vector3d::Zero();
    scale[axis] = -1;
    shift[axis] = scene.size[axis] - 1;
    scene.affine = scene.affine * Eigen::Translation3d(shift) * Eigen::Scaling(scale);
  }
  EXPECT_LT(scene.affine.linear().determinant(), 0);
  expect_same(scene, kSameMesh, "mirrored");
}

// Indices and sizes that are told are the file's, whatever order the axes are stored in.
TEST(Invariance, ErrorsNameTheCellsOfTheFile) {
  Eigen::Matrix3d axes;  // i runs to A, j to I, k to L
  axes << 0, 0, -1, 1, 0, 0, 0, -1, 0;
  const Eigen::Affine3d affine = Eigen::Translation3d(7, -5, 3) * Eigen::Affine3d(axes);
  const volume::Volume volume({10, 12, 14}, affine, std::vector<float>(10 * 12 * 14));
  const auto message = [&](const SegmentOptions& options) -> std::string {
    try {
      segment(volume, options);
    } catch (const UsageError& error) {
      return error.what();
    }
    return "";
  };
  SegmentOptions outside;
  outside.seeds_mm = {affine * Vector3d(3, 4, 20)};
  EXPECT_THAT(message(outside),
              ::testing::HasSubstr("voxel (3.0, 4.0, 20.0), outside the volume of 10 x 12 x 14"));
  for (int axis = 0; axis < 3; ++axis) {
    SegmentOptions thin;
    thin.seeds_mm = {affine * Vector3d(4, 4, 4)};
    Vector3d first(0, 0, 0), last(8, 8, 8);
    first[axis] = last[axis] = 4;
    thin.box_mm = {affine * first, affine * last};
    EXPECT_THAT(message(thin),
                ::testing::HasSubstr(fmt::format("voxels thick along axis {}", "ijk"[axis])));
  }
}

TEST(Invariance, OfTheUnitOfLength) {
  for (const double factor : {1000.0, 0.001}) {
    Scene scene;
    scene.affine = Eigen::Affine3d(Eigen::Scaling(factor)) * scene.affine;
    scene.to_plain = Eigen::Affine3d(Eigen::Scaling(1 / factor));
    expect_same(scene, kSameMesh, fmt::format("unit {}", factor));
  }
}

TEST(Invariance, OfTheUnitOfIntensity) {
  Scene scene;
  scene.slope = 1000;  // the values are multiples of 2^-12: floats hold them exactly
  scene.offset = 500;
  expect_same(scene, kSameMesh, "1000 I + 500");
}

// (5.1) is even in the gradient; and so are the automatic windows round the seed's mean.
TEST(Invariance, OfTheSignOfTheContrast) {
  Scene scene;
  scene.slope = -8;
  scene.offset = 16;
  expect_same(scene, kSameMesh, "-8 I + 16");
}

TEST(Invariance, OfTheRadiusOfTheSeedBall) {
  for (const double radius : {3.2, 4.8, 6.4}) {  // [voxels]: 0.05 to 0.1 of half of 128
    Scene scene;
    scene.seed_radius_mm = radius;
    expect_same(scene, kOtherMesh, fmt::format("seed radius {}", radius), {false});
  }
}

TEST(Invariance, OfTheNumberOfThreadsIsExact) {
  for (const bool is_automatic : {false, true}) {
    const Triangles& several = plain(is_automatic);
    Scene scene;
    scene.is_automatic = is_automatic;
    for (const int n_threads : {1, 2}) {
      const ThreadLimit limit(n_threads);
      const Triangles surface = scene.surface();
      EXPECT_EQ(surface.points, several.points) << n_threads;
      EXPECT_EQ(surface.elements, several.elements) << n_threads;
    }
  }
}

TEST(Invariance, OfTheRunIsExact) {
  for (const bool is_automatic : {false, true}) {
    Scene scene;
    scene.is_automatic = is_automatic;
    const Triangles again = scene.surface();
    EXPECT_EQ(again.points, plain(is_automatic).points);
    EXPECT_EQ(again.elements, plain(is_automatic).elements);
  }
}

}  // namespace
}  // namespace surf::segment
