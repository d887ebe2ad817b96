// The experiments of thesis 5.1.3, and what adaptivity is worth: the tables and pictures of
// docs/adaptivity.md.
//
//   adaptivity_study [DIRECTORY [experiments|levels|accuracy]]
//
// writes surfaces (.vtp), pictures (.png, with a display) and the plot (.svg) into the directory.
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/products.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/triangle_mesh.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"
#include "tests/bench/draw_surface.h"
#include "tests/bench/volume_experiments.h"

namespace {

using namespace surf;

const io::RenderOptions kPicture = {.width = 1200, .height = 600, .has_edges = true};
constexpr int kSize = 128;

/// The prism of the comparison has edges of half-width 1.6 voxels, as scans have.
volume::PhantomOptions sharp_prism(int size) {
  volume::PhantomOptions phantom;
  phantom.kind = volume::PhantomKind::kBox;
  phantom.size = {size, size, size};
  phantom.edge_width_mm = 3.2 / size;
  return phantom;
}

volume::PhantomOptions phantom_of(volume::PhantomKind kind) {
  return bench::phantom_of(kind, kSize);
}

struct Sample {
  int k;
  double energy_of_thesis;
};

struct Lengths {
  double near = 0, far = 0;  // medians of the edges' lengths
};

/// Edges whose midpoint lies within / beyond given distances of the sharp parts of the body.
Lengths edge_lengths(const Triangles& surface, volume::PhantomKind kind) {
  std::vector<double> near, far;
  for (Eigen::Index t = 0; t < surface.elements.rows(); ++t)
    for (int i = 0; i < 3; ++i) {
      const Vector<3> a = surface.points.row(surface.elements(t, i));
      const Vector<3> b = surface.points.row(surface.elements(t, (i + 1) % 3));
      const Vector<3> middle = (a + b) / 2;
      double sharp = 0;  // distance to the cusp, or to the nearest edge of the prism
      if (kind == volume::PhantomKind::kTwoBalls) {
        sharp = middle.norm();
      } else {
        std::array<double, 3> to_face = {0.6 - std::abs(middle[0]), 0.4 - std::abs(middle[1]),
                                         0.3 - std::abs(middle[2])};
        std::sort(to_face.begin(), to_face.end());
        sharp = to_face[1];
      }
      const bool is_cusp = kind == volume::PhantomKind::kTwoBalls;
      if (sharp < (is_cusp ? 0.25 : 0.03)) near.push_back((b - a).norm());
      if (sharp > (is_cusp ? 0.5 : 0.2)) far.push_back((b - a).norm());
    }
  const auto median = [](std::vector<double>& v) {
    if (v.empty()) return 0.0;
    std::nth_element(v.begin(), v.begin() + v.size() / 2, v.end());
    return v[v.size() / 2];
  };
  return {median(near), median(far)};
}

/// Largest h_S theta_S of a side.
double largest_side(const Triangles& surface) {
  const mesh::TriMesh mesh = mesh::to_mesh(surface);
  double largest = 0;
  for (const auto side : mesh.edges())
    largest = std::max(largest, mesh.calc_edge_length(side) *
                                    angle_between(mesh.calc_face_normal(side.h0().face()),
                                                  mesh.calc_face_normal(side.h1().face())));
  return largest;
}

void experiment(const std::string& name, volume::PhantomKind kind,
                const std::vector<Sample>& samples, const std::filesystem::path& directory) {
  const volume::Volume image = volume::make_phantom(phantom_of(kind));
  const segment::SegmentOptions options = bench::options_of_thesis(image.voxel_size());
  fmt::print("\n{}\n\n| k | J of the thesis | J | triangles |\n|---|---|---|---|\n", name);
  std::vector<flow::StepRecord> records;
  const auto result = segment::segment(
      image, options,
      [&](const std::string& stage, const flow::StepRecord& record, const auto& surface) {
        if (stage != "evolve") return true;
        records.push_back(record);
        for (const Sample& sample : samples)
          if (record.k == sample.k)
            bench::draw(directory, fmt::format("{}-k{}", name, record.k), surface(), kPicture);
        return true;
      });
  for (const Sample& sample : samples) {
    const auto& at = records[std::min<std::size_t>(sample.k, records.size()) - 1];
    fmt::print("| {}{} | {} | {:.3f} | {} |\n", sample.k,
               at.k < sample.k ? fmt::format(" (ended at {})", at.k) : "", sample.energy_of_thesis,
               at.energy, at.n_elements);
  }
  const double target = samples.back().energy_of_thesis;
  const auto reached = std::find_if(records.begin(), records.end(),
                                    [&](const auto& record) { return record.energy <= target; });
  const Triangles& end = result.shape;
  const auto distance = mesh::distances_from(end, [&](const Eigen::Vector3d& x) {
    return volume::phantom_distance_mm(phantom_of(kind), x);
  });
  const Lengths lengths = edge_lengths(end, kind);
  const mesh::Quality quality = mesh::quality(end);
  fmt::print(
      "\nJ <= {} first at k = {}. End: k = {} ({}), J = {:.4f}. Settled: {} triangles, {}; mean "
      "distance "
      "{:.3f} voxel; smallest angle {:.1f} degrees, {:.1f} % of triangles above 25; median edge "
      "{:.4f} mm at the sharp parts, {:.4f} mm away from them: {:.1f} times; largest h_S theta_S "
      "{:.4f} mm (tolerance {}).\n",
      target, reached == records.end() ? 0 : reached->k, records.back().k,
      flow::to_string(result.last().termination), records.back().energy, end.elements.rows(),
      mesh::verify(end).passed() ? "verified" : "NOT VERIFIED",
      distance.mean_mm / image.voxel_size(), quality.min_angle_deg,
      100 * quality.share_above_25_deg, lengths.near, lengths.far, lengths.far / lengths.near,
      largest_side(end), bench::kGeometryTolerance);
  bench::draw(directory, name + "-end", end, kPicture);
  std::fflush(stdout);
}

struct Point {
  double n_triangles, mean, max;  // distances to the reference [voxel]
};

/// What of a surface's mesh the comparison varies, in voxels.
struct Resolution {
  double edge, coarseness, tolerance;
};

/// The minimiser of (5.1), not settled: settling moves the surface by what its curvature, smoothed
/// over three edge lengths, says, which differs from mesh to mesh by more than the minimisers do.
/// Tolerances of the flow leave no error that shows.
Triangles prism(const volume::Volume& image, const Resolution& resolution) {
  segment::SegmentOptions options = bench::options_of_thesis(image.voxel_size());
  options.initial = mesh::ball({0, 0, 0}, 1, 0.2);
  options.sigma_mm = 0.7 * image.voxel_size();
  options.edge_length_mm = resolution.edge * image.voxel_size();
  options.coarseness = resolution.coarseness;
  options.geometry_tolerance_mm = resolution.tolerance * image.voxel_size();
  options.n_levels = 3;
  options.settle = false;
  options.flow.energy_tol = options.flow.rel_tol = 1e-6;
  return segment::segment(image, options).shape;
}

/// Triangles of a uniform mesh with this error, by a power law between two points of the series.
double triangles_at(const std::vector<Point>& uniform, double Point::*error, double value) {
  for (std::size_t i = 1; i < uniform.size(); ++i) {
    const Point &coarse = uniform[i - 1], &fine = uniform[i];
    if (value > coarse.*error || value < fine.*error) continue;
    const double at = std::log(value / (coarse.*error)) / std::log(fine.*error / (coarse.*error));
    return coarse.n_triangles * std::pow(fine.n_triangles / coarse.n_triangles, at);
  }
  return 0;
}

/// Triangles over those of a uniform mesh with the same error; a dash beyond the series.
std::string share_of_uniform(const std::vector<Point>& uniform, double Point::*error,
                             const Point& point) {
  const double n = triangles_at(uniform, error, point.*error);
  return n > 0 ? fmt::format("{:.2f}", point.n_triangles / n) : "-";
}

/// The error of the discretisation: distance to the minimiser on a very fine mesh. (The distance to
/// the prism itself is that of its edges, which the edge's width rounds; it hardly depends on
/// the mesh.)
Point prism_error(const volume::Volume& image, const Triangles& reference,
                  const Resolution& resolution, const std::vector<Point>& uniform) {
  const auto start = std::chrono::steady_clock::now();
  const Triangles surface = prism(image, resolution);
  const double seconds =
      std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto distance = mesh::surface_distances(surface, reference);
  const double voxel = image.voxel_size();
  const Point point{double(surface.elements.rows()), distance.mean_mm / voxel,
                    distance.max_mm / voxel};
  const bool is_adaptive = resolution.coarseness > 1;
  fmt::print("| {} | {} | {} | {} | {:.4f} / {:.3f} | {} | {:.2f} |\n",
             is_adaptive ? "adaptive" : "uniform", resolution.edge,
             is_adaptive ? fmt::format("{}", resolution.tolerance) : "-", surface.elements.rows(),
             point.mean, point.max,
             is_adaptive ? fmt::format("{} / {}", share_of_uniform(uniform, &Point::mean, point),
                                       share_of_uniform(uniform, &Point::max, point))
                         : "",
             seconds);
  std::fflush(stdout);
  return point;
}

/// Both series over logarithmic axes.
void plot(const std::filesystem::path& path, const std::vector<Point>& uniform,
          const std::vector<Point>& adaptive) {
  constexpr double kWidth = 640, kHeight = 420, kMargin = 60;
  constexpr double kLeft = 2, kRight = 5.3, kBottom = -3, kTop = 0;  // log10
  const auto x = [&](double n) {
    return kMargin + (std::log10(n) - kLeft) / (kRight - kLeft) * (kWidth - 2 * kMargin);
  };
  const auto y = [&](double e) {
    return kHeight - kMargin -
           (std::log10(e) - kBottom) / (kTop - kBottom) * (kHeight - 2 * kMargin);
  };
  std::ofstream out(path);
  out << fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{0}\" height=\"{1}\" "
      "font-family=\"sans-serif\" font-size=\"13\">\n<rect width=\"{0}\" height=\"{1}\" "
      "fill=\"white\"/>\n",
      kWidth, kHeight);
  const auto text = [&](double at_x, double at_y, const std::string& anchor,
                        const std::string& words) {
    out << fmt::format("<text x=\"{:.0f}\" y=\"{:.0f}\" text-anchor=\"{}\">{}</text>\n", at_x, at_y,
                       anchor, words);
  };
  for (const double n : {100.0, 1000.0, 10000.0, 100000.0}) {
    out << fmt::format("<path d=\"M{0:.1f} {1} V{2}\" stroke=\"#ddd\"/>\n", x(n), kMargin,
                       kHeight - kMargin);
    text(x(n), kHeight - kMargin + 18, "middle", fmt::format("{}", n));
  }
  for (const double e : {0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5}) {
    out << fmt::format("<path d=\"M{0} {1:.1f} H{2}\" stroke=\"#ddd\"/>\n", kMargin, y(e),
                       kWidth - kMargin);
    text(kMargin - 6, y(e) + 4, "end", fmt::format("{}", e));
  }
  text(kWidth / 2, kHeight - 18, "middle", "triangles");
  text(kMargin, kMargin - 14, "start", "mean distance to the minimiser on a fine mesh [voxel]");
  const auto series = [&](const std::vector<Point>& points, const char* color, const char* name,
                          double legend) {
    std::string path_data;
    for (const Point& p : points) {
      path_data += fmt::format("{}{:.1f} {:.1f} ", path_data.empty() ? "M" : "L", x(p.n_triangles),
                               y(p.mean));
      out << fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"4\" fill=\"{}\"/>\n",
                         x(p.n_triangles), y(p.mean), color);
    }
    out << fmt::format("<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"2\"/>\n",
                       path_data, color);
    out << fmt::format("<circle cx=\"{}\" cy=\"{}\" r=\"4\" fill=\"{}\"/>\n", kWidth - 160, legend,
                       color);
    text(kWidth - 150, legend + 4, "start", name);
  };
  series(uniform, "#b5523b", "uniform", kMargin + 10);
  series(adaptive, "#2f6db5", "adaptive", kMargin + 30);
  out << "</svg>\n";
}

struct Comparison {
  int size;
  Resolution reference;
  std::vector<double> edges, tolerances;
};

void accuracy_against_triangles(const Comparison& comparison,
                                const std::filesystem::path& directory) {
  const volume::Volume image = volume::make_phantom(sharp_prism(comparison.size));
  const Triangles reference = prism(image, comparison.reference);
  fmt::print("\n{}^3 voxels; reference: {} triangles\n", comparison.size,
             reference.elements.rows());
  fmt::print(
      "\n| mesh | finest edge voxel | tolerance voxel | triangles | distance to the reference mean "
      "/ max voxel | share of the uniform triangles at equal mean / max | time s "
      "|\n|---|---|---|---|---|---|---|\n");
  std::vector<Point> uniform, adaptive;
  for (const double edge : comparison.edges)
    uniform.push_back(prism_error(image, reference, {edge, 1, 1}, {}));
  for (const double tolerance : comparison.tolerances)
    adaptive.push_back(prism_error(image, reference, {0.75, 32, tolerance}, uniform));
  if (!directory.empty())
    plot(directory / fmt::format("accuracy-triangles-{}.svg", comparison.size), uniform, adaptive);
}

/// Steps on each level, and time, for the prism and the two balls.
void multi_resolution() {
  fmt::print(
      "\n| phantom | levels | steps, coarsest level first | triangles | to the body mean voxel | "
      "time "
      "s |\n|---|---|---|---|---|---|\n");
  for (const auto& [name, kind] : {std::pair{"two-balls", volume::PhantomKind::kTwoBalls},
                                   {"prism", volume::PhantomKind::kBox}})
    for (const int n_levels : {1, 2, 3}) {
      const volume::Volume image = volume::make_phantom(phantom_of(kind));
      segment::SegmentOptions options = bench::options_of_thesis(image.voxel_size());
      options.n_levels = n_levels;
      const auto start = std::chrono::steady_clock::now();
      const auto result = segment::segment(image, options);
      const double seconds =
          std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
      std::string steps;
      for (const auto& stage : result.stages)
        steps += fmt::format("{}{}", steps.empty() ? "" : " + ", stage.flow.steps.size());
      const auto distance =
          mesh::distances_from(result.shape, [&, body = kind](const Eigen::Vector3d& x) {
            return volume::phantom_distance_mm(phantom_of(body), x);
          });
      fmt::print("| {} | {} | {} | {} | {:.3f} | {:.2f} |\n", name, n_levels, steps,
                 result.shape.elements.rows(), distance.mean_mm / image.voxel_size(), seconds);
      std::fflush(stdout);
    }
}

}  // namespace

int main(int argc, char** argv) {
  const std::filesystem::path directory = argc > 1 ? argv[1] : "";
  const std::string part = argc > 2 ? argv[2] : "";
  if (!directory.empty()) std::filesystem::create_directories(directory);
  if (part.empty() || part == "experiments") {
    experiment("two-balls", volume::PhantomKind::kTwoBalls,
               {{12, 1.802}, {20, 0.926}, {25, 0.590}, {30, 0.407}, {35, 0.317}, {59, 0.278}},
               directory);
    experiment("prism", volume::PhantomKind::kBox,
               {{5, 10.831}, {50, 4.441}, {85, 2.780}, {125, 1.517}, {160, 0.500}}, directory);
  }
  if (part.empty() || part == "levels") multi_resolution();
  if (part.empty() || part == "accuracy") {
    accuracy_against_triangles({128, {0.6, 8, 0.15}, {8, 6, 4, 3, 2, 1.5, 1}, {16, 8, 4, 2, 1}},
                               directory);
    accuracy_against_triangles({256, {0.75, 16, 0.3}, {12, 8, 6, 4, 3, 2, 1.5}, {16, 8, 4, 2}},
                               directory);
  }
}
