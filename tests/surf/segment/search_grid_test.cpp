#include "libsurf/segment/search_grid.h"

#include <gtest/gtest.h>

#include <stdexcept>

#include "tests/surf/segment/ball_field.h"

namespace surf::segment {
namespace {

TEST(SearchGridTest, PartsAreTheSameWithAndWithoutTheRest) {
  const auto field = std::make_shared<test::BallField>(Vector<3>(30, 40, 50), 12);
  const SearchGrid<3> whole(*field, test::BallField::extent(), test::ball_lattice());
  for (const NodeBox<3>& box :
       {NodeBox<3>{{20, 30, 40}, {25, 31, 27}}, NodeBox<3>{{0, 0, 0}, {40, 60, 55}},
        NodeBox<3>{{60, 70, 80}, {40, 30, 20}}, NodeBox<3>{{0, 10, 20}, {100, 80, 70}}}) {
    const SearchGrid<3> alone(field, test::BallField::extent(), test::ball_lattice());
    const SearchGrid<3> part = alone.part(box), cropped_part = whole.part(box);
    EXPECT_EQ(part.intensity(), cropped_part.intensity());
    EXPECT_EQ(part.slope(), cropped_part.slope());
    EXPECT_EQ(part.edge_slope(), cropped_part.edge_slope());
    EXPECT_EQ(part.level(), cropped_part.level());
    EXPECT_EQ(part.intensity(), cropped(whole.box(), whole.intensity(), box));
    EXPECT_EQ(part.edge_slope(), cropped(whole.box(), whole.edge_slope(), box));
    EXPECT_EQ(part.node_to_world().matrix(), cropped_part.node_to_world().matrix());
    EXPECT_EQ(part.box().lower, (NodeBox<3>::Index{}));
  }
}

TEST(SearchGridTest, MakesOnlyWhatIsAskedFor) {
  const auto field = std::make_shared<test::BallField>(Vector<3>(50, 50, 50), 12);
  const SearchGrid<3> grid(field, test::BallField::extent(), test::ball_lattice());
  EXPECT_EQ(field->n_asked(), 0u);
  EXPECT_EQ(grid.memory_bytes(), 0u);
  EXPECT_THROW(grid.intensity(), std::logic_error);
  grid.part({{40, 40, 40}, {20, 20, 20}});
  EXPECT_LT(field->n_asked(), 27u * 27 * 27);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_FALSE(grid.make_all(stop.get_token()));
  EXPECT_THROW(grid.intensity(), std::logic_error);
  EXPECT_TRUE(grid.make_all());
  EXPECT_EQ(grid.intensity().size(),
            std::size_t(test::kBallFieldSize) * test::kBallFieldSize * test::kBallFieldSize);
  EXPECT_GE(grid.memory_bytes(), 14 * grid.box().n());
}

/// One voxel of it is broken.
class BrokenField : public test::BallField {
 public:
  using BallField::BallField;
  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
    BallField::sample(x, order, out);
    for (Eigen::Index i = 0; i < x.rows(); ++i)
      if (x.row(i).transpose() == Vector<3>(3, 4, 5)) out.value[i] = 1e6;
  }
};

TEST(SearchGridTest, OneBrokenVoxelLeavesTheOthersTheirLevels) {
  const test::BallField field(Vector<3>(50, 50, 50), 12);
  const BrokenField broken(Vector<3>(50, 50, 50), 12);
  const ImageExtent<3> extent = test::BallField::extent();
  const SearchGrid<3> grid(field, extent, test::ball_lattice()),
      beside(broken, extent, test::ball_lattice());
  const auto levels_between = [](const SearchGrid<3>& of, const NodeBox<3>::Index& a,
                                 const NodeBox<3>::Index& b) {
    return of.level()[of.box().at(a)] - of.level()[of.box().at(b)];
  };
  // From the background to the ball's middle.
  EXPECT_GT(levels_between(grid, {50, 50, 50}, {20, 20, 20}), 0.8 * SearchGrid<3>::kLevels);
  EXPECT_GT(levels_between(beside, {50, 50, 50}, {20, 20, 20}), 0.1 * SearchGrid<3>::kLevels);
  EXPECT_EQ(beside.level()[beside.box().at({3, 4, 5})], SearchGrid<3>::kLevels - 1);
}

}  // namespace
}  // namespace surf::segment
