// Alg. 8 on the domain meshes of the Mumford-Shah model: sizes are lowered where I asks for it, and
// raised again.
#include <cmath>

#include "libcurve/energy/mumford_shah.h"
#include "libcurve/mesh/primitives.h"
#include "tests/curve/analytic_fields.h"
#include "tests/curve/curves.h"
#include "tests/curve/mumford_shah_options.h"

namespace surf::curve {
namespace {

constexpr double kRing = 1.4, kTextured = 0.7;  // radii
constexpr double kTolerance = 0.0026;

/// A disc with a sharp border, and fine waves in its middle.
std::shared_ptr<const Field<2>> textured_disc() {
  return std::make_shared<FormulaField>(
      [](const Vector<2>& x) {
        const double r = x.norm();
        return 1 / (1 + std::exp((r - kRing) / 0.03)) +
               0.5 * std::sin(20 * x[0]) * std::sin(20 * x[1]) * std::exp(-std::pow(r / 0.4, 4));
      },
      [](const Vector<2>&) { return Vector<2>::Zero(); });  // no derivative is asked for
}

MumfordShahOptions options(double gamma_coarsen, double tolerance = kTolerance) {
  MumfordShahOptions out = options_on_square(0.02);
  out.max_size_mm = 0.3;
  out.data_tolerance = tolerance;
  out.gamma_coarsen = gamma_coarsen;
  return out;
}

fem::Geometry<2> circle_geometry(double radius) {
  const Segments curve = circle({0, 0}, radius, 0.05);
  return {curve.points, curve.elements};
}

int n_triangles_in_texture(const MumfordShah& J) {
  const DomainMesh& mesh = J.solution().mesh();
  int n = 0;
  for (const auto t : mesh.triangles.rowwise())
    n += (mesh.points.row(t[0]) + mesh.points.row(t[1]) + mesh.points.row(t[2])).norm() <
         3 * kTextured;
  return n;
}

double error_per_area(const MumfordShah& J) {
  return J.solution().integrals().errors.sum() / 16;  // of the square of half side 2
}

void start(MumfordShah& J) {
  for (int k = 0; k < 5; ++k) J.reset(circle_geometry(0.5));
}

/// From the texture to the disc's border.
void cross(MumfordShah& J) {
  for (int k = 1; k <= 18; ++k) J.remesh(circle_geometry(0.5 + 0.05 * k));
  for (int k = 0; k < 5; ++k) J.remesh(circle_geometry(kRing));
}

// On the border the curve resolves it, and the texture need not be resolved any more.
TEST(DomainSizes, RiseWhereACurveHasLeftATexture) {
  MumfordShah J(textured_disc(), options(0.3)), kept(textured_disc(), options(0)),
      never(textured_disc(), options(0, 0));
  for (MumfordShah* energy : {&J, &kept, &never}) {
    start(*energy);
    if (energy != &never) {
      EXPECT_LE(error_per_area(*energy), kTolerance);
    }
    cross(*energy);
  }
  const int n_never = n_triangles_in_texture(never);
  const int n_refined = n_triangles_in_texture(kept) - n_never;
  EXPECT_GT(n_refined, 0.3 * n_never);
  EXPECT_LT(n_triangles_in_texture(J) - n_never, 0.3 * n_refined);
  // What Alg. 8 bounds still holds, and J is the same: u is smooth where the texture is.
  EXPECT_LE(error_per_area(J), kTolerance);
  EXPECT_NEAR(J.value(), kept.value(), 3e-4 * kept.value());
}

TEST(DomainSizes, FallAgainWhenTheCurveReturns) {
  MumfordShah J(textured_disc(), options(0.3));
  start(J);
  const int n_before = n_triangles_in_texture(J);
  cross(J);
  for (int k = 17; k >= 0; --k) J.remesh(circle_geometry(0.5 + 0.05 * k));
  for (int k = 0; k < 5; ++k) J.remesh(circle_geometry(0.5));
  EXPECT_LE(error_per_area(J), kTolerance);
  EXPECT_GT(n_triangles_in_texture(J), 0.8 * n_before);
}

// Else a run would refine and coarsen for ever. Nodes that serve again make a few triangles more or
// less of the same sizes.
TEST(DomainSizes, ComeToRestWithTheCurve) {
  for (const double tolerance : {0.004, 0.002, 0.001}) {
    MumfordShah J(textured_disc(), options(0.3, tolerance));
    start(J);
    cross(J);
    const double n = double(J.solution().mesh().triangles.rows());
    for (int k = 0; k < 12; ++k) {
      J.remesh(circle_geometry(kRing));
      EXPECT_NEAR(double(J.solution().mesh().triangles.rows()), n, 0.01 * n) << tolerance;
      EXPECT_LE(error_per_area(J), tolerance);
    }
  }
}

}  // namespace
}  // namespace surf::curve
