// What energies have in common whose value is computed anew from the boundary.
#pragma once

#include <memory>

#include "libsurf/energy/shape_energy.h"

namespace surf::energy {

/// A shape energy J(Gamma) that costs no more than the boundary: every call evaluates it. Integrals
/// over Gamma count what does not lie on a border (fem::Geometry::charged_measures).
template <int Dim>
class BoundaryEnergy : public ShapeEnergy<Dim> {
 public:
  void reset(const fem::Geometry<Dim>& shape) override {
    shape_ = std::make_unique<fem::Geometry<Dim>>(shape);
    value_ = evaluate(shape);
  }
  double value() const override { return value_; }
  double try_move(const fem::Geometry<Dim>& moved) override {
    tried_ = std::make_unique<fem::Geometry<Dim>>(moved);
    return tried_value_ = evaluate(moved);
  }
  void accept() override {
    shape_ = std::move(tried_);
    value_ = tried_value_;
  }
  void remesh(const fem::Geometry<Dim>& shape) override { reset(shape); }

 protected:
  virtual double evaluate(const fem::Geometry<Dim>& shape) const = 0;
  const fem::Geometry<Dim>& shape() const { return *shape_; }

 private:
  std::unique_ptr<fem::Geometry<Dim>> shape_, tried_;
  double value_ = 0, tried_value_ = 0;
};

}  // namespace surf::energy
