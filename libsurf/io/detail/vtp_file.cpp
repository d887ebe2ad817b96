#include "libsurf/io/detail/vtp_file.h"

#include <vtkCellArray.h>
#include <vtkCellData.h>
#include <vtkDoubleArray.h>
#include <vtkFieldData.h>
#include <vtkIntArray.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataWriter.h>

namespace surf::io {
namespace {

vtkNew<vtkPoints> to_vtk(const Points<3>& points) {
  vtkNew<vtkPoints> out;
  out->SetDataTypeToDouble();
  out->SetNumberOfPoints(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i) out->SetPoint(i, points.row(i).data());
  return out;
}

void add_triangles(const Triangles& surface, vtkPolyData& data) {
  vtkNew<vtkCellArray> cells;
  cells->AllocateExact(surface.elements.rows(), surface.elements.size());
  for (const auto element : surface.elements.rowwise())
    cells->InsertNextCell({element[0], element[1], element[2]});
  data.SetPolys(cells);
}

void add_rings(const std::vector<std::vector<int>>& rings, vtkPolyData& data) {
  vtkNew<vtkCellArray> cells;
  for (const std::vector<int>& ring : rings) {
    cells->InsertNextCell(int(ring.size()) + 1);
    for (const int point : ring) cells->InsertCellPoint(point);
    cells->InsertCellPoint(ring.front());
  }
  data.SetLines(cells);
}

void add_arrays(const VtpContent& content, vtkPolyData& data) {
  for (const PointArray& array : content.arrays) {
    vtkNew<vtkDoubleArray> values;
    values->SetName(array.name.c_str());
    for (const double value : array.values) values->InsertNextValue(value);
    data.GetPointData()->AddArray(values);
  }
  if (content.slices.empty()) return;
  vtkNew<vtkIntArray> slices;
  slices->SetName("slice");
  for (const int slice : content.slices) slices->InsertNextValue(slice);
  data.GetCellData()->AddArray(slices);
}

std::string bytes_of(const VtpContent& content, Space space) {
  vtkNew<vtkPolyData> data;
  data->SetPoints(to_vtk(content.surface.points));
  if (content.is_of_lines)
    add_rings(content.rings, *data);
  else
    add_triangles(content.surface, *data);
  add_arrays(content, *data);
  vtkNew<vtkStringArray> statement;
  statement->SetName("SPACE");
  statement->InsertNextValue(std::string(name(space)));
  data->GetFieldData()->AddArray(statement);
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(data);
  writer->WriteToOutputStringOn();
  writer->Write();
  return writer->GetOutputString();
}

}  // namespace

extern "C" {
std::string (*const surf_vtp_bytes)(const VtpContent&, Space) = bytes_of;
}

}  // namespace surf::io
