// The command replay of both programs.
#pragma once

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <vector>

#include "tools/common/objects.h"
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
    check_files(this->files().input());
  }

  Input read() override {
    recipe_ = read_recipe(arguments_);
    check_dimension(arguments_, recipe_, Base::kDimension);
    const auto& files = this->files();
    const std::string path = image_file(arguments_, recipe_, files.input(), Base::kInputOption);
    check_files(path);
    const bool is_chosen = !files.series_uid().empty();
    return {this->open(path, is_chosen ? "" : image_series(arguments_, recipe_, files.input())),
            {}};
  }

  Objects segment(const Input& input) override {
    return replayed(
        arguments_, recipe_, this->output(), input.setting,
        [this](const std::vector<std::string>& names) {
          check_files(this->image_path(), names);
          this->files().check_reference(names);
        },
        this->on_step());
  }

  std::vector<std::string> idle_options() const override { return {}; }

 private:
  /// No output is another one's file, nor one that is read.
  /// @param names  of the objects that are written; none = they are not known yet
  void check_files(const std::string& image, const std::vector<std::string>& names = {}) const {
    std::vector<Output> outputs = this->files().outputs(), inputs = this->files().references();
    outputs.emplace_back("--json", arguments_.json);
    inputs.insert(inputs.end(), {{"RECIPE", arguments_.path}, {"the input", image}});
    check_outputs(object_outputs(outputs, names), object_outputs(inputs, names));
  }

  const ReplayArguments& arguments_;
  std::string recipe_;
};

}  // namespace surfseg
