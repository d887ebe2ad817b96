#include "libsurf/mesh/detail/known_errors.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/fem/indicators.h"
#include "tests/surf/mesh/surfaces.h"

namespace surf::mesh {
namespace {

/// A wave that counts where it is looked at.
class CountedWave : public Field<3> {
 public:
  explicit CountedWave(double length) : length_(length) {}
  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
    n += x.rows();
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) out.value[i] = std::sin(x.row(i).sum() / length_);
  }
  mutable Eigen::Index n = 0;

 private:
  double length_;
};

struct KnownErrorsTest : ::testing::Test {
  static constexpr Eigen::Index kPoints = 3 + 7;  // of a face, by both rules

  fem::Geometry<3> geometry() const { return {points(mesh), elements(mesh)}; }

  TriMesh mesh = to_mesh(some_surface(0));
  std::shared_ptr<const CountedWave> wave = std::make_shared<CountedWave>(0.2),
                                     other = std::make_shared<CountedWave>(0.5);
  KnownErrors::Integrands integrands = {wave, other};
};

TEST_F(KnownErrorsTest, AreTheErrorsOfQuadrature) {
  const Eigen::MatrixXd errors = KnownErrors(mesh, integrands)(geometry());
  EXPECT_EQ(errors.col(0), fem::quadrature_error(geometry(), *wave));
  EXPECT_EQ(errors.col(1), fem::quadrature_error(geometry(), *other));
}

TEST_F(KnownErrorsTest, FacesThatStayAreNotSampledAgain) {
  KnownErrors(mesh, integrands)(geometry());
  const VertexHandle moved(3);
  mesh.set_point(moved, 1.1 * mesh.point(moved));
  TriMesh copy = mesh;  // as mending makes one
  wave->n = 0;
  const Eigen::MatrixXd errors = KnownErrors(copy, integrands)(geometry());
  EXPECT_EQ(wave->n, kPoints * Eigen::Index(mesh.valence(moved)));
  EXPECT_EQ(errors.col(0), fem::quadrature_error(geometry(), *wave));
}

TEST_F(KnownErrorsTest, OtherIntegrandsAndHalvesOfAFaceAreSampled) {
  KnownErrors(mesh, integrands)(geometry());
  bisect(mesh, std::vector{FaceHandle(0), FaceHandle(7)});
  EXPECT_EQ(KnownErrors(mesh, integrands)(geometry()).col(1),
            fem::quadrature_error(geometry(), *other));
  const KnownErrors::Integrands swapped = {other, wave};
  EXPECT_EQ(KnownErrors(mesh, swapped)(geometry()).col(1),
            fem::quadrature_error(geometry(), *wave));
}

TEST_F(KnownErrorsTest, ElementsOfAPartAreThoseOfTheirFaces) {
  const Elements<3> part = elements(mesh).middleRows(10, 5);
  const fem::Geometry<3> shape(points(mesh), part);
  const std::vector<int> faces = {10, 11, 12, 13, 14};
  const Eigen::MatrixXd errors = KnownErrors(mesh, integrands)(shape, faces);
  EXPECT_EQ(errors.col(0), fem::quadrature_error(shape, *wave));
  wave->n = 0;
  KnownErrors(mesh, integrands)(geometry());
  EXPECT_EQ(wave->n, kPoints * Eigen::Index(mesh.n_faces() - 5));
}

TEST_F(KnownErrorsTest, ManyIntegrandsAreSampledEachTime) {
  integrands.resize(5, wave);
  KnownErrors(mesh, integrands)(geometry());
  EXPECT_EQ(KnownErrors(mesh, integrands)(geometry()).col(4),
            fem::quadrature_error(geometry(), *wave));
}

}  // namespace
}  // namespace surf::mesh
