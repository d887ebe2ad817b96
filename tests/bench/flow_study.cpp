// What the flows do where the answer is known, and where two methods have to agree: the tables of
// docs/flows.md. Argument: willmore, diffusion, fixed-steps, products,
// methods; none = all.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <numbers>
#include <random>
#include <set>

#include "libsurf/energy/boundary_integral.h"
#include "libsurf/energy/curvature_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/evolution.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/moving_surface.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"
#include "tests/surf/torus.h"

namespace {

using namespace surf;
using flow::FlowOptions;
using flow::Method;
using flow::ScalarProduct;
using flow::Scheme;

constexpr double kPi = std::numbers::pi;

struct Flow {
  std::string name;
  Method method = Method::kGradientFlow;
  ScalarProduct product = ScalarProduct::kH1;
  Scheme scheme = Scheme::kExplicit;

  FlowOptions options() const {
    FlowOptions out;
    out.method = method;
    out.velocity.product = product;
    out.velocity.scheme = scheme;
    return out;
  }
};

const Flow kH1{"H1 explicit"};
const Flow kH1Implicit{"H1 semi-implicit", Method::kGradientFlow, ScalarProduct::kH1,
                       Scheme::kSemiImplicit};
const Flow kL2{"L2 explicit", Method::kGradientFlow, ScalarProduct::kL2};
const Flow kL2Implicit{"L2 semi-implicit", Method::kGradientFlow, ScalarProduct::kL2,
                       Scheme::kSemiImplicit};
const Flow kHMinus1{"H^-1 explicit", Method::kGradientFlow, ScalarProduct::kHMinus1};
const Flow kHMinus1Implicit{"H^-1 semi-implicit", Method::kGradientFlow, ScalarProduct::kHMinus1,
                            Scheme::kSemiImplicit};
const Flow kNewton{"Newton", Method::kNewton};
const Flow kLbfgs{"L-BFGS", Method::kLbfgs};

class Stopwatch {
 public:
  double seconds() const {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start_).count();
  }

 private:
  std::chrono::steady_clock::time_point start_ = std::chrono::steady_clock::now();
};

int n_trials(const flow::FlowSummary& summary) {
  int n = 0;
  for (const auto& step : summary.steps) n += step.n_trials;
  return n;
}

/// Torus about the z axis with radii R > r, edges of about the length given along the centre line
/// and shorter ones round the tube.
Triangles torus(double R, double r, double edge_length) {
  const int nu = int(2 * kPi * R / edge_length), nv = int(2 * kPi * r / (0.64 * edge_length));
  return test::torus_triangles(R, r, nu, nv);
}

/// The unit ball, its radius changed by random waves of up to 0.2.
Triangles bumpy_ball(double edge_length) {
  Triangles out = mesh::ball({0, 0, 0}, 1, edge_length);
  std::mt19937 generator(3);
  std::uniform_real_distribution<double> uniform(-1, 1);
  for (int wave = 0; wave < 6; ++wave) {
    const Vector<3> k = 4 * Vector<3>(uniform(generator), uniform(generator), uniform(generator));
    const double phase = 3 * uniform(generator), amplitude = 0.1 * uniform(generator);
    for (Eigen::Index i = 0; i < out.points.rows(); ++i) {
      const Vector<3> x = out.points.row(i).normalized();
      out.points.row(i) *= 1 + amplitude * std::cos(k.dot(x) + phase);
    }
  }
  return out;
}

mesh::MovingSurface moving(const Triangles& start, double edge_length) {
  mesh::MovingSurfaceOptions options;
  options.edge_length_mm = edge_length;
  options.max_displacement_mm = 0.1;
  return {start, options};
}

/// A surface whose mesh stays, so that J changes by the flow alone.
class FixedMesh : public flow::MovingShape<3> {
 public:
  explicit FixedMesh(const Triangles& start) : shape_(start.points, start.elements) {}
  fem::Geometry<3> geometry() const override { return shape_; }
  double max_displacement() const override { return 0.1; }
  double restrict_move(Points<3>&) override { return 0; }
  void move_to(const Points<3>& to) override { shape_ = shape_.moved_to(to); }
  bool mend() override { return false; }
  std::string obstacle() const override { return {}; }

 private:
  fem::Geometry<3> shape_;
};

/// J = 1/2 int kappa^2: 8 pi on every sphere, least on a torus at R / r = sqrt(2), where it is
/// 4 pi^2.
void study_willmore() {
  fmt::print(
      "\n| start | flow | vertices | J at the start | steps | trials | J - J_min | R / r | s |\n");
  fmt::print("|---|---|---|---|---|---|---|---|---|\n");
  for (const bool is_torus : {false, true})
    for (const double edge : {is_torus ? 0.1 : 0.16, is_torus ? 0.05 : 0.08})
      for (const Flow& flow : {kH1, kH1Implicit, kL2Implicit, kNewton, kLbfgs}) {
        if (is_torus && flow.name == kLbfgs.name) continue;  // it finds that fall
        energy::CurvatureIntegral<3> J(
            energy::squared_curvature<3>(energy::constant_field<3>(1), 0));
        FixedMesh shape(is_torus ? torus(1, 0.4, edge) : bumpy_ball(edge));
        FlowOptions options = flow.options();
        options.energy_tol =
            3e-3;  // on a mesh that stays the discrete J falls on as it degenerates
        options.max_steps = 200;
        const Stopwatch watch;
        const auto summary = flow::evolve<3>(shape, J, options);
        const double seconds = watch.seconds();
        const auto end = shape.geometry();
        const double least = is_torus ? 4 * kPi * kPi : 8 * kPi;
        const double r = 2 * end.enclosed() / end.measure();
        const double R = end.measure() / (4 * kPi * kPi * r);
        fmt::print("| {} | {} | {} | {:.2f} | {} | {} | {:+.2f} % | {} | {:.1f} |\n",
                   is_torus ? "torus, R / r = 2.5" : "bumpy ball", flow.name, end.n_vertices(),
                   summary.initial_energy, summary.steps.size(), n_trials(summary),
                   100 * (summary.final_energy / least - 1),
                   is_torus ? fmt::format("{:.4f}", R / r) : "-", seconds);
        std::fflush(stdout);
      }
}

double isoperimetric_ratio(const fem::Geometry<3>& shape) {
  return shape.measure() / (4 * kPi * shape.radius() * shape.radius());
}

/// 500 steps of one length, with and without the correction of each.
void study_fixed_steps() {
  fmt::print(
      "\n| time step | steps | volume's change | area / ball's at the end |\n|---|---|---|---|\n");
  for (const double tau : {1e-3, 1e-4, 1e-5}) {
    const Triangles start = mesh::ellipsoid({0, 0, 0}, Vector<3>(1.4, 1, 0.8).asDiagonal(), 0.15);
    fem::Geometry<3> shape(start.points, start.elements);
    energy::BoundaryIntegral<3> J(energy::constant_field<3>(1));
    const double volume = shape.enclosed();
    double change = 0;
    constexpr int kSteps = 500;
    for (int k = 0; k < kSteps; ++k) {
      const SparseMatrix A = fem::stiffness<3>(shape, Eigen::VectorXd::Ones(shape.n_elements()));
      J.reset(shape);
      energy::ShapeTerms<3> terms(shape);
      J.differentiate(fem::curvature<3>(shape, A), 1, terms);
      const flow::VelocitySystem<3> system(shape, terms, A, kHMinus1Implicit.options().velocity);
      shape = shape.moved_to(shape.points() + tau * system.solve(tau).vector);
      change = std::max(change, std::abs(shape.enclosed() / volume - 1));
    }
    fmt::print("| {:g} r^4 | {} | {:.1e} | {:.5f} |\n", tau, kSteps, change,
               isoperimetric_ratio(shape));
    std::fflush(stdout);
  }
}

/// Surface diffusion: the ball is the end, and the volume stays.
void study_diffusion() {
  fmt::print(
      "\n| flow | step | area / ball's | largest change of the volume so far | s "
      "|\n|---|---|---|---|---|\n");
  for (const Flow& flow : {kHMinus1Implicit, kHMinus1}) {
    auto shape = moving(mesh::ellipsoid({0, 0, 0}, Vector<3>(2, 1, 0.7).asDiagonal(), 0.15), 0.15);
    energy::BoundaryIntegral<3> J(energy::constant_field<3>(1));
    FlowOptions options = flow.options();
    options.energy_tol = 0;
    options.rel_tol = 0;
    options.max_steps = 500;
    const double volume = shape.geometry().enclosed();
    double change = 0;
    const Stopwatch watch;
    const auto line = [&](int k, const fem::Geometry<3>& at) {
      fmt::print("| {} | {} | {:.5f} | {:.1e} | {:.1f} |\n", flow.name, k, isoperimetric_ratio(at),
                 change, watch.seconds());
      std::fflush(stdout);
    };
    line(0, shape.geometry());
    int last = 0;
    const auto summary = flow::evolve<3>(shape, J, options, [&](const flow::StepRecord& step) {
      change = std::max(change, std::abs(step.enclosed / volume - 1));
      last = step.k;
      const std::set<int> lines = {1, 2, 5, 10, 20, 50, 100, 200};
      if (lines.contains(step.k)) line(step.k, shape.geometry());
      return true;
    });
    line(last, shape.geometry());
    fmt::print("\n{}: {}\n\n", flow.name, summary.message);
  }
}

struct Case {
  std::string name;
  volume::PhantomKind kind;
  std::vector<segment::EnergyTerm> energies;
  double noise = 0;
};

struct Outcome {
  segment::SegmentResult result;
  double seconds = 0;
};

Outcome run(const Case& one, const Flow& flow, const volume::PhantomOptions& phantom,
            double tolerance) {
  const volume::Volume image = volume::make_phantom(phantom);
  segment::SegmentOptions options;
  options.initial = one.kind == volume::PhantomKind::kTorus ? torus(0.5, 0.3, 0.05)
                                                            : mesh::ball({0, 0, 0}, 0.95, 0.1);
  options.energies = one.energies;
  options.edge_length_mm = 2 * image.voxel_size();
  options.settle = false;
  options.flow = flow.options();
  options.flow.rel_tol = tolerance;
  options.flow.energy_tol = std::min(1e-3, tolerance);
  Outcome out;
  const Stopwatch watch;
  out.result = segment::segment(image, options);
  out.seconds = watch.seconds();
  return out;
}

volume::PhantomOptions phantom_of(const Case& one, int size) {
  volume::PhantomOptions out;
  out.kind = one.kind;
  out.noise = one.noise;
  out.size = {size, size, size};
  return out;
}

const Case kBall{"ball, minimal-surface", volume::PhantomKind::kBall, {{"minimal-surface", 1, {}}}};
const Case kNoisyBall{"ball with 10 % noise, minimal-surface",
                      volume::PhantomKind::kBall,
                      {{"minimal-surface", 1, {}}},
                      0.1};
const Case kTorus{
    "torus, minimal-surface", volume::PhantomKind::kTorus, {{"minimal-surface", 1, {}}}};
const Case kBox{"box, minimal-surface", volume::PhantomKind::kBox, {{"minimal-surface", 1, {}}}};
const Case kBallMeans{"ball, chan-vese and area",
                      volume::PhantomKind::kBall,
                      {{"chan-vese", 1, {}}, {"area", 0.05, {}}}};
const Case kTorusMeans{"torus, chan-vese and area",
                       volume::PhantomKind::kTorus,
                       {{"chan-vese", 1, {}}, {"area", 0.05, {}}}};

/// How many steps the scalar products take, 5.1 and 5.2.
void study_products() {
  fmt::print("\n| case | flow | steps | trials | J | s | end |\n|---|---|---|---|---|---|---|\n");
  for (const Case& one : {kBall, kNoisyBall, kBox, kTorus, kBallMeans})
    for (const Flow& flow : {kH1, kH1Implicit, kL2Implicit, kL2}) {
      const Outcome outcome = run(one, flow, phantom_of(one, 96), 1e-4);
      const auto& summary = outcome.result.last();
      fmt::print("| {} | {} | {} | {} | {:.5g} | {:.1f} | {} |\n", one.name, flow.name,
                 summary.steps.size(), n_trials(summary), summary.final_energy, outcome.seconds,
                 to_string(summary.termination));
      std::fflush(stdout);
    }
}

/// Do independent minimisers end at the same surface?
void study_methods() {
  fmt::print(
      "\n| case | method | steps or rounds | evaluations of J | J | s | distance from H1: mean / "
      "95 "
      "% / max voxel |\n|---|---|---|---|---|---|---|\n");
  for (const Case& one : {kBall, kTorus, kBallMeans, kTorusMeans}) {
    const auto phantom = phantom_of(one, 96);
    const double voxel = volume::make_phantom(phantom).voxel_size();
    Triangles reference;
    for (const Flow& flow : {kH1, kLbfgs, kNewton}) {
      const Outcome outcome = run(one, flow, phantom, 1e-5);
      const auto& summary = outcome.result.last();
      if (flow.name == kH1.name) reference = outcome.result.shape;
      const auto distance = mesh::surface_distances(outcome.result.shape, reference);
      fmt::print("| {} | {} | {} | {} | {:.6g} | {:.1f} | {:.3f} / {:.3f} / {:.3f} |\n", one.name,
                 flow.name, summary.steps.size(), n_trials(summary), summary.final_energy,
                 outcome.seconds, distance.mean_mm / voxel, distance.p95_mm / voxel,
                 distance.max_mm / voxel);
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string part = argc > 1 ? argv[1] : "";
  if (part.empty() || part == "willmore") study_willmore();
  if (part.empty() || part == "diffusion") study_diffusion();
  if (part.empty() || part == "fixed-steps") study_fixed_steps();
  if (part.empty() || part == "products") study_products();
  if (part.empty() || part == "methods") study_methods();
}
