// Shapes and fields with known properties, in both dimensions.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <random>

#include "libsurf/base/field.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/geometry.h"
#include "tests/surf/torus.h"

namespace surf::test {

template <int N>
using Dim_ = std::integral_constant<int, N>;
using Dims = ::testing::Types<Dim_<2>, Dim_<3>>;
struct DimName {
  template <class T>
  static std::string GetName(int) {
    return "Dim" + std::to_string(T::value);
  }
};
/// A suite of TYPED_TESTs that run in the plane and in space, with the dimension as
/// TypeParam::value.
#define IN_BOTH_DIMENSIONS(Suite)    \
  template <class T>                 \
  struct Suite : ::testing::Test {}; \
  TYPED_TEST_SUITE(Suite, ::surf::test::Dims, ::surf::test::DimName)

template <int Dim>
struct Arrays {
  Points<Dim> X;
  Elements<Dim> T;
};

/// Unit circle with 8 * 2^level segments, or unit sphere: the octahedron, each triangle split in
/// four `level` times and projected. Outward.
template <int Dim>
Arrays<Dim> unit_sphere(int level) {
  Arrays<Dim> out;
  if constexpr (Dim == 2) {
    const int n = 8 << level;
    out.X.resize(n, 2);
    out.T.resize(n, 2);
    for (int i = 0; i < n; ++i) {
      const double angle = 2 * std::numbers::pi * i / n;
      out.X.row(i) << std::cos(angle), std::sin(angle);
      out.T.row(i) << i, (i + 1) % n;
    }
  } else {
    out.X.resize(6, 3);
    out.X << 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1, 0, 0, 0, 1, 0, 0, -1;
    out.T.resize(8, 3);
    out.T << 0, 2, 4, 2, 1, 4, 1, 3, 4, 3, 0, 4, 2, 0, 5, 1, 2, 5, 3, 1, 5, 0, 3, 5;
    for (int l = 0; l < level; ++l) {
      std::map<std::pair<int, int>, int> midpoints;
      std::vector<Vector<3>> points;
      for (Eigen::Index i = 0; i < out.X.rows(); ++i) points.push_back(out.X.row(i));
      const auto midpoint = [&](int a, int b) {
        const auto [at, is_new] = midpoints.try_emplace(std::minmax(a, b), int(points.size()));
        if (is_new) points.push_back((points[a] + points[b]).normalized());
        return at->second;
      };
      Elements<3> finer(4 * out.T.rows(), 3);
      for (Eigen::Index t = 0; t < out.T.rows(); ++t) {
        const int a = out.T(t, 0), b = out.T(t, 1), c = out.T(t, 2);
        const int ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
        finer.middleRows(4 * t, 4) << a, ab, ca, ab, b, bc, ca, bc, c, ab, bc, ca;
      }
      out.T = finer;
      out.X.resize(points.size(), 3);
      for (std::size_t i = 0; i < points.size(); ++i) out.X.row(i) = points[i];
    }
  }
  return out;
}

/// Curvatures of a plane, and of the unit sphere.
inline fem::Curvature no_curvature(Eigen::Index n) {
  return {Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
}
template <int Dim>
fem::Curvature unit_curvature(Eigen::Index n) {
  return {Eigen::VectorXd::Constant(n, Dim - 1), Eigen::VectorXd::Constant(n, Dim - 1)};
}

/// Torus with radii R > r about the z axis, nu x nv quads split in two. Outward.
inline Arrays<3> torus(double R, double r, int nu, int nv) {
  auto [points, elements] = torus_triangles(R, r, nu, nv);
  return {std::move(points), std::move(elements)};
}

/// Calls visit(k, phase, amplitude) for six random plane waves of low frequency, the amplitude in
/// [-1, 1].
template <int Dim, class Visit>
void for_random_waves(unsigned seed, const Visit& visit) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int wave = 0; wave < 6; ++wave) {
    Vector<Dim> k;
    for (int d = 0; d < Dim; ++d) k[d] = 3 * uniform(generator);
    const double phase = 3 * uniform(generator), amplitude = uniform(generator);
    visit(k, phase, amplitude);
  }
}

/// A random smooth star-shaped perturbation of the unit sphere: radius 1 + a sum of random plane
/// waves of low frequency, at most about 0.3.
template <int Dim>
Arrays<Dim> random_smooth_shape(unsigned seed, int level) {
  Arrays<Dim> shape = unit_sphere<Dim>(level);
  for_random_waves<Dim>(seed, [&](const Vector<Dim>& k, double phase, double amplitude) {
    for (Eigen::Index i = 0; i < shape.X.rows(); ++i) {
      const Vector<Dim> x = shape.X.row(i).normalized();
      shape.X.row(i) *= 1 + 0.05 * amplitude * std::cos(k.dot(x) + phase);
    }
  });
  return shape;
}

/// A sphere whose vertices are moved at random by up to a tenth of an edge: no symmetry left.
template <int Dim>
Arrays<Dim> rough_sphere(unsigned seed, int level = 2) {
  Arrays<Dim> shape = unit_sphere<Dim>(level);
  std::mt19937 generator(seed);
  const double size = 0.1 * (shape.X.row(shape.T(0, 0)) - shape.X.row(shape.T(0, 1))).norm();
  std::uniform_real_distribution<double> uniform(-size, size);
  for (Eigen::Index i = 0; i < shape.X.size(); ++i) shape.X.data()[i] += uniform(generator);
  return shape;
}

/// The same three as geometries.
template <int Dim>
fem::Geometry<Dim> sphere_geometry(int level) {
  const auto [X, T] = unit_sphere<Dim>(level);
  return {X, T};
}
template <int Dim>
fem::Geometry<Dim> smooth_geometry(unsigned seed, int level) {
  const auto [X, T] = random_smooth_shape<Dim>(seed, level);
  return {X, T};
}
template <int Dim>
fem::Geometry<Dim> rough_geometry(unsigned seed, int level = 2) {
  const auto [X, T] = rough_sphere<Dim>(seed, level);
  return {X, T};
}

/// The gradient of a functional by the vertices is that of its central differences.
template <int Dim, class Functional>
void expect_gradient(const Points<Dim>& gradient, const fem::Geometry<Dim>& shape,
                     const Functional& functional, double step, double tolerance) {
  for (Eigen::Index i = 0; i < gradient.size(); ++i) {
    Points<Dim> plus = shape.points(), minus = shape.points();
    plus.data()[i] += step;
    minus.data()[i] -= step;
    const double difference =
        (functional(shape.moved_to(plus)) - functional(shape.moved_to(minus))) / (2 * step);
    EXPECT_NEAR(gradient.data()[i], difference, tolerance) << "coordinate " << i;
  }
}

/// A smooth vector field at the points: random plane waves of low frequency.
template <int Dim>
Points<Dim> random_smooth_vectors(const Points<Dim>& X, unsigned seed) {
  std::mt19937 generator(seed);
  std::uniform_real_distribution<double> uniform(-1, 1);
  Points<Dim> out = Points<Dim>::Zero(X.rows(), Dim);
  for (int wave = 0; wave < 4; ++wave) {
    Vector<Dim> k, a;
    for (int d = 0; d < Dim; ++d) k[d] = 2 * uniform(generator), a[d] = uniform(generator);
    for (Eigen::Index i = 0; i < X.rows(); ++i) out.row(i) += std::cos(k.dot(X.row(i)) + wave) * a;
  }
  return out;
}

/// f(x) = c + sum_k a_k cos(k . x + p_k), with its derivatives.
template <int Dim>
class WaveField : public Field<Dim> {
 public:
  explicit WaveField(unsigned seed, double offset = 1.5) : offset_(offset) {
    std::mt19937 generator(seed);
    std::uniform_real_distribution<double> uniform(-1, 1);
    for (int wave = 0; wave < 3; ++wave) {
      Wave w;
      for (int d = 0; d < Dim; ++d) w.k[d] = 2 * uniform(generator);
      w.amplitude = 0.3 * uniform(generator);
      w.phase = 3 * uniform(generator);
      waves_.push_back(w);
    }
  }
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    out.resize(x.rows(), order);
    out.value.setConstant(offset_);
    out.gradient.setZero();
    out.hessian.setZero();
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      for (const Wave& w : waves_) {
        const double angle = w.k.dot(x.row(i)) + w.phase;
        out.value[i] += w.amplitude * std::cos(angle);
        if (order >= Derivatives::kFirst)
          out.gradient.row(i) -= w.amplitude * std::sin(angle) * w.k;
        if (order >= Derivatives::kSecond) {
          const Eigen::Matrix<double, Dim, Dim> h =
              -w.amplitude * std::cos(angle) * w.k * w.k.transpose();
          out.hessian.row(i) += Eigen::Map<const Eigen::Matrix<double, 1, Dim * Dim>>(h.data());
        }
      }
  }

 private:
  struct Wave {
    Vector<Dim> k;
    double amplitude, phase;
  };
  double offset_;
  std::vector<Wave> waves_;
};

}  // namespace surf::test
