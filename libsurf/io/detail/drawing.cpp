#include "libsurf/io/detail/drawing.h"

#include <fmt/format.h>
#include <vtkActor.h>
#include <vtkAutoInit.h>
#include <vtkCamera.h>
#include <vtkCellArray.h>
#include <vtkDoubleArray.h>
#include <vtkFloatArray.h>
#include <vtkLookupTable.h>
#include <vtkNew.h>
#include <vtkPointData.h>
#include <vtkPoints.h>
#include <vtkPolyData.h>
#include <vtkPolyDataMapper.h>
#include <vtkProperty.h>
#include <vtkRenderWindow.h>
#include <vtkRenderer.h>
#include <vtkUnsignedCharArray.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <iterator>
#include <memory>
#include <thread>
#include <vector>

#include "libsurf/base/error.h"
#include "libsurf/io/draw.h"
// Last: its macros (Success) are names of Eigen's.
#include <X11/Xlib.h>

VTK_MODULE_INIT(vtkRenderingOpenGL2)

namespace surf::io {
namespace {

/// Where the camera stands, seen from the surface [RAS].
constexpr std::array<std::array<double, 3>, 2> kCameras = {{{0.7, 0.85, 0.45}, {-1.0, 0.0, 0.1}}};
constexpr std::array<double, 3> kSurfaceColor = {0.93, 0.78, 0.66};
/// Viridis at every eighth.
constexpr std::array<std::array<double, 3>, 9> kViridis = {{{0.267, 0.005, 0.329},
                                                            {0.278, 0.176, 0.484},
                                                            {0.230, 0.322, 0.546},
                                                            {0.173, 0.449, 0.558},
                                                            {0.128, 0.567, 0.551},
                                                            {0.157, 0.684, 0.502},
                                                            {0.369, 0.789, 0.383},
                                                            {0.678, 0.864, 0.190},
                                                            {0.993, 0.906, 0.144}}};
constexpr int kTableSize = 256;
constexpr double kShown = 0.98;  // of the values lie below the upper end

/// VTK ends the process where it finds no display, so look first. The connection stays open
/// until the picture is made: a server resets itself when its last client leaves, and would refuse
/// VTK meanwhile.
class DisplayProbe {
 public:
  DisplayProbe() {
    const char* name = std::getenv("DISPLAY");
    if (!display_)
      throw OutputError(fmt::format(
          "drawing in 3-D needs an X display, and {}; run it under xvfb-run, or draw slices of the "
          "volume, which need none",
          name == nullptr ? std::string("DISPLAY is not set")
                          : fmt::format("'{}' cannot be opened", name)));
    int opcode = 0, event = 0, error = 0;
    if (XQueryExtension(display_.get(), "GLX", &opcode, &event, &error) == 0)
      throw OutputError("drawing in 3-D needs an X display with GLX; run it under xvfb-run");
  }

 private:
  struct Close {
    void operator()(Display* display) const { XCloseDisplay(display); }
  };
  /// A server whose last client has just gone begins anew (xvfb-run's does) and refuses
  /// connections for a moment.
  static Display* open() {
    for (int attempt = 0;; ++attempt) {
      Display* display = XOpenDisplay(nullptr);
      if (display != nullptr || attempt == 5 || std::getenv("DISPLAY") == nullptr) return display;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
  }

  std::unique_ptr<Display, Close> display_{open()};
};

/// Normals at the vertices, weighted by area.
Points<3> vertex_normals(const Triangles& surface) {
  Points<3> normals = Points<3>::Zero(surface.points.rows(), 3);
  for (const auto element : surface.elements.rowwise()) {
    const Vector<3> a = surface.points.row(element[0]), b = surface.points.row(element[1]),
                    c = surface.points.row(element[2]);
    const Vector<3> normal = (b - a).cross(c - a);
    for (const int vertex : element) normals.row(vertex) += normal.transpose();
  }
  normals.rowwise().normalize();
  return normals;
}

/// What the bar spans.
std::array<double, 2> range_of(const RenderOptions& options) {
  if (options.range) return *options.range;
  const Eigen::VectorXd& values = options.colors->values;
  std::vector<double> sorted;
  std::copy_if(values.begin(), values.end(), std::back_inserter(sorted),
               [](double value) { return std::isfinite(value); });
  if (sorted.empty()) return {0, 1};
  std::sort(sorted.begin(), sorted.end());
  const double low = std::min(0.0, sorted.front()),
               high = sorted[std::size_t(kShown * double(sorted.size() - 1))];
  return {low, high > low ? high : low + 1};
}

/// The colour at 0 to 1.
std::array<double, 3> color_at(double share) {
  const double at = std::clamp(share, 0.0, 1.0) * double(kViridis.size() - 1);
  const std::size_t first = std::min(std::size_t(at), kViridis.size() - 2);
  std::array<double, 3> out;
  for (std::size_t c = 0; c < 3; ++c)
    out[c] = std::lerp(kViridis[first][c], kViridis[first + 1][c], at - double(first));
  return out;
}

vtkNew<vtkLookupTable> color_table(const std::array<double, 2>& range) {
  vtkNew<vtkLookupTable> table;
  table->SetNumberOfTableValues(kTableSize);
  for (int k = 0; k < kTableSize; ++k) {
    const std::array<double, 3> color = color_at(double(k) / (kTableSize - 1));
    table->SetTableValue(k, color[0], color[1], color[2]);
  }
  table->SetTableRange(range[0], range[1]);
  return table;
}

/// The colours at the foot of the picture, between the numbers of their ends.
void draw_bar(Picture& picture, const std::array<double, 2>& range) {
  constexpr Color kBlack = {0, 0, 0};
  const int scale = std::max(1, picture.width() / 750), gap = 6 * scale;
  const int height = text_height(scale), top = picture.height() - height - gap;
  const int width = picture.width() / 4;
  const std::string low = fmt::format("{:.3g}", range[0]), high = fmt::format("{:.3g}", range[1]);
  int x = (picture.width() - width) / 2;
  draw_text(picture, x - gap - text_width(low, scale), top, low, kBlack, scale);
  draw_text(picture, x + width + gap, top, high, kBlack, scale);
  for (int column = 0; column < width; ++column) {
    const std::array<double, 3> color = color_at(double(column) / (width - 1));
    for (int y = top; y < top + height; ++y)
      for (std::size_t c = 0; c < 3; ++c)
        picture.at(x + column, y)[c] = std::uint8_t(std::lround(255 * color[c]));
  }
}

vtkNew<vtkPolyData> poly_data_of(const Triangles& surface) {
  vtkNew<vtkPoints> points;
  vtkNew<vtkFloatArray> normals;
  normals->SetNumberOfComponents(3);
  const Points<3> directions = vertex_normals(surface);
  for (Eigen::Index i = 0; i < surface.points.rows(); ++i) {
    points->InsertNextPoint(surface.points.row(i).data());
    normals->InsertNextTuple(directions.row(i).data());
  }
  vtkNew<vtkCellArray> cells;
  for (const auto element : surface.elements.rowwise())
    cells->InsertNextCell({element[0], element[1], element[2]});
  vtkNew<vtkPolyData> data;
  data->SetPoints(points);
  data->SetPolys(cells);
  data->GetPointData()->SetNormals(normals);
  return data;
}

vtkNew<vtkActor> actor_of(const Triangles& surface, const RenderOptions& options,
                          vtkLookupTable* table) {
  vtkNew<vtkPolyDataMapper> mapper;
  const vtkNew<vtkPolyData> data = poly_data_of(surface);
  if (options.colors) {
    vtkNew<vtkDoubleArray> values;
    for (const double value : options.colors->values) values->InsertNextValue(value);
    data->GetPointData()->SetScalars(values);
    mapper->SetLookupTable(table);
    mapper->UseLookupTableScalarRangeOn();
    mapper->InterpolateScalarsBeforeMappingOn();
  }
  mapper->SetInputData(data);
  vtkNew<vtkActor> actor;
  actor->SetMapper(mapper);
  vtkProperty& look = *actor->GetProperty();
  look.SetColor(kSurfaceColor[0], kSurfaceColor[1], kSurfaceColor[2]);
  look.SetInterpolationToPhong();
  look.SetAmbient(0.12);
  look.SetDiffuse(0.85);
  look.SetSpecular(0.15);
  look.SetSpecularPower(20);
  look.SetEdgeVisibility(options.has_edges);
  look.SetEdgeColor(0.15, 0.15, 0.2);
  return actor;
}

/// Parallel projection that the surface fills up to a margin.
void aim(vtkRenderer& renderer, const Triangles& surface, const std::array<double, 3>& from,
         double aspect) {
  constexpr double kMargin = 1.08;
  const Vector<3> back = Vector<3>(from[0], from[1], from[2]).normalized();
  const Vector<3> right = Vector<3>::UnitZ().cross(back).normalized();
  Eigen::Matrix3d axes;  // rows: right, up and towards the camera
  axes << right.transpose(), back.cross(right).transpose(), back.transpose();
  Eigen::AlignedBox3d seen;  // of the triangles: a file may hold more points
  for (const auto element : surface.elements.rowwise())
    for (const int vertex : element)
      seen.extend(Vector<3>(axes * surface.points.row(vertex).transpose()));
  const Vector<3> half = 0.5 * seen.sizes();
  const Vector<3> center = axes.transpose() * seen.center();
  const Vector<3> position = center + 2 * half.norm() * back;
  vtkCamera& camera = *renderer.GetActiveCamera();
  camera.ParallelProjectionOn();
  camera.SetParallelScale(kMargin * std::max(half[1], half[0] / aspect));
  camera.SetFocalPoint(center.data());
  camera.SetPosition(position.data());
  camera.SetViewUp(0, 0, 1);
  renderer.ResetCameraClippingRange();
}

Picture picture_of(vtkRenderWindow& window) {
  const int width = window.GetSize()[0], height = window.GetSize()[1];
  vtkNew<vtkUnsignedCharArray> pixels;
  if (window.GetPixelData(0, 0, width - 1, height - 1, /*front=*/0, pixels) == 0 ||
      pixels->GetNumberOfValues() != vtkIdType(3) * width * height)
    throw OutputError("the X display drew nothing; is its OpenGL 3.2 or later?");
  Picture picture(width, height);
  for (int y = 0; y < height; ++y)
    std::memcpy(&picture.at(0, height - 1 - y), pixels->GetPointer(vtkIdType(3) * width * y),
                std::size_t(3) * width);
  return picture;
}

Picture drawn(const Triangles& surface, const RenderOptions& options) {
  const DisplayProbe display;
  vtkNew<vtkRenderWindow> window;
  window->SetOffScreenRendering(1);
  window->SetMultiSamples(8);
  window->SetSize(options.width, options.height);
  const std::array<double, 2> range =
      options.colors ? range_of(options) : std::array<double, 2>{0, 1};
  const vtkNew<vtkLookupTable> table = color_table(range);
  const vtkNew<vtkActor> actor = actor_of(surface, options, table);
  const double n_views = kCameras.size();
  for (std::size_t i = 0; i < kCameras.size(); ++i) {
    vtkNew<vtkRenderer> renderer;
    renderer->SetViewport(double(i) / n_views, 0, double(i + 1) / n_views, 1);
    renderer->SetBackground(1, 1, 1);
    renderer->AddActor(actor);
    aim(*renderer, surface, kCameras[i], options.width / n_views / options.height);
    window->AddRenderer(renderer);
  }
  window->Render();
  Picture picture = picture_of(*window);
  if (options.colors) draw_bar(picture, range);
  return picture;
}

}  // namespace

extern "C" {
Picture (*const surf_drawn)(const Triangles&, const RenderOptions&) = drawn;
}

}  // namespace surf::io
