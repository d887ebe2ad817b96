// Prints the tables of docs/mumford-shah-volumes.md: orders of convergence, the derivative against
// differences, Newton's method, and noisy phantoms with their scores.
//   mumford_shah_volumes [solver|derivative|newton|phantoms [SIZE]]
#include <fmt/format.h>
#include <sys/resource.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "libsurf/energy/mumford_shah.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/denoised.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"
#include "libsurf/volume/screened_poisson.h"

namespace {

using namespace surf;

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Of all threads: what a run takes on any number of shared cores.
double cpu_seconds() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_utime.tv_sec + usage.ru_stime.tv_sec) +
         1e-6 * double(usage.ru_utime.tv_usec + usage.ru_stime.tv_usec);
}

double peak_memory_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) / 1024;
}

/// About the cube [-1.7, 1.7]^3 with n cells along it, turned and with three spacings.
volume::Grid oblique_grid(int n) {
  volume::Grid grid{{n + 1, n + 1, n + 1}, Eigen::Affine3d::Identity()};
  const Eigen::Matrix3d turn =
      Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, 2, 3).normalized()).toRotationMatrix();
  grid.index_to_world.linear() = turn * Eigen::Vector3d(1, 1.2, 0.9).asDiagonal() * (3.4 / n);
  grid.index_to_world.translation() =
      -grid.index_to_world.linear() * Eigen::Vector3d::Constant(0.5 * n);
  return grid;
}

/// u = 1 + exp(-4 s^2), s = r^2 - R^2: its normal derivative vanishes on the ball of radius R.
struct BallSolution {
  static constexpr double kRadius = 0.7, kRate = 4, kMu = 0.03;

  static double s(const Eigen::Vector3d& x) { return x.squaredNorm() - kRadius * kRadius; }
  static double bump(const Eigen::Vector3d& x) { return std::exp(-kRate * s(x) * s(x)); }
  static double u(const Eigen::Vector3d& x) { return 1 + bump(x); }
  static Eigen::Vector3d gradient(const Eigen::Vector3d& x) {
    return -4 * kRate * s(x) * bump(x) * x;
  }
  static double I(const Eigen::Vector3d& x) {
    const double r2 = x.squaredNorm();
    const double laplacian =
        bump(x) * (-4 * kRate * (3 * s(x) + 2 * r2) + std::pow(4 * kRate * s(x), 2) * r2);
    return u(x) - kMu * laplacian;
  }
};

/// Errors in L2 and H1, by one point in each cell away from its middle.
std::array<double, 2> errors(const volume::ScreenedPoisson& solution,
                             const volume::DomainCells& cells, const volume::Grid& grid) {
  const Eigen::Matrix3d to_world = grid.index_to_world.linear().inverse().transpose();
  const double third = 1.0 / 3;
  double l2 = 0, h1 = 0;
  for (int k = 0; k < cells.size[2]; ++k)
    for (int j = 0; j < cells.size[1]; ++j)
      for (int i = 0; i < cells.size[0]; ++i) {
        const std::int32_t state = cells.at(i, j, k);
        const Eigen::Vector3d at =
            grid.index_to_world * (Eigen::Vector3d(i, j, k) + Eigen::Vector3d::Constant(third));
        if (state == volume::DomainCells::kEmpty) continue;
        const double share = state == volume::DomainCells::kFull ? 1 : cells.moments[state][0];
        const auto u = solution.corner_values(i, j, k);
        double value = 0;
        Eigen::Vector3d slope = Eigen::Vector3d::Zero();
        for (int a = 0; a < 8; ++a) {
          const double x = a & 1 ? third : 1 - third, y = a & 2 ? third : 1 - third,
                       z = a & 4 ? third : 1 - third;
          value += u[a] * x * y * z;
          slope += u[a] * Eigen::Vector3d((a & 1 ? 1 : -1) * y * z, x * (a & 2 ? 1 : -1) * z,
                                          x * y * (a & 4 ? 1 : -1));
        }
        l2 += share * std::pow(value - BallSolution::u(at), 2);
        h1 += share * (to_world * slope - BallSolution::gradient(at)).squaredNorm();
      }
  const double cell = std::abs(grid.index_to_world.linear().determinant());
  return {std::sqrt(cell * l2), std::sqrt(cell * h1)};
}

void print_solver() {
  fmt::print("| side | cells | L2 error | order | H1 error | order | iterations | time s |\n");
  fmt::print("|---|---|---|---|---|---|---|---|\n");
  for (const int side : {0, 1}) {
    std::array<double, 2> last{};
    for (const int n : {16, 32, 64, 128}) {
      const volume::Grid grid = oblique_grid(n);
      const Triangles ball = mesh::ball({0, 0, 0}, BallSolution::kRadius, 2.0 / n);
      const auto cells = volume::cut_cells(ball.points, ball.elements, grid);
      std::vector<double> I;
      for (int k = 0; k <= n; ++k)
        for (int j = 0; j <= n; ++j)
          for (int i = 0; i <= n; ++i)
            I.push_back(BallSolution::I(grid.index_to_world * Eigen::Vector3d(i, j, k)));
      const double start = seconds();
      const volume::ScreenedPoisson u(cells[side], grid, BallSolution::kMu, I, {1e-8, 100});
      const double time = seconds() - start;
      const auto now = errors(u, cells[side], grid);
      const auto order = [&](int at) {
        return last[at] > 0 ? fmt::format("{:.2f}", std::log2(last[at] / now[at])) : "-";
      };
      fmt::print("| {} | {}^3 | {:.2e} | {} | {:.2e} | {} | {} | {:.2f} |\n",
                 side ? "outside" : "inside", n, now[0], order(0), now[1], order(1),
                 u.n_iterations(), time);
      last = now;
    }
  }
}

class Waves : public Field<3> {
 public:
  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index n = 0; n < x.rows(); ++n) {
      const Eigen::Vector3d a(3, 1, -2), b(-1, 4, 2);
      const double p = a.dot(x.row(n)), q = b.dot(x.row(n)) + 1;
      out.value[n] = std::cos(p) + 0.5 * std::sin(q);
      if (order >= Derivatives::kFirst)
        out.gradient.row(n) = -std::sin(p) * a + 0.5 * std::cos(q) * b;
    }
  }
};

void print_derivative() {
  fmt::print(
      "| step | dJ(V) | difference quotient | relative error | order |\n|---|---|---|---|---|\n");
  Triangles shape = mesh::ball({0, 0, 0}, 0.6, 0.08);
  Points<3> W(shape.points.rows(), 3);
  for (Eigen::Index n = 0; n < W.rows(); ++n) {
    const Eigen::Vector3d x = shape.points.row(n);
    shape.points.row(n) *= 1 + 0.1 * std::cos(4 * x[0] + 1) * std::sin(3 * x[1] - 2 * x[2]);
    W.row(n) << std::cos(3 * x[1]), std::sin(2 * x[2] + x[0]), std::cos(x[0] - 2 * x[1]);
  }
  energy::MumfordShahOptions options;
  options.mu = 0.02;
  options.gamma = 0.1;
  options.solver.tolerance = 1e-13;
  energy::MumfordShah J(std::make_shared<const Waves>(), oblique_grid(32), options);
  const fem::Geometry<3> geometry(shape.points, shape.elements);
  J.reset(geometry);
  energy::ShapeTerms<3> terms(geometry);
  const auto A = fem::stiffness<3>(geometry, Eigen::VectorXd::Ones(geometry.n_elements()));
  J.differentiate(fem::curvature<3>(geometry, A), 1, terms);
  const double exact = terms.derivative.cwiseProduct(W).sum();
  double last = 0;
  for (const double step : {4e-2, 2e-2, 1e-2, 5e-3, 2.5e-3, 1e-3, 1e-4, 1e-5}) {
    const double plus = J.try_move(geometry.moved_to(shape.points + step * W));
    const double minus = J.try_move(geometry.moved_to(shape.points - step * W));
    const double quotient = (plus - minus) / (2 * step);
    const double error = std::abs(quotient / exact - 1);
    fmt::print("| {:.1e} | {:.10f} | {:.10f} | {:.1e} | {} |\n", step, exact, quotient, error,
               last > 0 && step > 2e-3 ? fmt::format("{:.2f}", std::log2(last / error)) : "-");
    last = error;
  }
}

struct Scores {
  double dice, psnr_noisy, psnr;
};

/// Of voxels whose centres lie inside; and the peak signal to noise ratio to the volume without
/// noise, whose contrast is 1.
Scores scores(const volume::PhantomOptions& phantom, const volume::Volume& noisy,
              const volume::Volume* denoised, const Triangles& surface) {
  volume::PhantomOptions clean_options = phantom;
  clean_options.noise = 0;
  const volume::Volume clean = volume::make_phantom(clean_options);
  const auto inside = mesh::rasterize(surface, noisy.size(), noisy.index_to_world());
  double both = 0, sum = 0, square_noisy = 0, square = 0;
  std::size_t n = 0;
  for (int k = 0; k < noisy.size()[2]; ++k)
    for (int j = 0; j < noisy.size()[1]; ++j)
      for (int i = 0; i < noisy.size()[0]; ++i, ++n) {
        const bool is_object = clean.value(i, j, k) > 0.5;
        both += is_object && inside[n];
        sum += is_object + (inside[n] != 0);
        square_noisy += std::pow(noisy.value(i, j, k) - clean.value(i, j, k), 2);
        if (denoised) square += std::pow(denoised->value(i, j, k) - clean.value(i, j, k), 2);
      }
  const auto psnr = [&](double squares) { return -10 * std::log10(squares / double(n)); };
  return {2 * both / sum, psnr(square_noisy), denoised ? psnr(square) : 0};
}

struct Case {
  std::string name;
  volume::PhantomKind kind;
  double edge_width;
  double start_radius;
};

void run(const Case& one, int size, const std::string& energy) {
  volume::PhantomOptions phantom;
  phantom.kind = one.kind;
  phantom.noise = 0.25;
  phantom.edge_width_mm = one.edge_width;
  phantom.size = {size, size, size};
  const volume::Volume image = volume::make_phantom(phantom);
  segment::SegmentOptions options;
  if (energy == "minimal-surface" && one.start_radius < 0.6) {  // a seed: it gets a balloon
    options.seeds_mm = {Eigen::Vector3d::Zero()};
    options.seed_radius_mm = one.start_radius;
  } else {
    options.initial = mesh::ball({0, 0, 0}, one.start_radius, 0.05);
  }
  options.energies = {{energy, 1, {}}};
  const double start = cpu_seconds();
  const segment::SegmentResult result = segment::segment(image, options);
  const double time = cpu_seconds() - start;
  if (result.shape.elements.rows() == 0) {
    fmt::print("| {} | {:.2f} | {} | {:.2f} | - | - | - | {} | vanishes | {:.1f} | {:.0f} |\n",
               one.name, one.edge_width, energy, one.start_radius, result.last().steps.size(), time,
               peak_memory_mb());
    return;
  }
  std::optional<volume::Volume> u;
  if (energy == "mumford-shah")
    u = segment::denoised(image, result.shape, segment::parameter(result.energies.front(), "mu"));
  const Scores score = scores(phantom, image, u ? &*u : nullptr, result.shape);
  const auto distance = mesh::distances_from(result.shape, [&](const Eigen::Vector3d& x) {
    return volume::phantom_distance_mm(phantom, x);
  });
  fmt::print("| {} | {:.2f} | {} | {:.2f} | {:.4f} | {:.3f} | {} | {} | {} | {:.1f} | {:.0f} |\n",
             one.name, one.edge_width, energy, one.start_radius, score.dice,
             distance.mean_mm / image.voxel_size(),
             u ? fmt::format("{:.1f} -> {:.1f}", score.psnr_noisy, score.psnr) : "-",
             result.last().steps.size(), mesh::verify(result.shape).passed() ? "passed" : "FAILED",
             time, peak_memory_mb());
  std::fflush(stdout);
}

void print_phantoms(int size) {
  fmt::print(
      "| phantom | edge | energy | start radius | Dice | mean distance voxel | PSNR dB | steps | "
      "verification | CPU time s | "
      "peak memory MB |\n|---|---|---|---|---|---|---|---|---|---|---|\n");
  using Kind = volume::PhantomKind;
  for (const Case& one :
       {Case{"ball", Kind::kBall, 0.05, 0.45}, Case{"ball", Kind::kBall, 0.05, 0.9},
        Case{"ball", Kind::kBall, 0.15, 0.45}, Case{"ball", Kind::kBall, 0.15, 0.9},
        Case{"box", Kind::kBox, 0.05, 0.6}, Case{"torus", Kind::kTorus, 0.05, 0.7},
        Case{"two-balls", Kind::kTwoBalls, 0.05, 0.6}})
    for (const char* energy : {"minimal-surface", "mumford-shah"}) run(one, size, energy);
}

/// Newton's method against the H1 flow, both until |dJ| has fallen to a share of its largest.
void print_newton(int size) {
  fmt::print(
      "| phantom | tolerance | method | steps | trials | J | mean distance voxel | CPU time s |\n"
      "|---|---|---|---|---|---|---|---|\n");
  for (const auto& [name, kind, start_radius] :
       {std::tuple{"ball", volume::PhantomKind::kBall, 0.9},
        {"torus", volume::PhantomKind::kTorus, 0.7}})
    for (const double tolerance : {1e-3, 1e-4})
      for (const auto method : {flow::Method::kGradientFlow, flow::Method::kNewton}) {
        volume::PhantomOptions phantom;
        phantom.kind = kind;
        phantom.noise = 0.1;
        phantom.size = {size, size, size};
        const volume::Volume image = volume::make_phantom(phantom);
        segment::SegmentOptions options;
        options.initial = mesh::ball({0, 0, 0}, start_radius, 0.05);
        options.energies = {{"mumford-shah", 1, {}}};
        options.flow.method = method;
        options.flow.rel_tol = tolerance;
        options.flow.energy_tol = 0;
        const double start = cpu_seconds();
        const segment::SegmentResult result = segment::segment(image, options);
        const double time = cpu_seconds() - start;
        int n_trials = 0;
        for (const auto& step : result.last().steps) n_trials += step.n_trials;
        const auto distance = mesh::distances_from(result.shape, [&](const Eigen::Vector3d& x) {
          return volume::phantom_distance_mm(phantom, x);
        });
        fmt::print("| {} | {:g} | {} | {} | {} | {:.6g} | {:.3f} | {:.1f} |\n", name, tolerance,
                   method == flow::Method::kNewton ? "Newton" : "H1", result.last().steps.size(),
                   n_trials, result.last().final_energy, distance.mean_mm / image.voxel_size(),
                   time);
        std::fflush(stdout);
      }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "all";
  if (what == "solver" || what == "all") print_solver();
  if (what == "derivative" || what == "all") print_derivative();
  if (what == "newton" || what == "all") print_newton(64);
  if (what == "phantoms" || what == "all") print_phantoms(argc > 2 ? std::atoi(argv[2]) : 128);
}
