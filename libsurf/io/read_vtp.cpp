#include <fmt/format.h>
#include <vtkCellArray.h>
#include <vtkFieldData.h>
#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkPolyData.h>
#include <vtkSmartPointer.h>
#include <vtkStringArray.h>
#include <vtkXMLPolyDataReader.h>

#include <algorithm>
#include <mutex>

#include "libsurf/io/surface_formats.h"

namespace surf::io {
namespace {

/// Keeps VTK's first error or warning instead of having it printed.
class Messages : public vtkOutputWindow {
 public:
  static Messages* New();
  vtkTypeMacro(Messages, vtkOutputWindow);

  void DisplayText(const char* text) override {
    if (text_.empty() && text != nullptr) text_ = text;
  }
  bool is_empty() const { return text_.empty(); }
  /// VTK's text without the source file and the object's address, on one line.
  std::string line() const {
    const std::size_t at = text_.find("): ");
    std::string text = at == std::string::npos ? text_ : text_.substr(at + 3);
    std::replace(text.begin(), text.end(), '\n', ' ');
    while (text.ends_with(' ')) text.pop_back();
    return text;
  }

 private:
  std::string text_;
};
vtkStandardNewMacro(Messages);

/// Collects what VTK says while this lives. VTK has one window and one log for the whole
/// process (observers do not reach all the objects inside a reader), so that one thread reads
/// at a time.
class Listener {
 public:
  Listener()
      : lock_(mutex()),
        old_window_(vtkOutputWindow::GetInstance()),
        old_cutoff_(vtkLogger::GetCurrentVerbosityCutoff()) {
    vtkOutputWindow::SetInstance(messages_);
    vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  }
  ~Listener() {
    vtkLogger::SetStderrVerbosity(old_cutoff_);
    vtkOutputWindow::SetInstance(old_window_);
  }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  const Messages& messages() { return *messages_; }

 private:
  static std::mutex& mutex() {
    static std::mutex the_mutex;
    return the_mutex;
  }
  std::lock_guard<std::mutex> lock_;
  vtkSmartPointer<vtkOutputWindow> old_window_;
  vtkLogger::Verbosity old_cutoff_;
  vtkNew<Messages> messages_;
};

void check(const std::string& path, const Messages& messages, vtkPolyData* data) {
  if (!messages.is_empty()) throw InputError(fmt::format("{}: broken: {}", path, messages.line()));
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
  Listener listener;
  vtkNew<vtkXMLPolyDataReader> reader;
  reader->ReadFromInputStringOn();
  reader->SetInputString(content);
  reader->Update();
  check(path, listener.messages(), reader->GetOutput());
  FileSurface surface = to_surface(path, reader->GetOutput());
  surface.space = space_of_field_data(path, reader->GetOutput());
  return surface;
}

}  // namespace surf::io
