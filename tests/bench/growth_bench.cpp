// Segmentation time and peak memory of a phantom ball from the inside at 128^3 and 256^3 with
// the same final mesh (edge length and geometric tolerance are the same lengths in mm): medians of
// several runs, and their ratio within this run. Smoothing with the same sigma [mm] at both sizes
// (0.7 and 1.4 voxels), or with 0.7 voxels at both.
//
//   growth_bench [runs]
#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <vector>

#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"

namespace {

using namespace surf;

struct Measured {
  double median_s = 0, median_cpu_s = 0;
  Eigen::Index n_triangles = 0;
};

double peak_mb() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return double(usage.ru_maxrss) / 1024;
}

/// Of all threads, user and system: what the wall clock adds on a shared machine is not in it.
double cpu_s() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * double(t.tv_usec); };
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + Eigen::Index(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Measured measure(int size, double noise, double lambda, double sigma_mm, int n_runs) {
  volume::PhantomOptions phantom;
  phantom.size = {size, size, size};
  phantom.noise = noise;
  const volume::Volume image = volume::make_phantom(phantom);
  segment::SegmentOptions options;
  options.seeds_mm = {{0, 0, 0}};
  options.seed_radius_mm = 0.15;
  options.energies = {{"minimal-surface", 1, {{"gamma", -30}}}};
  if (lambda > 0) options.energies.front().parameters["lambda"] = lambda;
  options.edge_length_mm = 0.045;
  options.geometry_tolerance_mm = 0.0156;  // a voxel of 128^3
  options.sigma_mm = sigma_mm;
  std::vector<double> seconds, cpu_seconds;
  Measured out;
  for (int run = 0; run < n_runs; ++run) {
    const auto start = std::chrono::steady_clock::now();
    const double cpu_start = cpu_s();
    const auto result = segment::segment(image, options);
    seconds.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
    cpu_seconds.push_back(cpu_s() - cpu_start);
    out.n_triangles = result.shape.elements.rows();
  }
  out.median_s = median(seconds);
  out.median_cpu_s = median(cpu_seconds);
  return out;
}

}  // namespace

int main(int argc, char** argv) {
  const int n_runs = argc > 1 ? std::max(1, std::atoi(argv[1])) : 5;
  fmt::print("{:>6} {:>7} {:>7} {:>9} {:>10} {:>9} {:>9} {:>9} {:>8} {:>6} {:>6}\n", "size",
             "noise", "lambda", "sigma mm", "triangles", "median s", "cpu s", "float MB", "peak MB",
             "ratio", "cpu");
  for (const bool is_fixed : {true, false})
    for (const double lambda : {0.0, 5.0})
      for (const double noise : {0.0, 0.1}) {
        Measured first;
        for (const int size : {128, 256}) {
          const double sigma = is_fixed ? 0.011 : 0.011 * 128 / size;
          const Measured m = measure(size, noise, lambda, sigma, n_runs);
          if (size == 128) first = m;
          fmt::print(
              "{:>6} {:>7} {:>7} {:>9.4f} {:>10} {:>9.2f} {:>9.2f} {:>9.0f} {:>8.0f} {:>6.2f} "
              "{:>6.2f}\n",
              size, noise, lambda > 0 ? fmt::format("{}", lambda) : "auto", sigma, m.n_triangles,
              m.median_s, m.median_cpu_s, 4e-6 * size * size * size, peak_mb(),
              m.median_s / first.median_s, m.median_cpu_s / first.median_cpu_s);
        }
      }
}
