// A dialogue about one volume (Dim = 3) or image (2), for Python.
#pragma once

#include <array>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <stop_token>
#include <string>
#include <vector>

#include "libsurf/segment/segmentation.h"
#include "tools/python/arrays.h"
#include "tools/python/curve.h"
#include "tools/python/surface.h"

namespace surfseg::python {

/// What is segmented in a dimension, and what is found.
template <int Dim>
struct Kind;
template <>
struct Kind<2> {
  using Image = surf::curve::Image;
  using Shape = Curve;
};
template <>
struct Kind<3> {
  using Image = surf::volume::Volume;
  using Shape = Surface;
};

/// A segment::Segmentation that several Python threads may call: they take turns. What computes
/// does so on a thread of its own, while the caller's, without the interpreter's lock, looks for
/// Ctrl-C and takes the lock to call progress: a step that takes long can be stopped too. What
/// progress asks of the segmentation itself is a UsageError.
template <int Dim>
class Segmentation {
 public:
  using Id = int;
  using Image = typename Kind<Dim>::Image;
  using Shape = typename Kind<Dim>::Shape;
  using Click = std::pair<std::array<double, Dim>, bool>;

  explicit Segmentation(Image image);

  Id add_object(const std::string& name);
  void remove_object(Id id);
  std::vector<std::pair<Id, std::string>> objects();
  void add_click(Id id, const std::vector<double>& point_mm, bool is_inside);
  void take_back_click(Id id, std::size_t index);
  /// [(point, is_inside), ...]
  std::vector<Click> clicks(Id id);
  /// @param words  as on the command line, see typed_options()
  void set_options(Id id, const std::vector<std::string>& words,
                   const std::optional<std::vector<std::vector<double>>>& box_mm,
                   bool is_along_world);
  /// A line of text for each, the best first.
  std::vector<std::string> propose(Id id, const py::object& progress);
  void choose(Id id, std::size_t proposal);
  /// @param n_steps  None = to its end
  /// @throws py::error_already_set  what progress raised, KeyboardInterrupt; the shape so far is
  ///                                that of the object then
  void evolve(Id id, std::optional<int> n_steps, const py::object& progress);
  bool undo(Id id);
  bool redo(Id id);
  std::string outcome(Id id);
  std::shared_ptr<Shape> shape(Id id);
  std::string recipe(const std::string& image_path);
  void replay(const std::string& recipe, const py::object& progress);

 private:
  using Told = surf::segment::ProgressOf<Dim>;

  template <class Work>
  auto alone(Work&& work);
  void compute(const py::object& progress,
               const std::function<void(const Told&, const std::stop_token&)>& work);

  Image image_;
  std::shared_ptr<const surf::segment::Setting<Dim>> setting_;
  surf::segment::Segmentation<Dim> segmentation_;
  std::timed_mutex mutex_;
};

void add_segmentation(py::module_& module);

}  // namespace surfseg::python
