// Energies by name for one image or volume.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "libsurf/base/image_box.h"
#include "libsurf/energy/anisotropic_density.h"
#include "libsurf/energy/chan_vese.h"
#include "libsurf/energy/energy_sum.h"
#include "libsurf/segment/energy_term.h"

namespace surf::segment {

/// Where an image (Dim = 2) or volume (Dim = 3) lies, and between which values.
template <int Dim>
struct ImageExtent : ImageBox<Dim> {
  std::array<float, 2> range;

  /// Side of the square or cube of a pixel's or voxel's content [mm].
  double cell_mm() const {
    return std::pow(std::abs(this->index_to_world.linear().determinant()), 1.0 / Dim);
  }
};

/// The fields of one image and the energies made from them. Fields are shared by all energies.
template <int Dim>
class EnergyModel {
 public:
  explicit EnergyModel(const ImageExtent<Dim>& extent) : extent_(extent) {}
  virtual ~EnergyModel() = default;

  const ImageExtent<Dim>& extent() const { return extent_; }
  virtual std::shared_ptr<const Field<Dim>> intensity() const = 0;
  std::shared_ptr<const Field<Dim>> edge_indicator(double lambda);

  /// The fields that are integrated over the shape, or whose integral over the domain it bounds,
  /// dimensionless and of order 1: what its resolution has to follow. Those of chan-vese and
  /// region-competition, whose statistics change with every step, are not among them. Not
  /// thread-safe.
  std::vector<std::shared_ptr<const Field<Dim>>> integrands(std::span<const EnergyTerm> terms);
  /// @param terms  every parameter filled in
  std::unique_ptr<energy::EnergySum<Dim>> energy(std::span<const EnergyTerm> terms);
  /// The distance of object and background in intensity, > 0: what (I - u)^2 is divided by the
  /// square of. The whole range unless a model knows better.
  virtual double contrast() const;

 protected:
  virtual std::shared_ptr<const Field<Dim>> make_edge_indicator(double lambda) const = 0;
  /// Sums over the whole image.
  virtual energy::ImageTotals totals() const = 0;
  /// (5.4), its length or area term included.
  /// @param term  every parameter filled in
  /// @throws UsageError  there is none for this kind of image
  virtual std::unique_ptr<energy::ShapeEnergy<Dim>> make_mumford_shah(const EnergyTerm& term) const;
  /// Of the intensity, where it is cheap to have.
  virtual std::optional<energy::Antiderivative<Dim>> antiderivative() const { return {}; }

 private:
  energy::DomainIntegralOptions domain_options() const;
  /// Sums over the whole of the smoothed image.
  energy::ImageTotals field_totals() const;
  std::unique_ptr<energy::ShapeEnergy<Dim>> make_energy(const EnergyTerm& term);
  std::unique_ptr<energy::ShapeEnergy<Dim>> chan_vese() const;
  energy::DensityPointer<Dim> norm(const EnergyTerm& term);
  energy::DensityPointer<Dim> alignment(const EnergyTerm& term) const;
  std::shared_ptr<const Field<Dim>> window(const EnergyTerm& term) const;

  ImageExtent<Dim> extent_;
  std::map<double, std::shared_ptr<const Field<Dim>>> edge_indicators_;
};

}  // namespace surf::segment
