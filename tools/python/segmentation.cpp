#include "tools/python/segmentation.h"

#include <pybind11/stl.h>

#include <chrono>

#include "libsurf/base/error.h"
#include "libsurf/segment/recipe.h"
#include "libsurf/segment/segment.h"
#include "tools/common/typed_options.h"

namespace surfseg::python {
namespace {

// Between two calls of a progress function, and two looks for Ctrl-C.
constexpr std::chrono::milliseconds kPause(50);

}  // namespace

Segmentation::Segmentation(surf::volume::Volume volume)
    : volume_(std::move(volume)),
      setting_(surf::segment::make_setting(volume_)),
      segmentation_(setting_) {}

/// One thread at a time, none of them with the interpreter's lock while it waits or works.
template <class Work>
auto Segmentation::alone(Work&& work) {
  py::gil_scoped_release released;
  std::lock_guard lock(mutex_);
  return work();
}

surf::segment::ProgressOf<3> Segmentation::progress_of(const py::object& progress,
                                                       std::exception_ptr& raised) {
  return [&progress, &raised, last = std::chrono::steady_clock::time_point(),
          begin = std::chrono::steady_clock::now()](
             const std::string& stage, const surf::flow::StepRecord& record,
             const std::function<surf::Triangles()>&) mutable {
    const auto now = std::chrono::steady_clock::now();
    if (now - last < kPause) return true;
    last = now;
    py::gil_scoped_acquire held;
    try {
      if (PyErr_CheckSignals() != 0) throw py::error_already_set();
      if (progress.is_none()) return true;
      const std::chrono::duration<double> seconds = now - begin;
      const py::object answer = progress(stage, record.k, record.n_elements, record.enclosed,
                                         record.energy, seconds.count());
      return answer.is_none() || answer.cast<bool>();
    } catch (...) {
      raised = std::current_exception();
      return false;
    }
  };
}

Segmentation::Id Segmentation::add_object(const std::string& name) {
  return alone([&] { return segmentation_.add_object(name); });
}

void Segmentation::remove_object(Id id) {
  alone([&] { segmentation_.remove_object(id); });
}

std::vector<std::pair<Segmentation::Id, std::string>> Segmentation::objects() {
  return alone([&] {
    std::vector<std::pair<Id, std::string>> out;
    for (const Id id : segmentation_.objects()) out.emplace_back(id, segmentation_.object(id).name);
    return out;
  });
}

void Segmentation::add_click(Id id, const std::vector<double>& point_ras_mm, bool is_inside) {
  using surf::segment::Side;
  const auto point = point_of(point_ras_mm, is_inside ? "seeds" : "outside");
  alone([&] { segmentation_.add_click(id, {point, is_inside ? Side::kInside : Side::kOutside}); });
}

void Segmentation::take_back_click(Id id, std::size_t index) {
  alone([&] { segmentation_.take_back_click(id, index); });
}

std::vector<std::pair<std::array<double, 3>, bool>> Segmentation::clicks(Id id) {
  return alone([&] {
    std::vector<std::pair<std::array<double, 3>, bool>> out;
    for (const auto& click : segmentation_.object(id).clicks)
      out.push_back({{click.point_mm[0], click.point_mm[1], click.point_mm[2]},
                     click.side == surf::segment::Side::kInside});
    return out;
  });
}

void Segmentation::set_options(Id id, const std::vector<std::string>& words,
                               const std::optional<std::vector<std::vector<double>>>& box_ras_mm) {
  surf::segment::Options<3> options = typed_options(words, volume_.voxel_size());
  if (box_ras_mm) {
    if (box_ras_mm->size() != 2)
      throw surf::UsageError("box: expected two opposite corners (x, y, z)");
    options.box_mm = {point_of((*box_ras_mm)[0], "box"), point_of((*box_ras_mm)[1], "box")};
  }
  alone([&] { segmentation_.set_options(id, options); });
}

std::vector<std::string> Segmentation::propose(Id id, const py::object& progress) {
  std::exception_ptr raised;
  const auto told = progress_of(progress, raised);
  std::vector<std::string> out = alone([&] {
    std::vector<std::string> lines;
    for (const auto& proposal : segmentation_.propose(id, told).proposals)
      lines.push_back(to_string(proposal));
    return lines;
  });
  if (raised) std::rethrow_exception(raised);
  return out;
}

void Segmentation::choose(Id id, std::size_t proposal) {
  alone([&] { segmentation_.choose(id, proposal); });
}

void Segmentation::evolve(Id id, const py::object& progress) {
  std::exception_ptr raised;
  const auto told = progress_of(progress, raised);
  alone([&] { segmentation_.evolve(id, told); });
  if (raised) std::rethrow_exception(raised);
}

bool Segmentation::undo(Id id) {
  return alone([&] { return segmentation_.undo(id); });
}

bool Segmentation::redo(Id id) {
  return alone([&] { return segmentation_.redo(id); });
}

std::string Segmentation::outcome(Id id) {
  return alone([&] { return to_string(segmentation_.object(id).state()); });
}

std::shared_ptr<Surface> Segmentation::surface(Id id) {
  return alone([&] {
    return std::make_shared<Surface>(volume_, setting_, segmentation_.object(id).result);
  });
}

std::string Segmentation::recipe(const std::string& image_path) {
  return alone([&] { return surf::segment::to_recipe<3>(segmentation_, image_path); });
}

void Segmentation::replay(const std::string& recipe, const py::object& progress) {
  std::exception_ptr raised;
  const auto told = progress_of(progress, raised);
  alone([&] { surf::segment::replay<3>(recipe, segmentation_, told); });
  if (raised) std::rethrow_exception(raised);
}

void add_segmentation(py::module_& module) {
  py::class_<Segmentation>(module, "Segmentation")
      .def(py::init<surf::volume::Volume>(), py::arg("volume"))
      .def("add_object", &Segmentation::add_object, py::arg("name"))
      .def("remove_object", &Segmentation::remove_object, py::arg("object"))
      .def("objects", &Segmentation::objects)
      .def("add_click", &Segmentation::add_click, py::arg("object"), py::arg("point"),
           py::arg("inside"))
      .def("take_back_click", &Segmentation::take_back_click, py::arg("object"), py::arg("index"))
      .def("clicks", &Segmentation::clicks, py::arg("object"))
      .def("set_options", &Segmentation::set_options, py::arg("object"), py::arg("words"),
           py::arg("box"))
      .def("propose", &Segmentation::propose, py::arg("object"), py::arg("progress"))
      .def("choose", &Segmentation::choose, py::arg("object"), py::arg("proposal"))
      .def("evolve", &Segmentation::evolve, py::arg("object"), py::arg("progress"))
      .def("undo", &Segmentation::undo, py::arg("object"))
      .def("redo", &Segmentation::redo, py::arg("object"))
      .def("outcome", &Segmentation::outcome, py::arg("object"))
      .def("surface", &Segmentation::surface, py::arg("object"))
      .def("recipe", &Segmentation::recipe, py::arg("image_path"))
      .def("replay", &Segmentation::replay, py::arg("recipe"), py::arg("progress"));
}

}  // namespace surfseg::python
