// The studies of thesis 5.2: the tables and pictures of docs/mumford-shah.md on phantoms and, with
// --image, of docs/mumford-shah-images.md (tools/mumford-shah-images.sh).
//
//   mumford_shah_study [SET] [--pictures DIR]
//   mumford_shah_study [SET] --image FILE --reference MASK --circle X,Y,RADIUS [--pictures DIR]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/Dense>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <numbers>
#include <set>
#include <string>
#include <vector>

#include "libcurve/energy/mumford_shah.h"
#include "libcurve/image/image_fields.h"
#include "libcurve/image/phantom.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "libsurf/base/random.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/stiffness.h"
#include "tests/bench/mumford_shah_runs.h"
#include "tests/curve/analytic_fields.h"
#include "tests/curve/mumford_shah_options.h"

namespace {

using namespace surf;
using namespace surf::curve;
using namespace surf::bench;
using std::numbers::pi;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

// --- orders: u_i = a_i cos(pi x) cos(pi y) + b_i inside and outside the square |x|, |y| <= 1.

constexpr double kMu = TwoSquares::kMu;
constexpr auto kA = TwoSquares::kA, kB = TwoSquares::kB;
constexpr auto exact = TwoSquares::exact;
constexpr auto exact_gradient = TwoSquares::exact_gradient;

std::array<double, 3> solution_errors(double h) {
  const auto I = TwoSquares::image();
  const NeumannOptions options{.mu = kMu, .spacing_mm = h / 2};
  const DomainMesh mesh =
      mesh_domain(polygon(square(1), h), square(2), SizeField(square(2), h, 0.1));
  const Neumann problem(mesh, image_integrals(mesh, *I, options), I, options);
  double value = 0, gradient = 0;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const bool in = mesh.is_inside[t];
    Eigen::Matrix3d C;
    Eigen::Vector3d u;
    for (int i = 0; i < 3; ++i) {
      C.row(i) << 1, mesh.points.row(mesh.triangles(t, i));
      u[i] = problem.value(mesh.triangles(t, i), in);
    }
    const Eigen::Vector3d plane = C.inverse() * u;
    for (int i = 0; i < 3; ++i) {
      const Eigen::Vector3d at = (C.row(i) + C.row((i + 1) % 3)) / 2;
      const Vector<2> x = at.tail<2>();
      value += C.determinant() / 6 * std::pow(plane.dot(at) - exact(x, in), 2);
      gradient += C.determinant() / 6 * (plane.tail<2>() - exact_gradient(x, in)).squaredNorm();
    }
  }
  const double k = 1 + 2 * pi * pi * kMu;
  double J = 0;
  for (int side = 0; side < 2; ++side)
    J -= 0.5 * (side == 1 ? 4 : 12) * (k * kA[side] * kA[side] / 4 + kB[side] * kB[side]);
  return {std::sqrt(value), std::sqrt(gradient), problem.energy() - J};
}

void orders() {
  fmt::print(
      "\n| h | L2 | order | H1 | order | J_h - J | order |\n|---|---|---|---|---|---|---|\n");
  std::array<double, 3> last{};
  for (double h = 0.2; h > 0.01; h /= 2) {
    const auto error = solution_errors(h);
    fmt::print("| {:.4f} |", h);
    for (int k = 0; k < 3; ++k)
      fmt::print(" {:.2e} | {} |", error[k],
                 last[k] > 0 ? fmt::format("{:.2f}", std::log2(last[k] / error[k])) : "");
    fmt::print("\n");
    last = error;
  }
}

// --- derivative: exact for J_h; to the boundary form with h.

/// A field sampled from pixels.
std::shared_ptr<const Field<2>> pixels_of(const Field<2>& field, int n) {
  Eigen::Affine2d map = Eigen::Affine2d::Identity();
  map.linear() *= 4.0 / n;
  map.translation().setConstant(-2 + 2.0 / n);
  std::vector<float> values;
  Samples<2> samples;
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i) {
      Points<2> x(1, 2);
      x.row(0) = map * Vector<2>(i, j);
      field.sample(x, Derivatives::kNone, samples);
      values.push_back(float(samples.value[0] + 0.1 * normal_random(3, std::uint64_t(j) * n + i)));
    }
  return intensity_field(Image({n, n}, map, values), {});
}

Segments blob(int n, std::uint64_t seed) {
  Segments out{Points<2>(n, 2), Elements<2>(n, 2)};
  for (int i = 0; i < n; ++i) {
    const double t = 2 * pi * i / n;
    double r = 0.9;
    for (int k = 2; k <= 5; ++k)
      r += 0.1 * ((2 * uniform_random(seed, 2 * k) - 1) * std::cos(k * t) +
                  (2 * uniform_random(seed, 2 * k + 1) - 1) * std::sin(k * t));
    out.points.row(i) << r * std::cos(t), r * std::sin(t);
    out.elements.row(i) << i, (i + 1) % n;
  }
  return out;
}

fem::Geometry<2> geometry(const Segments& curves) { return {curves.points, curves.elements}; }

void derivative() {
  fmt::print(
      "\nLargest |dJ(V) - (J(+s V) - J(-s V)) / 2s| / |dJ(V)| of five random shapes, V "
      "smooth along the normals:\n\n| step | formula | order | pixels | order |\n"
      "|---|---|---|---|---|\n");
  std::array<double, 2> last{};
  for (double step = 0.04; step > 5e-5; step /= 4) {
    fmt::print("| {:.1e} |", step);
    for (int kind = 0; kind < 2; ++kind) {
      const auto I = kind == 0 ? bright_waves() : pixels_of(*bright_waves(), 128);
      double worst = 0;
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const Segments curves = blob(100, seed);
        const fem::Geometry<2> shape = geometry(curves);
        MumfordShah J(I, options_on_square(0.03));
        J.reset(shape);
        energy::ShapeTerms<2> terms(shape);
        J.differentiate({Eigen::VectorXd::Zero(100), Eigen::VectorXd::Zero(100)}, 1, terms);
        Points<2> V = shape.nodal_normals();
        for (int i = 0; i < 100; ++i)
          V.row(i) *= 1 + std::cos(2 * pi * (i / 50.0 + 0.1 * double(seed)));
        const double dJ = terms.derivative.cwiseProduct(V).sum();
        const double plus = J.try_move(shape.moved_to(curves.points + step * V));
        const double minus = J.try_move(shape.moved_to(curves.points - step * V));
        worst = std::max(worst, std::abs((plus - minus) / (2 * step) - dJ) / std::abs(dJ));
      }
      fmt::print(" {:.1e} | {} |", worst,
                 last[kind] > 0 ? fmt::format("{:.2f}", std::log2(last[kind] / worst) / 2) : "");
      last[kind] = worst;
    }
    fmt::print("\n");
  }
  fmt::print(
      "\nSum of |dJ(phi_i n_i) - <G, phi_i>| over sum of |<G, phi_i>|:\n\n| elements | "
      "difference | order |\n|---|---|---|\n");
  double before = 0;
  for (int n = 50; n <= 400; n *= 2) {
    const fem::Geometry<2> shape = geometry(blob(n, 7));
    MumfordShah J(bright_waves(), options_on_square(3.0 / n));
    J.reset(shape);
    energy::ShapeTerms<2> terms(shape);
    const auto A = fem::stiffness<2>(shape, Eigen::VectorXd::Ones(n));
    const auto curvature = fem::curvature<2>(shape, A);
    J.differentiate(curvature, 1, terms);
    const Eigen::VectorXd weak =
        J.shape_gradient(J.traces(), curvature.mean).matrix().cwiseProduct(shape.lumped_mass());
    const Eigen::VectorXd normal =
        terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum();
    const double difference = (normal - weak).cwiseAbs().sum() / weak.cwiseAbs().sum();
    fmt::print("| {} | {:.2e} | {} |\n", n, difference,
               before > 0 ? fmt::format("{:.2f}", std::log2(before / difference)) : "");
    before = difference;
  }
}

// --- runs on phantoms, or on one image with its mask

struct Arguments {
  std::string set;
  Pictures pictures;
  std::string image, reference, name;
  std::vector<double> circle;
  double mu = 100, gamma = 0.25;
  std::vector<std::string> starts;

  bool has_image() const { return !image.empty(); }
};

constexpr double kEdge = 1.5;

Segments start_round_all() { return circle({127.5, 127.5}, 110, kEdge); }

/// x, y, radius in pixels.
Segments circle_of(const std::vector<double>& numbers) {
  return circle({numbers[0], numbers[1]}, numbers[2], std::min(kEdge, numbers[2] / 4));
}

/// "NAME=X,Y,RADIUS".
std::pair<std::string, Segments> named_circle(const std::string& text) {
  const std::size_t equals = std::min(text.find('='), text.size());
  double x = 0, y = 0, radius = 0;
  if (std::sscanf(text.c_str() + equals, "=%lf,%lf,%lf", &x, &y, &radius) != 3)
    throw UsageError(fmt::format(
        "--start: expected NAME=X,Y,RADIUS in pixels, such as inside=137,131,15; got '{}'", text));
  return {text.substr(0, equals), circle_of({x, y, radius})};
}

Subject subject_of(const Arguments& a) {
  Subject out = image_subject(a.name, a.image, a.reference);
  out.start = circle_of(a.circle);
  out.mu = a.mu;
  out.gamma = a.gamma;
  return out;
}

void flows(const Arguments& a) {
  if (a.has_image()) return study_flows({subject_of(a)}, a.pictures);
  std::vector<Subject> subjects;
  for (const auto& [name, kind] : {std::pair{"blob", PhantomKind::kBlob},
                                   {"bay", PhantomKind::kBay},
                                   {"ring", PhantomKind::kRing}}) {
    subjects.push_back(phantom_subject(name, {.kind = kind, .noise = 0.1}, start_round_all()));
    subjects.back().open_cavities = kind == PhantomKind::kRing;
  }
  study_flows(subjects, a.pictures);
}

Segments seeds_on_a_grid() { return grid_of_circles({0, 0}, {255, 255}, 24, 8, kEdge); }

void newton(const Arguments& a) {
  if (a.has_image()) return study_newton({subject_of(a)});
  study_newton(
      {phantom_subject("blob", {.kind = PhantomKind::kBlob, .noise = 0.1}, start_round_all()),
       phantom_subject("bay", {.kind = PhantomKind::kBay, .noise = 0.1}, start_round_all())});
}

void noise(const Arguments& a) {
  if (a.has_image()) return study_noise({subject_of(a)}, a.pictures);
  study_noise({phantom_subject("blob", {.kind = PhantomKind::kBlob}, start_round_all()),
               phantom_subject("bay", {.kind = PhantomKind::kBay}, start_round_all()),
               phantom_subject("discs12", {.kind = PhantomKind::kDiscs12}, seeds_on_a_grid())},
              a.pictures);
}

/// The discs, where the background rises across the image.
Subject rising_discs() {
  return phantom_subject("discs12",
                         {.kind = PhantomKind::kDiscs12, .noise = 0.1, .linear_background = 0.5},
                         seeds_on_a_grid());
}

/// Of mu and gamma of an image.
constexpr double kFactors[] = {0.5, 1, 2, 4};

void mu_sweep(const Arguments& a) {
  std::vector<std::pair<double, double>> pairs;
  if (a.has_image()) {
    for (const double factor : kFactors) pairs.emplace_back(factor * a.mu, a.gamma);
    return study_values("mu", subject_of(a), pairs, a.pictures);
  }
  for (const double value : {20, 100, 500, 2000, 10000}) pairs.emplace_back(value, 0.5);
  study_values("mu", rising_discs(), pairs, a.pictures);
}

void gamma_sweep(const Arguments& a) {
  std::vector<std::pair<double, double>> pairs;
  if (a.has_image()) {
    for (const double factor : kFactors) pairs.emplace_back(a.mu, factor * a.gamma);
    return study_values("gamma", subject_of(a), pairs, a.pictures);
  }
  for (const double value : {0.05, 0.2, 1.0, 4.0, 16.0}) pairs.emplace_back(1000, value);
  study_values("gamma", rising_discs(), pairs, a.pictures);
}

void start(const Arguments& a) {
  if (a.has_image()) {
    std::vector<std::pair<std::string, Segments>> starts = {{"as given", circle_of(a.circle)}};
    for (const std::string& text : a.starts) starts.push_back(named_circle(text));
    return study_starts(subject_of(a), starts, a.pictures);
  }
  study_starts(phantom_subject("bay", {.kind = PhantomKind::kBay, .noise = 0.1}, {}),
               {{"outside", circle({127.5, 127.5}, 120, kEdge)},
                {"inside", circle({90, 100}, 15, kEdge)},
                {"overlapping", circle({170, 170}, 50, kEdge)},
                {"three", joined({circle({60, 128}, 25, kEdge), circle({120, 200}, 30, kEdge),
                                  circle({180, 70}, 35, kEdge)})},
                {"grid", grid_of_circles({0, 0}, {255, 255}, 32, 10, kEdge)}},
               a.pictures);
}

void many() {
  const Subject subject =
      phantom_subject("discs12", {.kind = PhantomKind::kDiscs12, .size = {512, 512}, .noise = 0.1},
                      grid_of_circles({0, 0}, {511, 511}, 40, 12, kEdge));
  const Outcome out = run(subject.image, subject.start, options_of(1000, 0.5));
  fmt::print("\n| stage | steps | seconds |\n|---|---|---|\n");
  for (const auto& stage : out.result.stages)
    fmt::print("| {} | {} | {:.1f} |\n", stage.name, stage.flow.steps.size(), stage.used.seconds);
  fmt::print("\n512 x 512: {:.1f} s; regions, Dice, mean px: {}\n", out.seconds,
             found(out.result.shape, subject));
}

void meshes() {
  fmt::print(
      "\n| curve nodes | mesh nodes | anew s | from the last s | kept |\n|---|---|---|---|---|"
      "\n");
  Points<2> outer(4, 2);
  outer << -0.5, -0.5, 511.5, -0.5, 511.5, 511.5, -0.5, 511.5;
  for (const double edge : {1.5, 3.0, 6.0}) {
    const SizeField sizes(outer, 16, 4);
    const auto curves = [&](double r) {
      return grid_of_circles({60, 60}, {450, 450}, 110, r, edge);
    };
    const DomainMesh last = mesh_domain(curves(30), outer, sizes);
    double anew = 1e9, again = 1e9;
    Eigen::Index n_kept = 0;
    for (int k = 0; k < 5; ++k) {
      double begin = now();
      mesh_domain(curves(31), outer, sizes);
      anew = std::min(anew, now() - begin);
      begin = now();
      const Points<2> kept = reusable_nodes(last, curves(31), sizes);
      mesh_domain(curves(31), outer, sizes, kept);
      again = std::min(again, now() - begin);
      n_kept = kept.rows();
    }
    fmt::print("| {} | {} | {:.3f} | {:.3f} | {} |\n", curves(31).points.rows(), last.points.rows(),
               anew, again, n_kept);
  }
}

void add_options(CLI::App& app, Arguments& a) {
  app.add_option(
      "SET", a.set,
      "orders, derivative, meshes, flows, newton, noise, mu, gamma, start or many [all]");
  app.add_option("--pictures", a.pictures.directory, "Folder for a picture per study");
  app.add_option("--panel", a.pictures.width, "Width of a panel of the pictures [pixels]");
  const auto image = app.add_option(
      "--image", a.image, "flows, newton, noise, mu, gamma and start on this image, not phantoms");
  const auto of_image = [&](const char* option, auto& value, const char* help) {
    return app.add_option(option, value, help)->needs(image);
  };
  const auto reference = of_image("--reference", a.reference, "Mask of the object in the image");
  const auto circle =
      of_image("--circle", a.circle, "Start X,Y,RADIUS in pixels")->delimiter(',')->expected(3);
  image->needs(reference)->needs(circle);
  of_image("--name", a.name, "Name of the image in tables and files [that of its file]");
  of_image("--mu", a.mu, "mu in pixel^2")->capture_default_str();
  of_image("--gamma", a.gamma, "gamma in pixels")->capture_default_str();
  of_image("--start", a.starts, "NAME=X,Y,RADIUS: one more of the study of starts; repeat for more")
      ->take_all()
      ->allow_extra_args(false);
}

}  // namespace

int main(int argc, char** argv) {
  using Table = std::function<void(const Arguments&)>;
  const auto alone = [](void (*table)()) -> Table { return [=](const Arguments&) { table(); }; };
  const std::vector<std::pair<std::string, Table>> tables = {
      {"orders", alone(orders)}, {"derivative", alone(derivative)},
      {"meshes", alone(meshes)}, {"flows", flows},
      {"newton", newton},        {"noise", noise},
      {"mu", mu_sweep},          {"gamma", gamma_sweep},
      {"start", start},          {"many", alone(many)}};
  const std::set<std::string> of_images = {"flows", "newton", "noise", "mu", "gamma", "start"};
  Arguments a;
  CLI::App app{"Studies of the Mumford-Shah model in the plane.", "mumford_shah_study"};
  add_options(app, a);
  CLI11_PARSE(app, argc, argv);
  if (a.name.empty()) a.name = std::filesystem::path(a.image).stem().string();
  if (a.has_image()) a.pictures.prefix += "-" + a.name;
  try {
    bool is_known = a.set.empty();
    for (const auto& [name, table] : tables) {
      if ((!a.set.empty() && name != a.set) || (a.has_image() && !of_images.contains(name)))
        continue;
      table(a);
      is_known = true;
    }
    if (!is_known)
      throw UsageError(fmt::format("{}: no such study{}; see --help", a.set,
                                   a.has_image() ? " of an image" : ""));
  } catch (const Error& error) {
    fmt::print(stderr, "mumford_shah_study: error: {}\n", error.what());
    return 1;
  }
}
