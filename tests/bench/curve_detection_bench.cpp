// Finding the intersections of curves: the boxes of libcurve against CGAL's.
//
//   curve_detection_bench [LARGEST [REPEATS]]
//
// Two slightly overlapping noisy circles with n elements in all. Medians of CPU time, all in one
// run.
#include <CGAL/Arr_segment_traits_2.h>
#include <CGAL/Exact_predicates_exact_constructions_kernel.h>
#include <CGAL/Exact_predicates_inexact_constructions_kernel.h>
#include <CGAL/Surface_sweep_2_algorithms.h>
#include <CGAL/box_intersection_d.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <ctime>
#include <functional>
#include <random>
#include <string>
#include <vector>

#include "libcurve/mesh/intersections.h"
#include "libcurve/mesh/primitives.h"

namespace {

using namespace surf;

/// Radii are off by up to a quarter of an element, as a curve that follows noise.
Segments noisy_circles(int n) {
  const double edge = 2 * M_PI / (n / 2.0);
  Segments curves =
      curve::joined({curve::circle({0, 0}, 1, edge), curve::circle({1.9, 0}, 1, edge)});
  std::mt19937 random(1);
  std::uniform_real_distribution<double> noise(-0.25 * edge, 0.25 * edge);
  for (double& value : curves.points.reshaped()) value += noise(random);
  return curves;
}

std::size_t by_cgal_sweep(const Segments& curves) {
  using Traits = CGAL::Arr_segment_traits_2<CGAL::Exact_predicates_exact_constructions_kernel>;
  std::vector<Traits::Curve_2> segments;
  segments.reserve(curves.elements.rows());
  const auto point = [&](int i) {
    return Traits::Point_2(curves.points(i, 0), curves.points(i, 1));
  };
  for (const auto e : curves.elements.rowwise()) segments.emplace_back(point(e[0]), point(e[1]));
  std::vector<Traits::Point_2> found;
  CGAL::compute_intersection_points(segments.begin(), segments.end(), std::back_inserter(found));
  return found.size();
}

std::size_t by_cgal_boxes(const Segments& curves) {
  using Kernel = CGAL::Exact_predicates_inexact_constructions_kernel;
  using Box = CGAL::Box_intersection_d::Box_with_info_d<double, 2, int,
                                                        CGAL::Box_intersection_d::ID_EXPLICIT>;
  const auto point = [&](int i) {
    return Kernel::Point_2(curves.points(i, 0), curves.points(i, 1));
  };
  std::vector<Box> boxes;
  boxes.reserve(curves.elements.rows());
  for (int e = 0; e < curves.elements.rows(); ++e)
    boxes.emplace_back(point(curves.elements(e, 0)).bbox() + point(curves.elements(e, 1)).bbox(),
                       e);
  std::size_t n = 0;
  CGAL::box_self_intersection_d(boxes.begin(), boxes.end(), [&](const Box& a, const Box& b) {
    const auto e = curves.elements.row(a.info()), f = curves.elements.row(b.info());
    if (e[0] == f[1] || e[1] == f[0]) return;
    n += CGAL::do_intersect(Kernel::Segment_2(point(e[0]), point(e[1])),
                            Kernel::Segment_2(point(f[0]), point(f[1])));
  });
  return n;
}

struct Method {
  std::string name;
  std::function<std::size_t(const Segments&)> run;
};

double median_ms(const Method& method, const Segments& curves, int repeats, std::size_t& n_found) {
  std::vector<double> times;
  for (int k = 0; k < repeats; ++k) {
    const std::clock_t start = std::clock();
    n_found = method.run(curves);
    times.push_back(1e3 * double(std::clock() - start) / CLOCKS_PER_SEC);
  }
  std::sort(times.begin(), times.end());
  return times[times.size() / 2];
}

/// Slope of log(time) over log(n) by least squares.
double exponent(const std::vector<double>& n, const std::vector<double>& time) {
  double sx = 0, sy = 0, sxx = 0, sxy = 0;
  const double k = double(n.size());
  for (std::size_t i = 0; i < n.size(); ++i) {
    const double x = std::log(n[i]), y = std::log(time[i]);
    sx += x, sy += y, sxx += x * x, sxy += x * y;
  }
  return (k * sxy - sx * sy) / (k * sxx - sx * sx);
}

}  // namespace

int main(int argc, char** argv) {
  const double largest = argc > 1 ? std::atof(argv[1]) : 1e6;
  const int repeats = argc > 2 ? std::atoi(argv[2]) : 7;
  const std::vector<Method> methods = {
      {"boxes",
       [](const Segments& c) { return curve::intersections(c.points, c.elements).size(); }},
      {"CGAL boxes", by_cgal_boxes},
      {"CGAL sweep", by_cgal_sweep}};
  fmt::print("CPU ms, median of {}; in brackets what was found\n{:>9}", repeats, "elements");
  for (const Method& method : methods) fmt::print(" {:>17}", method.name);
  fmt::print("\n");
  std::vector<double> sizes;
  std::vector<std::vector<double>> times(methods.size());
  for (double n = 1e3; n <= largest * 1.001; n *= std::sqrt(10.0)) {
    const Segments curves = noisy_circles(int(n));
    sizes.push_back(double(curves.elements.rows()));
    fmt::print("{:>9}", curves.elements.rows());
    for (std::size_t m = 0; m < methods.size(); ++m) {
      std::size_t n_found = 0;
      times[m].push_back(median_ms(methods[m], curves, repeats, n_found));
      fmt::print(" {:>10.3f} ({:>4})", times[m].back(), n_found);
    }
    fmt::print("\n");
  }
  fmt::print("{:>9}", "exponent");
  for (const auto& time : times) fmt::print(" {:>17.3f}", exponent(sizes, time));
  fmt::print("\n");
}
