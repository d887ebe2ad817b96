// surfseg batch: what a list becomes, and what becomes of it when something is wrong.
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/file.h>
#include <unistd.h>

#include <chrono>
#include <thread>

#include "tests/cli/program.h"
#include "tests/cli/rows.h"

namespace surfseg::test {
namespace {

std::string anat(const std::string& name, const std::string& ending) {
  return fmt::format("out/sub-{0}/anat/sub-{0}_desc-surfseg_{1}", name, ending);
}

class Batch : public FileTest {
 protected:
  void make(const std::string& name, const Words& more = {}) const {
    must(joined({"phantom", "ball", "--size", "24", "--spacing", "1", "-o", name}, more));
  }
  /// a, b and c in balls with different noise; the rows of `more` come after them.
  void make_list(const std::string& more = "") const {
    for (const char* seed : {"1", "2", "3"})
      make(std::string(seed) + ".nii.gz", {"--noise", "0.02", "--random-seed", seed});
    put("list.tsv",
        "name\tscan\tclicks\tedge-length\n"
        "a\t1.nii.gz\t0,0,0\t\n"
        "b\t2.nii.gz\t0,0,0; !9,9,9\t2mm\n"
        "c\t3.nii.gz\t1,0,0\t\n" +
            more);
  }
  Outcome batch(const Words& more = {}) const {
    return run(joined({"batch", "list.tsv", "-o", "out"}, more));
  }
  /// Everything under a folder by its name.
  std::map<std::string, std::string> contents(const std::string& folder) const {
    std::map<std::string, std::string> out;
    for (const std::string& name : files())
      if (name.starts_with(file(folder) + "/") && !std::filesystem::is_directory(name))
        out[name.substr(file(folder).size())] = read(name);
    return out;
  }
  static bool has(const Outcome& outcome, const std::string& words) {
    return outcome.err.find(words) != std::string::npos;
  }
};

TEST_F(Batch, GivesTheBytesOfSegmentForAnyNumberOfJobs) {
  make_list();
  const Outcome one = batch();
  EXPECT_EQ(one.exit_code, 0) << one.err;
  EXPECT_TRUE(has(one, "3 done; verdicts: ")) << one.err;
  EXPECT_TRUE(has(one, "; 0 outliers: out/group.html")) << one.err;
  must({"batch", "list.tsv", "-o", "two", "--jobs", "2", "-q"});
  EXPECT_EQ(contents("out"), contents("two"));
  must({"segment", "2.nii.gz", "--seed", "0,0,0", "--outside", "9,9,9", "--edge-length", "2mm",
        "-o", "s.stl", "--mask", "m.nii.gz", "--picture", "p.png", "--thumbnail", "t.png", "-q"});
  EXPECT_EQ(bytes("s.stl"), bytes(anat("b", "surface.stl")));
  EXPECT_EQ(bytes("m.nii.gz"), bytes(anat("b", "mask.nii.gz")));
  const std::string figure = "out/sub-b/figures/sub-b_desc-surfseg_";
  EXPECT_EQ(bytes("p.png"), bytes(figure + "slices.png"));
  EXPECT_EQ(bytes("t.png"), bytes(figure + "thumbnail.png"));
  must({"replay", anat("b", "recipe.json"), "-o", "again.stl", "-q"});
  EXPECT_EQ(bytes("again.stl"), bytes("s.stl"));
  EXPECT_EQ(json("out/dataset_description.json")["DatasetType"], "derivative");
}

TEST_F(Batch, QuietSaysWhatHasFailedAlone) {
  make_list("d\tnowhere.nii.gz\t 0, 0 ,0 ;\t\n");
  const Outcome outcome = batch({"-q"});
  EXPECT_EQ(outcome.exit_code, 7);
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 2) << outcome.err;
  EXPECT_TRUE(has(outcome, "d: failed (3): nowhere.nii.gz")) << outcome.err;
}

TEST_F(Batch, OneFailureStopsNoOtherAndComesFirst) {
  make_list("d\tnowhere.nii.gz\t0,0,0\t\ne\t1.nii.gz\t500,0,0\t\nf\t1.nii.gz\t0,0,1\t\n");
  const Outcome outcome = batch();
  EXPECT_EQ(outcome.exit_code, 7);
  EXPECT_TRUE(has(outcome, "[4/6] d: failed (3): nowhere.nii.gz")) << outcome.err;
  EXPECT_TRUE(has(outcome, "[5/6] e: failed (2): --seed")) << outcome.err;
  EXPECT_TRUE(has(outcome, "2 of 6 cases failed")) << outcome.err;
  EXPECT_TRUE(exists(anat("f", "surface.stl")));
  EXPECT_FALSE(exists(anat("d", "surface.stl")));
  EXPECT_EQ(json(anat("d", "surfseg.json"))["exit_code"], 3);
  const std::string table = bytes("out/group.tsv"), page = bytes("out/group.html");
  EXPECT_LT(table.find("\nd\t"), table.find("\na\t"));
  EXPECT_LT(table.find("\ne\t"), table.find("\na\t"));
  EXPECT_LT(page.find("<li>d: failed: nowhere.nii.gz"), page.find("<li>a: done"));
  EXPECT_LT(page.find(R"("name":"e")"), page.find(R"("name":"a")"));
  const Outcome again = batch();  // they are tried again
  EXPECT_EQ(again.exit_code, 7);
  EXPECT_TRUE(has(again, "[1/6] a: is done already")) << again.err;
  EXPECT_TRUE(has(again, "[4/6] d: failed")) << again.err;
}

TEST_F(Batch, RunsAgainWhatChangedAlone) {
  make_list();
  batch();
  const std::string before = bytes(anat("c", "surfseg.json"));
  make("1.nii.gz", {"--noise", "0.02", "--random-seed", "9"});
  put("list.tsv",
      "name\tscan\tclicks\tedge-length\na\t1.nii.gz\t0,0,0\t\nb\t2.nii.gz\t0,0,0\t2mm\n"
      "c\t3.nii.gz\t1,0,0\t\n");
  const Outcome outcome = batch();
  EXPECT_TRUE(has(outcome, "a: done")) << outcome.err;
  EXPECT_TRUE(has(outcome, "b: done")) << outcome.err;
  EXPECT_TRUE(has(outcome, "c: is done already")) << outcome.err;
  EXPECT_EQ(bytes(anat("c", "surfseg.json")), before);
  std::filesystem::remove(file(anat("c", "mask.nii.gz")));
  EXPECT_TRUE(has(batch(), "c: done"));
  // What fails now leaves nothing of what it was.
  put("3.nii.gz", "no volume");
  EXPECT_TRUE(has(batch(), "c: failed (3)"));
  EXPECT_FALSE(exists(anat("c", "surface.stl")));
}

// A header may name any file for its voxels, and either half of a pair may be the scan.
TEST_F(Batch, RunsAgainWhereVoxelsBesideAHeaderChanged) {
  constexpr std::size_t kHeader = 348, kOffset = 108, kMagic = 344, kDescription = 148;
  const auto voxels = [&](const std::string& seed) {
    make("v.nii", {"--noise", "0.02", "--random-seed", seed});
    return bytes("v.nii").substr(kHeader + 4);
  };
  const auto put_voxels = [&](const std::string& data) {
    for (const char* name : {"a.img.gz", "b.raw.gz", "other.raw"}) put(name, data);
  };
  put_voxels(voxels("1"));
  std::string header = bytes("v.nii").substr(0, kHeader);
  header.replace(kOffset, 4, 4, '\0').replace(kMagic, 4, "ni1", 4);
  put("a.hdr", header);
  put("h.hdr", header);
  put("h.img.gz", bytes("a.img.gz"));
  put("b.nhdr",
      "NRRD0004\ntype: float\ndimension: 3\nspace: RAS\nsizes: 24 24 24\nspace directions: (1,0,0) "
      "(0,1,0) (0,0,1)\nspace origin: (-11.5,-11.5,-11.5)\nendian: little\nencoding: raw\n"
      "data file: b.raw.gz\n");
  put("c.mhd",
      "NDims = 3\nDimSize = 24 24 24\nElementType = MET_FLOAT\nElementSpacing = 1 1 1\n"
      "Offset = -11.5 -11.5 -11.5\nElementDataFile = other.raw\n");
  put("list.tsv",
      "name\tscan\tclicks\na\ta.hdr\t0,0,0\nh\th.img.gz\t0,0,0\nb\tb.nhdr\t0,0,0\n"
      "c\tc.mhd\t0,0,0\n");
  EXPECT_EQ(batch().exit_code, 0);
  const Outcome same = batch();
  for (const char* name : {"a", "h", "b", "c"})
    EXPECT_TRUE(has(same, std::string(name) + ": is done already")) << same.err;
  put_voxels(voxels("2"));
  put("h.hdr", header.replace(kDescription, 4, "anew"));
  const Outcome again = batch();
  for (const char* name : {"a", "h", "b", "c"})
    EXPECT_TRUE(has(again, std::string(name) + ": done")) << again.err;
}

// On a share that is away for a moment.
TEST_F(Batch, AScanThatIsNotThereLeavesWhatWasMadeOfIt) {
  make_list();
  batch();
  const auto before = contents("out");
  std::filesystem::rename(file("3.nii.gz"), file("away.nii.gz"));
  const Outcome outcome = batch();
  EXPECT_EQ(outcome.exit_code, 7);
  EXPECT_TRUE(has(outcome, "c: failed (3): 3.nii.gz: cannot be read: No such file")) << outcome.err;
  EXPECT_EQ(contents("out"), before);
  std::filesystem::rename(file("away.nii.gz"), file("3.nii.gz"));
  const Outcome again = batch();
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(has(again, "c: is done already")) << again.err;
}

TEST_F(Batch, WhatARowSaidBeforeItWasChangedIsNotCollected) {
  make_list();
  batch();
  put("list.tsv", "name\tscan\tclicks\na\t2.nii.gz\t0,0,0\nc\t3.nii.gz\t1,0,0\n");
  batch({"--collect", "--space", "ijk"});  // which the list does not state
  const std::string table = bytes("out/group.tsv");
  EXPECT_NE(table.find("\nc\tn/a\tdone"), std::string::npos) << table;
  EXPECT_NE(table.find("a\tn/a\tnot run"), std::string::npos) << table;
  EXPECT_NE(table.find("its row has changed since it was run"), std::string::npos) << table;
}

TEST_F(Batch, TwoRunsOnOneFolderDoNotDisturbEachOther) {
  make_list();
  Outcome first, second;
  {
    const std::jthread one([&] { first = batch(); });
    const std::jthread two([&] { second = batch(); });
  }
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_EQ(second.exit_code, 0) << second.err;
  must({"batch", "list.tsv", "-o", "once", "-q"});
  EXPECT_EQ(contents("out"), contents("once"));
}

TEST_F(Batch, RemovesWhatKilledRunsHaveLeftAndNoOthers) {
  make_list();
  const auto made = [&](const std::string& name) {
    std::filesystem::create_directories(file("out/" + name + "/anat"));
    std::filesystem::last_write_time(
        file("out/" + name),
        std::filesystem::file_time_type::clock::now() - std::chrono::minutes(5));
  };
  made(".sub-a.partial-left12");
  made(".sub-b.partial");
  made(".sub-c.partial-used34");
  const int used = ::open(file("out/.sub-c.partial-used34").c_str(), O_RDONLY);
  ASSERT_EQ(::flock(used, LOCK_EX), 0);
  std::filesystem::create_directories(file("out/.sub-a.partial-new567"));
  batch();
  EXPECT_FALSE(exists("out/.sub-a.partial-left12"));
  EXPECT_FALSE(exists("out/.sub-b.partial"));
  EXPECT_TRUE(exists("out/.sub-c.partial-used34"));
  EXPECT_TRUE(exists("out/.sub-a.partial-new567"));
  ::close(used);
}

TEST_F(Batch, ALabelThatIsNotInTheReferenceIsNoDice) {
  must({"phantom", "ball", "--size", "24", "--spacing", "1", "-o", "1.nii.gz"});
  must({"segment", "1.nii.gz", "--seed", "0,0,0", "-o", "s.stl", "--mask", "m.nii.gz", "-q"});
  put("list.tsv",
      "name\tscan\tclicks\treference\treference-label\n"
      "a\t1.nii.gz\t0,0,0\tm.nii.gz\t9\nb\t1.nii.gz\t0,0,0\tm.nii.gz\t1\n"
      "two\t1.nii.gz\tright: 0,0,0; wrong: -11,-11,-11\tm.nii.gz\t\n");
  EXPECT_EQ(batch().exit_code, 7);
  EXPECT_TRUE(json(anat("a", "surfseg.json"))["dice"].is_null());
  EXPECT_GT(json(anat("b", "surfseg.json"))["dice"], 0.99);
  // One of several objects that are not all there.
  const auto objects = json(anat("two", "surfseg.json"))["objects"];
  EXPECT_GT(objects[0]["dice"], 0.99);
  EXPECT_TRUE(objects[1]["dice"].is_null());
}

TEST_F(Batch, AMeshIsAReferenceAndWhatIsNoneStopsNoCase) {
  make("1.nii.gz");
  must({"segment", "1.nii.gz", "--seed", "0,0,0", "-o", "m.stl", "-q"});
  put("no.nii.gz", "no label map");
  put("list.tsv",
      "name\tscan\tclicks\treference\na\t1.nii.gz\t0,0,0\tm.stl\nb\t1.nii.gz\t0,0,0\tno.nii.gz\n");
  const Outcome outcome = batch();
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_GT(json(anat("a", "surfseg.json"))["dice"], 0.99);
  const auto summary = json(anat("b", "surfseg.json"));
  EXPECT_TRUE(summary["dice"].is_null());
  EXPECT_TRUE(summary["reference"].contains("not_compared"));
}

TEST_F(Batch, ShardsTogetherDoAllAndCollectShowsThem) {
  make_list();
  const Outcome first = batch({"--shard", "1/2"});
  EXPECT_TRUE(has(first, "2 done, 1 not run")) << first.err;
  EXPECT_TRUE(exists(anat("a", "surface.stl")));
  EXPECT_FALSE(exists(anat("b", "surface.stl")));
  batch({"--shard", "2/2"});
  EXPECT_TRUE(exists(anat("b", "surface.stl")));
  const std::string table = bytes("out/group.tsv");
  std::filesystem::remove(file("out/group.tsv"));
  const Outcome all = batch({"--collect"});
  EXPECT_EQ(all.exit_code, 0);
  EXPECT_EQ(bytes("out/group.tsv"), table);
  EXPECT_EQ(table.find("not run"), std::string::npos);
  EXPECT_EQ(batch({"--shard", "7/8"}).exit_code, 0) << "a part without a case";
  const Outcome of_many = batch({"--shard", "2/20000"});
  EXPECT_EQ(of_many.exit_code, 0) << of_many.err;
  EXPECT_TRUE(has(of_many, "[1/1] b: is done already")) << of_many.err;
  EXPECT_EQ(batch({"--shard", "10000/20000"}).exit_code, 0);
  EXPECT_EQ(batch({"--shard", "3/2"}).exit_code, 2);
  EXPECT_EQ(batch({"--shard", "0/2"}).exit_code, 2);
  EXPECT_EQ(batch({"--jobs", "0"}).exit_code, 2);
}

TEST_F(Batch, LeavesADataSetOfOthersAsItIs) {
  make_list();
  std::filesystem::create_directory(file("out"));
  const std::string theirs = R"({"Name": "scans", "BIDSVersion": "1.8.0"})";
  put("out/dataset_description.json", theirs);
  const Outcome outcome = batch();
  EXPECT_EQ(outcome.exit_code, 4) << outcome.err;
  EXPECT_TRUE(has(outcome, "not of surfseg")) << outcome.err;
  EXPECT_EQ(bytes("out/dataset_description.json"), theirs);
}

TEST_F(Batch, ASummaryThatIsNoneIsDamaged) {
  make_list();
  batch();
  put(anat("a", "surfseg.json"), "[]");
  const Outcome outcome = batch({"--collect"});
  EXPECT_NE(outcome.exit_code, 1) << outcome.err;
  EXPECT_TRUE(exists("out/group.tsv"));
  EXPECT_EQ(batch().exit_code, 0);
  EXPECT_EQ(json(anat("a", "surfseg.json"))["exit_code"], 0);
}

// Landmarks of Slicer state their space; a ball beside them would be read in it, too.
TEST_F(Batch, RefusesTwoSpacesInARow) {
  make_list();
  put("a.fcsv",
      "# Markups fiducial file version = 4.11\n# CoordinateSystem = RAS\n"
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
      "1,0,0,0,0,0,0,1,1,1,0,a,,\n");
  put("list.tsv",
      "name\tscan\tclicks\tspace\tinitial-ball\tenergy\n"
      "a\t1.nii.gz\ta.fcsv\tlps\t0,0,0,5mm\tchan-vese\n");
  const Outcome outcome = batch();
  EXPECT_EQ(outcome.exit_code, 7) << outcome.err;
  EXPECT_TRUE(has(outcome, "a: failed (2): clicks: a.fcsv: states its space")) << outcome.err;
}

TEST_F(Batch, InterruptLeavesWholeCasesAndTheNextRunGoesOn) {
  make_list();
  const Outcome outcome =
      interrupted_run({"batch", "list.tsv", "-o", "out"}, SIGINT, "[1/3] a: done");
  EXPECT_EQ(outcome.exit_code, 130) << outcome.err;
  EXPECT_TRUE(exists(anat("a", "surfseg.json")));
  EXPECT_FALSE(exists("out/sub-c"));
  for (const std::string& name : files())
    EXPECT_EQ(name.find("partial"), std::string::npos) << name;
  const Outcome next = batch();
  EXPECT_EQ(next.exit_code, 0);
  EXPECT_TRUE(has(next, "a: is done already")) << next.err;
  EXPECT_TRUE(has(next, "c: done")) << next.err;
  must({"batch", "list.tsv", "-o", "once", "-q"});
  EXPECT_EQ(contents("out"), contents("once"));
}

TEST_F(Batch, TakesObjectsLandmarksRecipesAndReferences) {
  must({"phantom", "separate-balls", "--size", "40", "--spacing", "1", "-o", "v.nii.gz"});
  must({"segment", "v.nii.gz", "--seed", "10,0,0", "-o", "s.stl", "--recipe", "r.json", "--mask",
        "m.nii.gz", "-q"});
  std::filesystem::create_directories(file("lists"));
  put("lists/p.txt", "# SPACE=LPS\n-10 0 0\n");
  put("lists/list.tsv",
      "# two balls\n\nscan\tclicks\trecipe\treference\tspace\tkeep\tfill-cavities\tname\r\n"
      "../v.nii.gz\tleft: -10,0,0; right: 10,0,0; !0,0,0\t\t\t\t\t\tsub-two\r\n"
      "../v.nii.gz\tp.txt\t\t../m.nii.gz\tijk\tlargest\tyes\tpoints\r\n"
      "../v.nii.gz\tn/a\t../r.json\t../m.nii.gz\t\t\t\tagain\r\n");
  const Outcome outcome = run({"batch", "lists/list.tsv", "-o", "out"});
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_TRUE(exists(anat("two", "dseg.nii.gz")));
  EXPECT_EQ(bytes(anat("two", "dseg.tsv")), "index\tname\n1\tleft\n2\tright\n");
  EXPECT_TRUE(exists("out/sub-two/anat/sub-two_label-left_desc-surfseg_surface.stl"));
  EXPECT_EQ(json(anat("two", "surfseg.json"))["objects"].size(), 2u);
  EXPECT_EQ(bytes(anat("again", "surface.stl")), bytes("s.stl"));
  for (const char* name : {"points", "again"})
    EXPECT_GT(json(anat(name, "surfseg.json"))["dice"], 0.99) << name;
}

// As a dialogue leaves it: objects are named once they are there, and often more than once.
TEST_F(Batch, ObjectsOfARecipeHaveTheirLastNames) {
  must({"phantom", "separate-balls", "--size", "40", "--spacing", "1", "-o", "v.nii.gz"});
  must({"segment", "v.nii.gz", "--object", "one", "--seed", "-10,0,0", "--object", "two", "--seed",
        "10,0,0", "-o", "{object}.stl", "--recipe", "r.json", "--mask", "m.nii.gz", "-q"});
  nlohmann::json recipe = json("r.json");
  recipe["objects"][0]["name"] = "object 1";
  for (const char* name : {"left kidney", "liver"})
    recipe["objects"][0]["history"].push_back({{"do", "rename"}, {"name", name}});
  recipe["objects"][1]["history"].push_back({{"do", "rename"}, {"name", "spleen"}});
  put("r.json", recipe.dump());
  recipe["objects"][1]["history"].push_back({{"do", "rename"}, {"name", "left kidney"}});
  put("unfit.json", recipe.dump());
  put("list.tsv",
      "name\tscan\trecipe\treference\treference-label\na\tv.nii.gz\tr.json\tm.nii.gz\t\n"
      "b\tv.nii.gz\tunfit.json\tm.nii.gz\t\nc\tv.nii.gz\tr.json\tm.nii.gz\t2\n");
  const Outcome outcome = batch();
  EXPECT_TRUE(has(outcome, "a: done")) << outcome.err;
  EXPECT_EQ(bytes(anat("a", "dseg.tsv")), "index\tname\n1\tliver\n2\tspleen\n");
  EXPECT_TRUE(exists("out/sub-a/anat/sub-a_label-liver_desc-surfseg_surface.stl"));
  for (const auto& object : json(anat("a", "surfseg.json"))["objects"])
    EXPECT_GT(object["dice"], 0.99) << object["name"];
  EXPECT_TRUE(has(outcome, "b: failed (3): unfit.json: object 'left kidney': expected a name"))
      << outcome.err;
  EXPECT_TRUE(has(outcome, "c: failed (2): reference-label: several objects have the labels 1, 2"))
      << outcome.err;
}

// Which frame it was a recipe does not say.
TEST_F(Batch, AFrameIsChosenForARecipeToo) {
  make("v.nii");
  std::string scan = bytes("v.nii");
  constexpr std::size_t kHeader = 352, kDimensions = 40, kFrames = 48;
  scan[kDimensions] = 4;
  scan[kFrames] = 2;
  scan.insert(kHeader, std::string(scan.size() - kHeader, '\0'));
  put("frames.nii", scan);
  must({"segment", "frames.nii", "--frame-index", "1", "--seed", "0,0,0", "-o", "s.stl", "--recipe",
        "r.json", "-q"});
  put("list.tsv",
      "name\tscan\trecipe\tframe-index\na\tframes.nii\tr.json\t1\nb\tframes.nii\tr.json\t\n");
  const Outcome outcome = batch();
  EXPECT_TRUE(has(outcome, "a: done")) << outcome.err;
  EXPECT_EQ(bytes(anat("a", "surface.stl")), bytes("s.stl"));
  EXPECT_TRUE(has(outcome, "b: failed (3): r.json: recipe: belongs to another image"))
      << outcome.err;
}

// Five balls alike and a box.
TEST_F(Batch, OutliersComeBeforeTheOthers) {
  make("ball.nii.gz");
  must({"phantom", "box", "--size", "24", "--spacing", "1", "-o", "box.nii.gz"});
  std::string list = "name\tscan\tclicks\n";
  for (const char* name : {"a", "b", "c", "d", "e"})
    list += fmt::format("{}\tball.nii.gz\t0,0,0\n", name);
  put("list.tsv", list + "odd\tbox.nii.gz\t0,0,0\n");
  const Outcome outcome = batch();
  EXPECT_TRUE(has(outcome, "; 1 outlier: ")) << outcome.err;
  const std::string table = bytes("out/group.tsv");
  EXPECT_EQ(table.substr(table.find('\n') + 1, 4), "odd\t");
  EXPECT_NE(table.find("volume_ml,area_cm2"), std::string::npos) << table;
  EXPECT_EQ(json("out/group.json")["z_volume_ml"]["Description"],
            "Robust z among objects of the same name: (x - median) / max(MAD / 0.6745, distance of "
            "the quartiles / 1.349); where MAD is 0, (x - median) / (1.2533 mean |x - median|)");
}

// Five noisy balls and four noisy boxes: neither are outliers of the other.
TEST_F(Batch, OfTwoKindsNeitherAreOutliers) {
  std::string list = "name\tscan\tclicks\n";
  for (int n = 0; n < 9; ++n) {
    const std::string scan = fmt::format("v{}.nii.gz", n);
    must({"phantom", n < 5 ? "ball" : "box", "--size", "24", "--spacing", "1", "--noise", "0.05",
          "--random-seed", std::to_string(n), "-o", scan});
    list += fmt::format("v{}\t{}\t0,0,0\n", n, scan);
  }
  put("list.tsv", list);
  const Outcome outcome = batch();
  EXPECT_TRUE(has(outcome, "; 0 outliers: ")) << outcome.err;
}

class BatchList : public FileTest,
                  public ::testing::WithParamInterface<std::pair<std::string, std::string>> {};

TEST_P(BatchList, WhatIsWrongIsOneLineBeforeAnythingRuns) {
  const auto& [list, words] = GetParam();
  put("list.tsv", list);
  const Outcome outcome = run({"batch", "list.tsv", "-o", "out"});
  EXPECT_EQ(outcome.exit_code, 3) << outcome.err;
  EXPECT_NE(outcome.err.find(words), std::string::npos) << outcome.err;
  EXPECT_TRUE(outcome.err.starts_with("surfseg: error: list.tsv")) << outcome.err;
  EXPECT_EQ(std::count(outcome.err.begin(), outcome.err.end(), '\n'), 1) << outcome.err;
  EXPECT_EQ(outcome.out, "");
  EXPECT_FALSE(exists("out"));
}

INSTANTIATE_TEST_SUITE_P(
    Errors, BatchList,
    ::testing::Values(
        std::pair{"", "is empty"}, std::pair{"name\tscan\n", "has no rows"},
        std::pair{"name\tclicks\na\t0,0,0\n", "no column 'scan'"},
        std::pair{"name\tscan\tedge-lenght\na\tv\t2mm\n", "did you mean 'edge-length'"},
        std::pair{"name\tscan\toutput\na\tv\ts.stl\n", "'output' is not a column"},
        std::pair{"name\tscan\tscan\na\tv\tv\n", "'scan' is there twice"},
        std::pair{"name\tscan\na\tv\t0,0,0\n", "list.tsv:2: has 3 cells"},
        std::pair{"name\tscan\tclicks\na\tv\t0,0,0\n\n../up\tv\t0,0,0\n", "list.tsv:4: name:"},
        std::pair{"name\tscan\tclicks\na\tv\t0,0,0\nA\tv\t0,0,0\n",
                  "list.tsv:3: name: 'A' is there"},
        std::pair{"name\tscan\tclicks\na\t\t0,0,0\n", "list.tsv:2: scan: a volume is missing"},
        std::pair{"name\tscan\tclicks\na\tv\t\n", "list.tsv:2: --seed"},
        std::pair{"name\tscan\tclicks\na\tv\t!1,2,3\n", "list.tsv:2: --seed"},
        std::pair{"name\tscan\tclicks\na\tv\t0,0\n", "list.tsv:2: --seed: expected three"},
        std::pair{"name\tscan\tclicks\na\tv\t1,2,3; 1,,2\n", "list.tsv:2: --seed: expected three"},
        std::pair{"name\tscan\tclicks\na\tv\t1 4,20,37\n", "three numbers X,Y,Z; got '1 4,20,37'"},
        std::pair{"name\tscan\tclicks\na\tv\t! 1, 2,3 4; 5,6,7\n", "got '1,2,3 4'"},
        std::pair{"name\tscan\tclicks\tbox\na\tv\t1,2,3\t0,0,0,9,9,9 9\n", "list.tsv:2: --box"},
        std::pair{"name\tscan\tclicks\na\tv\tleft lung: 1,2,3;b b!: 1,2,3\n", "list.tsv:2: clicks"},
        std::pair{"name\tscan\tclicks\tpreset\na\tv\t1,2,3\tno-such\n", "list.tsv:2: "},
        std::pair{"name\tscan\tclicks\tpreset\na\tv\t1,2,3\tlist\n", "list.tsv:2: preset=list"},
        std::pair{"name\tscan\tclicks\tedge-length\na\tv\t1,2,3\t2\n", "list.tsv:2: --edge-length"},
        std::pair{"name\tscan\tclicks\tmax-iterations\na\tv\t1,2,3\tmany\n", "max-iterations"},
        std::pair{"name\tscan\tclicks\tfill-cavities\na\tv\t1,2,3\tperhaps\n",
                  "expected yes or no"},
        std::pair{"name\tscan\tclicks\tspace\na\tv\t1,2,3\tmni\n", "list.tsv:2: --space"},
        std::pair{"name\tscan\tclicks\trecipe\na\tv\t1,2,3\tr.json\n", "the recipe says it"},
        std::pair{"name\tscan\trecipe\tframe-index\na\tv\tr.json\tone\n",
                  "list.tsv:2: Could not convert: --frame-index"},
        std::pair{"name\tscan\tclicks\tframe-index\na\tv\t1,2,3\t0\nb\tv\t1,2,3\t-1\n",
                  "list.tsv:3: --frame-index: expected 0 or more; got -1"},
        std::pair{"name\tscan\trecipe\tframe-index\na\tv\tr.json\t-1\n",
                  "list.tsv:2: --frame-index: expected 0 or more"},
        std::pair{"name\tscan\tclicks\treference-label\na\tv\t1,2,3\t1.5\n", "expected a label"},
        std::pair{"name\tscan\tclicks\treference-label\na\tv\tl: 1,2,3; r: 4,5,6\t2\n",
                  "list.tsv:2: reference-label: several objects have the labels 1, 2"},
        std::pair{"name\tscan\tclicks\treference\na\tv\tl: 1,2,3; r: 4,5,6\t{object}.nii\n",
                  "list.tsv:2: reference: {object}.nii: one file tells of all objects"},
        std::pair{"name\tscan\tclicks\toutside\na\tv\tl: 1,2,3; r: 4,5,6\t7,8,9\n",
                  "list.tsv:2: outside: of which of the objects?"},
        std::pair{"name\tscan\tclicks\tbox\na\tv\t1,2,3\t1,2,3\n", "list.tsv:2: --box"}));

// Stopped at a limit there is a result; where no object was found there is none.
TEST_F(Batch, TellsWhatEachCaseEndedWith) {
  make("ball.nii.gz");
  put("list.tsv",
      "name\tscan\tclicks\tmax-iterations\nlimit\tball.nii.gz\t0,0,0\t1\n"
      "none\tball.nii.gz\t-11,-11,-11\t\n");
  const Outcome outcome = batch();
  EXPECT_EQ(outcome.exit_code, 7);
  EXPECT_TRUE(has(outcome, "limit: stopped at a limit")) << outcome.err;
  EXPECT_TRUE(has(outcome, "none: failed (8): no object")) << outcome.err;
  EXPECT_EQ(json(anat("limit", "surfseg.json"))["exit_code"], 5);
  EXPECT_TRUE(exists(anat("limit", "surface.stl")));
  EXPECT_EQ(json(anat("none", "surfseg.json"))["exit_code"], 8);
  EXPECT_FALSE(exists(anat("none", "surface.stl")));
  put("list.tsv", "name\tscan\tclicks\tmax-iterations\nlimit\tball.nii.gz\t0,0,0\t1\n");
  const Outcome again = batch();
  EXPECT_EQ(again.exit_code, 0) << again.err;
  EXPECT_TRUE(has(again, "limit: is done already")) << again.err;
}

// Names and messages are data: they end no script, and nothing is fetched.
TEST_F(Batch, ThePageStandsAlone) {
  put("list.tsv", "name\tscan\tclicks\na\t</script><b>.nii\t0,0,0\n");
  EXPECT_EQ(batch({"-q"}).exit_code, 7);
  const std::string page = bytes("out/group.html");
  EXPECT_EQ(page.find("</script><b>"), std::string::npos);
  EXPECT_NE(page.find("&lt;/script&gt;&lt;b&gt;.nii"), std::string::npos);
  EXPECT_NE(page.find("default-src 'none'"), std::string::npos);
  EXPECT_EQ(page.find("https:"), std::string::npos);
  EXPECT_EQ(page.find("src=\"http"), std::string::npos);
}

TEST_F(Batch, AListThatIsNotThereIsAnInputError) {
  const Outcome outcome = batch();
  EXPECT_EQ(outcome.exit_code, 3);
  EXPECT_TRUE(has(outcome, "list.tsv: cannot be read")) << outcome.err;
}

}  // namespace
}  // namespace surfseg::test
