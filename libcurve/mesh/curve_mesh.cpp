#include "libcurve/mesh/curve_mesh.h"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>

#include "libcurve/mesh/detail/exact_segments.h"
#include "libsurf/base/error.h"

namespace surf::curve {

CurveMesh::CurveMesh(const Segments& curves) {
  check_elements(curves.points, curves.elements);
  const Eigen::Index n = curves.points.rows();
  std::vector<int> after(n, -1), before(n, -1);
  for (const auto element : curves.elements.rowwise()) {
    const int a = element[0], b = element[1];
    if (after[a] >= 0 || before[b] >= 0)
      throw InvalidMesh(fmt::format("node {} of a curve {} more than one element",
                                    after[a] >= 0 ? a : b, after[a] >= 0 ? "starts" : "ends"));
    after[a] = b;
    before[b] = a;
  }
  std::vector<int> number(n, -1);
  for (Eigen::Index i = 0; i < n; ++i) {
    if ((after[i] < 0) != (before[i] < 0))
      throw InvalidMesh(fmt::format("node {} of a curve {} no element: the curve is open", i,
                                    after[i] < 0 ? "starts" : "ends"));
    if (after[i] < 0) continue;
    number[i] = size();
    points_.emplace_back(curves.points.row(i));
  }
  for (Eigen::Index i = 0; i < n; ++i) {
    if (number[i] < 0) continue;
    next_.push_back(number[after[i]]);
    prev_.push_back(number[before[i]]);
  }
}

Points<2> CurveMesh::points() const {
  Points<2> out(size(), 2);
  for (int i = 0; i < size(); ++i) out.row(i) = points_[i];
  return out;
}

void CurveMesh::set_points(const Points<2>& to) {
  assert(to.rows() == size());
  for (int i = 0; i < size(); ++i) points_[i] = to.row(i);
}

Elements<2> CurveMesh::elements() const {
  Elements<2> out(size(), 2);
  for (int i = 0; i < size(); ++i) out.row(i) << i, next_[i];
  return out;
}

int CurveMesh::split(int i, const Vector<2>& at) {
  const int added = size(), end = next_[i];
  points_.push_back(at);
  next_.push_back(end);
  prev_.push_back(i);
  next_[i] = added;
  prev_[end] = added;
  return added;
}

std::vector<int> CurveMesh::remove(const std::vector<char>& is_gone) {
  const std::vector<int> component = components();
  std::vector<int> n_left(size(), 0);
  for (int i = 0; i < size(); ++i) n_left[component[i]] += !is_gone[i];
  std::vector<int> number(size(), -1), old;
  for (int i = 0; i < size(); ++i) {
    if (is_gone[i] || n_left[component[i]] < 3) continue;
    number[i] = static_cast<int>(old.size());
    old.push_back(i);
  }
  CurveMesh out;
  out.prev_.resize(old.size());
  for (const int i : old) {
    int end = next_[i];
    while (number[end] < 0) end = next_[end];
    out.points_.push_back(points_[i]);
    out.next_.push_back(number[end]);
    out.prev_[number[end]] = number[i];
  }
  *this = std::move(out);
  return old;
}

std::vector<int> CurveMesh::components() const {
  std::vector<int> out(size(), -1);
  int n = 0;
  for (int first = 0; first < size(); ++first) {
    if (out[first] >= 0) continue;
    for (int i = first; out[i] < 0; i = next_[i]) out[i] = n;
    ++n;
  }
  return out;
}

}  // namespace surf::curve
