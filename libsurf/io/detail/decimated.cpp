#include <vtkCellArray.h>
#include <vtkIdList.h>
#include <vtkNew.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkQuadricDecimation.h>
#include <vtkStaticPointLocator.h>

#include <mutex>

#include "libsurf/io/detail/drawing.h"

namespace surf::io {
namespace {

Thinned decimated(const Triangles& surface, Eigen::Index n_triangles) {
  static std::mutex one_at_a_time;  // VTK makes its objects by factories that all threads share
  const std::scoped_lock lock(one_at_a_time);
  vtkNew<vtkPoints> points;
  points->SetDataTypeToDouble();
  for (const auto point : surface.points.rowwise())
    points->InsertNextPoint(point[0], point[1], point[2]);
  vtkNew<vtkCellArray> triangles;
  for (const auto element : surface.elements.rowwise())
    triangles->InsertNextCell({element[0], element[1], element[2]});
  vtkNew<vtkPolyData> whole;
  whole->SetPoints(points);
  whole->SetPolys(triangles);
  vtkNew<vtkQuadricDecimation> decimation;
  decimation->SetInputData(whole);
  decimation->SetTargetReduction(1 - double(n_triangles) / double(surface.elements.rows()));
  decimation->Update();
  Thinned out;
  vtkPolyData& less = *decimation->GetOutput();
  vtkNew<vtkStaticPointLocator> locator;
  locator->SetDataSet(whole);
  locator->BuildLocator();
  out.surface.points.resize(less.GetNumberOfPoints(), 3);
  for (vtkIdType k = 0; k < less.GetNumberOfPoints(); ++k) {
    less.GetPoint(k, out.surface.points.row(k).data());
    out.nearest.push_back(int(locator->FindClosestPoint(out.surface.points.row(k).data())));
  }
  out.surface.elements.resize(less.GetNumberOfPolys(), 3);
  vtkNew<vtkIdList> corners;
  for (vtkIdType k = 0; k < less.GetNumberOfPolys(); ++k) {
    less.GetPolys()->GetCellAtId(k, corners);
    for (int c = 0; c < 3; ++c) out.surface.elements(k, c) = int(corners->GetId(c));
  }
  return out;
}

}  // namespace

extern "C" {
Thinned (*const surf_decimated)(const Triangles&, Eigen::Index) = decimated;
}

}  // namespace surf::io
