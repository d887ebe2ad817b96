#include "libcurve/image/image.h"

#include <gtest/gtest.h>

#include <cmath>

#include "libsurf/base/error.h"

namespace surf::curve {
namespace {

const Eigen::Affine2d kUnit = Eigen::Affine2d::Identity();

std::string error_of(const std::array<int, 2>& size, const Eigen::Affine2d& affine,
                     std::vector<float> values) {
  try {
    Image(size, affine, std::move(values));
  } catch (const InputError& error) {
    return error.what();
  }
  return {};
}

TEST(Image, KnowsItsPixelsAndItsPlane) {
  const Image image({3, 2}, pixel_to_plane({2, 0.5}), {1, 2, 3, 4, 5, 6});
  EXPECT_EQ(image.value(2, 1), 6);
  EXPECT_EQ(image.range(), (std::array<float, 2>{1, 6}));
  EXPECT_DOUBLE_EQ(image.pixel_size(), 1);
  EXPECT_TRUE(image.spacing().isApprox(Eigen::Vector2d(2, 0.5)));
  EXPECT_TRUE(image.contains({4.99, 0.74}));  // to the outer sides of the pixels
  EXPECT_FALSE(image.contains({5.01, 0.5}));
  EXPECT_FALSE(image.plane_to_ras());
}

TEST(Image, RefusesWhatIsNoImage) {
  EXPECT_NE(error_of({1, 5}, kUnit, std::vector<float>(5)).find("at least 2"), std::string::npos);
  EXPECT_NE(error_of({2, 2}, kUnit, {1, 2, 3}).find("3 values for 2 x 2"), std::string::npos);
  EXPECT_NE(error_of({2, 2}, kUnit, {1, 2, NAN, 3}).find("pixel (0, 1) is NaN"), std::string::npos);
  EXPECT_NE(error_of({2, 2}, kUnit, {1, INFINITY, 1, 3}).find("pixel (1, 0) is Inf"),
            std::string::npos);
  EXPECT_NE(error_of({2, 2}, pixel_to_plane({0, 1}), {1, 2, 3, 4}).find("zero pixel spacing"),
            std::string::npos);
  Eigen::Affine2d flat = kUnit;
  flat.linear() << 1, 2, 1, 2;
  EXPECT_NE(error_of({2, 2}, flat, {1, 2, 3, 4}).find("singular"), std::string::npos);
  EXPECT_THROW(check_image_size({1LL << 30, 1LL << 30}, "x"), InputError);
}

}  // namespace
}  // namespace surf::curve
