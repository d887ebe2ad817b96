#include "tools/python/surface.h"

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "libsurf/base/error.h"
#include "libsurf/base/file.h"
#include "libsurf/io/write_surface.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/volume/write_volume.h"
#include "tools/common/outputs.h"
#include "tools/common/reference.h"
#include "tools/common/surface_scores.h"

namespace surfseg::python {
namespace {

surf::io::Space space_of(const std::string& space) {
  if (space != "lps" && space != "ras")
    throw surf::UsageError(fmt::format("space: expected 'lps' or 'ras'; got '{}'", space));
  return file_space(space);
}

py::object certainty_array(const Surface& self, py::handle owner,
                           Eigen::VectorXd surf::segment::Certainty<3>::*field) {
  if (!self.finished().certainty) return py::none();
  const Eigen::VectorXd& values = (*self.finished().certainty).*field;
  return rows_of(values, owner).attr("reshape")(-1);
}

/// .dcm is a surface, but .seg.dcm.
bool is_label_map(const std::string& path) {
  return surf::volume::is_writable_volume(path) ||
         (surf::extension(path) == ".dcm" &&
          surf::extension(path.substr(0, path.size() - 4)) == ".seg");
}

}  // namespace

Surface::Surface(surf::volume::Volume volume, std::shared_ptr<const Setting> setting,
                 const surf::segment::Object<3>& object)
    : Found(std::move(setting), object), volume_(std::move(volume)) {}

py::array_t<std::uint8_t> Surface::mask() const {
  py::array_t<std::uint8_t, py::array::f_style> out(volume_.size());
  std::uint8_t* data = out.mutable_data();
  {
    py::gil_scoped_release released;  // up to here: what is returned is another handle of the array
    const auto flags =
        surf::mesh::rasterize(finished().shape, volume_.size(), volume_.index_to_world());
    std::copy(flags.begin(), flags.end(), data);
  }
  return out;
}

py::array_t<double> Surface::curvature() const {
  const Eigen::VectorXd kappa = [&] {
    py::gil_scoped_release released;
    return surf::segment::curvature(finished());
  }();
  return py::array_t<double>(kappa.size(), kappa.data());
}

void Surface::save(const std::string& path, const std::string& space) const {
  check_is_not_input(path, volume_.source().path);
  if (is_label_map(path)) {
    const auto flags =
        surf::mesh::rasterize(finished().shape, volume_.size(), volume_.index_to_world());
    const std::vector<std::uint8_t> labels(flags.begin(), flags.end());
    surf::volume::write_label_map(
        path, volume_, labels,
        std::array{surf::volume::LabelName{1, object().name, object().colour}});
    return;
  }
  if (!surf::io::is_writable_surface(path))
    throw surf::UsageError(fmt::format("{}: expected a name that ends in {}, or of a mask in {}",
                                       path, surf::io::writable_surfaces(),
                                       surf::volume::writable_label_maps()));
  surf::io::WriteOptions options{space_of(space)};
  options.colour = object().colour;
  options.name = object().name;
  options.dicom = volume_.dicom();
  surf::volume::check_dicom_output(path, volume_);
  surf::segment::write(path, finished(surf::extension(path)), std::move(options));
}

std::string Surface::scores(const std::string& path, std::optional<int> label) const {
  constexpr int kCaller = 3;  // of surfseg.evaluate()
  const auto warn = [](const std::string& message) {
    const py::gil_scoped_acquire acquired;
    if (PyErr_WarnEx(PyExc_UserWarning, message.c_str(), kCaller) != 0)
      throw py::error_already_set();
  };
  const Reference reference = read_reference(path, label, VolumeArguments(), "lps", warn);
  return surface_scores(finished().shape, reference, label).dump();
}

void add_surface(py::module_& module) {
  using surf::segment::Certainty;
  add_found<Surface>(module, "Surface", "vertices", "faces", "volume_mm3", "area_mm2")
      .def_property_readonly("deviation_mm",
                             [](const py::object& self) {
                               return certainty_array(self.cast<const Surface&>(), self,
                                                      &Certainty<3>::deviation_mm);
                             })
      .def_property_readonly("edge_strength",
                             [](const py::object& self) {
                               return certainty_array(self.cast<const Surface&>(), self,
                                                      &Certainty<3>::edge_strength);
                             })
      .def("curvature", &Surface::curvature)
      .def("save", &Surface::save, py::arg("path"), py::arg("space"),
           py::call_guard<py::gil_scoped_release>())
      .def("scores", &Surface::scores, py::arg("reference"), py::arg("label"),
           py::call_guard<py::gil_scoped_release>());
}

}  // namespace surfseg::python
