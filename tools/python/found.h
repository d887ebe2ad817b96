// What surfaces and curves that were found have in common, for Python.
#pragma once

#include <fmt/format.h>

#include <memory>
#include <string>
#include <utility>

#include "libsurf/base/error.h"
#include "libsurf/segment/finish.h"
#include "libsurf/segment/history.h"
#include "tools/common/outputs.h"
#include "tools/python/arrays.h"

namespace surfseg::python {

/// @throws surf::UsageError  the image was read from the file, or from others and it
inline void check_is_not_input(const std::string& path, const std::string& image) {
  if (is_read_with(image, path))
    throw surf::UsageError(
        fmt::format("{}: is the file that the image was read from; give another name", path));
}

/// A verified shape and what is known of it; keeps what it came from.
template <int Dim>
class Found {
 public:
  using Setting = surf::segment::Setting<Dim>;

  /// @throws surf::NoObject, surf::InvalidMesh  as segment::finish()
  Found(std::shared_ptr<const Setting> setting, const surf::segment::Object<Dim>& object)
      : setting_(std::move(setting)), object_(object), finished_(finished("")) {}

  const surf::segment::Finished<Dim>& finished() const { return finished_; }
  /// Its coordinates as a file of this ending holds them.
  surf::segment::Finished<Dim> finished(const std::string& extension) const {
    return surf::segment::finish<Dim>(*setting_, *object_.result, extension);
  }
  const surf::segment::Object<Dim>& object() const { return object_; }
  std::string outcome() const { return to_string(object_.state()); }
  /// The summary that `segment --json` writes, without what it says of files.
  std::string summary() const {
    return surf::segment::summary_json<Dim>(*object_.result, &finished_);
  }

 private:
  std::shared_ptr<const Setting> setting_;
  surf::segment::Object<Dim> object_;
  surf::segment::Finished<Dim> finished_;
};

/// What Python sees of both kinds of shapes; their arrays share the library's memory.
/// @param points, elements, content, measure  what it calls them
template <class Shape>
py::class_<Shape, std::shared_ptr<Shape>> add_found(py::module_& module, const char* name,
                                                    const char* points, const char* elements,
                                                    const char* content, const char* measure) {
  const auto finished = [](const py::object& self) -> const auto& {
    return self.cast<const Shape&>().finished();
  };
  py::class_<Shape, std::shared_ptr<Shape>> out(module, name);
  out.def_property_readonly(
         points, [=](py::object self) { return rows_of(finished(self).shape.points, self); })
      .def_property_readonly(
          elements, [=](py::object self) { return rows_of(finished(self).shape.elements, self); })
      .def_property_readonly("outcome", &Shape::outcome)
      .def_property_readonly(content,
                             [](const Shape& self) { return self.finished().measures.content; })
      .def_property_readonly(measure,
                             [](const Shape& self) { return self.finished().measures.measure; })
      .def("summary", &Shape::summary, py::call_guard<py::gil_scoped_release>())
      .def("mask", &Shape::mask);
  return out;
}

}  // namespace surfseg::python
