#include "libsurf/mesh/shape_part.h"

#include <algorithm>

namespace surf::mesh {

template <int Dim>
ShapePart<Dim> part_of(const Simplices<Dim>& shape, const std::vector<char>& is_left_out) {
  const auto n = std::size_t(shape.points.rows());
  std::vector<char> is_in(n, 0), is_out(n, 0);
  ShapePart<Dim> out;
  for (int t = 0; t < int(shape.elements.rows()); ++t) {
    const bool is_left = !is_left_out.empty() && is_left_out[std::size_t(t)];
    if (!is_left) out.elements.push_back(t);
    for (const int i : shape.elements.row(t)) (is_left ? is_out : is_in)[std::size_t(i)] = 1;
  }
  std::vector<int> place(n, -1);
  for (int i = 0; i < int(n); ++i) {
    if (!is_in[std::size_t(i)]) continue;
    place[std::size_t(i)] = int(out.vertices.size());
    out.vertices.push_back(i);
    out.is_shared.push_back(is_out[std::size_t(i)]);
  }
  out.shape.points = shape.points(out.vertices, Eigen::all);
  out.shape.elements = shape.elements(out.elements, Eigen::all);
  for (int& i : out.shape.elements.reshaped()) i = place[std::size_t(i)];
  return out;
}

template <int Dim>
std::vector<char> without_neighbours(const Elements<Dim>& T, std::vector<char> is_left_out) {
  if (is_left_out.empty()) return is_left_out;
  std::vector<char> is_in(std::size_t(T.rows() > 0 ? T.maxCoeff() + 1 : 0), 0);
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (int i = 0; i < Dim && !is_left_out[std::size_t(t)]; ++i) is_in[std::size_t(T(t, i))] = 1;
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (int i = 0; i < Dim; ++i)
      if (is_in[std::size_t(T(t, i))]) is_left_out[std::size_t(t)] = 0;
  return is_left_out;
}

template ShapePart<2> part_of<2>(const Segments&, const std::vector<char>&);
template ShapePart<3> part_of<3>(const Triangles&, const std::vector<char>&);
template std::vector<char> without_neighbours<2>(const Elements<2>&, std::vector<char>);
template std::vector<char> without_neighbours<3>(const Elements<3>&, std::vector<char>);

}  // namespace surf::mesh
