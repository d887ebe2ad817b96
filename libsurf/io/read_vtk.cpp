#include <fmt/format.h>
#include <vtkCallbackCommand.h>
#include <vtkCellArray.h>
#include <vtkCommand.h>
#include <vtkFieldData.h>
#include <vtkNew.h>
#include <vtkPolyData.h>
#include <vtkPolyDataReader.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>

#include "libsurf/io/surface_formats.h"

namespace surf::io {
namespace {

/// Keeps the first error of a VTK object instead of having it printed.
class ErrorObserver {
 public:
  ErrorObserver() {
    callback_->SetClientData(this);
    callback_->SetCallback([](vtkObject*, unsigned long, void* self, void* text) {
      auto& message = static_cast<ErrorObserver*>(self)->message_;
      if (message.empty() && text != nullptr) message = static_cast<const char*>(text);
    });
  }
  void observe(vtkObject* object) {
    for (const auto event : {vtkCommand::ErrorEvent, vtkCommand::WarningEvent})
      object->AddObserver(event, callback_);
  }
  vtkCommand* command() { return callback_; }
  bool has_error() const { return !message_.empty(); }
  /// VTK's text without the source file and the object's address, on one line.
  std::string message() const {
    std::string text = message_.substr(std::min(message_.find("): "), message_.size()));
    text.erase(0, std::min<std::size_t>(3, text.size()));
    std::replace(text.begin(), text.end(), '\n', ' ');
    while (text.ends_with(' ')) text.pop_back();
    return text;
  }

 private:
  vtkNew<vtkCallbackCommand> callback_;
  std::string message_;
};

void check(const std::string& path, const ErrorObserver& errors, vtkPolyData* data) {
  if (errors.has_error()) throw InputError(fmt::format("{}: broken: {}", path, errors.message()));
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
  return surface;
}

std::optional<Space> space_of_field_data(const std::string& path, vtkPolyData* data) {
  const auto* array = vtkStringArray::SafeDownCast(data->GetFieldData()->GetAbstractArray("SPACE"));
  if (array == nullptr || const_cast<vtkStringArray*>(array)->GetNumberOfValues() == 0)
    return std::nullopt;
  return stated_space("SPACE=" + const_cast<vtkStringArray*>(array)->GetValue(0), path);
}

}  // namespace

FileSurface read_vtp(const std::string& path, const std::string& content) {
  vtkNew<vtkXMLPolyDataReader> reader;
  ErrorObserver errors;
  errors.observe(reader);
  reader->SetParserErrorObserver(errors.command());
  reader->ReadFromInputStringOn();
  reader->SetInputString(content);
  reader->Update();
  check(path, errors, reader->GetOutput());
  FileSurface surface = to_surface(path, reader->GetOutput());
  surface.space = space_of_field_data(path, reader->GetOutput());
  return surface;
}

FileSurface read_vtk(const std::string& path, const std::string& content) {
  vtkNew<vtkPolyDataReader> reader;
  ErrorObserver errors;
  errors.observe(reader);
  reader->ReadFromInputStringOn();
  reader->SetBinaryInputString(content.data(), static_cast<int>(content.size()));
  reader->Update();
  check(path, errors, reader->GetOutput());
  FileSurface surface = to_surface(path, reader->GetOutput());
  Lines lines(content);
  if (lines.next() && lines.next()) surface.space = stated_space(lines.line(), path);
  return surface;
}

}  // namespace surf::io
