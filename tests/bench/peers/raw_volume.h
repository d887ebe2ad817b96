// What the drivers of peers share: a volume, and their times.
#pragma once

#include <sys/resource.h>

#include <array>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <vector>

/// An uncompressed NIfTI-1 of floats as `surfseg phantom` writes it, cubes along the axes.
struct RawVolume {
  std::array<int, 3> size{};
  double spacing = 1, origin = 0;  ///< the same along each axis
  std::vector<float> values;

  explicit RawVolume(const std::string& path) {
    std::ifstream file(path, std::ios::binary);
    std::vector<char> header(352);
    if (!file.read(header.data(), 352)) throw std::runtime_error(path + ": no header");
    std::int16_t dim[8], datatype;
    float pixdim[8], offset, srow_x[4];
    std::memcpy(dim, &header[40], sizeof dim);
    std::memcpy(&datatype, &header[70], sizeof datatype);
    std::memcpy(pixdim, &header[76], sizeof pixdim);
    std::memcpy(&offset, &header[108], sizeof offset);
    std::memcpy(srow_x, &header[280], sizeof srow_x);
    if (datatype != 16) throw std::runtime_error(path + ": not float32");
    size = {dim[1], dim[2], dim[3]};
    spacing = pixdim[1];
    origin = srow_x[3];
    values.resize(std::size_t(size[0]) * size[1] * size[2]);
    file.seekg(std::streamoff(offset));
    if (!file.read(reinterpret_cast<char*>(values.data()),
                   std::streamsize(values.size() * sizeof(float))))
      throw std::runtime_error(path + ": too short");
  }
};

/// Ends the program where there are not as many words as its usage names.
inline void expect_arguments(int argc, int n, const char* usage) {
  if (argc == n + 1) return;
  std::fprintf(stderr, "usage: %s\n", usage);
  std::exit(2);
}

/// "x,y,z" [mm].
inline std::array<double, 3> point_of(const char* text) {
  std::array<double, 3> out{};
  if (std::sscanf(text, "%lf,%lf,%lf", &out[0], &out[1], &out[2]) == 3) return out;
  std::fprintf(stderr, "expected a point such as 0.5,0,0; got '%s'\n", text);
  std::exit(2);
}

/// Prints {"wall_s": ..., "cpu_s": ...} of what lies between its begin and its end.
class PeerClock {
 public:
  void stop() const {
    const double wall =
        std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
    std::printf("{\"wall_s\": %.4f, \"cpu_s\": %.4f}\n", wall, cpu() - cpu_begin_);
  }

 private:
  static double cpu() {
    rusage usage{};
    getrusage(RUSAGE_SELF, &usage);
    const auto seconds = [](const timeval& t) { return double(t.tv_sec) + 1e-6 * t.tv_usec; };
    return seconds(usage.ru_utime) + seconds(usage.ru_stime);
  }
  std::chrono::steady_clock::time_point begin_ = std::chrono::steady_clock::now();
  double cpu_begin_ = cpu();
};
