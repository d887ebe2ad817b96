#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLPolyDataReader.h>

#include <cstring>
#include <string_view>

#include "libsurf/base/memory.h"
#include "libsurf/base/vtk_xml.h"
#include "libsurf/io/detail/vtp_file.h"
#include "libsurf/volume/detail/vtk_messages.h"

namespace surf::io {
namespace {

/// VTK 9.1 sees itself that the offsets of cells ascend from 0 and that there are as many corners
/// as the last one says. But it makes room for them first, for none where that overflows, and
/// writes beyond.
class Reader : public vtkXMLPolyDataReader {
 public:
  static Reader* New();
  vtkTypeMacro(Reader, vtkXMLPolyDataReader);

  double n_stored = 0;  ///< bytes of the file

 protected:
  int ReadArrayValues(vtkXMLDataElement* element, vtkIdType at, vtkAbstractArray* array,
                      vtkIdType first, vtkIdType n, FieldType type) override {
    if (Superclass::ReadArrayValues(element, at, array, first, n, type) == 0) return 0;
    auto* offsets = vtkDataArray::SafeDownCast(array);
    if (offsets == nullptr || n < 1 || offsets->GetNumberOfComponents() != 1 ||
        !are_offsets(element))
      return 1;
    const double n_corners = offsets->GetComponent(at + n - 1, 0);
    if (is_borne_out(n_corners, n_stored)) return 1;
    vtkErrorMacro("its offsets promise " << n_corners << " corners of polygons, the file has "
                                         << n_stored << " bytes");
    return 0;
  }

 private:
  /// Of cells; others may have that name, too.
  static bool are_offsets(vtkXMLDataElement* element) {
    const char* name = element->GetAttribute("Name");
    vtkXMLDataElement* parent = element->GetParent();
    if (name == nullptr || parent == nullptr || std::strcmp(name, "offsets") != 0) return false;
    const std::string_view part = parent->GetName();
    return part == "Verts" || part == "Lines" || part == "Strips" || part == "Polys";
  }
};
vtkStandardNewMacro(Reader);

void check(const std::string& path, const volume::VtkMessages& messages, vtkPolyData* data) {
  if (const std::string message = messages.first(); !message.empty())
    throw InputError(fmt::format("{}: broken: {}", path, message));
  if (data == nullptr || data->GetPoints() == nullptr)
    throw InputError(fmt::format("{}: holds no points", path));
  if (data->GetNumberOfStrips() > 0)
    throw InputError(fmt::format("{}: triangle strips; save the surface as triangles", path));
}

FileSurface to_surface(const std::string& path, vtkPolyData* data) {
  FileSurface surface;
  surface.points.resize(data->GetNumberOfPoints());
  for (std::size_t i = 0; i < surface.points.size(); ++i)
    data->GetPoint(static_cast<vtkIdType>(i), surface.points[i].data());
  vtkNew<vtkIdList> corners;
  vtkCellArray* cells = data->GetPolys();
  for (vtkIdType cell = 0; cell < cells->GetNumberOfCells(); ++cell) {
    cells->GetCellAtId(cell, corners);
    if (corners->GetNumberOfIds() < 3)
      throw InputError(fmt::format("{}: polygon {} has {} vertices; expected 3 or more", path,
                                   cell + 1, corners->GetNumberOfIds()));
    surface.add_polygon({corners->begin(), corners->end()});
  }
  for (int k = 0; k < data->GetPointData()->GetNumberOfArrays(); ++k) {
    vtkDataArray* array = data->GetPointData()->GetArray(k);
    if (array == nullptr || array->GetName() == nullptr || array->GetNumberOfComponents() != 1)
      continue;
    std::vector<double>& values = surface.arrays[array->GetName()];
    for (vtkIdType i = 0; i < array->GetNumberOfTuples(); ++i)
      values.push_back(array->GetComponent(i, 0));
  }
  return surface;
}

std::optional<Space> space_of_field_data(const std::string& path, vtkPolyData* data) {
  const auto* array = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray("SPACE"));
  if (array == nullptr || const_cast<vtkStringArray*>(array)->GetNumberOfValues() == 0)
    return std::nullopt;
  return stated_space("SPACE=" + const_cast<vtkStringArray*>(array)->GetValue(0), path);
}

FileSurface read_vtp(const std::string& path, const std::string& content) {
  check_vtk_xml(path, content);
  const volume::VtkMessages messages;
  vtkNew<Reader> reader;
  reader->n_stored = double(content.size());
  reader->ReadFromInputStringOn();
  reader->SetInputString(content);
  reader->Update();
  check(path, messages, reader->GetOutput());
  FileSurface surface = to_surface(path, reader->GetOutput());
  surface.space = space_of_field_data(path, reader->GetOutput());
  return surface;
}

}  // namespace

extern "C" {
FileSurface (*const surf_read_vtp)(const std::string&, const std::string&) = read_vtp;
}

}  // namespace surf::io
