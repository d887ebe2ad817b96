// Seconds for refining about a million triangles once, by bisecting all of them twice (each
// triangle in four), and for coarsening them back; and the same for every third triangle.
//
//   bisection_bench [triangles]
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <cstdlib>
#include <vector>

#include "libsurf/mesh/bisection.h"
#include "libsurf/mesh/primitives.h"

namespace {

using namespace surf;
using OpenMesh::FaceHandle;

std::vector<FaceHandle> every_nth_face(const mesh::TriMesh& mesh, int n) {
  std::vector<FaceHandle> faces;
  for (int j = 0; j < static_cast<int>(mesh.n_faces()); j += n) faces.emplace_back(j);
  return faces;
}

template <class Work>
double seconds(const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  work();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void print(const char* what, double time, const mesh::TriMesh& mesh) {
  fmt::print("  {:<24} {:7.3f} s  -> {} triangles\n", what, time, mesh.n_faces());
}

}  // namespace

int main(int argc, char** argv) {
  const double n_triangles = argc > 1 ? std::atof(argv[1]) : 1e6;
  // 20 k^2 triangles with k = 1.21 / edge length on the unit ball.
  const double edge_length = 1.21 / std::floor(std::sqrt(n_triangles / 20));
  for (const int nth : {1, 3}) {
    mesh::TriMesh mesh = mesh::to_mesh(mesh::ball({0, 0, 0}, 1, edge_length));
    const Elements<3> before = mesh::elements(mesh);
    fmt::print("{} triangles, every {}. marked\n", mesh.n_faces(), nth);
    print("mark longest edges", seconds([&] { mesh::mark_longest_edges(mesh); }), mesh);
    for (int round = 0; round < 2; ++round)
      print("bisect", seconds([&] { mesh::bisect(mesh, every_nth_face(mesh, nth)); }), mesh);
    for (int round = 0; round < 2; ++round)
      print("coarsen all", seconds([&] { mesh::coarsen(mesh, every_nth_face(mesh, 1)); }), mesh);
    if (mesh::elements(mesh) != before) fmt::print("  the triangles are not those of the start\n");
  }
}
