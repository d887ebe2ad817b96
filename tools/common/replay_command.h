// The command replay of both programs.
#pragma once

#include <string>
#include <vector>

#include "tools/common/outputs.h"
#include "tools/common/replay.h"

namespace surfseg {

/// A recipe in, what it makes again out.
/// @tparam Base  the SegmentCommand that reads the image and writes shapes in it: SurfaceCommand,
///               CurveCommand
template <class Base>
class ReplayCommand : public Base {
 public:
  /// @param arguments, files  are kept
  ReplayCommand(const CLI::App& command, const ReplayArguments& arguments,
                const typename Base::Files& files)
      : Base(command, arguments, files), arguments_(arguments), files_(files) {}

 protected:
  using typename Base::Input;
  using typename Base::Objects;

  void check() const override {
    files_.check();
    check_range("--threads", arguments_.threads, 0, "0 (all) or more");
    std::vector<Output> outputs = files_.outputs();
    outputs.emplace_back("--json", arguments_.json);
    check_outputs(outputs, arguments_.path);
  }

  Input read() override {
    recipe_ = read_recipe(arguments_);
    const std::string path = image_file(arguments_, recipe_, files_.input(), Base::kInputOption);
    for (const std::string& output : {files_.output, files_.mask})
      check_outputs({{"-o, --mask", output}}, path);
    return {this->open(path), {}};
  }

  Objects segment(const Input& input) override {
    return replayed(arguments_, recipe_, files_.output, input.setting, this->on_step());
  }

  std::vector<std::string> idle_options() const override { return {}; }

 private:
  const ReplayArguments& arguments_;
  const typename Base::Files& files_;
  std::string recipe_;
};

}  // namespace surfseg
