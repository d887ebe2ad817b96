// Points and a volume from a host in, a surface and a label map for it out: `surfseg segment` with
// tags for its progress.
#pragma once

#include <CLI/App.hpp>
#include <string>
#include <vector>

#include "tools/slicer/cli/arguments.h"
#include "tools/slicer/cli/tags.h"
#include "tools/surfseg/surface_command.h"

namespace surfseg::slicer {

/// The options of `surfseg segment`, as its own parser takes them from words.
class SegmentOptions {
 public:
  /// @throws CLI::ParseError, surf::UsageError, surf::InputError
  explicit SegmentOptions(std::vector<std::string> words);

  const CLI::App& command() const { return command_; }
  const RunArguments& run() const { return run_; }

 private:
  RunArguments run_;
  CLI::App command_{"", "segment"};
};

class PointsCommand : public SurfaceCommand {
 public:
  /// @param options, files, tags  are kept
  PointsCommand(const SegmentOptions& options, const SurfaceFiles& files,
                const std::string& return_file, Tags& tags)
      : SurfaceCommand(options.command(), options.run(), files),
        options_(options),
        return_file_(return_file),
        tags_(tags) {}

 protected:
  void check() const override;
  Input read() override;
  std::vector<std::string> idle_options() const override { return {}; }
  void tell(const std::string& stage, const surf::flow::StepRecord& record) override;
  std::string output() const override;
  void write(const surf::segment::Object<3>& object,
             const surf::segment::Finished<3>& finished) const override;

 private:
  void give_back(const surf::segment::Result<3>& result,
                 const surf::segment::Measures<3>& measures) const;

  const SegmentOptions& options_;
  std::string return_file_;
  Tags& tags_;
};

}  // namespace surfseg::slicer
