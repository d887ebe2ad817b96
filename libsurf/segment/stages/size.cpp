#include "libsurf/segment/stages/size.h"

#include <fmt/format.h>

#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/base/log.h"

namespace surf::segment {
namespace {

// A step on a million triangles takes minutes; adaptation stops at two (fem/adaptivity.h).
constexpr double kMost = 1e6;
constexpr double kMany = 2e5;

}  // namespace

template <int Dim>
double least_elements(double measure, double longest_edge_mm) {
  return Dim == 2 ? measure / longest_edge_mm
                  : measure / (std::sqrt(3.0) / 4 * longest_edge_mm * longest_edge_mm);
}

template <int Dim>
void check_elements(const char* name, double measure, double edge_length_mm,
                    double longest_edge_mm) {
  const double n = least_elements<Dim>(measure, longest_edge_mm);
  if (!(n > kMany)) return;
  const char* elements = Dim == 3 ? "triangles" : "segments";
  const std::string size = fmt::format(
      "edges of {:.3g} mm (at most {:.3g} mm) on {:.4g} mm{} make at least {:.2g} "
      "million {}",
      edge_length_mm, longest_edge_mm, measure, Dim == 3 ? "^2" : "", n / 1e6, elements);
  if (n > kMost) {
    const double least = edge_length_mm * (Dim == 3 ? std::sqrt(n / kMost) : n / kMost);
    throw UsageError(fmt::format(
        "Options::edge_length_mm: {}, more than the {:.0f} million that can be computed with; give "
        "{:.2g}mm or more",
        size, kMost / 1e6, least * 1.05));
  }
  log(LogLevel::kWarning, fmt::format("{}: {}; a step may take a minute", name, size));
}

template double least_elements<2>(double, double);
template double least_elements<3>(double, double);
template void check_elements<2>(const char*, double, double, double);
template void check_elements<3>(const char*, double, double, double);

}  // namespace surf::segment
