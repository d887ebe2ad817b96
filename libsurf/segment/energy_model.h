// The fields of one image or volume, from which energies are made.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <optional>

#include "libsurf/base/image_box.h"
#include "libsurf/energy/chan_vese.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::segment {

struct SeedModel;

/// Where an image (Dim = 2) or volume (Dim = 3) lies, and which values it has.
template <int Dim>
struct ImageExtent : ImageBox<Dim> {
  std::array<float, 2> range;  ///< lowest and highest one
  double rounded_to = 0;       ///< see rounding_step()
  /// Where nearly all values lie, see usual_range().
  std::array<float, 2> usual = range;
  /// With the axes of its file, by which people know its cells, and the padding that it may have
  /// there (base/padding.h): a Setting's is so.
  ImageBox<Dim> in_file = *this;

  /// Of the usual values.
  double width() const { return double(usual[1]) - usual[0]; }
  /// Side of the square or cube of a pixel's or voxel's content [mm].
  double cell_mm() const {
    return std::pow(std::abs(this->index_to_world.linear().determinant()), 1.0 / Dim);
  }
  /// Of its sides along the axes of the world [mm].
  double diagonal_mm() const {
    Vector<Dim> cells;
    for (int axis = 0; axis < Dim; ++axis) cells[axis] = this->size[axis];
    return (this->index_to_world.linear().cwiseAbs() * cells).norm();
  }
};

/// The parameters of (5.4).
struct PiecewiseSmooth {
  double mu = 1;        ///< [mm^2]
  double gamma = 0;     ///< [mm]
  double contrast = 1;  ///< [intensity]
  std::optional<double> data_tolerance = {};
};

/// The fields of one image with one blur, and what has been computed from them: shared by all
/// energies. Not thread-safe; the fields are.
template <int Dim>
class EnergyModel {
 public:
  explicit EnergyModel(const ImageExtent<Dim>& extent) : extent_(extent) {}
  virtual ~EnergyModel() = default;

  const ImageExtent<Dim>& extent() const { return extent_; }
  virtual std::shared_ptr<const Field<Dim>> intensity() const = 0;
  /// 1 / (1 + |grad I|^2 / lambda^2); the same one for the same lambda.
  std::shared_ptr<const Field<Dim>> edge_indicator(double lambda);
  /// Of the intensity, where it is cheap to have.
  virtual std::optional<energy::Antiderivative<Dim>> antiderivative() const { return {}; }

  /// Sums over the whole image as it is; those of the smoothed one lack the variance that the
  /// smoothing takes off.
  const energy::ImageTotals& totals();
  const energy::ImageTotals& smoothed_totals();
  /// The distance of object and background in intensity, > 0: what (I - u)^2 is divided by the
  /// square of. The whole range unless a model knows better.
  /// @param seed  what the image says round the seeds; all 0 without one
  virtual double contrast(const SeedModel& seed) const;
  /// Of all fields made so far.
  virtual std::size_t memory_bytes() const = 0;

  /// (5.4), its length or area term included.
  virtual std::unique_ptr<energy::ShapeEnergy<Dim>> mumford_shah(
      const PiecewiseSmooth& parameters) const = 0;

 protected:
  virtual std::shared_ptr<const Field<Dim>> make_edge_indicator(double lambda) const = 0;
  virtual energy::ImageTotals sum_up() const = 0;

 private:
  energy::ImageTotals sum_up_smoothed() const;

  ImageExtent<Dim> extent_;
  std::map<double, std::shared_ptr<const Field<Dim>>> edge_indicators_;
  std::optional<energy::ImageTotals> totals_, smoothed_totals_;
};

}  // namespace surf::segment
