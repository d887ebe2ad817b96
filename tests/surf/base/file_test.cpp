#include "libsurf/base/file.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <optional>
#include <thread>

#include "libsurf/base/error.h"
#include "tests/surf/not_root.h"

namespace surf {
namespace {

namespace fs = std::filesystem;

/// An empty folder of its own for each test.
struct Files : ::testing::Test {
  const fs::path folder =
      fs::temp_directory_path() / ("surf_base_" + std::to_string(::getpid()) + "_" +
                                   ::testing::UnitTest::GetInstance()->current_test_info()->name());
  Files() { fs::create_directories(folder); }
  ~Files() override { fs::remove_all(folder); }
  std::string path(const std::string& name) const { return (folder / name).string(); }
  auto n_files() const {
    return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
  }
};

/// Of the environment.
class ScopedVariable {
 public:
  ScopedVariable(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    ::setenv(name, value.c_str(), 1);
  }
  ~ScopedVariable() { before_ ? ::setenv(name_, before_->c_str(), 1) : ::unsetenv(name_); }
  ScopedVariable(const ScopedVariable&) = delete;
  ScopedVariable& operator=(const ScopedVariable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

void write_text(const std::string& path, const std::string& text) { std::ofstream(path) << text; }

std::string read_text(const std::string& path) {
  std::ifstream in(path);
  return {std::istreambuf_iterator<char>(in), {}};
}

TEST_F(Files, AreWrittenWholeBesideAndThenRenamed) {
  write_text(path("a.nii.gz"), "old");
  write_atomically(path("a.nii.gz"), [&](const std::string& temporary) {
    EXPECT_EQ(fs::path(temporary).parent_path(), folder);
    EXPECT_EQ(extension(temporary), ".nii.gz");
    EXPECT_NE(temporary, path("a.nii.gz"));
    write_text(temporary, "new");
    EXPECT_EQ(read_text(path("a.nii.gz")), "old");
  });
  EXPECT_EQ(read_text(path("a.nii.gz")), "new");
  EXPECT_EQ(n_files(), 1);
}

TEST_F(Files, AreWrittenWhereLinksLead) {
  fs::create_directory(path("disk"));
  fs::create_symlink("disk/real.stl", path("link.stl"));  // to nothing yet
  fs::create_symlink(path("link.stl"), path("second.stl"));
  write_bytes(path("second.stl"), "one");
  EXPECT_EQ(read_text(path("disk/real.stl")), "one");
  write_bytes(path("link.stl"), "two");
  EXPECT_EQ(read_text(path("disk/real.stl")), "two");
  EXPECT_TRUE(fs::is_symlink(path("link.stl")) && fs::is_symlink(path("second.stl")));
  EXPECT_EQ(n_files(), 3);
}

TEST_F(Files, GoIntoPipesWhichStayPipes) {
  ASSERT_EQ(::mkfifo(path("pipe.json").c_str(), 0600), 0);
  std::string read;
  std::thread reader([&] { read = read_text(path("pipe.json")); });
  write_bytes(path("pipe.json"), "all of it");
  reader.join();
  EXPECT_EQ(read, "all of it");
  EXPECT_TRUE(fs::is_fifo(path("pipe.json")));
  EXPECT_EQ(n_files(), 1);
}

TEST_F(Files, ThatNobodyReadsAnyMoreAreErrorsAndLeaveNothing) {
  ScopedVariable temporary("TMPDIR", folder.string());
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ::close(ends[0]);
  EXPECT_THROW(write_bytes("/dev/fd/" + std::to_string(ends[1]), "this"), OutputError);
  ::close(ends[1]);
  EXPECT_EQ(n_files(), 0);
}

TEST_F(Files, ForPipesNeedAFolderForTemporaryOnes) {
  ScopedVariable temporary("TMPDIR", path("none"));
  EXPECT_THROW(write_bytes("/dev/null", "this"), OutputError);
}

TEST_F(Files, GoIntoDevicesAndSayIfThoseAreFull) {
  EXPECT_THROW(write_bytes("/dev/full", "much"), OutputError);
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  write_bytes("/dev/null", "nothing");
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
}

TEST_F(Files, GoToWhatADescriptorHasOpenWithoutTakingItsPlace) {
  write_text(path("log"), "before ");
  const int descriptor = ::open(path("log").c_str(), O_WRONLY);
  ASSERT_GE(descriptor, 0);
  ASSERT_EQ(::write(descriptor, "before ", 7), 7);
  EXPECT_TRUE(is_stream("/dev/fd/" + std::to_string(descriptor)));
  EXPECT_FALSE(is_stream(path("log")));
  write_bytes("/dev/fd/" + std::to_string(descriptor), "this ");
  ASSERT_EQ(::write(descriptor, "after", 5), 5);
  ::close(descriptor);
  EXPECT_EQ(read_text(path("log")), "before this after");
}

TEST_F(Files, AreAsBeforeIfWritingThrows) {
  write_text(path("a.stl"), "old");
  const auto fail_halfway = [](const std::string& temporary) {
    write_text(temporary, "half");
    throw std::runtime_error("disk full");
  };
  EXPECT_THROW(write_atomically(path("a.stl"), fail_halfway), std::runtime_error);
  EXPECT_EQ(read_text(path("a.stl")), "old");
  EXPECT_EQ(n_files(), 1);
}

TEST_F(Files, KeepTheirPermissions) {
  for (const fs::perms mode : {fs::perms(0640), fs::perms(0666), fs::perms(0444)}) {
    if (::geteuid() != 0 && mode == fs::perms(0444)) continue;  // only root writes to it
    write_text(path("a.json"), "old");
    fs::permissions(path("a.json"), mode);
    write_bytes(path("a.json"), "new");
    EXPECT_EQ(read_text(path("a.json")), "new");
    EXPECT_EQ(fs::status(path("a.json")).permissions(), mode);
  }
}

TEST_F(Files, ThatAreWriteProtectedAreRefusedBeforeAnythingIsComputed) {
  write_text(path("a.stl"), "old");
  fs::permissions(path("a.stl"), fs::perms(0444));
  fs::permissions(folder, fs::perms::all);  // which would take another in its place
  bool is_called = false;
  {
    const test::NotRoot anybody;
    if (!anybody.may_enter(folder)) GTEST_SKIP() << "root cannot become anybody here";
    EXPECT_FALSE(may_be_written(path("a.stl")));
    EXPECT_TRUE(may_be_written(path("none.stl")));
    EXPECT_THROW(write_atomically(path("a.stl"), [&](const std::string&) { is_called = true; }),
                 OutputError);
  }
  EXPECT_FALSE(is_called);
  EXPECT_EQ(read_text(path("a.stl")), "old");
  EXPECT_EQ(n_files(), 1);
}

TEST_F(Files, InAMissingFolderAreRefusedBeforeAnythingIsComputed) {
  bool is_called = false;
  EXPECT_THROW(write_atomically(path("none/a.stl"), [&](const std::string&) { is_called = true; }),
               OutputError);
  EXPECT_FALSE(is_called);
}

TEST_F(Files, WithTheNameOfAFolderAreRefused) {
  fs::create_directory(path("sub"));
  EXPECT_THROW(write_atomically(path("sub"), [](const std::string&) {}), OutputError);
}

TEST_F(Files, ThatWereNeverWrittenAreReported) {
  EXPECT_THROW(write_atomically(path("a.stl"), [](const std::string&) {}), OutputError);
  EXPECT_EQ(n_files(), 0);
}

TEST_F(Files, OfAFolderAreListedByName) {
  for (const char* name : {"b", "a", "c"}) std::ofstream(path(name)) << name;
  fs::create_directory(path("sub"));
  fs::create_symlink(path("a"), path("link"));
  EXPECT_EQ(files_in(folder.string()),
            (std::vector{path("a"), path("b"), path("c"), path("link")}));
  EXPECT_THROW(files_in(path("missing")), InputError);
  EXPECT_THROW(files_in(path("a")), InputError);
}

TEST(Extension, IsTheLastOneInLowerCaseOrBothOfCompressedNifti) {
  EXPECT_EQ(extension("a.STL"), ".stl");
  EXPECT_EQ(extension("/tmp/x.y/scan.Nii.GZ"), ".nii.gz");
  EXPECT_EQ(extension("a.b.ply"), ".ply");
  EXPECT_EQ(extension("a.tar.gz"), ".gz");
  EXPECT_EQ(extension("/x.y/name"), "");
  EXPECT_EQ(extension(".nii.gz"), ".nii.gz");
  EXPECT_EQ(extension(""), "");
}

}  // namespace
}  // namespace surf
