// Several regions of one image: none overlaps another.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "libcurve/mesh/difference.h"
#include "libcurve/mesh/verify.h"
#include "libcurve/segment/segment.h"
#include "libsurf/segment/finish_objects.h"
#include "libsurf/segment/recipe.h"

namespace surf::curve {
namespace {

using segment::Click;
using segment::Side;

constexpr int kSize = 96;

/// Two discs of unlike brightness that touch, the first before the second, and one apart.
int disc_at(const Vector<2>& x) {
  if ((x - Vector<2>(30, 40)).norm() <= 20) return 1;
  if ((x - Vector<2>(62, 44)).norm() <= 16) return 2;
  if ((x - Vector<2>(60, 78)).norm() <= 12) return 3;
  return 0;
}

Image discs() {
  std::mt19937 random(3);
  std::normal_distribution<double> noise(0, 2);
  constexpr double kValue[] = {0, 100, 170, 60};
  std::vector<float> values;
  for (int j = 0; j < kSize; ++j)
    for (int i = 0; i < kSize; ++i) {
      double sum = 0;
      for (int s = 0; s < 25; ++s)
        sum += kValue[disc_at(Vector<2>(i + (s % 5 - 2) / 5.0, j + (s / 5 - 2) / 5.0))];
      values.push_back(float(sum / 25 + noise(random)));
    }
  return Image({kSize, kSize}, pixel_to_plane({1, 1}), values);
}

TEST(CurveObjects, NeverOverlapAndShareOneMapOfLabels) {
  segment::Segmentation<2> s(make_setting(discs()));
  const std::vector<Vector<2>> seeds = {{26, 40}, {66, 44}, {60, 78}};
  for (const auto& seed : seeds) s.add_click(s.add_object(), {seed, Side::kInside});
  std::vector<const segment::Result<2>*> results;
  for (const int id : s.objects()) results.push_back(&s.evolve(id));
  const auto finished = segment::finish_objects<2>(s.setting(), results, ".json");
  for (std::size_t n = 0; n < finished.size(); ++n) {
    ASSERT_TRUE(finished[n].finished) << n;
    EXPECT_TRUE(verify(finished[n].finished->shape).passed());
    for (std::size_t m = 0; m < n; ++m)
      EXPECT_FALSE(do_overlap(finished[n].finished->shape, finished[m].finished->shape));
  }
  ASSERT_FALSE(finished[1].walls.empty());
  EXPECT_LE(finished[1].walls.front().greatest_gap, segment::kMostGapOfWalls);
  const auto labels = segment::label_map<2>(s.setting(), s.setting().extent(), finished);
  double n_wrong = 0;
  for (std::size_t at = 0; at < labels.size(); ++at)
    n_wrong += labels[at] != disc_at({double(at % kSize), double(at / kSize)});
  EXPECT_LT(n_wrong, 0.02 * kSize * kSize);

  segment::Segmentation<2> again(make_setting(discs()));
  segment::replay<2>(segment::to_recipe<2>(s), again);
  for (const int id : s.objects())
    EXPECT_EQ(again.object(id).result->shape.points, s.object(id).result->shape.points);
}

}  // namespace
}  // namespace surf::curve
