#include "libsurf/segment/search_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
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

TEST(SearchGridTest, EndsWithWhatWasScanned) {
  ImageExtent<3> extent = test::BallField::extent();
  extent.scanned = NodeBox<3>::between({10, 0, 3}, {100, 60, 97});
  const SearchLattice<3> lattice(extent, 1.5e6);
  EXPECT_EQ(lattice.box.size, extent.scanned.size);
  EXPECT_EQ(lattice.node_to_world * Vector<3>::Zero(), Vector<3>(10, 0, 3));
  EXPECT_EQ(lattice.is_outside_beyond, decltype(lattice.is_outside_beyond){});
  // Faces of a box at its end are the border's, not those of the box.
  const SearchLattice<3> boxed(extent, 1.5e6, NodeBox<3>::between({5, 10, 20}, {40, 100, 90}));
  EXPECT_EQ(boxed.box.size, (std::array{30, 50, 70}));
  EXPECT_EQ(boxed.node_to_world * Vector<3>::Zero(), Vector<3>(10, 10, 20));
  EXPECT_EQ(boxed.is_outside_beyond,
            (decltype(boxed.is_outside_beyond){{{false, true}, {true, false}, {true, true}}}));
}

TEST(SearchGridTest, LevelsAreThoseOfUsualIntensities) {
  const test::BallField field(Vector<3>(50, 50, 50), 12);
  ImageExtent<3> extent = test::BallField::extent();
  const SearchGrid<3> grid(field, extent, test::ball_lattice());
  extent.usual = {0.2f, 0.6f};
  const SearchGrid<3> usual(field, extent, test::ball_lattice());
  EXPECT_NEAR(usual.width(), 0.4, 1e-6);
  EXPECT_EQ(usual.intensity(), grid.intensity());
  for (std::size_t at = 0; at < grid.box().n(); at += 7) {
    const double share = (std::clamp(double(grid.intensity()[at]), 0.2, 0.6) - 0.2) / 0.4;
    EXPECT_NEAR(usual.level()[at], share * (SearchGrid<3>::kLevels - 1), 1);
  }
}

}  // namespace
}  // namespace surf::segment
