// Several objects of one segmentation: what they know of each other, and that they never overlap.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <random>

#include "libsurf/base/error.h"
#include "libsurf/mesh/difference.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/finish_objects.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "tests/surf/message_of.h"
#include "tests/surf/segment/phantoms.h"

namespace surf::segment {
namespace {

constexpr int kSize = 52;

struct Organ {
  const char* name;
  Vector<3> center;  ///< [voxels = mm]
  Vector<3> axes;
  double value;
};

/// Where two of them meet, the place is the earlier one's: liver and kidney, kidney and bowel have
/// walls in common; a gap of about one voxel parts the spleen from the kidney; the duct is apart.
const std::vector<Organ>& organs() {
  static const std::vector<Organ> all = {{"liver", {16, 22, 25}, {12, 13, 12}, 100},
                                         {"kidney", {34, 24, 25}, {8, 9, 11}, 160},
                                         {"spleen", {33, 41, 25}, {7, 7, 8}, 130},
                                         {"bowel", {36, 11, 25}, {7, 8, 8}, 70},
                                         {"duct", {14, 43, 25}, {4, 4, 12}, 190}};
  return all;
}

bool is_in(const Organ& organ, const Vector<3>& x) {
  return (x - organ.center).cwiseQuotient(organ.axes).norm() <= 1;
}

/// 1, 2, ...; 0 outside all.
int organ_at(const Vector<3>& x) {
  for (std::size_t n = 0; n < organs().size(); ++n)
    if (is_in(organs()[n], x)) return int(n + 1);
  return 0;
}

/// Means over 3^3 points of each voxel, and noise.
volume::Volume abdomen() {
  std::mt19937 random(5);
  std::normal_distribution<double> noise(0, 4);
  std::vector<float> values;
  for (int k = 0; k < kSize; ++k)
    for (int j = 0; j < kSize; ++j)
      for (int i = 0; i < kSize; ++i) {
        double sum = 0;
        for (int s = 0; s < 27; ++s) {
          const Vector<3> x =
              Vector<3>(i, j, k) + Vector<3>(s % 3 - 1, s / 3 % 3 - 1, s / 9 - 1) / 3;
          const int organ = organ_at(x);
          sum += organ == 0 ? 0 : organs()[std::size_t(organ - 1)].value;
        }
        values.push_back(float(sum / 27 + noise(random)));
      }
  return {{kSize, kSize, kSize}, Eigen::Affine3d::Identity(), values};
}

Click<3> inside(const Vector<3>& x) { return {x, Side::kInside}; }
Click<3> inside(double x, double y = 0, double z = 0) { return {{x, y, z}, Side::kInside}; }

struct FinishedAbdomen {
  Segmentation<3> segmentation{make_setting(abdomen())};
  std::vector<FinishedObject<3>> finished;

  FinishedAbdomen() {
    std::vector<int> ids;
    for (const Organ& organ : organs()) {
      ids.push_back(segmentation.add_object(organ.name));
      segmentation.add_click(ids.back(), inside(organ.center));
    }
    std::vector<const Result<3>*> results;
    for (const int id : ids) results.push_back(&segmentation.evolve(id));
    finished = finish_objects<3>(segmentation.setting(), results, ".stl");
  }
};

const FinishedAbdomen& finished_abdomen() {
  static const FinishedAbdomen made;
  return made;
}

TEST(Objects, OfOneSegmentationNeverOverlap) {
  const auto& finished = finished_abdomen().finished;
  for (std::size_t n = 0; n < finished.size(); ++n) {
    ASSERT_TRUE(finished[n].finished) << organs()[n].name;
    EXPECT_TRUE(mesh::verify(finished[n].finished->shape).passed()) << organs()[n].name;
    for (std::size_t m = 0; m < n; ++m)
      EXPECT_FALSE(mesh::do_overlap(finished[n].finished->shape, finished[m].finished->shape))
          << organs()[n].name << " " << organs()[m].name;
  }
}

TEST(Objects, HaveWallsInCommonWhereTheyTouch) {
  const auto& finished = finished_abdomen().finished;
  const double cell = 1;
  ASSERT_FALSE(finished[1].walls.empty());
  const Wall& wall = finished[1].walls.front();
  EXPECT_EQ(wall.other, 0u);
  EXPECT_GT(wall.removed, 0);
  EXPECT_GT(wall.measure, 5);
  EXPECT_GT(wall.greatest_gap, 0);
  EXPECT_LE(wall.greatest_gap, kMostGapOfWalls * cell);
  EXPECT_TRUE(finished[0].walls.empty());
}

// The certainty of the whole surface was told of the part that is left.
TEST(Objects, WithNewVerticesHaveNoCertainty) {
  const FinishedAbdomen& made = finished_abdomen();
  const auto ids = made.segmentation.objects();
  for (std::size_t n = 0; n < ids.size(); ++n) {
    const Result<3>& result = *made.segmentation.object(ids[n]).result;
    ASSERT_TRUE(result.certainty) << organs()[n].name;
    const auto summary =
        nlohmann::json::parse(summary_json<3>(result, &*made.finished[n].finished));
    EXPECT_EQ(summary.contains("certainty"), made.finished[n].walls.empty()) << organs()[n].name;
    EXPECT_TRUE(summary.contains("volume_mm3"));
    const auto failed =
        nlohmann::json::parse(summary_json<3>(result, made.finished[n].finished->measures));
    EXPECT_TRUE(failed.contains("volume_mm3") && !failed.contains("certainty"));
  }
}

// The spleen ends a voxel before the kidney, and so do their surfaces: not a bit has changed.
TEST(Objects, KeepTheirNaturalGaps) {
  const FinishedAbdomen& made = finished_abdomen();
  const auto& spleen = made.finished[2];
  EXPECT_TRUE(spleen.walls.empty());
  EXPECT_EQ(spleen.whole.elements.rows(), 0);
  const auto ids = made.segmentation.objects();
  const auto alone =
      finish<3>(made.segmentation.setting(), *made.segmentation.object(ids[2]).result, ".stl");
  EXPECT_EQ(spleen.finished->shape.points, alone.shape.points);
  const mesh::DistanceToSurface to_kidney(made.finished[1].finished->shape);
  double gap = 1e9;
  for (const auto& x : spleen.finished->shape.points.rowwise())
    gap = std::min(gap, to_kidney(x.transpose()));
  EXPECT_GT(gap, 0.4);
}

TEST(Objects, HaveNoMoreLabelsThanAByte) {
  const FinishedAbdomen& made = finished_abdomen();
  const auto labels_of = [&](std::size_t n) {
    return label_map<3>(made.segmentation.setting(), made.segmentation.setting().extent(),
                        std::vector<FinishedObject<3>>(n));
  };
  EXPECT_NO_THROW(labels_of(255));
  EXPECT_THROW(labels_of(256), UsageError);
}

TEST(Objects, ShareOneMapOfLabels) {
  const FinishedAbdomen& made = finished_abdomen();
  const auto labels = label_map<3>(made.segmentation.setting(),
                                   made.segmentation.setting().extent(), made.finished);
  ASSERT_EQ(labels.size(), std::size_t(kSize) * kSize * kSize);
  std::vector<double> both(organs().size() + 1), found(both.size()), truth(both.size());
  for (std::size_t at = 0; at < labels.size(); ++at) {
    const Vector<3> x(double(at % kSize), double(at / kSize % kSize), double(at / kSize / kSize));
    const auto organ = std::size_t(organ_at(x));
    found[labels[at]] += 1;
    truth[organ] += 1;
    both[organ] += labels[at] == organ;
  }
  for (std::size_t n = 1; n < both.size(); ++n)
    EXPECT_GT(2 * both[n] / (found[n] + truth[n]), 0.94) << organs()[n - 1].name;
  // Each object's own voxels are its own in the map.
  for (std::size_t n = 0; n < organs().size(); ++n) {
    const auto own = made.segmentation.setting().rasterized(
        made.finished[n].finished->shape, {kSize, kSize, kSize}, Eigen::Affine3d::Identity());
    for (std::size_t at = 0; at < labels.size(); ++at) {
      if (own[at]) {
        ASSERT_EQ(labels[at], n + 1);
      }
    }
  }
}

TEST(Objects, OfAnAbdomenAreRepeatedByTheirRecipe) {
  const FinishedAbdomen& made = finished_abdomen();
  const std::string recipe = to_recipe<3>(made.segmentation);
  Segmentation<3> again(make_setting(abdomen()));
  replay<3>(recipe, again);
  ASSERT_EQ(again.objects().size(), organs().size());
  for (std::size_t n = 0; n < organs().size(); ++n)
    EXPECT_EQ(again.object(again.objects()[n]).result->shape.points,
              made.segmentation.object(made.segmentation.objects()[n]).result->shape.points)
        << n;
  EXPECT_EQ(to_recipe<3>(again), recipe);
}

// What an object sees of the others when it is made is in its history, whatever they do later.
TEST(Objects, SeeTheInsideClicksOfTheOthersAsTheyAreThen) {
  Segmentation<3> s(make_setting(test::two_balls()));
  const int first = s.add_object("first"), second = s.add_object("second");
  s.add_click(first, inside(-0.5));
  s.add_click(second, inside(0.5));
  const Result<3>& alone = s.propose(first);
  ASSERT_TRUE(alone.search);
  ASSERT_EQ(alone.search->clicks.size(), 2u);
  EXPECT_EQ(alone.search->clicks[1], (Click<3>{{0.5, 0, 0}, Side::kOutside}));
  EXPECT_EQ(s.object(first).clicks.size(), 1u);  // its own are as they were made
  s.evolve(first);
  s.take_back_click(second, 0);
  s.add_click(second, inside(0.45));
  s.evolve(second);
  s.undo(first);
  s.add_click(first, inside(-0.4));
  s.evolve(first);
  s.take_back_click(first, 0);
  const std::string recipe = to_recipe<3>(s);
  Segmentation<3> again(make_setting(test::two_balls()));
  replay<3>(recipe, again);
  for (const int n : {0, 1})
    EXPECT_EQ(again.object(again.objects()[n]).result->shape.points,
              s.object(s.objects()[n]).result->shape.points);
  EXPECT_EQ(to_recipe<3>(again), recipe);
}

TEST(Objects, MayNotBothHaveAVoxel) {
  Segmentation<3> s(make_setting(test::two_balls()));
  const int first = s.add_object("first"), second = s.add_object("second");
  s.add_click(first, inside(-0.5));
  try {
    s.add_click(second, inside(-0.49));
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("'first'"), std::string::npos) << error.what();
  }
  s.add_click(second, {{-0.49, 0, 0}, Side::kOutside});  // says the same
  EXPECT_TRUE(s.undo(second));
  s.undo(first);
  s.add_click(second, inside(-0.5));
  s.redo(first);  // what could not be clicked cannot be made either
  EXPECT_THROW(s.evolve(first), UsageError);
  EXPECT_THROW(s.propose(second), UsageError);
}

// A twin has nothing left; the others are as they would be without it.
TEST(Objects, SayWhatFailed) {
  const auto setting = make_setting(test::two_balls());
  SegmentOptions options;
  options.seeds_mm = {{-0.5, 0, 0}};
  const Result<3> ball = segment<3>(setting, options);
  const Result<3> nothing;
  const auto finished =
      finish_objects<3>(*setting, std::vector<const Result<3>*>{&ball, &nothing, &ball}, ".stl");
  EXPECT_TRUE(finished[0].finished);
  EXPECT_FALSE(finished[1].finished);
  EXPECT_THROW(std::rethrow_exception(finished[1].failure), NoObject);
  EXPECT_FALSE(finished[2].finished);
  EXPECT_THROW(std::rethrow_exception(finished[2].failure), InvalidMesh);
}

Triangles cube_at(const Vector<3>& corner, double side) {
  return mesh::box(corner, corner + Vector<3>::Constant(side), side);
}

TEST(Objects, SayWhereTheFloatsOfAFileAreTooCoarse) {
  const auto setting = make_setting(test::two_balls());
  const auto words_on = [&](const Triangles& surface, const char* extension) {
    Result<3> result;
    result.outcome = Outcome::kConverged;
    result.shape = surface;
    return test::message_of<InvalidMesh>([&] { finish<3>(*setting, result, extension); });
  };
  const Triangles first = cube_at({100, 0, 0}, 1);
  const Triangles apart = mesh::joined({first, cube_at({101 + 1e-6, 0.25, 0.25}, 1)}),
                  across = mesh::joined({first, cube_at({100.7, 0.2, 0.3}, 1)});
  EXPECT_TRUE(words_on(apart, ".stl")
                  .ends_with("; the file's floats are 7.6e-06 mm apart here, .vtp keeps doubles"))
      << words_on(apart, ".stl");
  EXPECT_EQ(words_on(apart, ".vtp"), "accepted");
  EXPECT_EQ(words_on(across, ".stl").find("floats"), std::string::npos);
}

// Cut along a wall at 1e6 mm, where floats are 1/16 mm apart and the gap is a thousandth.
TEST(Objects, SayWhereFloatsLeaveNoGapBesideAWall) {
  const auto setting = make_setting(test::two_balls());
  Result<3> first, second;
  first.outcome = second.outcome = Outcome::kConverged;
  first.shape = cube_at(Vector<3>::Constant(1e6 + 0.01), 4);
  second.shape = cube_at(Vector<3>(1e6 + 2.51, 1e6 + 1.51, 1e6 + 0.51), 4);
  const auto finished =
      finish_objects<3>(*setting, std::vector<const Result<3>*>{&first, &second}, ".stl");
  ASSERT_TRUE(finished[0].finished);
  ASSERT_FALSE(finished[1].finished);
  const std::string words =
      test::message_of<InvalidMesh>([&] { std::rethrow_exception(finished[1].failure); });
  EXPECT_TRUE(words.starts_with("beside object 1: ") &&
              words.ends_with(" mm apart here, .vtp keeps doubles"))
      << words;
}

}  // namespace
}  // namespace surf::segment
