// Pixels and PNG files.
#include "libsurf/io/picture.h"

#include "libsurf/base/error.h"
#include "tests/surf/io/scratch_folder.h"

namespace surf::io {
namespace {

class PictureFile : public test::ScratchFolder {};

TEST(Picture, BlendMixesColorsAndIgnoresWhatIsOutside) {
  Picture picture(4, 3, {100, 100, 100});
  picture.blend(1, 2, {200, 0, 100}, 0.5);
  EXPECT_EQ(picture.at(1, 2), (Color{150, 50, 100}));
  picture.blend(4, 0, {200, 0, 100}, 1);
  picture.blend(0, -1, {200, 0, 100}, 1);
  EXPECT_EQ(picture.at(0, 0), (Color{100, 100, 100}));
}

TEST(Picture, PasteCopiesToItsCorner) {
  Picture picture(4, 3);
  picture.paste(Picture(2, 1, {9, 8, 7}), 2, 1);
  EXPECT_EQ(picture.at(2, 1), (Color{9, 8, 7}));
  EXPECT_EQ(picture.at(3, 1), (Color{9, 8, 7}));
  EXPECT_EQ(picture.at(1, 1), (Color{0, 0, 0}));
  EXPECT_EQ(picture.at(2, 2), (Color{0, 0, 0}));
}

TEST_F(PictureFile, IsAPngWithThePicturesSizeAndTheSameBytesTwice) {
  const Picture picture(300, 7, {1, 2, 3});
  write_png(path("a.png"), picture);
  write_png(path("b.png"), picture);
  const std::string bytes = read(path("a.png"));
  ASSERT_GT(bytes.size(), 24u);
  EXPECT_EQ(bytes.substr(0, 8), "\x89PNG\r\n\x1a\n");
  EXPECT_EQ(bytes.substr(16, 8), std::string("\0\0\x01\x2c\0\0\0\x07", 8));  // width, height
  EXPECT_EQ(bytes, read(path("b.png")));
}

TEST_F(PictureFile, IsRefusedWithAnotherEndingOrInAMissingFolder) {
  EXPECT_THROW(write_png(path("a.jpg"), Picture(2, 2)), UsageError);
  EXPECT_THROW(write_png(path("none/a.png"), Picture(2, 2)), OutputError);
  EXPECT_EQ(n_files(), 0u);
}

}  // namespace
}  // namespace surf::io
