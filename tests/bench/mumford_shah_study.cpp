// The studies of thesis 5.2 on phantoms: the tables of docs/mumford-shah.md.
//
//   mumford_shah_study [NAME]   all tables, or the one of this name: orders, derivative, flows,
//                               noise, mu, gamma, start, many, meshes
#include <fmt/format.h>

#include <Eigen/Dense>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "libcurve/distance.h"
#include "libcurve/hierarchy.h"
#include "libcurve/image_fields.h"
#include "libcurve/mumford_shah.h"
#include "libcurve/phantom.h"
#include "libcurve/primitives.h"
#include "libcurve/rasterize.h"
#include "libcurve/segment.h"
#include "libsurf/base/random.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/stiffness.h"

namespace {

using namespace surf;
using namespace surf::curve;
using std::numbers::pi;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

class Formula : public Field<2> {
 public:
  using Value = std::function<double(const Vector<2>&)>;
  using Gradient = std::function<Vector<2>(const Vector<2>&)>;
  Formula(Value value, Gradient gradient)
      : value_(std::move(value)), gradient_(std::move(gradient)) {}
  void sample(const Points<2>& x, Derivatives order, Samples<2>& out) const override {
    out.resize(x.rows(), order);
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      out.value[i] = value_(x.row(i));
      if (order >= Derivatives::kFirst) out.gradient.row(i) = gradient_(x.row(i));
    }
  }

 private:
  Value value_;
  Gradient gradient_;
};

Points<2> square(double half) {
  Points<2> out(4, 2);
  out << -half, -half, half, -half, half, half, -half, half;
  return out;
}

// --- orders: u_i = a_i cos(pi x) cos(pi y) + b_i inside and outside the square |x|, |y| <= 1.

constexpr double kMu = 0.05, kA[2] = {-0.3, 1.0}, kB[2] = {0.2, -0.5};

double exact(const Vector<2>& x, bool in) {
  return kA[in] * std::cos(pi * x[0]) * std::cos(pi * x[1]) + kB[in];
}
Vector<2> exact_gradient(const Vector<2>& x, bool in) {
  return -pi * kA[in] *
         Vector<2>(std::sin(pi * x[0]) * std::cos(pi * x[1]),
                   std::cos(pi * x[0]) * std::sin(pi * x[1]));
}

std::array<double, 3> solution_errors(double h) {
  const auto I = std::make_shared<Formula>(
      [](const Vector<2>& x) {
        const bool in = x.cwiseAbs().maxCoeff() < 1;
        return (1 + 2 * pi * pi * kMu) * (exact(x, in) - kB[in]) + kB[in];
      },
      [](const Vector<2>&) { return Vector<2>::Zero(); });
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

std::shared_ptr<const Field<2>> waves() {
  return std::make_shared<Formula>(
      [](const Vector<2>& x) {
        return std::exp(-x.squaredNorm()) + 0.2 * std::sin(3 * x[0] + x[1]);
      },
      [](const Vector<2>& x) {
        const double e = std::exp(-x.squaredNorm()), c = 0.2 * std::cos(3 * x[0] + x[1]);
        return Vector<2>(-2 * x[0] * e + 3 * c, -2 * x[1] * e + c);
      });
}

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

MumfordShahOptions analytic_options(double h) {
  MumfordShahOptions out;
  out.mu = 0.1;
  out.gamma = 0.05;
  out.outer = square(2);
  out.pixel_mm = h;
  out.max_size_mm = 2 * h;
  out.data_tolerance = 0;
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
      const auto I = kind == 0 ? waves() : pixels_of(*waves(), 128);
      double worst = 0;
      for (std::uint64_t seed = 1; seed <= 5; ++seed) {
        const Segments curves = blob(100, seed);
        const fem::Geometry<2> shape = geometry(curves);
        MumfordShah J(I, analytic_options(0.03));
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
    MumfordShah J(waves(), analytic_options(3.0 / n));
    J.reset(shape);
    energy::ShapeTerms<2> terms(shape);
    const auto A = fem::stiffness<2>(shape, Eigen::VectorXd::Ones(n));
    const auto curvature = fem::curvature<2>(shape, A);
    J.differentiate(curvature, 1, terms);
    const Eigen::VectorXd weak = J.shape_gradient(curvature.mean).cwiseProduct(shape.lumped_mass());
    const Eigen::VectorXd normal =
        terms.derivative.cwiseProduct(shape.nodal_normals()).rowwise().sum();
    const double difference = (normal - weak).cwiseAbs().sum() / weak.cwiseAbs().sum();
    fmt::print("| {} | {:.2e} | {} |\n", n, difference,
               before > 0 ? fmt::format("{:.2f}", std::log2(before / difference)) : "");
    before = difference;
  }
}

// --- runs

struct Outcome {
  CurveResult result;
  CurveOptions options;
  int steps = 0, trials = 0;
  double seconds = 0;
};

Outcome run(const Image& image, const Segments& start, CurveOptions options) {
  options.initial = start;
  const double begin = now();
  Outcome out{surf::curve::segment(image, options), options};
  out.seconds = now() - begin;
  for (const auto& stage : out.result.stages)
    for (const auto& step : stage.flow.steps) {
      ++out.steps;
      out.trials += step.n_trials;
    }
  return out;
}

CurveOptions options_of(double mu, double gamma) {
  CurveOptions out;
  out.energies = {{"mumford-shah", 1, {{"mu", mu}, {"gamma", gamma}}}};
  out.flow.max_steps = 1000;
  return out;
}

double psnr(const Image& image, const Image& clean) {
  double sum = 0;
  for (std::size_t i = 0; i < image.values().size(); ++i)
    sum += std::pow(double(image.values()[i]) - clean.values()[i], 2);
  return -10 * std::log10(sum / double(image.values().size()));
}

double dice(const Segments& a, const Segments& b, const Image& image) {
  const auto x = rasterize(a, image.size(), image.pixel_to_plane()),
             y = rasterize(b, image.size(), image.pixel_to_plane());
  double both = 0, sum = 0;
  for (std::size_t i = 0; i < x.size(); ++i) {
    both += x[i] && y[i];
    sum += (x[i] != 0) + (y[i] != 0);
  }
  return 2 * both / sum;
}

/// Region count, Dice and mean distance.
std::string found(const Outcome& out, const Image& image, const Segments& exact_contour) {
  if (out.result.shape.elements.rows() == 0) return "0 | | ";
  return fmt::format("{} | {:.4f} | {:.3f}", regions(curve_hierarchy(out.result.shape)).size(),
                     dice(out.result.shape, exact_contour, image),
                     curve_distances(out.result.shape, exact_contour).mean_mm);
}

Segments start_round_all() { return circle({127.5, 127.5}, 110, 1.5); }

void flows() {
  fmt::print(
      "\n| phantom | flow | steps | trials | seconds | J | regions | Dice | mean px "
      "|\n|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [name, kind] : {std::pair{"blob", PhantomKind::kBlob},
                                   {"bay", PhantomKind::kBay},
                                   {"ring", PhantomKind::kRing}})
    for (const auto& [flow_name, product, scheme] :
         {std::tuple{"L2 explicit", flow::ScalarProduct::kL2, flow::Scheme::kExplicit},
          {"L2", flow::ScalarProduct::kL2, flow::Scheme::kSemiImplicit},
          {"H1", flow::ScalarProduct::kH1, flow::Scheme::kExplicit}}) {
      const PhantomOptions phantom{.kind = kind, .noise = 0.1};
      const Image image = make_phantom(phantom);
      CurveOptions options = options_of(1000, 0.5);
      options.n_coarse_steps = 0;
      options.flow.velocity.product = product;
      options.flow.velocity.scheme = scheme;
      options.open_cavities = kind == PhantomKind::kRing;
      const Outcome out = run(image, start_round_all(), options);
      fmt::print("| {} | {} | {} | {} | {:.1f} | {:.4g} | {} |\n", name, flow_name, out.steps,
                 out.trials, out.seconds, out.result.last().final_energy,
                 found(out, image, phantom_contour(phantom)));
      std::fflush(stdout);
    }
}

void noise() {
  fmt::print(
      "\n| phantom | noise | PSNR of I | PSNR of u | gain dB | steps | seconds | regions | "
      "Dice | mean px |\n|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [name, kind] : {std::pair{"blob", PhantomKind::kBlob},
                                   {"bay", PhantomKind::kBay},
                                   {"discs12", PhantomKind::kDiscs12}})
    for (const double sigma : {0.1, 0.25, 0.5}) {
      PhantomOptions phantom{.kind = kind, .noise = sigma};
      const Image image = make_phantom(phantom);
      const Segments exact_contour = phantom_contour(phantom);
      phantom.noise = 0;
      const Image clean = make_phantom(phantom);
      const Outcome out =
          run(image,
              kind == PhantomKind::kDiscs12 ? grid_of_circles({0, 0}, {255, 255}, 24, 8, 1.5)
                                            : start_round_all(),
              options_of(1000, 0.5));
      const Image u = denoised(image, out.options, out.result);
      fmt::print("| {} | {} | {:.1f} | {:.1f} | {:+.1f} | {} | {:.1f} | {} |\n", name, sigma,
                 psnr(image, clean), psnr(u, clean), psnr(u, clean) - psnr(image, clean), out.steps,
                 out.seconds, found(out, image, exact_contour));
      std::fflush(stdout);
    }
}

/// The discs, where the background rises across the image.
void sweep(const char* name, const std::vector<std::pair<double, double>>& pairs) {
  const PhantomOptions phantom{
      .kind = PhantomKind::kDiscs12, .noise = 0.1, .linear_background = 0.5};
  const Image image = make_phantom(phantom);
  PhantomOptions no_noise = phantom;
  no_noise.noise = 0;
  const Image clean = make_phantom(no_noise);
  fmt::print(
      "\n{}\n\n| mu | gamma | steps | PSNR of u | length | regions | Dice | mean px "
      "|\n|---|---|---|---|---|---|---|---|\n",
      name);
  for (const auto& [mu, gamma] : pairs) {
    const Outcome out =
        run(image, grid_of_circles({0, 0}, {255, 255}, 24, 8, 1.5), options_of(mu, gamma));
    const bool is_left = out.result.shape.elements.rows() > 0;
    double length = 0;
    for (const auto e : out.result.shape.elements.rowwise())
      length += (out.result.shape.points.row(e[1]) - out.result.shape.points.row(e[0])).norm();
    fmt::print(
        "| {} | {} | {} | {} | {:.0f} | {} |\n", mu, gamma, out.steps,
        is_left ? fmt::format("{:.1f}", psnr(denoised(image, out.options, out.result), clean)) : "",
        length, found(out, image, phantom_contour(phantom)));
    std::fflush(stdout);
  }
}

void start() {
  const PhantomOptions phantom{.kind = PhantomKind::kBay, .noise = 0.1};
  const Image image = make_phantom(phantom);
  const Segments exact_contour = phantom_contour(phantom);
  const std::vector<std::pair<std::string, Segments>> starts = {
      {"outside", circle({127.5, 127.5}, 120, 1.5)},
      {"inside", circle({90, 100}, 15, 1.5)},
      {"overlapping", circle({170, 170}, 50, 1.5)},
      {"three", joined({circle({60, 128}, 25, 1.5), circle({120, 200}, 30, 1.5),
                        circle({180, 70}, 35, 1.5)})},
      {"grid", grid_of_circles({0, 0}, {255, 255}, 32, 10, 1.5)}};
  fmt::print(
      "\n| start | steps | seconds | J | regions | Dice | mean px |\n|---|---|---|---|---|---|"
      "---|\n");
  for (const auto& [name, curves] : starts) {
    const Outcome out = run(image, curves, options_of(1000, 0.5));
    fmt::print("| {} | {} | {:.1f} | {:.5g} | {} |\n", name, out.steps, out.seconds,
               out.result.last().final_energy, found(out, image, exact_contour));
    std::fflush(stdout);
  }
}

void many() {
  const PhantomOptions phantom{.kind = PhantomKind::kDiscs12, .size = {512, 512}, .noise = 0.1};
  const Image image = make_phantom(phantom);
  const Outcome out =
      run(image, grid_of_circles({0, 0}, {511, 511}, 40, 12, 1.5), options_of(1000, 0.5));
  fmt::print("\n| stage | steps | seconds |\n|---|---|---|\n");
  for (const auto& stage : out.result.stages)
    fmt::print("| {} | {} | {:.1f} |\n", stage.name, stage.flow.steps.size(), stage.seconds);
  fmt::print("\n512 x 512: {:.1f} s; regions, Dice, mean px: {}\n", out.seconds,
             found(out, image, phantom_contour(phantom)));
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

}  // namespace

int main(int argc, char** argv) {
  const std::vector<std::pair<std::string, std::function<void()>>> tables = {
      {"orders", orders},
      {"derivative", derivative},
      {"meshes", meshes},
      {"flows", flows},
      {"noise", noise},
      {"mu",
       [] {
         sweep("mu", {{20, 0.5}, {100, 0.5}, {500, 0.5}, {2000, 0.5}, {10000, 0.5}});
       }},
      {"gamma",
       [] {
         sweep("gamma", {{1000, 0.05}, {1000, 0.2}, {1000, 1}, {1000, 4}, {1000, 16}});
       }},
      {"start", start},
      {"many", many}};
  for (const auto& [name, table] : tables)
    if (argc < 2 || name == argv[1]) table();
  return 0;
}
