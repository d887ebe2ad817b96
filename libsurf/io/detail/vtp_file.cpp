#include "libsurf/io/detail/vtp_file.h"

#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataWriter.h>

namespace surf::io {

vtkSmartPointer<vtkPoints> to_vtk(const Points<3>& points) {
  const auto out = vtkSmartPointer<vtkPoints>::New();
  out->SetDataTypeToDouble();
  out->SetNumberOfPoints(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i) out->SetPoint(i, points.row(i).data());
  return out;
}

std::string vtp_file(vtkPolyData& data, Space space) {
  vtkNew<vtkStringArray> statement;
  statement->SetName("SPACE");
  statement->InsertNextValue(std::string(name(space)));
  data.GetFieldData()->AddArray(statement);
  vtkNew<vtkXMLPolyDataWriter> writer;
  writer->SetInputData(&data);
  writer->WriteToOutputStringOn();
  writer->Write();
  return writer->GetOutputString();
}

}  // namespace surf::io
