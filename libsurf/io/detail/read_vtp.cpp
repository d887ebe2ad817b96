#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkDataArray.h>
#include <vtkFieldData.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>

#include "libsurf/base/vtk_xml.h"
#include "libsurf/io/detail/vtp_file.h"
#include "libsurf/volume/detail/vtk_messages.h"

namespace surf::io {
namespace {

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
  vtkNew<vtkXMLPolyDataReader> reader;
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
