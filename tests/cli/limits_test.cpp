// What the system allows a process, and names that are no text.
#include <sys/resource.h>

#include <cstdlib>

#include "tests/cli/program.h"

namespace surfseg::test {
namespace {

#ifdef SURFSEG_SANITIZED
constexpr bool kIsSanitized = true;
#else
constexpr bool kIsSanitized = false;
#endif

class Limits : public Program {};

TEST_F(Limits, AFileThatMayNotGrowIsAnErrorOfWriting) {
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_FSIZE, &before), 0);
  rlimit small = before;
  small.rlim_cur = 20000;  // bytes
  ASSERT_EQ(::setrlimit(RLIMIT_FSIZE, &small), 0);
  const Outcome outcome = run({"segment", "v.nii", "--seed", "0,0,0", "-o", "s.stl"});
  ::setrlimit(RLIMIT_FSIZE, &before);
  EXPECT_EQ(outcome.exit_code, 4) << outcome.err;
  EXPECT_NE(outcome.err.find("s.stl: cannot be written: File too large"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(files().size(), 1u);  // the volume, nothing temporary
}

TEST_F(Limits, AFullDiskIsAnErrorOfWritingWhateverIsWrittenToIt) {
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  const Outcome summary =
      run({"segment", "v.nii", "--seed", "0,0,0", "-o", "s.stl", "--json", "/dev/full"});
  EXPECT_EQ(summary.exit_code, 4) << summary.err;
  EXPECT_TRUE(std::filesystem::is_character_file("/dev/full")) << "a file has taken its place";
  for (const char* arguments : {"info v.nii", "--help", "--version", "segment --energy list"}) {
    const std::string command = std::string("cd '") + path("files") +
                                "' && '" SURFSEG_PROGRAM "' " + arguments + " > /dev/full 2> told";
    const int status = std::system(command.c_str());
    EXPECT_TRUE(WIFEXITED(status));
    EXPECT_EQ(WEXITSTATUS(status), 4) << arguments;
    EXPECT_EQ(bytes("told"),
              "surfseg: error: standard output cannot be written: No space left on device\n");
  }
}

// A log on a full disk, a terminal that is closed.
TEST_F(Limits, StandardErrorThatCannotBeWrittenEndsNoWork) {
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  must({"segment", "v.nii", "--seed", "0,0,0", "-o", "told.stl"});
  const auto code = [&](const std::string& words) {
    const int status =
        std::system(("cd '" + path("files") + "' && '" SURFSEG_PROGRAM "' " + words).c_str());
    EXPECT_TRUE(WIFEXITED(status)) << words;
    return WEXITSTATUS(status);
  };
  for (const char* away : {"2> /dev/full", "2>&-", "2>&- >&- <&-"}) {
    const std::string to = away;
    EXPECT_EQ(code("info nowhere.nii " + to), 3) << to;
    EXPECT_EQ(code("segment v.nii --seed 0,0,0 -o s.stl " + to), 0) << to;
    EXPECT_EQ(bytes("s.stl"), bytes("told.stl")) << to;
  }
  // A pipe whose reader has gone.
  std::filesystem::remove(file("s.stl"));
  EXPECT_EQ(code("segment v.nii --seed 0,0,0 -o s.stl -v 2>&1 >&- | true; test -s s.stl"), 0);
  EXPECT_EQ(bytes("s.stl"), bytes("told.stl"));
}

TEST_F(Limits, AnOutputIsWrittenOnceWhateverLinksLeadToIt) {
  must({"phantom", "ball", "--size", "24", "--spacing", "1", "-o", "v.nii"});
  std::filesystem::create_symlink("s.stl", file("link.stl"));  // to what is not there yet
  const Outcome outcome =
      run({"segment", "v.nii", "--seed", "0,0,0", "-o", "s.stl", "--json", "link.stl"});
  EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
  EXPECT_FALSE(exists("s.stl"));
}

TEST_F(Limits, TheLongestNameIsWrittenAndALongerOneRefusedBeforeTheWork) {
  must({"phantom", "ball", "--size", "24", "--spacing", "1", "-o", "v.nii"});
  const std::string longest = std::string(251, 'x') + ".stl";
  must({"segment", "v.nii", "--seed", "0,0,0", "-o", longest});
  EXPECT_TRUE(exists(longest));
  const Outcome outcome = run({"segment", "v.nii", "--seed", "0,0,0", "-o", "x" + longest});
  EXPECT_EQ(outcome.exit_code, 4);
  EXPECT_NE(outcome.err.find("the name has 256 bytes; the disk takes 255"), std::string::npos)
      << outcome.err;
  EXPECT_EQ(outcome.err.find("propose"), std::string::npos) << outcome.err;
}

// What the program prints itself comes behind the summary, not over it.
TEST_F(Limits, ASummaryGoesToTheStandardOutputWhateverThatIs) {
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  must({"segment", "v.nii", "--seed", "0,0,0", "-o", "s.stl", "--mask", "m.nii"});
  for (const char* to : {"/dev/stdout", "/dev/fd/1"}) {
    const Outcome outcome = run({"evaluate", "s.stl", "--reference", "m.nii", "--json", to});
    ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
    const std::size_t end = outcome.out.find("\n}\n");
    ASSERT_NE(end, std::string::npos) << outcome.out;
    EXPECT_TRUE(nlohmann::json::parse(outcome.out.substr(0, end + 2)).contains("dice"));
    EXPECT_TRUE(outcome.out.substr(end + 3).starts_with("Dice")) << outcome.out;
  }
}

TEST_F(Limits, ANameThatIsNotUtf8IsToldInJsonAllTheSame) {
  const std::string name = "ball-\xff.nii";
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", name});
  must({"segment", name, "--seed", "0,0,0", "-o", "s.stl", "--json", "s.json", "--recipe",
        "r.json"});
  EXPECT_EQ(json("s.json")["exit_code"], 0);
  EXPECT_FALSE(json("r.json")["objects"].empty());
  must({"info", name, "--json"});
}

// A click in the air near a volume's border once asked for wider and wider blurs.
TEST_F(Limits, AClickBesideAnObjectEndsWithAnEnergyToo) {
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  const Outcome outcome = run({"segment", "v.nii", "--seed=-14,0,0", "--energy", "area:weight=1",
                               "--radius", "2mm", "--max-iterations", "1", "-o", "s.stl"});
  EXPECT_EQ(outcome.exit_code, 8) << outcome.err;  // a ball of 2 mm that area alone shrinks
}

// OpenVDB's libraries start threads before main() does, and end the process where they cannot.
TEST_F(Limits, FewAddressesAreToldInOneLine) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer takes addresses of its own";
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  rlimit before{};
  ASSERT_EQ(::getrlimit(RLIMIT_AS, &before), 0);
  int n_told = 0;
  for (rlim_t n_kilobytes = 190'000; n_told < 4; n_kilobytes += 10'000) {
    ASSERT_LT(n_kilobytes, 600'000u) << "it never ran out of addresses";
    rlimit small = before;
    small.rlim_cur = n_kilobytes << 10;
    ASSERT_EQ(::setrlimit(RLIMIT_AS, &small), 0);
    const Outcome outcome = run({"segment", "v.nii", "--seed", "0,0,0", "-q", "-o", "s.stl"});
    ::setrlimit(RLIMIT_AS, &before);
    // Too few for the libraries: the loader's own words, before there is a program.
    if (outcome.exit_code == 127) continue;
    ++n_told;
    EXPECT_EQ(outcome.exit_code, 3) << n_kilobytes << ": " << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("surfseg: error: ")) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
}

TEST_F(Limits, MemoryThatIsAllowedIsKeptOrToldInOneLine) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer takes addresses of its own";
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  const std::vector<std::string> words = {"segment", "v.nii", "--seed", "0,0,0", "-q", "-o"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), words.begin(), words.end());
    return run(more);
  };
  EXPECT_EQ(with({"a.stl"}).exit_code, 0);
  const Outcome limited = with({"b.stl", "--memory", "1GB"});
  EXPECT_EQ(limited.exit_code, 0) << limited.err;
  EXPECT_EQ(bytes("a.stl"), bytes("b.stl"));
  EXPECT_EQ(with({"c.stl", "--memory", "12"}).exit_code, 2);
  EXPECT_EQ(with({"c.stl", "--memory", "100MB"}).exit_code, 2);

  // 800^3 bytes that are not on the disk.
  std::string header = bytes("v.nii").substr(0, 352);
  const auto put = [&](std::size_t at, std::int16_t value) {
    header.replace(at, 2, reinterpret_cast<const char*>(&value), 2);
  };
  for (const std::size_t axis : {1, 2, 3}) put(40 + 2 * axis, 800);
  put(70, 2);  // unsigned bytes
  put(72, 8);
  std::ofstream(file("large.nii"), std::ios::binary) << header;
  std::filesystem::resize_file(file("large.nii"), 352 + 800 * 800 * 800);
  const Outcome large =
      run({"segment", "large.nii", "--seed", "0,0,0", "-o", "c.stl", "--memory", "300MB"});
  EXPECT_EQ(large.exit_code, 3) << large.err;
  EXPECT_NE(large.err.find("need 0.5 GiB at least, 0.3 GiB are allowed"), std::string::npos)
      << large.err;
}

// Libraries that end the process or ask again without end where they get no memory.
TEST_F(Limits, MemoryThatRunsOutIsToldInOneLineWhereverItDoes) {
  if (kIsSanitized) GTEST_SKIP() << "the sanitizer takes addresses of its own";
  must({"phantom", "ball", "--size", "96", "--noise", "0.1", "-o", "v.nii"});
  int n_told = 0;
  for (int n_megabytes = 210; n_megabytes <= 690; n_megabytes += 60) {
    const Outcome outcome = run({"segment", "v.nii", "--seed", "0,0,0", "-q", "-o", "s.stl",
                                 "--memory", std::to_string(n_megabytes) + "MB"});
    if (outcome.exit_code == 0) continue;
    ++n_told;
    EXPECT_EQ(outcome.exit_code, 3) << n_megabytes << ": " << outcome.err;
    EXPECT_TRUE(outcome.err.starts_with("surfseg: error: ")) << outcome.err;
    EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  }
  EXPECT_GT(n_told, 1);
}

TEST_F(Limits, EdgesThatWouldMakeMillionsOfTrianglesAreRefusedAtOnce) {
  must({"phantom", "ball", "--size", "32", "--spacing", "1", "-o", "v.nii"});
  for (const std::vector<std::string>& start :
       {std::vector<std::string>{}, {"--energy", "area", "--radius", "5mm"}}) {
    std::vector<std::string> words = {"segment",       "v.nii",  "--seed", "0,0,0",
                                      "--edge-length", "0.01mm", "-o",     "s.stl"};
    words.insert(words.end(), start.begin(), start.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_NE(outcome.err.find("--edge-length: edges of 0.01 mm"), std::string::npos)
        << outcome.err;
    EXPECT_NE(outcome.err.find("mm or more"), std::string::npos) << outcome.err;
  }
}

}  // namespace
}  // namespace surfseg::test
