// What a studio outlives: no memory where nobody expects it, a folder that cannot be read to its
// end. And what needs neither a program nor a browser.
#include "tools/studio/dialogue.h"

#include <dirent.h>
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <nifti/nifti1.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <limits>
#include <new>
#include <string>
#include <thread>
#include <vector>

#include "libsurf/volume/write_volume.h"
#include "tests/surf/io/scratch_folder.h"
#include "tests/surf/segment/phantoms.h"
#include "tools/studio/access.h"
#include "tools/studio/folder.h"
#include "tools/studio/gzip.h"
#include "tools/studio/server.h"
#include "tools/studio/volume_file.h"

namespace {

std::atomic<std::size_t> most_bytes = std::numeric_limits<std::size_t>::max();
std::atomic<int> n_readable = std::numeric_limits<int>::max();

}  // namespace

// Of this program: larger pieces of memory fail.
void* operator new(std::size_t n) {
  if (n <= most_bytes)
    if (void* out = std::malloc(n)) return out;
  throw std::bad_alloc();
}
// Inlined they would be warned of: GCC sees a free() of what `new` has made.
[[gnu::noinline]] void operator delete(void* memory) noexcept { std::free(memory); }
[[gnu::noinline]] void operator delete(void* memory, std::size_t) noexcept { std::free(memory); }

namespace {

template <class Entry>
Entry* next_entry(Entry* (*real)(DIR*), DIR* folder) {
  if (n_readable-- > 0) return real(folder);
  errno = EIO;
  return nullptr;
}

}  // namespace

// Of this program: folders break off after some entries, as on a disk that fails. Which of the two
// the standard library calls depends on how it was built.
extern "C" dirent* readdir(DIR* folder) {
  static const auto real = reinterpret_cast<dirent* (*)(DIR*)>(::dlsym(RTLD_NEXT, "readdir"));
  return next_entry(real, folder);
}
#if defined(__GLIBC__) && !defined(__USE_FILE_OFFSET64)  // else the one above has its name
extern "C" dirent64* readdir64(DIR* folder) {
  static const auto real = reinterpret_cast<dirent64* (*)(DIR*)>(::dlsym(RTLD_NEXT, "readdir64"));
  return next_entry(real, folder);
}
#endif

namespace surfseg::studio {
namespace {

using namespace std::chrono_literals;

/// While it lives.
struct LargestPiece {
  explicit LargestPiece(std::size_t n) { most_bytes = n; }
  ~LargestPiece() { most_bytes = std::numeric_limits<std::size_t>::max(); }
};

/// An object whose name has 2 MB: to tell of it takes pieces of that size, to write it down larger
/// ones, and nothing else does.
class StudioFailures : public surf::test::ScratchFolder {
 protected:
  static constexpr std::size_t kMB = std::size_t(1) << 20;

  StudioFailures() : dialogue_(std::filesystem::path(path(""))) {
    surf::volume::write_volume(path("ball.nii"),
                               surf::test::phantom(surf::volume::PhantomKind::kBall, 24, 0));
    dialogue_.open(path("ball.nii"));
    wait_until([](const State& state) { return state.volume && !state.job; });
    dialogue_.rename(1, std::string(2 * kMB, 'x'));
    dialogue_.click(1, {0, 0, 0}, Side::kInside);
    wait_until_it_has_a_surface();
  }

  void wait_until(const std::function<bool(const State&)>& condition) {
    const auto end = std::chrono::steady_clock::now() + 120s;
    while (!condition(*dialogue_.state())) {
      ASSERT_LT(std::chrono::steady_clock::now(), end);
      std::this_thread::sleep_for(10ms);
    }
  }

  void wait_until_it_has_a_surface() {
    wait_until([](const State& state) { return !state.job && state.objects[0].measures; });
  }

  Dialogue dialogue_;
};

TEST_F(StudioFailures, AStateThatCannotBeToldEndsNothing) {
  {
    const LargestPiece limit(kMB);
    dialogue_.stop();
    EXPECT_THROW(dialogue_.recolour(1, {1, 2, 3}), std::bad_alloc);  // after it
  }
  dialogue_.recolour(1, {1, 2, 4});
  EXPECT_EQ(dialogue_.state()->objects[0].object.colour, (surf::segment::Colour{1, 2, 4}));
}

TEST_F(StudioFailures, AStateThatCannotBeWrittenIsToldAndEndsNothing) {
  const std::int64_t n_errors = dialogue_.state()->error_number;
  {
    const LargestPiece limit(3 * kMB);
    dialogue_.evolve(1);
    wait_until([&](const State& state) { return state.error_number > n_errors && !state.job; });
  }
  EXPECT_NE(dialogue_.state()->error.find("out of memory"), std::string::npos)
      << dialogue_.state()->error;
  dialogue_.click(1, {0.1, 0, 0}, Side::kInside);
  wait_until_it_has_a_surface();
  EXPECT_EQ(dialogue_.state()->objects[0].object.clicks.size(), 2u);
}

TEST_F(StudioFailures, AnEventThatCannotBeMadeEndsItsStreamAlone) {
  Server server(dialogue_, 0, "test");
  std::thread serves([&] { server.run(); });
  httplib::Client client("127.0.0.1", server.port());
  const std::string address = server.address();
  client.set_bearer_token_auth(address.substr(address.find("token=") + 6));
  {
    const LargestPiece limit(kMB);
    const auto events = client.Get("/api/events");
    ASSERT_TRUE(events) << httplib::to_string(events.error());
    EXPECT_EQ(events->body, "");
  }
  const auto state = client.Get("/api/state");
  ASSERT_TRUE(state);
  EXPECT_EQ(state->status, 200);
  server.stop();
  serves.join();
}

TEST_F(StudioFailures, AFolderThatBreaksOffIsListedAsFarAsItCanBeRead) {
  const std::size_t all = entries_of(path("")).size();
  ASSERT_GE(all, 2u);  // the scan and its state: what is read of n = 0 and 1 is less
  std::size_t n_entries = 0;
  for (std::size_t n = 0; n < 8; ++n) {
    n_readable = int(n);
    EXPECT_NO_THROW(n_entries = entries_of(path("")).size()) << n;
    n_readable = int(n);
    EXPECT_NO_THROW(is_dicom_folder(path(""))) << n;
    n_readable = std::numeric_limits<int>::max();
    EXPECT_LE(n_entries, std::min(n, all));
  }
  EXPECT_EQ(n_entries, all);
}

TEST(LaunchCode, OpensOnceWithinAMinute) {
  const auto now = LaunchCode::Clock::now();
  LaunchCode code, late;
  EXPECT_NE(code.text(), late.text());
  EXPECT_FALSE(code.opens("", now));
  EXPECT_FALSE(code.opens(late.text(), now));
  EXPECT_TRUE(code.opens(code.text(), now + 50s));
  EXPECT_FALSE(code.opens(code.text(), now + 51s));
  EXPECT_FALSE(late.opens(late.text(), now + 70s));
}

// Textures of graphics have 2048 voxels along an axis.
TEST(DisplayOfAVolume, IsCoarserAlongAnAxisThatIsLongerThanATexture) {
  for (const auto& [longest, factor] : {std::pair(2048, 1), {2049, 2}, {4096, 2}, {4097, 3}}) {
    const std::vector<float> values(std::size_t(longest) * 4);
    const surf::volume::Volume volume({2, longest, 2}, Eigen::Affine3d::Identity(), values);
    EXPECT_EQ(display_of(volume).coarser_by, (std::array{1, factor, 1})) << longest;
  }
}

// A click that lies in a slice lies in the volume, also in the last one.
TEST(VolumeFile, CoarserOnesHaveTheBoxOfTheVolume) {
  const std::array<int, 3> size = {7, 2, 3};
  std::vector<float> values;
  for (int k = 0; k < size[2]; ++k)
    for (int j = 0; j < size[1]; ++j)
      for (int i = 0; i < size[0]; ++i) values.push_back(float(2 * i + 50 * j + 20 * k));
  Eigen::Affine3d affine(Eigen::Translation3d(10, 20, 30));
  affine.scale(Eigen::Vector3d(-0.5, 0.75, 2));
  const surf::volume::Volume volume(size, affine, values);
  const std::string bytes = gunzip(volume_file(volume, {3, 1, 2}), 352 + 3 * 2 * 2);

  nifti_1_header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  EXPECT_EQ((std::array{header.dim[1], header.dim[2], header.dim[3]}),
            (std::array<short, 3>{3, 2, 2}));
  const auto place = [&](const Eigen::Vector3d& index) {
    const Eigen::Vector4d at = index.homogeneous();
    Eigen::Vector3d out(0, 0, 0);
    for (int column = 0; column < 4; ++column)
      out += at[column] *
             Eigen::Vector3d(header.srow_x[column], header.srow_y[column], header.srow_z[column]);
    return out;
  };
  constexpr double kTolerance = 1e-5;  // floats of some 10 mm
  EXPECT_LT((place({-0.5, -0.5, -0.5}) - affine * Eigen::Vector3d(-0.5, -0.5, -0.5)).norm(),
            kTolerance);
  EXPECT_LT((place({2.5, 1.5, 1.5}) - affine * Eigen::Vector3d(6.5, 1.5, 2.5)).norm(), kTolerance);
  EXPECT_NEAR(header.pixdim[1], 0.5 * 7 / 3, kTolerance);
  // 2, 3 and 2 voxels along the first axis, 1 and 2 along the last.
  const std::vector<int> means(bytes.begin() + 352, bytes.end());
  EXPECT_EQ(means, (std::vector{1, 6, 11, 51, 56, 61, 31, 36, 41, 81, 86, 91}));
}

}  // namespace
}  // namespace surfseg::studio
