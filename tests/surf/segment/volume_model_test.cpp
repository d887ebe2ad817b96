#include "libsurf/segment/detail/volume_model.h"

#include <gtest/gtest.h>

#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/energy_assembly.h"
#include "libsurf/segment/seed_model.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

ImageModel some_model() {
  volume::PhantomOptions options;
  options.size = {48, 48, 48};
  const volume::Volume volume = volume::make_phantom(options);
  return {volume, extent_of(volume), {}, volume::DerivativeFilter::kBSpline};
}

double value(ImageModel& model, const std::vector<EnergyTerm>& terms) {
  const auto energy = make_energy<3>(terms, {model});
  const Triangles ball = mesh::ball(Eigen::Vector3d::Zero(), 0.4, 0.1);
  energy->reset({ball.points, ball.elements});
  return energy->value();
}

TEST(ImageModel, MakesTheEnergiesThatAreNamed) {
  ImageModel model = some_model();
  const Triangles ball = mesh::ball(Eigen::Vector3d::Zero(), 0.4, 0.1);
  const fem::Geometry<3> shape(ball.points, ball.elements);
  EXPECT_NEAR(value(model, {{"area", 2, {}}}), 2 * shape.measure(), 1e-12);
  // Inside the object the image is constant: H = 1, and the window is -1.
  EXPECT_NEAR(value(model, {{"minimal-surface", 3, {{"gamma0", 2}, {"gamma", -5}, {"lambda", 1}}}}),
              3 * (2 * shape.measure() - 5 * shape.enclosed()), 1e-6);
  EXPECT_NEAR(value(model, {{"window", 1, {{"mean", 1}, {"half-width", 0.1}}}}), -shape.enclosed(),
              1e-6);
  EXPECT_GT(value(model, {{"chan-vese", 1, {}}}), 0);
}

TEST(ImageModel, MakesTheEnergiesOfNormalsCurvaturesAndStatistics) {
  ImageModel model = some_model();
  const Triangles ball = mesh::ball(Eigen::Vector3d::Zero(), 0.4, 0.1);
  const fem::Geometry<3> shape(ball.points, ball.elements);
  EXPECT_NEAR(value(model, {{"volume", 2, {}}}), 2 * shape.enclosed(), 1e-12);
  EXPECT_NEAR(value(model, {{"anisotropic", 1, {{"x", 2}, {"y", 2}, {"z", 2}}}}),
              2 * shape.measure(), 1e-12);
  EXPECT_NEAR(value(model, {{"anisotropic", 1, {{"x", 1}, {"y", 1}, {"z", 1}, {"lambda", 1}}}}),
              shape.measure(), 1e-6);
  // (kappa - 5)^2 = 0 on a ball of radius 0.4, and 8 pi without a spontaneous curvature.
  constexpr double kTolerance = 0.05;  // of a mesh whose edges are a quarter of the radius
  const double sphere = 8 * std::numbers::pi;
  EXPECT_NEAR(value(model, {{"willmore", 1, {{"curvature", 0}}}}), sphere, kTolerance * sphere);
  EXPECT_NEAR(value(model, {{"willmore", 1, {{"curvature", 5}}}}), 0, kTolerance * sphere);
  EXPECT_NEAR(value(model, {{"prescribed-curvature", 1, {{"curvature", 0}, {"lambda", 1}}}}),
              sphere, kTolerance * sphere);
  // Inside the object the image is constant.
  EXPECT_NEAR(value(model, {{"alignment", 1, {{"sign", 1}, {"scale", 1}}}}), 0, 1e-6);
  EXPECT_NEAR(value(model, {{"average-edge", 3, {{"lambda", 1}}}}), 3, 1e-6);
  EXPECT_NEAR(value(model, {{"average-alignment", 1, {{"sign", 0}, {"scale", 1}}}}), -0.1, 1e-6);
  EXPECT_LT(value(model, {{"region-competition", 1, {}}}), 0);
}

TEST(ImageModel, MeasuresEdgesByWhereNearlyAllValuesLie) {
  volume::PhantomOptions options;
  options.size = {48, 48, 48};
  const volume::Volume plain = volume::make_phantom(options);
  std::vector<float> values(plain.n_voxels());
  plain.copy_box({0, 0, 0}, plain.size(), values.data());
  values.front() += 100;  // of a contrast of 1, in a corner
  const volume::Volume with_metal(plain.size(), plain.index_to_world(), values);
  const auto strength = [](const volume::Volume& volume) {
    const ImageModel model(volume, extent_of(volume), {}, volume::DerivativeFilter::kBSpline);
    const std::vector<Vector<3>> seeds = {{0, 0, 0}};
    return estimate_edge_strength<3>(*model.intensity(), seeds, model.extent());
  };
  EXPECT_NEAR(strength(with_metal), strength(plain), 0.05 * strength(plain));
}

TEST(ImageModel, SharesTheEdgeIndicatorOfEachLambda) {
  ImageModel model = some_model();
  EXPECT_EQ(model.edge_indicator(1), model.edge_indicator(1));
  EXPECT_NE(model.edge_indicator(1), model.edge_indicator(2));
}

}  // namespace
}  // namespace surf::segment
