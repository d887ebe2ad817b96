#include "libsurf/segment/object_box.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "libsurf/base/error.h"
#include "tests/surf/fixtures.h"
#include "tests/surf/segment/click_scenes.h"

namespace surf::segment {
namespace {

using test::inside;
using test::outside;
using test::point;

/// 48 cells along each axis, at 1 mm.
template <class T>
struct ObjectBoxes : ::testing::Test {
  static constexpr int kDim = T::value;
  const test::LatticeImage<kDim> image = test::image_of<kDim>(test::is_in_dumbbell<kDim>, 0.03);

  /// A box from one corner to another, the same along the axes beyond the first.
  BoxCorners<kDim> corners(double first, double last, double low = 8, double high = 40) const {
    return {point<kDim>(first, low, low), point<kDim>(last, high, high)};
  }
  NodeBox<kDim> cells(const BoxCorners<kDim>& corners_mm) const {
    return cells_of_box<kDim>(image.extent(), corners_mm);
  }
  SearchGrid<kDim> grid(const BoxCorners<kDim>& corners_mm) const {
    return {image, image.extent(), {image.extent(), 1.5e6, cells(corners_mm)}};
  }
  std::string error_of(const BoxCorners<kDim>& corners_mm) const {
    try {
      cells(corners_mm);
    } catch (const UsageError& error) {
      return error.what();
    }
    return {};
  }
};
TYPED_TEST_SUITE(ObjectBoxes, test::Dims, test::DimName);

TYPED_TEST(ObjectBoxes, TakeTheCellsOfBothCornersWhicheverIsFirst) {
  constexpr int Dim = TypeParam::value;
  const NodeBox<Dim> a = this->cells(this->corners(4, 20)),
                     b = this->cells({this->corners(4, 20)[1], this->corners(4, 20)[0]});
  EXPECT_EQ(a.lower[0], 4);
  EXPECT_EQ(a.size[0], 17);
  EXPECT_EQ(a.lower, b.lower);
  EXPECT_EQ(a.size, b.size);
}

// Two corners on a line along one of the image's axes would hold nothing.
TYPED_TEST(ObjectBoxes, OfTheWorldAreHeldInTurnedImages) {
  constexpr int Dim = TypeParam::value;
  ImageBox<Dim> turned = this->image.extent();
  const BoxCorners<Dim> corners = this->corners(10, 30);
  EXPECT_EQ(holding_box_along_world<Dim>(turned, corners), corners);
  Eigen::Matrix<double, Dim, Dim> turn = Eigen::Matrix<double, Dim, Dim>::Identity();
  turn.template topLeftCorner<2, 2>() = Eigen::Rotation2Dd(EIGEN_PI / 4).toRotationMatrix();
  turned.index_to_world.linear() = turn;
  turned.world_to_index = turned.index_to_world.inverse();
  const BoxCorners<Dim> held = holding_box_along_world<Dim>(turned, corners);
  const auto low = turned.index(held[0]), high = turned.index(held[1]);
  for (int corner = 0; corner < 1 << Dim; ++corner) {
    Vector<Dim> point;
    for (int axis = 0; axis < Dim; ++axis) point[axis] = corners[corner >> axis & 1][axis];
    EXPECT_TRUE((turned.index(point) >= low - 1e-9).all());
    EXPECT_TRUE((turned.index(point) <= high + 1e-9).all());
  }
}

TYPED_TEST(ObjectBoxes, EndWhereTheImageDoes) {
  const auto cells = this->cells(this->corners(-50, 20));
  EXPECT_EQ(cells.lower[0], 0);
  EXPECT_EQ(cells.size[0], 21);
}

TYPED_TEST(ObjectBoxes, SayWhatIsWrongWithThem) {
  EXPECT_THAT(this->error_of(this->corners(60, 80)), ::testing::HasSubstr("holds no"));
  EXPECT_THAT(this->error_of(this->corners(20, 20)), ::testing::HasSubstr("thick along axis i"));
  EXPECT_THAT(this->error_of(this->corners(std::nan(""), 20)), ::testing::HasSubstr("finite"));
}

TYPED_TEST(ObjectBoxes, HaveFacesWhereTheImageGoesOn) {
  constexpr int Dim = TypeParam::value;
  const SearchGrid<Dim> grid = this->grid(this->corners(0, 26));
  EXPECT_TRUE(grid.has_outside_faces());
  EXPECT_FALSE(grid.is_outside_beyond(0, false));  // that is where the image ends
  EXPECT_TRUE(grid.is_outside_beyond(0, true));
  EXPECT_NEAR((grid.node_to_world() * Vector<Dim>::Zero() - point<Dim>(0, 8, 8)).norm(), 0, 1e-12);
  const NodeSet<Dim> faces = outside_faces(grid);
  for (std::size_t at = 0; at < grid.box().n(); ++at) {
    const auto node = grid.box().node(at);
    bool is_on_face = node[0] + 1 == grid.box().size[0];
    for (int axis = 1; axis < Dim; ++axis)
      is_on_face |= node[axis] == 0 || node[axis] + 1 == grid.box().size[axis];
    EXPECT_EQ(faces.contains(node), is_on_face) << at;
  }
  const SearchGrid<Dim> whole(this->image, this->image.extent(), {this->image.extent(), 1.5e6});
  EXPECT_FALSE(whole.has_outside_faces());
  EXPECT_TRUE(outside_faces(whole).is_empty());
}

TYPED_TEST(ObjectBoxes, FitWhatLeavesAMargin) {
  constexpr int Dim = TypeParam::value;
  const SearchGrid<Dim> grid = this->grid(this->corners(2, 46, 2, 46));
  const auto good = NodeBox<Dim>::cube(12, 21), small = NodeBox<Dim>::cube(21, 3);
  auto at_face = good;
  at_face.lower[0] = 0;
  at_face.size[0] = 33;
  EXPECT_EQ(box_fit(grid, good), 1);
  EXPECT_NEAR(box_fit(grid, at_face), std::exp(-2.0), 1e-12);  // (8 mm)^2 / (2 (4 mm)^2)
  EXPECT_LE(box_fit(grid, small), 1);
  EXPECT_GT(box_fit(grid, small), box_fit(grid, at_face));
}

// Where the box was drawn close what is as near to all faces fits; a leak to one of them does not.
TYPED_TEST(ObjectBoxes, FitWhatTheyAreDrawnCloseTo) {
  constexpr int Dim = TypeParam::value;
  const SearchGrid<Dim> grid = this->grid(this->corners(2, 46, 2, 46));
  auto leak = NodeBox<Dim>::cube(2, 41);
  EXPECT_EQ(box_fit(grid, leak), 1);
  leak.lower[0] = 0;
  leak.size[0] = 43;
  EXPECT_LT(box_fit(grid, leak), 0.7);
  // In a box of half the size half as near is as near.
  const SearchGrid<Dim> less = this->grid(this->corners(14, 34, 14, 34));
  auto near = NodeBox<Dim>::cube(6, 9);
  near.lower[0] = 4;
  EXPECT_GT(box_fit(less, near), 0.9);
}

TYPED_TEST(ObjectBoxes, KeepWhatIsFoundWithin) {
  constexpr int Dim = TypeParam::value;
  // The first ball of the dumbbell and a part of the bridge, which goes on beyond the box.
  const SearchGrid<Dim> grid = this->grid(this->corners(0, 28));
  const std::vector<Click<Dim>> clicks = {inside<Dim>(14), outside<Dim>(26)};
  for (const std::size_t n : {1, 2}) {
    const auto found = search_clicks<Dim>(grid, std::span<const Click<Dim>>(clicks).subspan(0, n));
    ASSERT_TRUE(found && !found->found.empty());
    EXPECT_EQ(outside_faces(grid).count_in_both(found->inside()), 0u);
    const Flags inside = found->inside().flags();
    double both = 0, sum = 0;
    for (std::size_t at = 0; at < inside.size(); ++at) {
      const auto node = grid.box().node(at);
      Vector<Dim> index;
      for (int axis = 0; axis < Dim; ++axis) index[axis] = node[axis];
      const Vector<Dim> x = grid.node_to_world() * index;
      const bool is_in_ball = test::is_in_ball<Dim>(x, point<Dim>(14), 9);
      both += is_in_ball && inside[at];
      sum += is_in_ball + inside[at];
    }
    EXPECT_GT(2 * both / sum, 0.93) << n;
  }
}

}  // namespace
}  // namespace surf::segment
