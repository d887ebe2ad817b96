#include "libcurve/image/read_image.h"

#include <tiffio.h>
#include <zlib.h>

#include <cmath>
#include <functional>

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

/// A file of JPEG with a block of EXIF that says an orientation, in either order of bytes.
std::string turned(const std::string& jpeg, int orientation, bool is_little) {
  using namespace std::string_literals;
  const std::string value(1, char(orientation));
  const std::string exif =
      "Exif\0\0"s +
      (is_little ? "II*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0"s + value + "\0\0\0\0\0\0\0"s
                 : "MM\0*\0\0\0\x08\0\x01\x01\x12\0\x03\0\0\0\x01\0"s + value + "\0\0\0\0\0\0"s);
  const std::string segment = "\xff\xe1"s + '\0' + char(exif.size() + 2) + exif;
  return jpeg.substr(0, 2) + segment + jpeg.substr(2);
}

// Where the pixel in the file's column x and row y is seen, by the orientation.
TEST_F(ReadImage, JpegIsTurnedAsItsExifSays) {
  const std::string upright = jpeg_of_a_ramp();
  write("upright.jpg", upright);
  const Image stored = read_image(path("upright.jpg"));
  const std::size_t n_notes = stored.source().notes.size();
  const int w = 96, h = 80;
  const std::vector<std::function<std::array<int, 2>(int, int)>> seen = {
      [](int x, int y) {
        return std::array{x, y};
      },
      [&](int x, int y) {
        return std::array{w - 1 - x, y};
      },
      [&](int x, int y) {
        return std::array{w - 1 - x, h - 1 - y};
      },
      [&](int x, int y) {
        return std::array{x, h - 1 - y};
      },
      [](int x, int y) {
        return std::array{y, x};
      },
      [&](int x, int y) {
        return std::array{h - 1 - y, x};
      },
      [&](int x, int y) {
        return std::array{h - 1 - y, w - 1 - x};
      },
      [&](int x, int y) {
        return std::array{y, w - 1 - x};
      }};
  for (int orientation = 1; orientation <= 8; ++orientation) {
    write("turned.jpg", turned(upright, orientation, orientation % 2 == 0));
    const Image image = read_image(path("turned.jpg"));
    EXPECT_EQ(image.size()[0], orientation < 5 ? w : h);
    EXPECT_EQ(image.source().notes.size(), n_notes + (orientation == 1 ? 0 : 1));
    for (int y = 0; y < h; y += 7)
      for (int x = 0; x < w; x += 7) {
        const auto [i, j] = seen[std::size_t(orientation - 1)](x, y);
        ASSERT_EQ(image.value(i, j), stored.value(x, y)) << orientation << ": " << x << " " << y;
      }
  }
  for (std::size_t n = 0; n < 26; ++n) {  // cut short before the value: upright, and no crash
    const std::string whole = turned(upright, 6, true);
    std::string cut = whole;
    cut.erase(6 + n, 30 - n).replace(5, 1, 1, char(whole[5] - (30 - int(n))));
    write("cut.jpg", cut);
    EXPECT_EQ(read_image(path("cut.jpg")).size()[0], w) << n;
  }
}

TEST_F(ReadImage, JpegHasTheSizeOfItsPixels) {
  std::string bytes = jpeg_of_a_ramp();
  const std::size_t jfif = bytes.find("JFIF");
  ASSERT_NE(jfif, std::string::npos);
  write("none.jpg", bytes);
  EXPECT_EQ(read_image(path("none.jpg")).source().spacing_source, "unknown");
  bytes.replace(jfif + 7, 5, std::string("\x01\x00\xfe\x00\x7f", 5));  // per inch: 254, 127
  write("inch.jpg", bytes);
  EXPECT_TRUE(read_image(path("inch.jpg")).spacing().isApprox(Eigen::Vector2d(0.1, 0.2)));
  write("turned.jpg", turned(bytes, 6, true));
  EXPECT_EQ(read_image(path("turned.jpg")).size()[0], 80);
  EXPECT_TRUE(read_image(path("turned.jpg")).spacing().isApprox(Eigen::Vector2d(0.2, 0.1)));
}

TEST_F(ReadImage, ExifIsFoundBehindOtherBlocksAndInPng) {
  using namespace std::string_literals;
  const std::string xmp = "http://ns.adobe.com/xap/1.0/\0<x/>"s;
  const std::string jpeg = turned(jpeg_of_a_ramp(), 6, false);
  write("xmp.jpg",
        jpeg.substr(0, 2) + "\xff\xe1"s + '\0' + char(xmp.size() + 2) + xmp + jpeg.substr(2));
  EXPECT_EQ(read_image(path("xmp.jpg")).size(), (std::array<int, 2>{80, 96}));
  write_mask(path("m.png"), {3, 2}, std::vector<std::uint8_t>{1, 0, 0, 0, 0, 0});
  const std::string png = read(path("m.png")),
                    chunk = "eXIfII*\0\x08\0\0\0\x01\0\x12\x01\x03\0\x01\0\0\0\x06\0\0\0\0\0\0\0"s;
  const uLong sum = ::crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), uInt(chunk.size()));
  std::string exif = "\0\0\0"s + char(chunk.size() - 4) + chunk;
  for (int shift = 24; shift >= 0; shift -= 8) exif += char(sum >> shift & 0xff);
  write("t.png", png.substr(0, 33) + exif + png.substr(33));  // behind the header
  EXPECT_EQ(read_image(path("t.png")).size(), (std::array<int, 2>{2, 3}));
  EXPECT_EQ(read_image(path("t.png")).values(), (std::vector<float>{0, 255, 0, 0, 0, 0}));
}

TEST_F(ReadImage, TiffOfAnyOrientationTypeAndSize) {
  const auto write_tiff = [&](const char* mode, int bits, int format, int orientation,
                              const std::string& rows, int width, int height) {
    TIFF* tiff = TIFFOpen(path("t.tif").c_str(), mode);
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, format);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, orientation);
    std::string bytes = rows;
    for (int j = 0; j < height; ++j)
      TIFFWriteScanline(tiff, bytes.data() + std::size_t(j) * width * bits / 8, j, 0);
    TIFFClose(tiff);
  };
  const std::string six("\x01\x02\x03\x04\x05\x06", 6);
  for (const char* mode : {"w", "w8"}) {  // and BigTIFF
    write_tiff(mode, 8, SAMPLEFORMAT_UINT, ORIENTATION_TOPLEFT, six, 3, 2);
    EXPECT_EQ(read_image(path("t.tif")).values(), (std::vector<float>{1, 2, 3, 4, 5, 6}));
    write_tiff(mode, 8, SAMPLEFORMAT_UINT, ORIENTATION_BOTRIGHT, six, 3, 2);
    EXPECT_EQ(read_image(path("t.tif")).values(), (std::vector<float>{6, 5, 4, 3, 2, 1}));
    write_tiff(mode, 8, SAMPLEFORMAT_UINT, ORIENTATION_RIGHTTOP, six, 3, 2);
    EXPECT_EQ(read_image(path("t.tif")).size(), (std::array<int, 2>{2, 3}));
    EXPECT_EQ(read_image(path("t.tif")).values(), (std::vector<float>{4, 1, 5, 2, 6, 3}));
  }
  const auto bytes_of = [](const auto& values) {
    return std::string(reinterpret_cast<const char*>(values.data()), sizeof(values));
  };
  const std::array<std::int64_t, 4> integers = {-3, 70000000000, 0, 1};
  write_tiff("w", 64, SAMPLEFORMAT_INT, ORIENTATION_TOPLEFT, bytes_of(integers), 2, 2);
  EXPECT_EQ(read_image(path("t.tif")).values(), (std::vector<float>{-3, 7e10f, 0, 1}));
  const std::array<Eigen::half, 4> halves = {Eigen::half(0.5f), Eigen::half(-2.f), {}, {}};
  write_tiff("w", 16, SAMPLEFORMAT_IEEEFP, ORIENTATION_TOPLEFT, bytes_of(halves), 2, 2);
  EXPECT_EQ(read_image(path("t.tif")).values(), (std::vector<float>{0.5, -2, 0, 0}));
}

// libtiff's own conversion to colours keeps the upper byte alone.
TEST_F(ReadImage, TiffOfSixteenBitsIsReadWholeOrRefused) {
  constexpr int kWidth = 40, kHeight = 21, kTile = 16;
  const auto value = [](int x, int y, int sample) { return 1000 + x + 100 * y + 7 * sample; };
  const auto write_tiles = [&](int n_samples, int photometric, int planar) {
    TIFF* tiff = TIFFOpen(path("t.tif").c_str(), "w");
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kWidth);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kHeight);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, n_samples);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, photometric);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, planar);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_LZW);
    TIFFSetField(tiff, TIFFTAG_TILEWIDTH, kTile);
    TIFFSetField(tiff, TIFFTAG_TILELENGTH, kTile);
    const int n_planes = planar == PLANARCONFIG_CONTIG ? 1 : n_samples,
              n_together = n_samples / n_planes;
    for (int plane = 0; plane < n_planes; ++plane)
      for (int y = 0; y < kHeight; y += kTile)
        for (int x = 0; x < kWidth; x += kTile) {
          std::vector<std::uint16_t> tile;
          for (int j = 0; j < kTile; ++j)
            for (int i = 0; i < kTile; ++i)
              for (int sample = 0; sample < n_together; ++sample)
                tile.push_back(std::uint16_t(value(x + i, y + j, plane + sample)));
          TIFFWriteTile(tiff, tile.data(), x, y, 0, std::uint16_t(plane));
        }
    TIFFClose(tiff);
  };
  for (const int planar : {PLANARCONFIG_CONTIG, PLANARCONFIG_SEPARATE}) {
    write_tiles(1, PHOTOMETRIC_MINISBLACK, planar);
    const Image image = read_image(path("t.tif"));
    EXPECT_EQ(image.source().scalar_type, "uint16");
    EXPECT_EQ(image.size(), (std::array<int, 2>{kWidth, kHeight}));
    for (int y = 0; y < kHeight; ++y)
      for (int x = 0; x < kWidth; ++x)
        ASSERT_EQ(image.value(x, y), value(x, y, 0)) << x << " " << y;
  }
  write_tiles(3, PHOTOMETRIC_RGB, PLANARCONFIG_CONTIG);
  EXPECT_NEAR(read_image(path("t.tif")).value(39, 20), value(39, 20, 0) + 7 * 0.7152 + 14 * 0.0722,
              1e-3);
  write_tiles(3, PHOTOMETRIC_RGB, PLANARCONFIG_SEPARATE);
  EXPECT_NE(error_of("t.tif").find("save it as plain grey"), std::string::npos);
  write_tiles(1, PHOTOMETRIC_MINISWHITE, PLANARCONFIG_CONTIG);
  EXPECT_NE(error_of("t.tif").find("save it as plain grey"), std::string::npos);
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
