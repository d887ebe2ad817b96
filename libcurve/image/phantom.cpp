#include "libcurve/image/phantom.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/base/random.h"

namespace surf::curve {
namespace {

using Eigen::Vector2d;
using std::numbers::pi;

struct Disc {
  Vector2d centre;
  double radius;
};

const std::vector<Disc>& discs12() {
  static const std::vector<Disc> kDiscs = {
      {{-.70, -.68}, .20}, {{-.24, -.74}, .13}, {{.22, -.66}, .22}, {{.72, -.72}, .16},
      {{-.74, -.14}, .15}, {{-.28, -.18}, .24}, {{.26, -.10}, .17}, {{.72, -.16}, .21},
      {{-.64, .50}, .26},  {{-.10, .42}, .18},  {{.36, .56}, .22},  {{.80, .48}, .12}};
  return kDiscs;
}

const Disc kRingOuter = {{0.05, -0.03}, 0.6}, kRingInner = {{0.05, -0.03}, 0.3};
constexpr int kChords = 720;  // of a closed curve of radius 0.6: sagitta 6e-6

using Loop = std::vector<Vector2d>;

Loop closed_curve(const std::function<Vector2d(double)>& at) {
  Loop out;
  for (int n = 0; n < kChords; ++n) out.push_back(at(2 * pi * n / kChords));
  return out;
}

Loop circle_of(const Disc& disc) {
  return closed_curve([&](double t) -> Vector2d {
    return disc.centre + disc.radius * Vector2d(std::cos(t), std::sin(t));
  });
}

/// Appends an arc of an ellipse, its end excluded.
void add_arc(Loop& loop, const Vector2d& centre, double a, double b, double from, double to) {
  constexpr int kPieces = 180;
  for (int n = 0; n < kPieces; ++n) {
    const double t = from + (to - from) * n / kPieces;
    loop.push_back(centre + Vector2d(a * std::cos(t), b * std::sin(t)));
  }
}

/// Corners at (-0.6, -0.55), (0.45, -0.55), (0.35, 0.5), (0.1, 0.5), (-0.3, 0.5) and (-0.6, 0.5);
/// two quarters of ellipses that meet in a cusp at (0.8, 0), where both run along x; and half an
/// ellipse of half axes 0.2 and 0.6 that is cut out from (0.1, 0.5) to (-0.3, 0.5).
Loop bay() {
  Loop loop = {{-0.6, -0.55}};
  add_arc(loop, {0.8, -0.55}, 0.35, 0.55, pi, pi / 2);
  add_arc(loop, {0.8, 0.5}, 0.45, 0.5, -pi / 2, -pi);
  loop.push_back({0.35, 0.5});
  add_arc(loop, {-0.1, 0.5}, 0.2, 0.6, 0, -pi);
  loop.push_back({-0.3, 0.5});
  loop.push_back({-0.6, 0.5});
  return loop;
}

Segments to_segments(const std::vector<Loop>& loops) {
  Eigen::Index n = 0;
  for (const Loop& loop : loops) n += Eigen::Index(loop.size());
  Segments out{Points<2>(n, 2), Elements<2>(n, 2)};
  Eigen::Index at = 0;
  for (const Loop& loop : loops) {
    const auto m = Eigen::Index(loop.size());
    for (Eigen::Index i = 0; i < m; ++i) {
      out.points.row(at + i) = loop[i];
      out.elements.row(at + i) << int(at + i), int(at + (i + 1) % m);
    }
    at += m;
  }
  return out;
}

double distance_to(const Segments& outline, const Vector2d& point) {
  double least = 1e300;
  for (const auto element : outline.elements.rowwise()) {
    const Vector2d a = outline.points.row(element[0]), b = outline.points.row(element[1]);
    const Vector2d ab = b - a;
    const double t = std::clamp((point - a).dot(ab) / ab.squaredNorm(), 0.0, 1.0);
    least = std::min(least, (point - a - t * ab).squaredNorm());
  }
  return std::sqrt(least);
}

bool is_inside(const Segments& outline, const Vector2d& point) {
  bool inside = false;
  for (const auto element : outline.elements.rowwise()) {
    const Vector2d a = outline.points.row(element[0]), b = outline.points.row(element[1]);
    if ((a[1] > point[1]) == (b[1] > point[1])) continue;
    const double x = a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
    if (x > point[0]) inside = !inside;
  }
  return inside;
}

double background(const PhantomOptions& options, const Vector2d& u) {
  double value = options.linear_background / 4 * (2 + u[0] + u[1]);
  if (options.wave_amplitude != 0)
    value +=
        options.wave_amplitude * std::cos(pi * u[0] / (options.wave_periods * options.edge_width));
  return value;
}

}  // namespace

const std::map<std::string, PhantomKind>& phantom_kinds() {
  static const std::map<std::string, PhantomKind> kinds = {{"blob", PhantomKind::kBlob},
                                                           {"discs12", PhantomKind::kDiscs12},
                                                           {"ring", PhantomKind::kRing},
                                                           {"bay", PhantomKind::kBay}};
  return kinds;
}

std::string PhantomOptions::error() const {
  for (const int n : size)
    if (n < 2 || n > 32768)
      return fmt::format("PhantomOptions::size = {} violates 2 <= size <= 32768", n);
  if (!(spacing_mm.allFinite() && spacing_mm.minCoeff() > 0))
    return fmt::format("PhantomOptions::spacing_mm = ({}, {}) violates 0 < spacing < Inf",
                       spacing_mm[0], spacing_mm[1]);
  if (!(std::isfinite(edge_width) && edge_width > 0))
    return fmt::format("PhantomOptions::edge_width = {} violates 0 < width < Inf", edge_width);
  if (!(std::isfinite(noise) && noise >= 0))
    return fmt::format("PhantomOptions::noise = {} violates 0 <= noise < Inf", noise);
  if (!std::isfinite(linear_background) || !std::isfinite(wave_amplitude))
    return "PhantomOptions: a background is not finite";
  if (!(std::isfinite(wave_periods) && wave_periods > 0))
    return fmt::format("PhantomOptions::wave_periods = {} violates > 0", wave_periods);
  return {};
}

Eigen::Affine2d PhantomOptions::unit_to_plane() const {
  const Vector2d lengths = Vector2d(size[0] - 1, size[1] - 1).cwiseProduct(spacing_mm);
  return Eigen::Translation2d(0.5 * lengths) * Eigen::Scaling(0.5 * lengths.minCoeff());
}

Segments phantom_outline(PhantomKind kind) {
  switch (kind) {
    case PhantomKind::kBlob:
      return to_segments({closed_curve([](double t) -> Vector2d {
        return 0.5 * (1 + 0.15 * std::cos(3 * t)) * Vector2d(std::cos(t), std::sin(t));
      })});
    case PhantomKind::kDiscs12: {
      std::vector<Loop> loops;
      for (const Disc& disc : discs12()) loops.push_back(circle_of(disc));
      return to_segments(loops);
    }
    case PhantomKind::kRing: {
      Loop hole = circle_of(kRingInner);
      std::reverse(hole.begin(), hole.end());
      return to_segments({circle_of(kRingOuter), hole});
    }
    case PhantomKind::kBay:
      break;
  }
  return to_segments({bay()});
}

double phantom_depth(PhantomKind kind, const Segments& outline, const Vector2d& point) {
  if (kind == PhantomKind::kDiscs12) {
    double depth = -1e300;
    for (const Disc& disc : discs12())
      depth = std::max(depth, disc.radius - (point - disc.centre).norm());
    return depth;
  }
  if (kind == PhantomKind::kRing) {
    const double r = (point - kRingOuter.centre).norm();
    return std::min(kRingOuter.radius - r, r - kRingInner.radius);
  }
  const double distance = distance_to(outline, point);
  return is_inside(outline, point) ? distance : -distance;
}

Image make_phantom(const PhantomOptions& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  const Segments outline = phantom_outline(options.kind);
  const Eigen::Affine2d to_plane = pixel_to_plane(options.spacing_mm);
  const Eigen::Affine2d to_unit = options.unit_to_plane().inverse() * to_plane;
  const auto& [n_columns, n_rows] = options.size;
  std::vector<float> values(std::size_t(n_columns) * n_rows);
  tbb::parallel_for(0, n_rows, [&, n = n_columns](int j) {
    for (int i = 0; i < n; ++i) {
      const std::size_t at = std::size_t(j) * n + i;
      const Vector2d u = to_unit * Vector2d(i, j);
      const double I =
          0.5 * (1 + std::erf(2 * phantom_depth(options.kind, outline, u) / options.edge_width));
      double value = I + (1 - I) * background(options, u);
      if (options.noise > 0) value += options.noise * normal_random(options.random_seed, at);
      values[at] = static_cast<float>(value);
    }
  });
  ImageSource source;
  source.path = source.format = "phantom";
  source.scalar_type = "float32";
  source.spacing_source = "options";
  return Image(options.size, to_plane, std::move(values), std::move(source));
}

Segments phantom_contour(const PhantomOptions& options) {
  Segments out = phantom_outline(options.kind);
  const Eigen::Affine2d to_plane = options.unit_to_plane();
  for (auto point : out.points.rowwise())
    point = (to_plane * Vector2d(point.transpose())).transpose().eval();
  return out;
}

}  // namespace surf::curve
