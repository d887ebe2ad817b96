#include "libsurf/segment/seed_model.h"

#include <tbb/parallel_for.h>

#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <numbers>

namespace surf::segment {
namespace {

constexpr int kLargestRadius = 16;  // cells; more says nothing new and costs radius^3
constexpr int kNoiseRadius = 4;     // cells, of the ball that noise is measured in

/// A square or cubic lattice in the frame of an image, its spacing that of the cells.
template <int Dim>
struct Frame {
  double spacing;
  Eigen::Matrix<double, Dim, Dim> axes;  ///< orthonormal, mirrored where the image is

  /// The image's axes where they are orthogonal, else the nearest such frame (polar decomposition).
  explicit Frame(const ImageExtent<Dim>& extent) : spacing(extent.cell_mm()) {
    using Matrix = Eigen::Matrix<double, Dim, Dim>;
    const Matrix linear = extent.index_to_world.linear();
    const Matrix unit = linear * linear.colwise().norm().cwiseInverse().asDiagonal();
    const Eigen::JacobiSVD<Matrix> svd(unit, Eigen::ComputeFullU | Eigen::ComputeFullV);
    axes = svd.matrixU() * svd.matrixV().transpose();
  }
};

/// Calls visit(offset) for the points of a lattice with inner < |offset| <= outer.
template <int Dim, class Visit>
void for_shell(double inner, double outer, const Visit& visit) {
  constexpr double kSlack = 1e-9;  // many points lie at whole numbers
  const int n = static_cast<int>(std::ceil(outer));
  for (int k = Dim == 3 ? -n : 0; k <= (Dim == 3 ? n : 0); ++k)
    for (int j = -n; j <= n; ++j)
      for (int i = -n; i <= n; ++i) {
        const double r = std::sqrt(double(i * i + j * j + k * k)) - kSlack;
        if (r <= outer && r > inner) visit(Eigen::Vector3i(i, j, k).head<Dim>().eval());
      }
}

/// Points of the lattice about a centre; radii in its spacing.
template <int Dim>
Points<Dim> lattice_shell(const Frame<Dim>& frame, const Vector<Dim>& center, double inner,
                          double outer) {
  std::vector<Vector<Dim>> points;
  for_shell<Dim>(inner, outer, [&](const auto& offset) {
    points.push_back(center + frame.spacing * (frame.axes * offset.template cast<double>()));
  });
  Points<Dim> out(points.size(), Dim);
  for (std::size_t i = 0; i < points.size(); ++i) out.row(i) = points[i];
  return out;
}

template <int Dim>
std::vector<double> values_at(const Field<Dim>& I, const Points<Dim>& x) {
  Samples<Dim> samples;
  I.sample(x, Derivatives::kNone, samples);
  return {samples.value.data(), samples.value.data() + samples.value.size()};
}

double median_deviation(const std::vector<double>& values, double centre) {
  std::vector<double> distances;
  for (const double value : values) distances.push_back(std::abs(value - centre));
  return 1.4826 * median(std::move(distances));
}

/// 1.4826 median / sqrt 6 of second differences: the deviation of white noise.
double noise_of(std::vector<double> seconds) {
  return 1.4826 * median(std::move(seconds)) / std::sqrt(6.0);
}

template <int Dim>
double estimate_noise(const Field<Dim>& I, std::span<const Vector<Dim>> centers,
                      const Frame<Dim>& frame) {
  std::vector<double> seconds;
  for (const Vector<Dim>& center : centers) {
    const Points<Dim> x = lattice_shell<Dim>(frame, center, -1, kNoiseRadius);
    const std::vector<double> here = values_at<Dim>(I, x);
    for (int axis = 0; axis < Dim; ++axis) {
      const Eigen::Matrix<double, 1, Dim> step = frame.spacing * frame.axes.col(axis).transpose();
      const std::vector<double> plus = values_at<Dim>(I, x.rowwise() + step);
      const std::vector<double> minus = values_at<Dim>(I, x.rowwise() - step);
      for (std::size_t i = 0; i < here.size(); ++i)
        seconds.push_back(std::abs(plus[i] - 2 * here[i] + minus[i]));
    }
  }
  return noise_of(std::move(seconds));
}

/// Grows the ball.
/// @param shell  values at the lattice points with inner < r <= outer [cells]
template <class Shell>
SeedModel grown_ball(double noise, double cell_mm, const Shell& shell_values) {
  SeedModel model;
  model.noise = noise;
  std::vector<double> ball;
  double first_mean = 0, first_deviation = 0;
  for (int radius = 2; radius <= kLargestRadius; ++radius) {
    const std::vector<double> shell = shell_values(radius == 2 ? -1 : radius - 1, radius);
    if (radius > 2) {
      const auto n_inside = std::count_if(shell.begin(), shell.end(), [&](double value) {
        return std::abs(value - model.mean) <= 2.5 * model.deviation;
      });
      if (double(n_inside) < 0.85 * double(shell.size())) break;
    }
    std::vector<double> grown = ball;
    grown.insert(grown.end(), shell.begin(), shell.end());
    const double mean = median(grown);
    const double deviation = std::max(median_deviation(grown, mean), model.noise);
    if (radius == 2) {
      first_mean = mean;
      first_deviation = deviation;
    } else if (deviation > 2 * first_deviation || std::abs(mean - first_mean) > first_deviation) {
      break;
    }
    ball = std::move(grown);
    model.mean = mean;
    model.deviation = deviation;
    model.radius_mm = radius * cell_mm;
  }
  return model;
}

/// |grad I| along a ray up to its first pronounced peak: it exceeds `background` five times
/// and then falls to half. The largest value met if there is no such peak.
template <int Dim>
double first_peak(const Field<Dim>& I, const Vector<Dim>& seed, const Vector<Dim>& direction,
                  double step_mm, double background, const ImageExtent<Dim>& extent) {
  constexpr int kBatch = 32;
  Samples<Dim> samples;
  double highest = 0;
  for (int batch = 0; batch < 1000; ++batch) {
    Points<Dim> x(kBatch, Dim);
    for (int i = 0; i < kBatch; ++i) x.row(i) = seed + (batch * kBatch + i) * step_mm * direction;
    I.sample(x, Derivatives::kFirst, samples);
    for (int i = 0; i < kBatch; ++i) {
      if (!extent.contains(x.row(i).transpose())) return highest;
      const double gradient = samples.gradient.row(i).norm();
      if (highest > 5 * background && gradient < highest / 2) return highest;
      highest = std::max(highest, gradient);
    }
  }
  return highest;
}

}  // namespace

template <int Dim>
std::vector<Vector<Dim>> cell_centers(const ImageExtent<Dim>& extent,
                                      std::span<const Vector<Dim>> seeds) {
  std::vector<Vector<Dim>> out;
  for (const Vector<Dim>& seed : seeds)
    for (const auto& cell : nearest_nodes<Dim>(extent.world_to_index * seed, extent.size)) {
      Vector<Dim> index;
      for (int axis = 0; axis < Dim; ++axis) index[axis] = cell[axis];
      out.push_back(extent.index_to_world * index);
    }
  return out;
}

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + values.size() / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

template <>
Points<2> directions<2>(int n) {
  const int n_edge = std::max(1, int(std::lround(n / 4.0)));
  Points<2> out(4 * n_edge, 2);
  for (int i = 0; i < out.rows(); ++i) {
    const double angle = 2 * std::numbers::pi * (i + 0.5) / double(out.rows());
    out.row(i) << std::cos(angle), std::sin(angle);
  }
  return out;
}

template <>
Points<3> directions<3>(int n) {
  const int n_edge = std::max(1, int(std::lround(std::sqrt(n / 6.0))));
  const auto at = [&](int i) {
    return std::tan(std::numbers::pi / 4 * ((2 * i + 1.0) / n_edge - 1));
  };
  Points<3> out(6 * n_edge * n_edge, 3);
  Eigen::Index row = 0;
  for (int axis = 0; axis < 3; ++axis)
    for (const int side : {-1, 1})
      for (int j = 0; j < n_edge; ++j)
        for (int i = 0; i < n_edge; ++i, ++row) {
          Vector<3> point;
          point[axis] = side;
          point[(axis + 1) % 3] = at(i);
          point[(axis + 2) % 3] = at(j);
          out.row(row) = point.normalized().transpose();
        }
  return out;
}

template <int Dim>
std::vector<std::array<int, Dim>> nearest_nodes(const Vector<Dim>& index,
                                                const std::array<int, Dim>& size) {
  constexpr double kTie = 1e-3;
  std::vector<std::array<int, Dim>> out(1);
  for (int axis = 0; axis < Dim; ++axis) {
    const auto clamped = [&](double x) {
      return std::clamp(int(std::lround(x)), 0, size[axis] - 1);
    };
    const int low = clamped(index[axis] - kTie), high = clamped(index[axis] + kTie);
    const std::size_t n = out.size();
    for (std::size_t i = 0; i < n; ++i) {
      out[i][axis] = low;
      if (high == low) continue;
      out.push_back(out[i]);
      out.back()[axis] = high;
    }
  }
  return out;
}

template <int Dim>
SeedModel estimate_seed_model(const Field<Dim>& I, std::span<const Vector<Dim>> seeds,
                              const ImageExtent<Dim>& extent) {
  const Frame<Dim> frame(extent);
  const std::vector<Vector<Dim>> centers = cell_centers(extent, seeds);
  return grown_ball(
      estimate_noise<Dim>(I, centers, frame), frame.spacing, [&](double inner, double outer) {
        std::vector<double> shell;
        for (const Vector<Dim>& center : centers) {
          const auto values = values_at<Dim>(I, lattice_shell<Dim>(frame, center, inner, outer));
          shell.insert(shell.end(), values.begin(), values.end());
        }
        return shell;
      });
}

template <int Dim>
SeedModel estimate_seed_model(const SearchGrid<Dim>& grid, const Vector<Dim>& seed) {
  const NodeBox<Dim>& box = grid.box();
  const auto value = [&](std::array<int, Dim> node, const auto& offset) {
    for (int axis = 0; axis < Dim; ++axis)
      node[axis] = std::clamp(node[axis] + offset[axis], 0, box.size[axis] - 1);
    return double(grid.intensity()[box.at(node)]);
  };
  const auto nodes = nearest_nodes<Dim>(grid.node_to_world().inverse() * seed, box.size);
  std::vector<double> seconds;
  for (const auto& node : nodes)
    for_shell<Dim>(-1, kNoiseRadius, [&](const Eigen::Matrix<int, Dim, 1>& offset) {
      for (int axis = 0; axis < Dim; ++axis) {
        const Eigen::Matrix<int, Dim, 1> step = Eigen::Matrix<int, Dim, 1>::Unit(axis);
        seconds.push_back(std::abs(value(node, offset + step) - 2 * value(node, offset) +
                                   value(node, offset - step)));
      }
    });
  const double noise = std::max(noise_of(std::move(seconds)), grid.rounding());
  return grown_ball(noise, grid.node_mm(), [&](double inner, double outer) {
    std::vector<double> shell;
    for (const auto& node : nodes)
      for_shell<Dim>(inner, outer,
                     [&](const auto& offset) { shell.push_back(value(node, offset)); });
    return shell;
  });
}

template <int Dim>
double estimate_edge_strength(const Field<Dim>& I, std::span<const Vector<Dim>> seeds,
                              const ImageExtent<Dim>& extent) {
  constexpr int kRays = 48;                  // each costs the tiles it crosses
  constexpr double kLeastPronounced = 0.25;  // of the peaks
  const Frame<Dim> frame(extent);
  const double voxel_mm = frame.spacing;
  const std::vector<Vector<Dim>> centers = cell_centers(extent, seeds);
  const Points<Dim> rays = directions_in<Dim>(extent, kRays);
  const auto near = [&](double radius) {  // the median within so many cells of the seeds
    std::vector<double> out;
    for (const Vector<Dim>& center : centers) {
      Samples<Dim> samples;
      I.sample(lattice_shell<Dim>(frame, center, -1, radius), Derivatives::kFirst, samples);
      for (Eigen::Index i = 0; i < samples.gradient.rows(); ++i)
        out.push_back(samples.gradient.row(i).norm());
    }
    return median(std::move(out));
  };
  // Of small objects the wider ball reaches their edges. Without noise the background is 0, and
  // every ripple would count as a peak.
  const double measured = std::min(near(1.5), near(3));
  const double background = std::max(measured, 2e-3 * extent.width() / voxel_mm);
  std::vector<double> peaks(centers.size() * std::size_t(rays.rows()));
  tbb::parallel_for(std::size_t(0), peaks.size(), [&](std::size_t n) {
    const auto ray = Eigen::Index(n) % rays.rows();
    peaks[n] = first_peak<Dim>(I, centers[n / std::size_t(rays.rows())], rays.row(ray).transpose(),
                               voxel_mm / 2, background, extent);
  });
  std::vector<double> pronounced;
  std::copy_if(peaks.begin(), peaks.end(), std::back_inserter(pronounced),
               [&](double peak) { return peak > 5 * background; });
  // The others may end at the border of the image, before there is an edge.
  if (kLeastPronounced * double(peaks.size()) <= double(pronounced.size()))
    return std::max(0.25 * median(std::move(pronounced)), 3 * measured);
  return std::max({0.25 * median(std::move(peaks)), 3 * background, 1e-30});
}

template <int Dim>
Points<Dim> directions_in(const ImageExtent<Dim>& extent, int n) {
  return directions<Dim>(n) * Frame<Dim>(extent).axes.transpose();
}

#define SURF_INSTANTIATE(Dim)                                                                  \
  template SeedModel estimate_seed_model<Dim>(const Field<Dim>&, std::span<const Vector<Dim>>, \
                                              const ImageExtent<Dim>&);                        \
  template SeedModel estimate_seed_model<Dim>(const SearchGrid<Dim>&, const Vector<Dim>&);     \
  template std::vector<std::array<int, Dim>> nearest_nodes<Dim>(const Vector<Dim>&,            \
                                                                const std::array<int, Dim>&);  \
  template std::vector<Vector<Dim>> cell_centers<Dim>(const ImageExtent<Dim>&,                 \
                                                      std::span<const Vector<Dim>>);           \
  template Points<Dim> directions_in<Dim>(const ImageExtent<Dim>&, int);                       \
  template double estimate_edge_strength<Dim>(const Field<Dim>&, std::span<const Vector<Dim>>, \
                                              const ImageExtent<Dim>&);
SURF_INSTANTIATE(2)
SURF_INSTANTIATE(3)
#undef SURF_INSTANTIATE

}  // namespace surf::segment
