// The command replay of both programs.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "libsurf/segment/recipe.h"
#include "tools/common/outputs.h"
#include "tools/common/replay.h"
#include "tools/common/verb.h"

namespace surfseg {

/// What the help of the command says.
/// @param examples  a line each
/// @param image  what the program calls it
inline VerbText replay_text(std::string_view examples, std::string_view image) {
  return {"replay", "Repeat what a recipe says, to the byte",
          fmt::format("Examples:\n{}The {}'s content has to be the same: a hash of it is in the "
                      "recipe.\nExit codes: those of segment; 3 if the recipe is broken, newer or "
                      "of another {}.",
                      examples, image, image)};
}

/// A recipe in, what it makes again out.
/// @tparam Base  the SegmentCommand that reads the image and writes shapes in it: SurfaceCommand,
///               CurveCommand
template <class Base>
class ReplayCommand : public Base {
 public:
  /// @param typed  ReplayArguments and Base::Files; they are kept
  template <class Arguments>
  ReplayCommand(const CLI::App& command, const Arguments& typed)
      : Base(command, typed, typed), arguments_(typed) {}

 protected:
  using typename Base::Input;
  using typename Base::Objects;

  void check() const override {
    this->files().check();
    check_range("--threads", arguments_.threads, 0, "0 (all) or more");
    std::vector<Output> outputs = this->files().outputs();
    outputs.emplace_back("--json", arguments_.json);
    check_outputs(outputs, {{"RECIPE", arguments_.path}});
  }

  Input read() override {
    recipe_ = read_recipe(arguments_);
    check_dimension(arguments_, recipe_, Base::kDimension);
    const auto& files = this->files();
    const std::string path = image_file(arguments_, recipe_, files.input(), Base::kInputOption);
    for (const std::string& output : {files.output, files.mask})
      check_outputs({{"-o, --mask", output}}, {{"the input", path}});
    const bool is_named = !files.input().empty();
    return {this->open(path, is_named ? "" : surf::segment::series_of_recipe(recipe_)), {}};
  }

  Objects segment(const Input& input) override {
    return replayed(arguments_, recipe_, this->output(), input.setting, this->on_step());
  }

  std::vector<std::string> idle_options() const override { return {}; }

 private:
  const ReplayArguments& arguments_;
  std::string recipe_;
};

}  // namespace surfseg
