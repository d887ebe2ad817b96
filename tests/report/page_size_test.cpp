#include <gtest/gtest.h>

#include <cstdlib>
#include <random>
#include <regex>

#include "libsurf/base/base64.h"
#include "libsurf/mesh/primitives.h"
#include "tools/report/report.h"
#include "tools/report/scene.h"
#include "tools/report/sections.h"

namespace surfseg::report {
namespace {

/// Noise, of which no picture is small.
surf::volume::Volume noise() {
  constexpr int kSize = 96;
  std::mt19937 random(5);
  std::vector<float> values(kSize * kSize * kSize);
  for (float& value : values) value = float(random() % 1000);
  Eigen::Affine3d affine = Eigen::Affine3d::Identity();
  affine.translation().setConstant(-kSize / 2.0);
  return {{kSize, kSize, kSize}, affine, values};
}

// Twenty surfaces with 400 000 triangles and as many clicks as they may have: what has no budget of
// its own, clicks and text, is made up for by a coarser view.
TEST(ReportPage, StaysBelowFiveMegabytesHoweverMuchThereIsToSay) {
  const surf::volume::Volume volume = noise();
  std::vector<surf::segment::Object<3>> objects(20);
  std::vector<surf::segment::Finished<3>> finished(objects.size());
  std::vector<ReportedObject<3>> reported;
  std::mt19937 random(7);
  for (std::size_t n = 0; n < objects.size(); ++n) {
    const surf::Vector<3> center(-30 + 3.0 * double(n), 0, 0);
    objects[n].name = "object " + std::to_string(n + 1);
    objects[n].result = std::make_shared<const surf::segment::Result<3>>();
    for (int k = 0; k < 1000; ++k)
      objects[n].clicks.push_back(
          {center + surf::Vector<3>(1e-6 * double(random() % 1'000'000), 0.1, 1.0 / (k + 3)),
           surf::segment::Side::kInside});
    finished[n].shape = surf::mesh::ball(center, 12, 0.5);
    reported.push_back({&objects[n], &finished[n], nlohmann::ordered_json::object()});
  }
  const std::string page = report::page({"surfseg segment", 0, volume, "0123", reported});
  EXPECT_LT(page.size(), 5'000'000u);
  std::smatch words;
  ASSERT_TRUE(std::regex_search(page, words,
                                std::regex("shows about ([0-9]+) triangles in place "
                                           "of ([0-9]+)")));
  EXPECT_GT(std::atol(words[2].str().c_str()), 200'000);
  EXPECT_LT(std::atol(words[1].str().c_str()), 60'000) << "it was too large at first";
}

// Of its share of so few triangles nothing would be left.
TEST(ReportPage, ShowsASmallObjectBesideALargeOne) {
  const surf::volume::Volume volume = noise();
  std::vector<surf::segment::Object<3>> objects(2);
  std::vector<surf::segment::Finished<3>> finished(2);
  finished[0].shape = surf::mesh::ball({0, 0, 0}, 30, 0.4);
  finished[1].shape = surf::mesh::ball({40, 40, 40}, 0.5, 0.5);
  ASSERT_GT(finished[0].shape.elements.rows(), 500 * finished[1].shape.elements.rows());
  std::vector<ReportedObject<3>> reported;
  for (std::size_t n = 0; n < objects.size(); ++n) {
    objects[n].result = std::make_shared<const surf::segment::Result<3>>();
    reported.push_back({&objects[n], &finished[n], nlohmann::ordered_json::object()});
  }
  const Scene seen = scene(reported, 500);
  ASSERT_EQ(seen.json.size(), 2u);
  EXPECT_EQ(
      seen.json[1]["triangles"].get<std::string>().size(),
      surf::base64(std::string(std::size_t(6 * finished[1].shape.elements.rows()), '0')).size());
}

TEST(ReportPage, NamesAFolderWhateverItsPathEndsIn) {
  for (const char* path : {"ct", "ct/", "scans/ct", "scans/ct/"}) EXPECT_EQ(file_name(path), "ct");
}

// Numbers of nothing are not 0: an object between the centres of voxels has no mean.
TEST(ReportPage, HasNoIntensitiesWithoutVoxels) {
  surf::segment::Object<3> object;
  object.result = std::make_shared<const surf::segment::Result<3>>();
  surf::segment::Finished<3> finished;
  ReportedObject<3> reported{&object, &finished, nlohmann::ordered_json::object()};
  surf::mesh::RegionIntensities intensities;
  intensities.shell = {.n_voxels = 7, .mean = 3};
  reported.entry["intensities"] = intensities_json(intensities);
  EXPECT_EQ(reported.entry["intensities"]["inside"].size(), 1u);
  const std::string page = number_sections(reported);
  EXPECT_NE(page.find("Inside: voxels</th><td>0<"), std::string::npos) << page;
  EXPECT_EQ(page.find("Inside: mean"), std::string::npos);
  EXPECT_NE(page.find("around: mean</th><td>3<"), std::string::npos);
}

}  // namespace
}  // namespace surfseg::report
