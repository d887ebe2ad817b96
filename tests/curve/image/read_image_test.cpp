#include "libcurve/image/read_image.h"

#include <cmath>

#include "libcurve/image/phantom.h"
#include "libcurve/image/write_image.h"
#include "libsurf/base/error.h"
#include "libsurf/io/picture.h"
#include "tests/surf/io/scratch_folder.h"

namespace surf::curve {
namespace {

class ReadImage : public test::ScratchFolder {
 protected:
  std::string error_of(const std::string& name, const ReadImageOptions& options = {}) const {
    try {
      read_image(path(name), options);
    } catch (const InputError& error) {
      return error.what();
    }
    return {};
  }
};

TEST_F(ReadImage, ReadsBackFloatsFromTiff) {
  const Image image = make_phantom({.size = {40, 30}, .spacing_mm = {0.5, 0.25}, .noise = 0.1});
  write_image(path("a.tif"), image);
  const Image back = read_image(path("a.tif"));
  EXPECT_EQ(back.size(), image.size());
  EXPECT_EQ(back.values(), image.values());
  EXPECT_EQ(back.source().spacing_source, "file");
  EXPECT_TRUE(back.spacing().isApprox(image.spacing(), 1e-5)) << back.spacing();  // float32 tags
}

TEST_F(ReadImage, ReadsSixteenBitsFromPng) {
  const Image image = make_phantom({.size = {40, 30}});
  write_image(path("a.png"), image);
  const Image back = read_image(path("a.png"));
  const auto [low, high] = image.range();
  for (std::size_t at = 0; at < image.n_pixels(); ++at)
    ASSERT_NEAR(back.values()[at] / 65535.0 * (high - low) + low, image.values()[at], 1.0 / 65535);
  EXPECT_EQ(back.spacing(), Eigen::Vector2d(1, 1));
  EXPECT_EQ(read_image(path("a.png"), {.spacing_mm = Eigen::Vector2d(2, 3)}).spacing(),
            Eigen::Vector2d(2, 3));
}

TEST_F(ReadImage, RowZeroIsOnTopAndMasksAreZeroOr255) {
  write_mask(path("m.png"), {3, 2}, std::vector<std::uint8_t>{1, 0, 0, 0, 0, 1});
  EXPECT_EQ(read_image(path("m.png")).values(), (std::vector<float>{255, 0, 0, 0, 0, 255}));
}

TEST_F(ReadImage, TurnsColorsIntoLuminanceAndSaysSo) {
  io::write_png(path("c.png"), io::Picture(4, 4, {100, 200, 50}));
  const Image image = read_image(path("c.png"));
  EXPECT_NEAR(image.value(2, 2), 0.2126 * 100 + 0.7152 * 200 + 0.0722 * 50, 1e-4);
  ASSERT_EQ(image.source().notes.size(), 1u);
  EXPECT_NE(image.source().notes[0].find("luminance"), std::string::npos);
}

TEST_F(ReadImage, BrokenFilesEndInOneClearLine) {
  EXPECT_NE(error_of("gone.png").find("cannot be read"), std::string::npos);
  write("empty.png", "");
  EXPECT_NE(error_of("empty.png").find("is empty"), std::string::npos);
  write("text.png", "this is no image at all");
  EXPECT_NE(error_of("text.png").find("not a PNG, JPEG or TIFF"), std::string::npos);
  for (const char* name : {"a.png", "a.tif"}) {
    write_image(path(name), make_phantom({.size = {64, 64}, .noise = 0.1}));
    const std::string bytes = read(path(name));
    for (const double share : {0.1, 0.5, 0.9}) {
      write(name, bytes.substr(0, std::size_t(share * double(bytes.size()))));
      EXPECT_NE(error_of(name), "") << name << " " << share;
      EXPECT_EQ(error_of(name).find('\n'), std::string::npos);
    }
  }
  write("head.jpg", "\xff\xd8\xff\xe0 and no more");
  EXPECT_NE(error_of("head.jpg").find("JPEG"), std::string::npos);
  write_image(path("b.png"), make_phantom({.size = {8, 8}}));
  EXPECT_NE(error_of("b.png", {.page = 3}).find("no page 3"), std::string::npos);
}

/// Grey from left to right; colour files hold it, too.
std::string jpeg_of_a_ramp() {
  io::Picture picture(96, 80);
  for (int y = 0; y < picture.height(); ++y)
    for (int x = 0; x < picture.width(); ++x)
      picture.at(x, y).fill(static_cast<std::uint8_t>(2 * x + y / 4));
  return io::jpeg_bytes(picture, 95);
}

TEST_F(ReadImage, JpegHasThePicturesLuminance) {
  write("a.jpg", jpeg_of_a_ramp());
  const Image image = read_image(path("a.jpg"));
  ASSERT_EQ(image.size(), (std::array<int, 2>{96, 80}));
  for (int y = 0; y < 80; ++y)
    for (int x = 0; x < 96; ++x) ASSERT_NEAR(image.value(x, y), 2 * x + y / 4, 4) << x << " " << y;
}

TEST_F(ReadImage, JpegWhoseDataAreMissingIsRefused) {
  const std::string whole = jpeg_of_a_ramp();
  write("end.jpg", whole.substr(0, whole.size() - 2));
  EXPECT_NE(error_of("end.jpg").find("its end is missing"), std::string::npos);
  // libjpeg alone fills the rest with grey and warns.
  write("middle.jpg", whole.substr(0, whole.size() / 2) + "\xff\xd9");
  EXPECT_NE(error_of("middle.jpg").find("truncated or damaged"), std::string::npos);
  write("tables.jpg", "\xff\xd8\xff\xd9");  // no image at all
  EXPECT_NE(error_of("tables.jpg").find("truncated or damaged"), std::string::npos);
  write("flat.jpg", std::string(whole).replace(whole.find("\xff\xc0") + 5, 4, "\x7f\xff\x7f\xff"));
  EXPECT_NE(error_of("flat.jpg").find("promises 32767 x 32767 pixels"), std::string::npos);
}

}  // namespace
}  // namespace surf::curve
