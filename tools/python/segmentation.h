// A dialogue about one volume, for Python.
#pragma once

#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/segment/segmentation.h"
#include "tools/python/arrays.h"
#include "tools/python/surface.h"

namespace surfseg::python {

/// A segment::Segmentation<3> that several Python threads may call: they take turns. What computes
/// does so without the interpreter's lock; progress takes it again.
class Segmentation {
 public:
  using Id = int;

  explicit Segmentation(surf::volume::Volume volume);

  Id add_object(const std::string& name);
  void remove_object(Id id);
  std::vector<std::pair<Id, std::string>> objects();
  void add_click(Id id, const std::vector<double>& point_ras_mm, bool is_inside);
  void take_back_click(Id id, std::size_t index);
  /// [(point, is_inside), ...]
  std::vector<std::pair<std::array<double, 3>, bool>> clicks(Id id);
  /// @param words  as on the command line, see typed_options()
  void set_options(Id id, const std::vector<std::string>& words,
                   const std::optional<std::vector<std::vector<double>>>& box_ras_mm);
  /// A line of text for each, the best first.
  std::vector<std::string> propose(Id id, const py::object& progress);
  void choose(Id id, std::size_t proposal);
  /// @throws py::error_already_set  what progress raised, KeyboardInterrupt; the shape so far is
  ///                                that of the object then
  void evolve(Id id, const py::object& progress);
  bool undo(Id id);
  bool redo(Id id);
  std::string outcome(Id id);
  std::shared_ptr<Surface> surface(Id id);
  std::string recipe(const std::string& image_path);
  void replay(const std::string& recipe, const py::object& progress);

 private:
  template <class Work>
  auto alone(Work&& work);
  surf::segment::ProgressOf<3> progress_of(const py::object& progress, std::exception_ptr& raised);

  surf::volume::Volume volume_;
  std::shared_ptr<const surf::segment::Setting<3>> setting_;
  surf::segment::Segmentation<3> segmentation_;
  std::mutex mutex_;
};

void add_segmentation(py::module_& module);

}  // namespace surfseg::python
