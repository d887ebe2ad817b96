#include "libsurf/segment/stages/rest.h"

#include <gtest/gtest.h>

#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace surf::segment {
namespace {

constexpr int kWindow = 8;

std::shared_ptr<const Setting<3>> setting() {
  volume::PhantomOptions options;
  options.size = {16, 16, 16};
  return make_setting(volume::make_phantom(options));
}

Triangles ball_of_cells(const Setting<3>& setting, double radius) {
  const double cell = setting.extent().cell_mm();
  return mesh::ball(Vector<3>::Zero(), radius * cell, cell);
}

/// What the rule says in the end of windows whose last shapes have these radii [cells], while each
/// step gains `gain`.
std::string said_of(const std::vector<double>& radii, double gain) {
  const auto in = setting();
  RestRule<3> rest(*in, ball_of_cells(*in, 4).points.rows(), kWindow);
  std::string out;
  double energy = 0;
  int step = 0;
  for (const double radius : radii)
    for (int i = 0; i < kWindow && out.empty(); ++i)
      out = rest.check(++step, energy -= gain, [&] { return ball_of_cells(*in, radius); });
  return out;
}

TEST(RestRule, LetsAShapeRestThatGainsNothing) {
  EXPECT_NE(said_of({4, 4.5}, 0).find("hardly falls"), std::string::npos);
}

TEST(RestRule, LetsAShapeRestThatGoesToAndFro) {
  EXPECT_EQ(said_of({4, 4.05, 4, 4.05}, 1e6).find("it goes nowhere"), 0u);
}

TEST(RestRule, LetsAShapeGoOnThatCreeps) {
  EXPECT_EQ(said_of({4, 4.05, 4.1, 4.15, 4.2, 4.25}, 1e6), "");
}

TEST(RestRule, LetsAShapeGoOnThatGoesFarToAndFro) {
  EXPECT_EQ(said_of({4, 4.5, 4, 4.5, 4}, 1e6), "");
}

}  // namespace
}  // namespace surf::segment
