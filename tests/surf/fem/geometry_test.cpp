#include "libsurf/fem/geometry.h"

#include "libsurf/base/error.h"
#include "tests/surf/fixtures.h"

namespace surf::fem {
namespace {

IN_BOTH_DIMENSIONS(GeometryOf);

TYPED_TEST(GeometryOf, MeasuresTheInscribedOctagonAndOctahedronExactly) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::unit_sphere<Dim>(0);
  const Geometry<Dim> shape(2 * arrays.X, arrays.T);
  const double pi = std::numbers::pi;
  const double measure = Dim == 2 ? 2 * 16 * std::sin(pi / 8) : 4 * 4 * std::sqrt(3.0);
  const double enclosed = Dim == 2 ? 4 * 4 * std::sin(pi / 4) : 8 * 4.0 / 3;
  EXPECT_NEAR(shape.measure(), measure, 1e-14 * measure);
  EXPECT_NEAR(shape.enclosed(), enclosed, 1e-14 * enclosed);
}

TYPED_TEST(GeometryOf, MeasureAndRadiusOfTheSphereConvergeWithTheSquareOfTheEdge) {
  constexpr int Dim = TypeParam::value;
  const double sphere = Dim == 2 ? 2 * std::numbers::pi : 4 * std::numbers::pi;
  const auto errors = [&](int level) {
    const auto shape = test::sphere_geometry<Dim>(level);
    return Eigen::Array2d(sphere - shape.measure(), 1 - shape.radius());
  };
  const Eigen::Array2d order = (errors(3) / errors(4)).log() / std::log(2.0);
  EXPECT_NEAR(order[0], 2, 0.1);
  EXPECT_NEAR(order[1], 2, 0.1);
}

// Gauss: the integral of the normal over a closed shape is zero.
TYPED_TEST(GeometryOf, AreaVectorsAndWeightedNodalNormalsOfAClosedShapeAddUpToZero) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(1);
  const double tolerance = 1e-14 * shape.measure();
  EXPECT_LT((shape.measures().asDiagonal() * shape.normals()).colwise().sum().norm(), tolerance);
  EXPECT_LT((shape.lumped_mass().asDiagonal() * shape.nodal_normals()).colwise().sum().norm(),
            tolerance);
  EXPECT_NEAR(shape.lumped_mass().sum(), shape.measure(), tolerance);
}

TYPED_TEST(GeometryOf, EnclosedContentDoesNotDependOnThePlaceAndChangesSignWithTheNormals) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(2);
  constexpr double kShift = 1000;
  const Points<Dim> far = shape.points().array() + kShift;
  // Coordinates are rounded to eps * kShift when they are moved.
  EXPECT_NEAR(shape.moved_to(far).enclosed(), shape.enclosed(), 1e-15 * kShift * shape.measure());
  Elements<Dim> turned = shape.elements();
  turned.col(0).swap(turned.col(1));
  EXPECT_NEAR(Geometry<Dim>(shape.points(), turned).enclosed(), -shape.enclosed(), 1e-14);
}

// d|Omega|/dx_i = integral of phi_i nu = m_i n_i; |Omega| is linear in each coordinate.
TYPED_TEST(GeometryOf, NodalNormalsAreTheGradientOfTheEnclosedContent) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(3);
  const Points<Dim> gradient = shape.lumped_mass().asDiagonal() * shape.nodal_normals();
  constexpr double kStep = 0.01;
  const auto enclosed = [](const Geometry<Dim>& moved) { return moved.enclosed(); };
  test::expect_gradient<Dim>(gradient, shape, enclosed, kStep, 1e-14 / kStep);
}

TYPED_TEST(GeometryOf, NormalsPointOutwardAndNodalOnesAreShorterThanOneWhereTheShapeBends) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(4);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    EXPECT_NEAR(shape.normals().row(t).norm(), 1, 1e-15);
    EXPECT_GT(shape.normals().row(t).dot(shape.points().row(shape.elements()(t, 0))), 0);
  }
  EXPECT_LT(shape.nodal_normals().rowwise().norm().maxCoeff(), 1);
  EXPECT_GT(shape.nodal_normals().rowwise().norm().minCoeff(), 0.8);
}

TYPED_TEST(GeometryOf, BasisGradientsAreTangentialAndReproduceLinearFunctions) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(5);
  Vector<Dim> a;
  for (int d = 0; d < Dim; ++d) a[d] = 1.5 - d;
  const double longest_gradient = 100;  // 1 / height of the elements is far below
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const auto& gradients = shape.basis_gradients(t);
    const Vector<Dim> nu = shape.normals().row(t);
    EXPECT_LT((gradients * nu).norm(), 1e-15 * longest_gradient);
    EXPECT_LT(gradients.colwise().sum().norm(), 1e-15 * longest_gradient);
    Vector<Dim> gradient = Vector<Dim>::Zero();
    for (int i = 0; i < Dim; ++i)
      gradient += a.dot(shape.points().row(shape.elements()(t, i))) * gradients.row(i).transpose();
    EXPECT_LT((gradient - (a - a.dot(nu) * nu)).norm(), 1e-15 * longest_gradient);
  }
}

TYPED_TEST(GeometryOf, WithMovedPointsIsTheGeometryOfThosePoints) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(6);
  const auto other = test::rough_geometry<Dim>(7);
  const auto moved = shape.moved_to(other.points());
  EXPECT_EQ(moved.measures(), other.measures());
  EXPECT_EQ(moved.nodal_normals(), other.nodal_normals());
  EXPECT_EQ(&moved.topology(), &shape.topology());
}

TYPED_TEST(GeometryOf, SlotsOfTheTopologyNameTheEntriesOfThePattern) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(8);
  const auto& topology = shape.topology();
  SparseMatrix numbered = topology.pattern();
  for (Eigen::Index at = 0; at < numbered.nonZeros(); ++at)
    numbered.valuePtr()[at] = static_cast<double>(at);
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
    for (int i = 0; i < Dim; ++i)
      for (int j = 0; j < Dim; ++j)
        EXPECT_EQ(numbered.coeff(shape.elements()(t, i), shape.elements()(t, j)),
                  topology.slot(t, i, j));
}

TYPED_TEST(GeometryOf, QuadraturePointsAreTheBarycentricMeansElementByElement) {
  constexpr int Dim = TypeParam::value;
  const auto shape = test::rough_geometry<Dim>(9);
  Eigen::Matrix<double, Eigen::Dynamic, Dim, Eigen::RowMajor> barycentric(Dim + 1, Dim);
  barycentric.template topRows<Dim>().setIdentity();
  barycentric.row(Dim).setConstant(1.0 / Dim);
  const Points<Dim> x = quadrature_points<Dim>(shape.points(), shape.elements(), barycentric);
  ASSERT_EQ(x.rows(), shape.n_elements() * (Dim + 1));
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    Vector<Dim> mean = Vector<Dim>::Zero();
    for (int i = 0; i < Dim; ++i) {
      const Vector<Dim> corner = shape.points().row(shape.elements()(t, i));
      EXPECT_EQ(Vector<Dim>(x.row(t * (Dim + 1) + i)), corner);
      mean += corner / Dim;
    }
    EXPECT_LT((Vector<Dim>(x.row(t * (Dim + 1) + Dim)) - mean).norm(), 1e-15);
  }
}

TYPED_TEST(GeometryOf, RefusesBadElementsWithAMessageThatNamesThem) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::unit_sphere<Dim>(1);
  const auto message = [](const Points<Dim>& X, const Elements<Dim>& T) -> std::string {
    try {
      Geometry<Dim>(X, T);
    } catch (const InvalidMesh& error) {
      return error.what();
    }
    return "accepted";
  };
  EXPECT_EQ(message(arrays.X, Elements<Dim>(0, Dim)), "geometry: no elements");
  Elements<Dim> outside = arrays.T;
  outside(3, 1) = static_cast<int>(arrays.X.rows());
  EXPECT_NE(message(arrays.X, outside).find("outside 0.."), std::string::npos);
  outside(3, 1) = -1;
  EXPECT_NE(message(arrays.X, outside).find("outside 0.."), std::string::npos);
  Points<Dim> degenerate = arrays.X;
  degenerate.row(arrays.T(0, 0)) = degenerate.row(arrays.T(0, 1));
  EXPECT_EQ(message(degenerate, arrays.T), "geometry: element 0 has no measure");
  Points<Dim> not_a_number = arrays.X;
  not_a_number(arrays.T(0, 0), 0) = std::nan("");
  EXPECT_EQ(message(not_a_number, arrays.T), "geometry: element 0 has no measure");
}

}  // namespace
}  // namespace surf::fem
