#include "libsurf/volume/detail/vtk_messages.h"

#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>

#include <algorithm>
#include <mutex>

namespace surf::volume {
namespace {

class Messages : public vtkOutputWindow {
 public:
  static Messages* New();
  vtkTypeMacro(Messages, vtkOutputWindow);

  void DisplayText(const char* text) override {
    if (first.empty() && text != nullptr) first = text;
  }
  void DisplayErrorText(const char* text) override {
    has_error = true;
    DisplayText(text);
  }

  std::string first;
  bool has_error = false;
};
vtkStandardNewMacro(Messages);

std::mutex& mutex() {
  static std::mutex the_mutex;
  return the_mutex;
}

}  // namespace

struct VtkMessages::Impl {
  std::lock_guard<std::mutex> lock{mutex()};
  vtkLogger::Verbosity verbosity = vtkLogger::GetCurrentVerbosityCutoff();
  vtkSmartPointer<vtkOutputWindow> before = vtkOutputWindow::GetInstance();
  vtkNew<Messages> window;
};

VtkMessages::VtkMessages() : impl_(std::make_unique<Impl>()) {
  vtkLogger::SetStderrVerbosity(vtkLogger::VERBOSITY_OFF);
  vtkOutputWindow::SetInstance(impl_->window);
}

VtkMessages::~VtkMessages() {
  vtkOutputWindow::SetInstance(impl_->before);
  vtkLogger::SetStderrVerbosity(impl_->verbosity);
}

bool VtkMessages::has_error() const { return impl_->window->has_error; }

std::string VtkMessages::first() const {
  const std::string& all = impl_->window->first;
  const std::size_t at = all.find("): ");
  std::string text = at == std::string::npos ? all : all.substr(at + 3);
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (text.ends_with(' ')) text.pop_back();
  return text;
}

}  // namespace surf::volume
