#include "libcurve/energy/solution_response.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace surf::curve {
namespace {

/// C of both sides: on each edge of the mesh along the curves, where W is linear, by two Gauss
/// points on parts no longer than a pixel.
Eigen::SparseMatrix<double> loads(const Neumann& solution, const Elements<2>& elements,
                                  Eigen::Index n_vertices) {
  const double gauss = 0.5 / std::sqrt(3.0);
  const DomainMesh& mesh = solution.mesh();
  std::vector<Eigen::Triplet<double>> entries;
  entries.reserve(8 * mesh.trace.size());
  for (const TraceEdge& edge : mesh.trace) {
    const std::array<int, 2> nodes = {edge.start, edge.end};
    const Vector<2> start = mesh.points.row(edge.start),
                    along = mesh.points.row(edge.end).transpose() - start;
    const double length = along.norm();
    const int n = std::max(1, static_cast<int>(std::ceil(length / solution.options().spacing_mm)));
    Eigen::VectorXd s(2 * n);  // places along the edge, in [0, 1]
    for (int k = 0; k < n; ++k) s.segment<2>(2 * k) << k + 0.5 - gauss, k + 0.5 + gauss;
    s /= n;
    Points<2> x = s * along.transpose();
    x.rowwise() += start.transpose();
    const Eigen::VectorXd I = solution.intensity(x);
    const double weight = length / double(s.size());
    for (const bool is_inside : {false, true}) {
      const double u[2] = {solution.value(edge.start, is_inside),
                           solution.value(edge.end, is_inside)};
      const double slope = (u[1] - u[0]) / length;
      Eigen::Matrix2d local = Eigen::Matrix2d::Zero();  // (phi_a of the edge, phi_j of the element)
      for (Eigen::Index q = 0; q < s.size(); ++q) {
        const double at = edge.from + s[q] * (edge.to - edge.from);
        const Eigen::RowVector2d W(1 - at, at);
        const Eigen::Vector2d phi(1 - s[q], s[q]), phi_slope(-1 / length, 1 / length);
        const double difference = phi[0] * u[0] + phi[1] * u[1] - I[q];
        local += weight * (solution.options().mu * slope * phi_slope + difference * phi) * W;
      }
      for (int a = 0; a < 2; ++a)
        for (int j = 0; j < 2; ++j)
          entries.emplace_back(solution.unknowns().of_node(nodes[a], int(is_inside)),
                               elements(edge.element, j), is_inside ? local(a, j) : -local(a, j));
    }
  }
  Eigen::SparseMatrix<double> out(solution.unknowns().size, n_vertices);
  out.setFromTriplets(entries.begin(), entries.end());
  return out;
}

}  // namespace

SolutionResponse::SolutionResponse(const Neumann& solution, const Elements<2>& elements,
                                   Eigen::Index n_vertices)
    : factor_(solution.matrix()), loads_(loads(solution, elements, n_vertices)) {}

Eigen::VectorXd SolutionResponse::derivative(const Eigen::VectorXd& W) const {
  return -factor_.solve(loads_ * W);
}

Eigen::VectorXd SolutionResponse::operator()(const Eigen::VectorXd& W) const {
  return loads_.transpose() * derivative(W);
}

}  // namespace surf::curve
