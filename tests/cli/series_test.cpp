// A DICOM folder of several series: every verb that reads volumes says what there is, and takes
// --series-uid.
#include "tests/cli/rows.h"
#include "tests/surf/volume/dicom_files.h"

namespace surfseg::test {
namespace {

void write_both(const std::string& folder) {
  surf::volume::Grid grid;
  grid.size = {8, 8, 8};
  grid.index_to_world = surf::volume::affine(Eigen::Matrix3d::Identity(), {-4, -4, -4});
  surf::volume::write_series(folder, grid, "1.2.3.4");
  surf::volume::write_series(folder, grid, "1.2.3.5");
}

class Series : public RowTest {
 protected:
  Series() {
    write_both(file("both"));
    must({"phantom", "ball", "--size", "8", "--spacing", "1", "-o", "ball.nii"});
  }
};

const std::vector<Row> kRows = {
    {"Info", {"info", "both"}, 0, ""},
    {"Segment",
     {"segment", "both", "--initial-ball", "0,0,0,2mm", "--energy", "area", "-q", "-o", "a.ply",
      "--volume", "keep"},
     0,
     ""},
    {"Render", {"render", "ball.ply", "--volume", "both", "-o", "a.png"}, 0, ""},
    {"Evaluate", {"evaluate", "ball.ply", "--reference", "both"}, 0, ""}};

TEST_P(Series, AreListedAndOneIsChosen) {
  must({"segment", "ball.nii", "--initial-ball", "0,0,0,2mm", "--energy", "area", "--volume",
        "keep", "-q", "-o", "ball.ply"});
  const Outcome which = run(GetParam().arguments);
  EXPECT_EQ(which.exit_code, 3);
  EXPECT_NE(which.err.find("holds 2 series; give a file of one, or its UID as --series-uid: "
                           "1.2.3.4 (CT phantom, 8 files); 1.2.3.5"),
            std::string::npos)
      << which.err;
  must(joined(GetParam().arguments, {"--series-uid", "1.2.3.5"}));
}
INSTANTIATE_TEST_SUITE_P(All, Series, ::testing::ValuesIn(kRows), name_of);

/// With a recipe of one of the two series in the folder both.
class SeriesRecipe : public FileTest {
 protected:
  SeriesRecipe() {
    write_both(file("both"));
    must({"segment", "both", "--series-uid", "1.2.3.5", "--initial-ball", "0,0,0,2mm", "--energy",
          "area", "--volume", "keep", "-q", "-o", "a.ply", "--recipe", "a.json"});
  }
};

// The recipe knows which one it was; another folder need not have it.
TEST_F(SeriesRecipe, SaysWhichSeriesItWas) {
  must({"replay", "a.json", "-q", "-o", "again.ply"});
  EXPECT_EQ(bytes("again.ply"), bytes("a.ply"));
  must({"replay", "a.json", "--series-uid", "1.2.3.5", "-q", "-o", "again.ply"});
  must({"replay", "a.json", "--volume", "both", "-q", "-o", "there.ply"});
  EXPECT_EQ(bytes("there.ply"), bytes("a.ply"));
  std::filesystem::create_directories(file("one"));
  for (const std::string& name : files())
    if (name.ends_with("-4.dcm")) std::filesystem::copy(name, file("one"));  // the same values
  must({"replay", "a.json", "--volume", "one", "-q", "-o", "one.ply"});
  EXPECT_EQ(bytes("one.ply"), bytes("a.ply"));
  EXPECT_EQ(
      run({"replay", "a.json", "--volume", "both", "--series-uid", "7.8.9", "-q", "-o", "none.ply"})
          .exit_code,
      3);
}

TEST_F(SeriesRecipe, IsOneOfItsFolderInABatchToo) {
  put("list.tsv",
      "name\tscan\trecipe\tseries-uid\nown\tboth\ta.json\t\ntyped\tboth\ta.json\t1.2.3.4\n"
      "none\tboth\ta.json\t7.8.9\n");
  const Outcome outcome = run({"batch", "list.tsv", "-o", "out"});
  for (const char* done : {"own: done", "typed: done"})
    EXPECT_NE(outcome.err.find(done), std::string::npos) << outcome.err;
  EXPECT_NE(outcome.err.find("none: failed (3): both: no series 7.8.9 in it"), std::string::npos)
      << outcome.err;
}

/// What is read with a scan or a reference is not written over, whatever its name.
class SeriesOutputs : public FileTest {
 protected:
  SeriesOutputs() {
    write_both(file("ct"));
    for (const std::string& name : files())
      if (name.ends_with("-5.dcm")) std::filesystem::remove(name);
  }
  static Words segment(const std::string& scan, const Words& more) {
    return joined({"segment", scan, "--initial-ball", "0,0,0,2mm", "--energy", "area", "--volume",
                   "keep", "-q", "-o", "a.ply"},
                  more);
  }
  void expect_kept(const Words& command, const std::string& name, const std::string& piece) const {
    const std::string before = bytes(name);
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 2) << outcome.err;
    EXPECT_NE(outcome.err.find(name + ": is a part of " + piece), std::string::npos) << outcome.err;
    EXPECT_EQ(bytes(name), before);
  }
};

TEST_F(SeriesOutputs, AreNoSlices) {
  const std::string one = "ct/i03-4.dcm", other = "ct/i10-4.dcm";  // of the slices 0 and 1
  ASSERT_TRUE(exists(one) && exists(other));
  for (const std::string& scan : {std::string("ct"), other})
    for (const char* option : {"--json", "--recipe"})
      expect_kept(segment(scan, {option, one}), one, "the input; give another file name");
  must(segment("ct", {"--recipe", "r.json"}));
  expect_kept({"replay", "r.json", "-q", "-o", "b.ply", "--json", one}, one, "the input");
}

// What runs have left beside the slices is written anew.
TEST_F(SeriesOutputs, MayBeBesideTheSlices) {
  surf::volume::write_segmentation(file("ct/a.seg.dcm"), {"", {8, 8, 8}, {}}, "1.2.3.9");
  for (int n = 0; n < 2; ++n) {
    must(segment("ct", {"--json", "ct/s.json", "--recipe", "ct/r.json"}));
    must({"replay", "ct/r.json", "-q", "-o", "ct/a.ply"});
  }
  must(segment("ct", {"--json", "ct/a.seg.dcm"}));
}

TEST_F(SeriesOutputs, AreNoVoxelsOfAHeader) {
  put("v.mhd",
      "ObjectType = Image\nNDims = 3\nDimSize = 8 8 8\nElementType = MET_UCHAR\n"
      "ElementDataFile = v.raw\n");
  put("v.raw", std::string(512, '\1'));
  expect_kept(segment("v.mhd", {"--json", "v.raw"}), "v.raw", "the input");
  expect_kept(segment("ct", {"--reference", "v.mhd", "--json", "v.raw"}), "v.raw", "--reference");
}

}  // namespace
}  // namespace surfseg::test
