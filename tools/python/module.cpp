// The module `_surfseg`: thin, what is public is in surfseg/__init__.py.
#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "libcurve/image/read_image.h"
#include "libsurf/base/error.h"
#include "libsurf/base/threads.h"
#include "libsurf/volume/phantom.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/field_names.h"
#include "tools/python/arrays.h"
#include "tools/python/curve.h"
#include "tools/python/segmentation.h"
#include "tools/python/surface.h"

namespace surfseg::python {
namespace {

using surf::volume::Volume;

Volume phantom(const std::string& kind, const std::array<int, 3>& size, double noise,
               std::uint64_t random_seed) {
  const auto& kinds = surf::volume::phantom_kinds();
  if (!kinds.contains(kind)) {
    std::string known;
    for (const auto& [name, value] : kinds) known += (known.empty() ? "" : ", ") + name;
    throw surf::UsageError("kind: there is no phantom '" + kind + "'; there are " + known);
  }
  surf::volume::PhantomOptions options;
  options.kind = kinds.at(kind);
  options.size = size;
  options.noise = noise;
  options.random_seed = random_seed;
  if (const std::string error = options.error(); !error.empty()) throw surf::UsageError(error);
  return surf::volume::make_phantom(options);
}

Volume read(const std::string& path, int frame, const std::optional<std::string>& series_uid) {
  return surf::volume::read_volume(path, {frame, series_uid});
}

void add_volume(py::module_& module) {
  py::class_<Volume>(module, "Volume")
      .def(py::init(&volume_of), py::arg("values"), py::arg("affine"), py::arg("name"))
      .def_property_readonly("shape", &Volume::size)
      .def_property_readonly("affine", &affine_of)
      .def_property_readonly("spacing_mm",
                             [](const Volume& self) {
                               const Eigen::Vector3d s = self.spacing();
                               return std::array{s[0], s[1], s[2]};
                             })
      .def_property_readonly("name", [](const Volume& self) { return self.source().path; })
      .def_property_readonly("notes", [](const Volume& self) { return self.source().notes; })
      .def("array", [](const Volume& self) { return values_of(self); })
      .def(
          "save",
          [](const Volume& self, const std::string& path) {
            surf::volume::write_volume(path, self);
          },
          py::call_guard<py::gil_scoped_release>());
}

surf::curve::Image read_image(const std::string& path,
                              const std::optional<std::array<double, 2>>& spacing_mm) {
  surf::curve::ReadImageOptions options;
  if (spacing_mm) options.spacing_mm = {(*spacing_mm)[0], (*spacing_mm)[1]};
  return surf::curve::read_image(path, options);
}

void add_image(py::module_& module) {
  using surf::curve::Image;
  py::class_<Image>(module, "Image")
      .def(py::init(&image_of), py::arg("values"), py::arg("spacing_mm"), py::arg("name"))
      .def_static("read", &read_image, py::arg("path"), py::arg("spacing_mm"),
                  py::call_guard<py::gil_scoped_release>())
      .def_property_readonly("shape",
                             [](const Image& self) {
                               return std::array{self.size()[1], self.size()[0]};
                             })
      .def_property_readonly("spacing_mm",
                             [](const Image& self) {
                               const Eigen::Vector2d s = self.spacing();
                               return std::array{s[0], s[1]};
                             })
      .def_property_readonly("name", [](const Image& self) { return self.source().path; })
      .def_property_readonly("notes", [](const Image& self) { return self.source().notes; })
      .def("array", [](const Image& self) { return values_of(self); });
}

/// One Python class for each of the library's, below surfseg.Error.
void add_exceptions(py::module_& module) {
  static const py::object error = py::reinterpret_steal<py::object>(
      PyErr_NewException("surfseg.Error", PyExc_RuntimeError, nullptr));
  const auto derived = [](const char* name, PyObject* also) {
    const py::tuple bases = py::make_tuple(error, py::handle(also));
    return py::reinterpret_steal<py::object>(PyErr_NewException(name, bases.ptr(), nullptr));
  };
  static const py::object usage = derived("surfseg.UsageError", PyExc_ValueError),
                          input = derived("surfseg.InputError", PyExc_ValueError),
                          output = derived("surfseg.OutputError", PyExc_OSError),
                          no_object = derived("surfseg.NoObject", PyExc_LookupError),
                          invalid = derived("surfseg.InvalidMesh", PyExc_ArithmeticError);
  module.attr("Error") = error;
  module.attr("UsageError") = usage;
  module.attr("InputError") = input;
  module.attr("OutputError") = output;
  module.attr("NoObject") = no_object;
  module.attr("InvalidMesh") = invalid;
  // NOLINTNEXTLINE(performance-unnecessary-value-param): as pybind11 asks for it
  py::register_exception_translator([](std::exception_ptr pointer) {
    const auto raise = [](const py::object& kind, const std::exception& what) {
      PyErr_SetString(kind.ptr(), with_option_names(what.what(), "surfseg").c_str());
    };
    try {
      if (pointer) std::rethrow_exception(pointer);
    } catch (const surf::UsageError& what) {
      raise(usage, what);
    } catch (const surf::InputError& what) {
      raise(input, what);
    } catch (const surf::OutputError& what) {
      raise(output, what);
    } catch (const surf::NoObject& what) {
      raise(no_object, what);
    } catch (const surf::InvalidMesh& what) {
      raise(invalid, what);
    } catch (const surf::Error& what) {
      raise(error, what);
    }
  });
}

}  // namespace

PYBIND11_MODULE(_surfseg, module) {
  add_exceptions(module);
  add_volume(module);
  add_image(module);
  add_surface(module);
  add_curve(module);
  add_segmentation(module);
  module.attr("__version__") = SURFSEG_VERSION;
  module.def("read", &read, py::arg("path"), py::arg("frame"), py::arg("series_uid"),
             py::call_guard<py::gil_scoped_release>());
  module.def("phantom", &phantom, py::arg("kind"), py::arg("size"), py::arg("noise"),
             py::arg("random_seed"), py::call_guard<py::gil_scoped_release>());
  module.def("is_image_file", &surf::curve::is_image_file, py::arg("path"));
  py::class_<surf::ThreadLimit>(module, "ThreadLimit").def(py::init<int>(), py::arg("threads"));
}

}  // namespace surfseg::python
