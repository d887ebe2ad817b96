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

/// A shape of which the planes x_k = 0.5, k < n_planes, hold what lies on them.
template <int Dim>
Geometry<Dim> on_planes(const test::Arrays<Dim>& arrays, int n_planes) {
  Border<Dim> border{Points<Dim>::Identity(n_planes, Dim), {}};
  for (Eigen::Index i = 0; i < arrays.X.rows(); ++i) {
    border.planes.push_back(0);
    for (int k = 0; k < n_planes; ++k) border.planes.back() |= (arrays.X(i, k) == 0.5) << k;
  }
  return {arrays.X, arrays.T, border};
}

/// The unit sphere, pressed flat at x = 0.5.
template <int Dim>
Geometry<Dim> cut_sphere(int level) {
  auto arrays = test::unit_sphere<Dim>(level);
  arrays.X.col(0) = arrays.X.col(0).cwiseMin(0.5);
  return on_planes<Dim>(arrays, 1);
}

/// The sides of a square or cube, some of them on planes; it is cut off a little along its edges.
template <int Dim>
Geometry<Dim> cube(int n_planes) {
  auto arrays = test::unit_sphere<Dim>(3);
  for (auto row : arrays.X.rowwise()) row /= 2 * row.cwiseAbs().maxCoeff();
  for (double& x : arrays.X.reshaped())  // sines and cosines of 45 degrees differ in the last bit
    if (std::abs(std::abs(x) - 0.5) < 1e-12) x = std::copysign(0.5, x);
  return on_planes<Dim>(arrays, n_planes);
}

TYPED_TEST(GeometryOf, ABorderIsNotChargedAndItsRimIsHeldAtItsMeasure) {
  constexpr int Dim = TypeParam::value;
  const auto shape = cut_sphere<Dim>(3);
  ASSERT_TRUE(shape.has_border());
  const auto moved = shape.moved_to(1.1 * shape.points());
  int n_rim = 0;
  for (Eigen::Index t = 0; t < shape.n_elements(); ++t) {
    const bool is_flat = std::abs(shape.normals()(t, 0) - 1) < 1e-12;
    EXPECT_EQ(shape.place(t) == Place::kBorder, is_flat);
    n_rim += shape.place(t) == Place::kRim;
    const double expected = is_flat                         ? 0
                            : shape.place(t) == Place::kRim ? shape.measures()[t]
                                                            : moved.measures()[t];
    EXPECT_DOUBLE_EQ(moved.charged_measures()[t], expected);
  }
  EXPECT_GE(n_rim, 2);
}

// d . n = 1 with the normal n of what is not on the border, and |d| <= 2: less where its part in
// the planes is shorter than half.
TYPED_TEST(GeometryOf, VerticesWhereItEndsOnABorderMoveInItsPlanes) {
  constexpr int Dim = TypeParam::value;
  for (const auto& shape : {cut_sphere<Dim>(4), cube<Dim>(1), cube<Dim>(2), cube<Dim>(Dim)}) {
    Points<Dim> normals = Points<Dim>::Zero(shape.n_vertices(), Dim);
    Eigen::VectorXd masses = Eigen::VectorXd::Zero(shape.n_vertices());
    for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
      for (int i = 0; i < Dim && shape.place(t) != Place::kBorder; ++i) {
        normals.row(shape.elements()(t, i)) += shape.measures()[t] * shape.normals().row(t);
        masses[shape.elements()(t, i)] += shape.measures()[t];
      }
    int n_ends = 0;
    for (Eigen::Index i = 0; i < shape.n_vertices(); ++i) {
      const Vector<Dim> d = shape.directions().row(i);
      if (!shape.is_on_border(i)) {
        EXPECT_EQ(d, Vector<Dim>(shape.nodal_normals().row(i)));
        continue;
      }
      if (masses[i] == 0) {
        EXPECT_TRUE(d.isZero(0)) << "inside a face";
        continue;
      }
      const Vector<Dim> n = normals.row(i) / masses[i];
      Vector<Dim> in_planes = n;  // which are those of coordinates
      for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
        if (shape.place(t) == Place::kBorder && (shape.elements().row(t).array() == i).any()) {
          EXPECT_NEAR(d.dot(shape.normals().row(t)), 0, 1e-12);
          Eigen::Index plane = 0;
          shape.normals().row(t).maxCoeff(&plane);
          in_planes[plane] = 0;
        }
      EXPECT_LE(d.norm(), 2 + 1e-12);
      EXPECT_NEAR(d.dot(n), std::min(1.0, 4 * in_planes.squaredNorm()), 1e-12);
      n_ends += d.norm() > 1e-9;
    }
    EXPECT_GE(n_ends, 2);
  }
}

TYPED_TEST(GeometryOf, ContentChangesByItsDerivativeAlongTheDirections) {
  constexpr int Dim = TypeParam::value;
  const auto shape = cube<Dim>(2);
  const Eigen::VectorXd V = Eigen::VectorXd::LinSpaced(shape.n_vertices(), -1, 1);
  constexpr double kStep = 1e-5;
  const auto content_at = [&](double step) {
    return shape.moved_to(shape.points() + step * V.asDiagonal() * shape.directions()).enclosed();
  };
  const double difference = (content_at(kStep) - content_at(-kStep)) / (2 * kStep);
  const Eigen::VectorXd derivative = shape.content_derivative();
  EXPECT_NEAR(derivative.dot(V), difference, 1e-8);
  for (Eigen::Index i = 0; i < shape.n_vertices(); ++i)
    if (shape.directions().row(i).isZero(0)) {
      EXPECT_EQ(derivative[i], 0);
    }
}

TYPED_TEST(GeometryOf, WithoutElementsOnTheBorderIsAsWithoutABorder) {
  constexpr int Dim = TypeParam::value;
  const auto arrays = test::unit_sphere<Dim>(2);
  Border<Dim> border{Points<Dim>::Identity(1, Dim), std::vector<std::uint8_t>(arrays.X.rows(), 0)};
  border.planes[0] = 1;  // one vertex touches it
  const Geometry<Dim> shape(arrays.X, arrays.T, border);
  EXPECT_FALSE(shape.has_border());
  EXPECT_EQ(shape.directions(), shape.nodal_normals());
  EXPECT_TRUE(shape.has_border_of(Geometry<Dim>(arrays.X, arrays.T)));
}

/// The elements of a shape with a vertex on one side of a plane, as a part of it.
template <int Dim>
Geometry<Dim> half_of(const Geometry<Dim>& whole, std::vector<int>& vertices) {
  const auto is_moving = [&](int i) { return whole.points()(i, 0) > 0; };
  std::vector<int> rows, place(std::size_t(whole.n_vertices()), -1);
  for (Eigen::Index t = 0; t < whole.n_elements(); ++t) {
    const auto element = whole.elements().row(t);
    if (!std::any_of(element.begin(), element.end(), is_moving)) continue;
    rows.push_back(int(t));
    for (const int i : element)
      if (place[std::size_t(i)] < 0) {
        place[std::size_t(i)] = int(vertices.size());
        vertices.push_back(i);
      }
  }
  Elements<Dim> T = whole.elements()(rows, Eigen::all);
  for (int& i : T.reshaped()) i = place[std::size_t(i)];
  WholeShape left_out;
  for (const int i : vertices) left_out.is_held.push_back(!is_moving(i));
  left_out.radius_mm = whole.radius();
  Border<Dim> none{Points<Dim>(0, Dim), std::vector<std::uint8_t>(vertices.size(), 0)};
  return {whole.points()(vertices, Eigen::all), std::move(T), none, left_out};
}

TYPED_TEST(GeometryOf, OfAPartIsThatOfTheWholeWhereItMoves) {
  constexpr int Dim = TypeParam::value;
  const auto whole = test::rough_geometry<Dim>(7);
  std::vector<int> vertices;
  const Geometry<Dim> part = half_of<Dim>(whole, vertices);
  EXPECT_TRUE(part.is_part());
  EXPECT_FALSE(whole.is_part());
  EXPECT_EQ(part.radius(), whole.radius());
  EXPECT_LT(part.n_elements(), whole.n_elements());
  for (Eigen::Index i = 0; i < part.n_vertices(); ++i) {
    const int of_whole = vertices[std::size_t(i)];
    const bool moves = whole.points()(of_whole, 0) > 0;
    const Vector<Dim> expected =
        moves ? Vector<Dim>(whole.directions().row(of_whole)) : Vector<Dim>::Zero();
    EXPECT_LT((part.directions().row(i).transpose() - expected).norm(), 1e-12);
    EXPECT_EQ(part.is_on_border(i), !moves);
  }
  EXPECT_TRUE(part.moved_to(part.points()).is_part());
}

}  // namespace
}  // namespace surf::fem
