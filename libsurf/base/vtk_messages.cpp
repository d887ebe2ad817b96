#include "libsurf/base/vtk_messages.h"

#include <vtkLogger.h>
#include <vtkNew.h>
#include <vtkObjectFactory.h>
#include <vtkOutputWindow.h>
#include <vtkSmartPointer.h>

namespace surf {
namespace {

class CaptureErrors : public vtkOutputWindow {
 public:
  static CaptureErrors* New();
  vtkTypeMacro(CaptureErrors, vtkOutputWindow);
  void DisplayText(const char*) override {}
  void DisplayErrorText(const char*) override { has_error = true; }
  void DisplayWarningText(const char*) override {}
  void DisplayGenericWarningText(const char*) override {}
  void DisplayDebugText(const char*) override {}

  bool has_error = false;
};
vtkStandardNewMacro(CaptureErrors);

}  // namespace

struct VtkMessages::Impl {
  vtkLogger::Verbosity verbosity = vtkLogger::GetCurrentVerbosityCutoff();
  vtkSmartPointer<vtkOutputWindow> before = vtkOutputWindow::GetInstance();
  vtkNew<CaptureErrors> window;
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

}  // namespace surf
