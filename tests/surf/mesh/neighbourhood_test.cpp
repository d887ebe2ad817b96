#include "libsurf/mesh/neighbourhood.h"

#include <gtest/gtest.h>

namespace surf::mesh {
namespace {

TEST(Neighbourhood, HoldsTheCubeOfAPointAndThoseNextToIt) {
  Neighbourhood<3> places(2);
  EXPECT_FALSE(places.contains({0.5, 0.5, 0.5}));
  places.add({0.5, 0.5, 0.5});
  EXPECT_TRUE(places.contains({0.5, 0.5, 0.5}));
  EXPECT_TRUE(places.contains({-1.9, 3.9, -0.1}));
  EXPECT_FALSE(places.contains({-2.1, 0.5, 0.5}));
  EXPECT_FALSE(places.contains({0.5, 4.1, 0.5}));
}

TEST(Neighbourhood, TellsPlacesFarApart) {
  Neighbourhood<2> places(1);
  places.add({-1e5, 3e5});
  EXPECT_TRUE(places.contains({-1e5, 3e5}));
  for (const double away : {-1e5, -1e3, 1e3, 1e5}) {
    EXPECT_FALSE(places.contains({-1e5 + away, 3e5}));
    EXPECT_FALSE(places.contains({-1e5, 3e5 + away}));
  }
}

}  // namespace
}  // namespace surf::mesh
