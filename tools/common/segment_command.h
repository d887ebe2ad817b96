// What the segment commands of both programs do: read, segment, finish, write, tell.
#pragma once

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "libsurf/segment/finish_objects.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/checkpoint.h"
#include "tools/common/cli_app.h"
#include "tools/common/exit_codes.h"
#include "tools/common/objects.h"
#include "tools/common/progress.h"
#include "tools/common/run_arguments.h"
#include "tools/common/stage_clock.h"

namespace surfseg {

/// An object at the end of a segmentation.
template <int Dim>
struct SegmentedObject {
  surf::segment::Object<Dim> object;
  std::vector<surf::segment::Candidate<Dim>> candidates;
  /// The others are only what it must not overlap.
  bool is_wanted = true;
};

/// What a report tells of an object.
template <int Dim>
struct ReportedObject {
  const surf::segment::Object<Dim>* object;
  const surf::segment::Finished<Dim>* finished;  ///< null if there is no sound shape
  nlohmann::ordered_json entry;                  ///< of the summary
};

/// Seeds in a volume (Dim = 3) or an image (Dim = 2) in, verified shapes out.
template <int Dim>
class SegmentCommand {
 public:
  using Shape = surf::Simplices<Dim>;
  using Result = surf::segment::Result<Dim>;

  /// @param arguments  of the command; both are kept
  SegmentCommand(const CLI::App& command, const RunArguments& arguments);
  virtual ~SegmentCommand() = default;

  /// @throws surf::Error  as documented for the exit codes; what could be written was
  ExitCode run();

 protected:
  struct Input {
    std::shared_ptr<const surf::segment::Setting<Dim>> setting;
    std::vector<ObjectInput<Dim>> objects;
  };
  using Objects = std::vector<SegmentedObject<Dim>>;

  /// What can be found wrong before the work is done.
  virtual void check() const = 0;
  /// Reads the image. Notes go to progress().
  virtual Input read() = 0;
  /// Options that have no effect as they are combined.
  virtual std::vector<std::string> idle_options() const = 0;
  /// After every step, also of stages that have no shape yet.
  virtual void tell([[maybe_unused]] const std::string& stage,
                    [[maybe_unused]] const surf::flow::StepRecord& record) {}
  /// After every step of a shape.
  virtual void show([[maybe_unused]] const std::function<Shape()>& shape) {}
  /// A pattern with {object} if there are several.
  virtual std::string output() const = 0;
  virtual std::string image_path() const = 0;
  /// As it was typed; "" if none was.
  virtual std::string series_uid() const = 0;
  /// The key of the program's version in the summary.
  virtual const char* program() const = 0;
  /// Writes everything that was asked for of one object alone.
  virtual void write(const surf::segment::Object<Dim>& object,
                     const surf::segment::Finished<Dim>& finished) const = 0;
  /// Writes what shows all objects together, but for their labels.
  virtual void write_together(const Shape& all,
                              const std::vector<surf::segment::Click<Dim>>& clicks) const = 0;
  /// The file of a map of labels; empty if none was asked for.
  virtual std::string labels_path() const = 0;
  /// The grid of the map of labels: the image's own, as its file has it.
  virtual surf::ImageBox<Dim> image_box() const = 0;
  /// Writes the map of labels.
  virtual void write_labels(const std::vector<std::uint8_t>& labels,
                            const std::vector<surf::volume::LabelName>& names) const = 0;
  /// The file of a shape of an object, in the format that its name says.
  virtual void write_shape(const std::string& path, const surf::segment::Finished<Dim>& shape,
                           const surf::segment::Object<Dim>& object) const = 0;
  /// Adds further measures of a finished shape to its entry of the summary.
  /// @param label  its number among the objects, 0 if it is the only one
  virtual void measure([[maybe_unused]] const surf::segment::Object<Dim>& object,
                       [[maybe_unused]] const surf::segment::Finished<Dim>& finished,
                       [[maybe_unused]] int label, [[maybe_unused]] nlohmann::ordered_json& entry) {
  }
  /// Writes the report, if one was asked for.
  virtual void write_report(
      [[maybe_unused]] ExitCode exit_code,
      [[maybe_unused]] const std::vector<ReportedObject<Dim>>& objects) const {}
  /// "1656 triangles, 28.005 ml, ..."
  virtual std::string describe(const surf::segment::Measures<Dim>& measures) const = 0;

  /// From the input to objects, at least one of them wanted; a recipe is written if one was asked
  /// for.
  virtual Objects segment(const Input& input);

  const CLI::App& command() const { return command_; }
  ProgressLine& progress() { return progress_; }
  /// The file of --checkpoint; empty if there is none.
  const std::string& checkpoint_path() const { return checkpoint_.path(); }
  /// Shows every step, and stops after a signal.
  surf::segment::ProgressOf<Dim> on_step();

 private:
  using Finished = std::vector<surf::segment::FinishedObject<Dim>>;

  ExitCode run_one(const Input& input, const Objects& objects, const Finished& finished,
                   std::size_t n);
  ExitCode run_several(const Input& input, const Objects& objects, const Finished& finished);
  nlohmann::ordered_json write_candidates(const surf::segment::Setting<Dim>& setting,
                                          const SegmentedObject<Dim>& object);
  void write_labels_of(const Input& input, const Objects& objects, const Finished& finished);
  void note_result(const Result& result, const std::string& name);
  void note_profile(const Objects& objects);
  void note_walls(const Objects& objects, const Finished& finished, std::size_t n);
  nlohmann::ordered_json walls_to_json(const Objects& objects, const Finished& finished,
                                       std::size_t n) const;
  void summarise(ExitCode exit_code, const nlohmann::ordered_json& entries);

  const CLI::App& command_;
  const RunArguments& arguments_;
  ProgressLine progress_;
  StageClock clock_;
  Checkpoint checkpoint_;
  std::size_t max_kept_bytes_ = 0;
};

/// Of the files that --candidates may write or remove those that could be inputs, as a run before
/// left them: for check_outputs().
/// @param output  a pattern with {object} if there are several
std::vector<Output> candidate_outputs(const RunArguments& a, const std::string& output,
                                      const std::vector<Output>& inputs);

/// "evolve  step 12  J ...  tau ...  triangles ...  volume ... mm^3"
template <int Dim>
std::string step_line(const std::string& stage, const surf::flow::StepRecord& record,
                      double seconds);

/// A signal's code, else that of the outcome.
ExitCode exit_code_of(surf::segment::Outcome outcome);

/// "converged after 12 steps: ..."
template <int Dim>
std::string conclusion_of(const surf::segment::Result<Dim>& result);

}  // namespace surfseg
