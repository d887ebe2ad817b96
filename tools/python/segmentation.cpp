#include "tools/python/segmentation.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include <CLI/App.hpp>
#include <algorithm>
#include <chrono>
#include <map>

#include "libcurve/segment/segment.h"
#include "libsurf/base/error.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "tools/common/preset_arguments.h"
#include "tools/common/run_arguments.h"
#include "tools/common/typed_options.h"
#include "tools/python/watched_work.h"

namespace surfseg::python {
namespace {

std::shared_ptr<const surf::segment::Setting<2>> setting_of(const surf::curve::Image& image) {
  return surf::curve::make_setting(image);
}
std::shared_ptr<const surf::segment::Setting<3>> setting_of(const surf::volume::Volume& volume) {
  return surf::segment::make_setting(volume);
}

/// What typed_options() takes, without dashes, and whether it is a flag.
template <int Dim>
std::map<std::string, bool> options() {
  const RunWords& of_image = Dim == 3 ? kVolumeWords : kImageWords;
  RunArguments arguments;
  CLI::App command;
  command.set_help_flag();
  add_start_options(command, arguments, of_image);
  add_run_options(command, arguments, of_image);
  add_preset_option(command, arguments.preset, "");
  std::map<std::string, bool> out;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames())
      out[name] = option->get_expected_max() == 0;
  return out;
}

/// "" where the image is no series of DICOM.
std::string series_uid_of(const surf::curve::Image&) { return {}; }
std::string series_uid_of(const surf::volume::Volume& volume) {
  return volume.dicom() ? volume.dicom()->series_uid : "";
}

template <int Dim>
bool ends_with_consequence(const std::vector<surf::segment::Action<Dim>>& history) {
  return !history.empty() && surf::segment::is_consequence<Dim>(history.back());
}

/// Those that this thread waits for, calling progress.
thread_local std::vector<const void*> waited_for;

class Waiting {
 public:
  explicit Waiting(const void* segmentation) { waited_for.push_back(segmentation); }
  ~Waiting() { waited_for.pop_back(); }
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
};

/// A progress function would wait for ever.
void check_is_not_waited_for(const void* segmentation) {
  if (std::find(waited_for.begin(), waited_for.end(), segmentation) != waited_for.end())
    throw surf::UsageError(
        "progress: the segmentation is at work; ask it for something when the call that progress "
        "belongs to has ended");
}

}  // namespace

template <int Dim>
Segmentation<Dim>::Segmentation(Image image)
    : image_(std::move(image)), setting_(setting_of(image_)), segmentation_(setting_) {}

/// One thread at a time, none of them with the interpreter's lock while it waits or works.
template <int Dim>
template <class Work>
auto Segmentation<Dim>::alone(Work&& work) {
  check_is_not_waited_for(this);
  py::gil_scoped_release released;
  std::lock_guard lock(mutex_);
  return work();
}

/// The same for work that takes its time, with the turn waited for on the thread that works.
template <int Dim>
void Segmentation<Dim>::compute(
    const py::object& progress,
    const std::function<void(const Told&, const std::stop_token&)>& work) {
  check_is_not_waited_for(this);
  const Waiting waiting(this);
  do_watched(progress, [&](const Watch& watch, const std::stop_token& stop) {
    constexpr std::chrono::milliseconds kLook(20);
    std::unique_lock lock(mutex_, std::defer_lock);
    while (!lock.try_lock_for(kLook))
      if (stop.stop_requested()) return;
    work([&watch](const std::string& stage, const surf::flow::StepRecord& record,
                  const std::function<surf::Simplices<Dim>()>&) { return watch(stage, record); },
         stop);
  });
}

template <int Dim>
int Segmentation<Dim>::add_object(const std::string& name) {
  return alone([&] { return segmentation_.add_object(name); });
}

template <int Dim>
void Segmentation<Dim>::remove_object(Id id) {
  alone([&] { segmentation_.remove_object(id); });
}

template <int Dim>
std::vector<std::pair<int, std::string>> Segmentation<Dim>::objects() {
  return alone([&] {
    std::vector<std::pair<Id, std::string>> out;
    for (const Id id : segmentation_.objects()) out.emplace_back(id, segmentation_.object(id).name);
    return out;
  });
}

template <int Dim>
void Segmentation<Dim>::add_click(Id id, const std::vector<double>& point_mm, bool is_inside) {
  using surf::segment::Side;
  const auto point = point_of<Dim>(point_mm, is_inside ? "seeds" : "outside");
  alone([&] { segmentation_.add_click(id, {point, is_inside ? Side::kInside : Side::kOutside}); });
}

template <int Dim>
void Segmentation<Dim>::take_back_click(Id id, std::size_t index) {
  alone([&] { segmentation_.take_back_click(id, index); });
}

template <int Dim>
std::vector<typename Segmentation<Dim>::Click> Segmentation<Dim>::clicks(Id id) {
  return alone([&] {
    std::vector<Click> out;
    for (const auto& click : segmentation_.object(id).clicks) {
      std::array<double, Dim> point;
      std::copy_n(click.point_mm.data(), Dim, point.begin());
      out.push_back({point, click.side == surf::segment::Side::kInside});
    }
    return out;
  });
}

template <int Dim>
void Segmentation<Dim>::set_options(Id id, const std::vector<std::string>& words,
                                    const std::optional<std::vector<std::vector<double>>>& box_mm,
                                    bool is_along_world) {
  auto options = typed_options<Dim>(words, setting_->extent().cell_mm());
  if (box_mm) {
    if (box_mm->size() != 2) throw surf::UsageError("box: expected two opposite corners");
    options.box_mm = {point_of<Dim>((*box_mm)[0], "box"), point_of<Dim>((*box_mm)[1], "box")};
    if (is_along_world)
      options.box_mm =
          surf::segment::holding_box_along_world<Dim>(setting_->extent(), *options.box_mm);
  }
  alone([&] { segmentation_.set_options(id, options); });
}

template <int Dim>
std::vector<std::string> Segmentation<Dim>::propose(Id id, const py::object& progress) {
  std::vector<std::string> out;
  compute(progress, [&](const Told& told, const std::stop_token& stop) {
    for (const auto& proposal : segmentation_.propose(id, told, stop).proposals)
      out.push_back(to_string(proposal));
  });
  return out;
}

template <int Dim>
void Segmentation<Dim>::choose(Id id, std::size_t proposal) {
  alone([&] { segmentation_.choose(id, proposal); });
}

template <int Dim>
void Segmentation<Dim>::evolve(Id id, std::optional<int> n_steps, const py::object& progress) {
  if (n_steps && *n_steps < 1)
    throw surf::UsageError(fmt::format("steps: expected 1 or more; got {}", *n_steps));
  compute(progress, [&](const Told& told, const std::stop_token& stop) {
    n_steps ? segmentation_.step(id, *n_steps, told, stop) : segmentation_.evolve(id, told, stop);
  });
}

template <int Dim>
bool Segmentation<Dim>::undo(Id id) {
  return alone([&] {
    int n_undone = 0;
    for (; ends_with_consequence<Dim>(segmentation_.history(id)); ++n_undone)
      segmentation_.undo(id);
    try {
      return segmentation_.undo(id) || n_undone > 0;
    } catch (const surf::UsageError&) {  // its former name is another's: all stays as it was
      while (n_undone-- > 0) segmentation_.redo(id);
      throw;
    }
  });
}

template <int Dim>
bool Segmentation<Dim>::redo(Id id) {
  return alone([&] {
    if (!segmentation_.redo(id)) return false;
    const auto goes_on = [&] {
      try {
        return segmentation_.redo(id);
      } catch (const surf::UsageError&) {  // a name that is another's: an act of its own
        return false;
      }
    };
    while (goes_on())
      if (!ends_with_consequence<Dim>(segmentation_.history(id))) {
        segmentation_.undo(id);
        break;
      }
    return true;
  });
}

template <int Dim>
std::string Segmentation<Dim>::outcome(Id id) {
  return alone([&] { return to_string(segmentation_.object(id).state()); });
}

template <int Dim>
std::shared_ptr<typename Segmentation<Dim>::Shape> Segmentation<Dim>::shape(Id id) {
  return alone([&] { return std::make_shared<Shape>(image_, setting_, segmentation_.object(id)); });
}

template <int Dim>
std::string Segmentation<Dim>::recipe(const std::string& image_path) {
  return alone([&] {
    return surf::segment::to_recipe<Dim>(segmentation_, image_path, series_uid_of(image_));
  });
}

template <int Dim>
void Segmentation<Dim>::replay(const std::string& recipe, const py::object& progress) {
  compute(progress, [&](const Told& told, const std::stop_token& stop) {
    surf::segment::replay<Dim>(recipe, segmentation_, told, stop);
  });
}

namespace {

template <int Dim>
void add_segmentation_of(py::module_& module, const char* name) {
  using Of = Segmentation<Dim>;
  py::class_<Of>(module, name)
      .def(py::init<typename Of::Image>(), py::arg("image"))
      .def("add_object", &Of::add_object, py::arg("name"))
      .def("remove_object", &Of::remove_object, py::arg("object"))
      .def("objects", &Of::objects)
      .def("add_click", &Of::add_click, py::arg("object"), py::arg("point"), py::arg("inside"))
      .def("take_back_click", &Of::take_back_click, py::arg("object"), py::arg("index"))
      .def("clicks", &Of::clicks, py::arg("object"))
      .def_static("options", &options<Dim>)
      .def("set_options", &Of::set_options, py::arg("object"), py::arg("words"), py::arg("box"),
           py::arg("is_along_world"))
      .def("propose", &Of::propose, py::arg("object"), py::arg("progress"))
      .def("choose", &Of::choose, py::arg("object"), py::arg("proposal"))
      .def("evolve", &Of::evolve, py::arg("object"), py::arg("steps"), py::arg("progress"))
      .def("undo", &Of::undo, py::arg("object"))
      .def("redo", &Of::redo, py::arg("object"))
      .def("outcome", &Of::outcome, py::arg("object"))
      .def("shape", &Of::shape, py::arg("object"))
      .def("recipe", &Of::recipe, py::arg("image_path"))
      .def("replay", &Of::replay, py::arg("recipe"), py::arg("progress"));
}

}  // namespace

void add_segmentation(py::module_& module) {
  add_segmentation_of<3>(module, "Segmentation");
  add_segmentation_of<2>(module, "ImageSegmentation");
}

}  // namespace surfseg::python
