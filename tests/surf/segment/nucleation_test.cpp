#include "libsurf/segment/detail/nucleation.h"

#include <gtest/gtest.h>

#include <numbers>

#include "libsurf/mesh/hierarchy.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/detail/surface_setting.h"
#include "libsurf/segment/detail/volume_model.h"
#include "libsurf/segment/energy_assembly.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

constexpr int kSize = 48;

volume::Volume shell() {
  volume::PhantomOptions options;
  options.kind = volume::PhantomKind::kShell;
  options.size = {kSize, kSize, kSize};
  return volume::make_phantom(options);
}

struct Scene {
  volume::Volume image = shell();
  ImageModel model{image, extent_of(image), {.sigma_mm = 0.03}, volume::DerivativeFilter::kBSpline};
  SurfaceSetting setting{image};
  Triangles surface = mesh::ball({0, 0, 0}, 0.6, 0.08);

  std::unique_ptr<energy::EnergySum<3>> energy(const std::vector<EnergyTerm>& terms) {
    auto out = make_energy<3>(terms, {model});
    out->reset({surface.points, surface.elements});
    return out;
  }
};

TEST(Nucleation, DensityIsWhatASmallHoleChanges) {
  Scene s;
  const EnergyTerm window{"window", 2, {{"mean", 1}, {"half-width", 0.5}}};
  for (const auto& term : {EnergyTerm{"chan-vese", 1, {}}, window}) {
    const auto energy = s.energy({term});
    const double J = energy->value();
    for (const Vector<3>& at : {Vector<3>(0.02, 0, 0.01), Vector<3>(0, 0.45, 0)}) {
      Eigen::VectorXd density = Eigen::VectorXd::Zero(1);
      energy->add_density(Points<3>(at.transpose()), 1, density);
      const double radius = 0.08;
      const double volume = 4 * std::numbers::pi / 3 * std::pow(radius, 3);
      const Triangles with = mesh::joined({s.surface, mesh::flipped(mesh::ball(at, radius, 0.02))});
      const auto other = make_energy<3>(std::vector{term}, {s.model});
      other->reset({with.points, with.elements});
      // The ball is sampled by a few rays, and chan-vese's means move by its share of the volume.
      EXPECT_NEAR(other->value() - J, -density[0] * volume, 0.15 * std::abs(density[0]) * volume)
          << term.name << " at " << at.transpose();
      energy->reset({s.surface.points, s.surface.elements});
    }
  }
}

TEST(Nucleation, FindsTheCavityOfAShellAndNothingElse) {
  Scene s;
  const auto energy = s.energy({{"chan-vese", 1, {}}});
  const auto holes = find_holes<3>(s.setting, s.surface, *energy);
  ASSERT_EQ(holes.size(), 1u);
  EXPECT_LT(holes[0].center.norm(), 0.1);
  EXPECT_LT(holes[0].center.norm() + holes[0].radius_mm, 0.3);
  EXPECT_GT(holes[0].radius_mm, 0.1);
  EXPECT_EQ(open_holes<3>(s.setting, s.surface, holes, 0.08, *energy), 1);
  EXPECT_EQ(mesh::shell_hierarchy(s.surface).shells.size(), 2u);
}

TEST(Nucleation, OpensNothingWhereTheBoundaryCostsMore) {
  Scene s;
  const auto energy = s.energy({{"chan-vese", 1, {}}, {"area", 100, {}}});
  const auto holes = find_holes<3>(s.setting, s.surface, *energy);
  EXPECT_EQ(holes.size(), 1u);
  EXPECT_EQ(open_holes<3>(s.setting, s.surface, holes, 0.08, *energy), 0);
}

TEST(Nucleation, IsWhatARunFromOutsideNeedsForACavity) {
  SegmentOptions run;
  run.initial = mesh::ball({0, 0, 0}, 0.9, 0.1);
  run.energies = {{"chan-vese", 1, {}}};
  for (const bool is_on : {false, true}) {
    run.open_cavities = is_on;
    const SegmentResult result = segment(shell(), run);
    const auto solids = mesh::solids(mesh::shell_hierarchy(result.shape));
    ASSERT_EQ(solids.size(), 1u);
    EXPECT_EQ(solids[0].cavities.size(), is_on ? 1u : 0u);
  }
}

// Each evolution after a cavity was opened would else keep what that has left.
TEST(Nucleation, LeavesTheVolumeThatIsKept) {
  for (const bool is_by_product : {false, true}) {
    SegmentOptions run;
    run.initial = mesh::ball({0, 0, 0}, 0.6, 0.1);
    run.energies = {{"chan-vese", 1, {}}, {"area", 0.02, {}}};
    if (is_by_product)
      run.flow.velocity.product = flow::ScalarProduct::kHMinus1;
    else
      run.flow.keep_content = true;
    const double kept = mesh::volume_mm3(segment(shell(), run).shape);
    run.open_cavities = true;
    const SegmentResult result = segment(shell(), run);
    ASSERT_EQ(mesh::solids(mesh::shell_hierarchy(result.shape)).at(0).cavities.size(), 1u);
    EXPECT_NEAR(mesh::volume_mm3(result.shape), kept, 1e-6 * kept) << is_by_product;
  }
}

// A stroke that ends in the cavity, whose middle is far from it.
TEST(Nucleation, OpensNoCavityAcrossAStroke) {
  Segmentation<3> s(make_setting(shell()));
  const int object = s.add_object();
  SegmentOptions options;
  options.initial = mesh::ball({0, 0, 0}, 0.9, 0.1);
  options.energies = {{"chan-vese", 1, {}}};
  options.open_cavities = true;
  s.set_options(object, options);
  Click<3> stroke{{0.55, 0, 0}, Side::kInside};
  for (double x = 0; x < 0.6; x += 0.05) stroke.stroke_mm.push_back({x, 0, 0});
  s.add_click(object, stroke);
  const Result<3>& result = s.evolve(object);
  const auto solids = mesh::solids(mesh::shell_hierarchy(result.shape));
  ASSERT_EQ(solids.size(), 1u);
  EXPECT_TRUE(solids[0].cavities.empty());
}

}  // namespace
}  // namespace surf::segment
