// VTP files as surfseg writes them; for .cpp files that show VTK anyway.
#pragma once

#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>

#include <string>

#include "libsurf/base/types.h"
#include "libsurf/io/space.h"

namespace surf::io {

/// The points as doubles.
vtkSmartPointer<vtkPoints> to_vtk(const Points<3>& points);

/// The file's bytes: binary, compressed, with the field data SPACE, which is added to `data`.
std::string vtp_file(vtkPolyData& data, Space space);

}  // namespace surf::io
