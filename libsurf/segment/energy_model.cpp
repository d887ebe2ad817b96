#include "libsurf/segment/energy_model.h"

namespace surf::segment {

template <int Dim>
std::shared_ptr<const Field<Dim>> EnergyModel<Dim>::edge_indicator(double lambda) {
  auto& field = edge_indicators_[lambda];
  if (!field) field = make_edge_indicator(lambda);
  return field;
}

template <int Dim>
double EnergyModel<Dim>::contrast(const SeedModel&) const {
  const double width = double(extent_.range[1]) - extent_.range[0];
  return width > 0 ? width : 1;
}

template <int Dim>
const energy::ImageTotals& EnergyModel<Dim>::totals() {
  if (!totals_) totals_ = sum_up();
  return *totals_;
}

template <int Dim>
const energy::ImageTotals& EnergyModel<Dim>::smoothed_totals() {
  if (!smoothed_totals_) smoothed_totals_ = sum_up_smoothed();
  return *smoothed_totals_;
}

/// One pass over the cells.
template <int Dim>
energy::ImageTotals EnergyModel<Dim>::sum_up_smoothed() const {
  const int n = extent_.size[0];
  long n_rows = 1;
  for (int axis = 1; axis < Dim; ++axis) n_rows *= extent_.size[axis];
  const double cell = std::pow(extent_.cell_mm(), Dim);
  energy::ImageTotals totals;
  Points<Dim> points(n, Dim);
  Samples<Dim> samples;
  for (long row = 0; row < n_rows; ++row) {
    Vector<Dim> index = Vector<Dim>::Zero();
    long rest = row;
    for (int axis = 1; axis < Dim; ++axis, rest /= extent_.size[axis - 1])
      index[axis] = double(rest % extent_.size[axis]);
    for (int i = 0; i < n; ++i) {
      index[0] = i;
      points.row(i) = extent_.index_to_world * index;
    }
    intensity()->sample(points, Derivatives::kNone, samples);
    totals.content += cell * n;
    totals.intensity += cell * samples.value.sum();
    totals.intensity_squared += cell * samples.value.squaredNorm();
  }
  return totals;
}

template class EnergyModel<2>;
template class EnergyModel<3>;

}  // namespace surf::segment
