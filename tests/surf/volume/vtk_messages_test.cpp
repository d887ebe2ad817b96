#include "libsurf/volume/detail/vtk_messages.h"

#include <gtest/gtest.h>
#include <vtkNew.h>
#include <vtkOutputWindow.h>
#include <vtkPoints.h>

#include <atomic>
#include <optional>
#include <thread>

namespace surf::volume {
namespace {

void warn(const char* text) {
  vtkNew<vtkPoints> points;
  vtkWarningWithObjectMacro(points.Get(), << text);
}

void fail(const char* text) {
  vtkNew<vtkPoints> points;
  vtkErrorWithObjectMacro(points.Get(), << text);
}

TEST(VtkMessages, AreNoneWhereVtkSaysNothing) {
  const VtkMessages messages;
  EXPECT_FALSE(messages.has_error());
  EXPECT_EQ(messages.first(), "");
}

TEST(VtkMessages, KeepsTheFirstAndNotWhereItCameFrom) {
  const VtkMessages messages;
  fail("the file\nis damaged");
  fail("more of the same");
  EXPECT_TRUE(messages.has_error());
  EXPECT_EQ(messages.first(), "the file is damaged");
}

TEST(VtkMessages, AWarningIsNoError) {
  const VtkMessages messages;
  warn("an old version");
  EXPECT_FALSE(messages.has_error());
  EXPECT_EQ(messages.first(), "an old version");
}

TEST(VtkMessages, PrintsNothingWhileItLivesAndLeavesVtkAsItWas) {
  vtkOutputWindow* const before = vtkOutputWindow::GetInstance();
  testing::internal::CaptureStderr();
  {
    const VtkMessages messages;
    fail("the file is damaged");
    EXPECT_NE(vtkOutputWindow::GetInstance(), before);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(vtkOutputWindow::GetInstance(), before);
}

TEST(VtkMessages, OfOneThreadAtATime) {
  std::optional<VtkMessages> messages(std::in_place);
  std::atomic<bool> has_its_own = false;
  std::string first;
  std::thread other([&] {
    const VtkMessages own;
    has_its_own = true;
    fail("of the other thread");
    first = own.first();
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(50));
  EXPECT_FALSE(has_its_own);
  EXPECT_EQ(messages->first(), "");
  messages.reset();
  other.join();
  EXPECT_EQ(first, "of the other thread");
}

}  // namespace
}  // namespace surf::volume
