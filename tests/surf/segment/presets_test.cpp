#include "libsurf/segment/presets.h"

#include <gtest/gtest.h>

#include <cstdlib>

#include "libsurf/base/error.h"
#include "tests/surf/io/scratch_folder.h"
#include "tests/surf/message_of.h"

namespace surf::segment {
namespace {

class Presets : public test::ScratchFolder {
 protected:
  Presets() {
    std::filesystem::create_directories(path("first"));
    std::filesystem::create_directories(path("second"));
  }
  ~Presets() override { ::unsetenv("SURFSEG_PRESETS"); }

  void use(const std::string& folders) const {
    ::setenv("SURFSEG_PRESETS", folders.c_str(), /*overwrite=*/1);
  }
};

std::string message_of(const std::string& name) {
  return test::message_of<UsageError>([&] { find_preset(name); });
}

TEST_F(Presets, AreThoseThatTheProjectShipsEachWithWhatItIsFor) {
  ::unsetenv("SURFSEG_PRESETS");
  const auto all = presets();
  ASSERT_GE(all.size(), 6u);
  for (const Preset& preset : all) EXPECT_GT(preset.description.size(), 10u) << preset.name;
  EXPECT_EQ(find_preset("kidney-ct").name, "kidney-ct");
}

TEST_F(Presets, AreLookedForInTheFirstFolderFirst) {
  write("first/mine.json", R"({"description": "Of the first"})");
  write("second/mine.json", R"({"description": "Of the second"})");
  write("second/other.json", R"({"radius": "3mm"})");
  write("second/notes.txt", "no preset");
  use(path("first") + ":" + path("nowhere") + "::" + path("second"));
  EXPECT_EQ(preset_folders().front(), path("first"));
  EXPECT_EQ(find_preset("mine").description, "Of the first");
  EXPECT_EQ(find_preset("other").path, path("second/other.json"));
  EXPECT_EQ(find_preset("other").description, "");
  EXPECT_EQ(find_preset("kidney-ct").name, "kidney-ct");  // and then in the project's own
  std::string before;
  for (const Preset& preset : presets()) {
    EXPECT_LT(before, preset.name);
    before = preset.name;
  }
}

TEST_F(Presets, UnknownNameEndsInWhatItMayHaveBeen) {
  EXPECT_NE(message_of("kidny-ct").find("did you mean 'kidney-ct'?"), std::string::npos);
  const std::string message = message_of("femur");
  EXPECT_EQ(message.find("did you mean"), std::string::npos);
  EXPECT_NE(message.find("there are bladder-ct, brain-t1,"), std::string::npos) << message;
}

TEST_F(Presets, BrokenFileIsNamed) {
  for (const char* content : {"{\"radius\": ", "[1, 2]"}) {
    write("first/broken.json", content);
    use(path("first"));
    EXPECT_THROW(presets(), InputError) << content;
  }
}

}  // namespace
}  // namespace surf::segment
