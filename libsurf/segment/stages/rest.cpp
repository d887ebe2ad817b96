#include "libsurf/segment/stages/rest.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <limits>

#include "libsurf/fem/geometry.h"

namespace surf::segment {
namespace {

// Of a fitted energy, whose region term is of order 1, per cell and area: vertices move by less
// than about a ninth of a cell. Edges are located after it: with 1e-3 the inside of a skull takes
// eight steps, not six, and neither phantoms nor scans are nearer (docs/performance.md).
constexpr double kLeastGain = 3e-3;
// Over four steps phantoms come to the same errors (0.0273 voxel in the mean of twelve, 0.0269 over
// two), and most of a trunk (160,000 triangles) takes nine steps, not six.
constexpr std::size_t kGainSteps = 2;
// Over three windows by that over one: 3 on the way, more where it slows down, 1 to 1.3 where
// steps and mending undo each other.
constexpr double kNowhere = 1.4;
constexpr double kNear = 0.15;  // cells, in the mean over a window: further is a way
constexpr std::size_t kWindows = 3;
constexpr double kStill = 0.01;  // cells, in the mean over a window

/// How far the vertices of a shape are from another one, in the mean over the shape, or over what
/// of it lies in a region [mm].
template <int Dim>
double mean_distance(const Setting<Dim>& setting, const Simplices<Dim>& shape,
                     const Simplices<Dim>& other, const mesh::Neighbourhood<Dim>* region) {
  const auto distance = setting.distance_to(other);
  Eigen::VectorXd mass = fem::Geometry<Dim>(shape.points, shape.elements).lumped_mass();
  for (Eigen::Index i = 0; region && i < mass.size(); ++i)
    if (!region->contains(shape.points.row(i).transpose())) mass[i] = 0;
  Eigen::VectorXd distances = Eigen::VectorXd::Zero(mass.size());
  tbb::parallel_for(Eigen::Index(0), distances.size(), [&](Eigen::Index i) {
    if (mass[i] > 0) distances[i] = distance(shape.points.row(i).transpose());
  });
  return mass.dot(distances) / std::max(mass.sum(), std::numeric_limits<double>::min());
}

}  // namespace

template <int Dim>
RestRule<Dim>::RestRule(const Setting<Dim>& setting, double measure, int window,
                        const mesh::Neighbourhood<Dim>* region)
    : setting_(setting),
      least_gain_(kLeastGain * setting.extent().cell_mm() * measure),
      window_(window),
      region_(region) {}

template <int Dim>
std::string RestRule<Dim>::check(int n_steps, double energy,
                                 const std::function<Simplices<Dim>()>& shape_now) {
  energies_.push_back(energy);
  if (energies_.size() > kGainSteps + 1) energies_.pop_front();
  if (energies_.size() == kGainSteps + 1 && energies_.front() - energy < least_gain_)
    return "the energy hardly falls any more";
  return n_steps % window_ == 0 ? goes_nowhere(shape_now()) : "";
}

template <int Dim>
std::string RestRule<Dim>::goes_nowhere(const Simplices<Dim>& now) {
  std::string out;
  if (now.elements.rows() > 0 && !shapes_.empty()) {
    const double cell = setting_.extent().cell_mm(),
                 last = mean_distance(setting_, now, shapes_.back(), region_);
    if (last < kStill * cell)
      out = fmt::format("it moved by {:.2g} mm in the mean in {} steps", last, window_);
    else if (last < kNear * cell && shapes_.size() == kWindows) {
      const double all = mean_distance(setting_, now, shapes_.front(), region_);
      if (all < kNowhere * last)
        out = fmt::format(
            "it goes nowhere: moved by {:.2g} mm in the mean in {} steps, by {:.2g} mm in {}", last,
            window_, all, kWindows * std::size_t(window_));
    }
  }
  shapes_.push_back(now);
  if (shapes_.size() > kWindows) shapes_.pop_front();
  return out;
}

template class RestRule<2>;
template class RestRule<3>;

}  // namespace surf::segment
