#include "libsurf/fem/indicators.h"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cassert>
#include <limits>
#include <numeric>
#include <vector>

#include "libsurf/base/products.h"
#include "libsurf/fem/quadrature.h"

namespace surf::fem {
namespace {

/// Calls visit(t, other, h_S theta_S) for each node with its two segments, h_S their mean length.
template <class Visit>
void for_each_side(const Geometry<2>& shape, const Visit& visit) {
  const Elements<2>& T = shape.elements();
  std::vector<Eigen::Index> incoming(shape.n_vertices());
  for (Eigen::Index t = 0; t < T.rows(); ++t) incoming[T(t, 1)] = t;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const Eigen::Index other = incoming[T(t, 0)];
    const double h = (shape.measures()[t] + shape.measures()[other]) / 2;
    visit(t, other,
          h * angle_between(Vector<2>(shape.normals().row(t)),
                            Vector<2>(shape.normals().row(other))));
  }
}

/// The directed edges of triangles by the vertex they begin at: a directed edge belongs to one
/// triangle, and the neighbour across (a, b) owns (b, a).
class DirectedEdges {
 public:
  DirectedEdges(const Elements<3>& T, Eigen::Index n_vertices)
      : first_(std::size_t(n_vertices) + 1, 0), edges_(std::size_t(T.size())) {
    for (const int vertex : T.reshaped()) ++first_[std::size_t(vertex) + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    std::vector<int> end(first_.begin(), first_.end() - 1);
    for (Eigen::Index t = 0; t < T.rows(); ++t)
      for (int i = 0; i < 3; ++i)
        edges_[std::size_t(end[std::size_t(T(t, i))]++)] = {T(t, (i + 1) % 3), int(t)};
  }

  /// The triangle with the edge from one vertex to another; -1 if a part ends there.
  Eigen::Index owner(int from, int to) const {
    for (int at = first_[std::size_t(from)]; at < first_[std::size_t(from) + 1]; ++at)
      if (edges_[std::size_t(at)].to == to) return edges_[std::size_t(at)].triangle;
    return -1;
  }

 private:
  struct Edge {
    int to, triangle;
  };
  std::vector<int> first_;
  std::vector<Edge> edges_;
};

/// The same for each edge with its two triangles.
template <class Visit>
void for_each_side(const Geometry<3>& shape, const Visit& visit) {
  const Elements<3>& T = shape.elements();
  const DirectedEdges edges(T, shape.n_vertices());
  struct Side {
    Eigen::Index other;
    double h_theta;
  };
  std::vector<Side> sides(std::size_t(T.size()));
  tbb::parallel_for(Eigen::Index(0), T.rows(), [&](Eigen::Index t) {
    for (int i = 0; i < 3; ++i) {
      Side& side = sides[std::size_t(3 * t + i)];
      side = {edges.owner(T(t, (i + 1) % 3), T(t, i)), 0};
      if (side.other < t) continue;
      const double h = (shape.points().row(T(t, (i + 1) % 3)) - shape.points().row(T(t, i))).norm();
      side.h_theta = h * angle_between(Vector<3>(shape.normals().row(t)),
                                       Vector<3>(shape.normals().row(side.other)));
    }
  });
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (int i = 0; i < 3; ++i) {
      const Side& side = sides[std::size_t(3 * t + i)];
      // Else it has been visited, or a part ends there.
      if (side.other >= t) visit(t, side.other, side.h_theta);
    }
}

/// |I~_f(T) - I_f(T)| of elements.
template <int Dim>
Eigen::VectorXd errors_of(const Points<Dim>& X, const Elements<Dim>& T,
                          const Eigen::VectorXd& measures, const Field<Dim>& f, int order,
                          int higher_order) {
  assert(order < higher_order);
  const auto mean = [&](int of_order) -> Eigen::VectorXd {
    const auto& rule = quadrature<Dim>(of_order);
    Samples<Dim> samples;
    f.sample(quadrature_points<Dim>(X, T, rule.points), Derivatives::kNone, samples);
    return samples.value.reshaped(rule.size(), T.rows()).transpose() * rule.weights;
  };
  return (mean(higher_order) - mean(order)).cwiseAbs().cwiseProduct(measures);
}

std::vector<Mark> marks_above(const Eigen::VectorXd& eta, double bound) {
  std::vector<Mark> marks(eta.size(), Mark::kKeep);
  for (Eigen::Index t = 0; t < eta.size(); ++t)
    if (eta[t] > bound) marks[t] = Mark::kRefine;
  return marks;
}

void allow_coarsening(std::vector<Mark>& marks, const Eigen::VectorXd& eta,
                      const Eigen::VectorXd& measures, const MarkingOptions& options) {
  const double per_measure = options.gamma_coarsen * options.tolerance / measures.sum();
  for (Eigen::Index t = 0; t < eta.size(); ++t)
    if (marks[t] == Mark::kKeep && eta[t] < per_measure * measures[t]) marks[t] = Mark::kCoarsen;
}

}  // namespace

template <int Dim>
Eigen::VectorXd geometric_variation(const Geometry<Dim>& shape) {
  Eigen::VectorXd eta = Eigen::VectorXd::Zero(shape.n_elements());
  for_each_side(shape, [&](Eigen::Index t, Eigen::Index other, double at_side) {
    eta[t] += at_side;
    eta[other] += at_side;
  });
  return eta;
}

template <int Dim>
Eigen::VectorXd quadrature_error(const Geometry<Dim>& shape, const Field<Dim>& f, int order,
                                 int higher_order) {
  return errors_of<Dim>(shape.points(), shape.elements(), shape.measures(), f, order, higher_order);
}

template <int Dim>
Eigen::VectorXd quadrature_error(const Geometry<Dim>& shape, const std::vector<Eigen::Index>& of,
                                 const Field<Dim>& f, int order, int higher_order) {
  if (of.empty()) return Eigen::VectorXd(0);
  return errors_of<Dim>(shape.points(), shape.elements()(of, Eigen::all), shape.measures()(of), f,
                        order, higher_order);
}

std::vector<Mark> mark_geometry(const Eigen::VectorXd& eta, const MarkingOptions& options) {
  const double largest = eta.maxCoeff();
  const double bound = largest > options.tolerance
                           ? std::min(options.tolerance, options.gamma_refine * largest)
                           : std::numeric_limits<double>::infinity();
  std::vector<Mark> marks = marks_above(eta, bound);
  for (Eigen::Index t = 0; t < eta.size(); ++t)
    if (marks[t] == Mark::kKeep && eta[t] < options.gamma_coarsen * options.tolerance)
      marks[t] = Mark::kCoarsen;
  return marks;
}

std::vector<Mark> mark_integral(const Eigen::VectorXd& eta, const Eigen::VectorXd& measures,
                                const MarkingOptions& options) {
  std::vector<Mark> marks(eta.size(), Mark::kKeep);
  if (eta.sum() > options.tolerance)
    marks = marks_above(eta.cwiseQuotient(measures), options.tolerance / measures.sum());
  allow_coarsening(marks, eta, measures, options);
  return marks;
}

std::vector<Mark> mark_function(const Eigen::VectorXd& eta, const Eigen::VectorXd& measures,
                                const MarkingOptions& options) {
  std::vector<Mark> marks(eta.size(), Mark::kKeep);
  if (eta.sum() > options.tolerance)
    marks = marks_above(eta, options.gamma_refine * eta.maxCoeff());
  allow_coarsening(marks, eta, measures, options);
  return marks;
}

void combine(std::vector<Mark>& marks, const std::vector<Mark>& others) {
  assert(marks.size() == others.size());
  for (std::size_t t = 0; t < marks.size(); ++t) marks[t] = std::max(marks[t], others[t]);
}

template Eigen::VectorXd geometric_variation<2>(const Geometry<2>&);
template Eigen::VectorXd geometric_variation<3>(const Geometry<3>&);
template Eigen::VectorXd quadrature_error<2>(const Geometry<2>&, const Field<2>&, int, int);
template Eigen::VectorXd quadrature_error<2>(const Geometry<2>&, const std::vector<Eigen::Index>&,
                                             const Field<2>&, int, int);
template Eigen::VectorXd quadrature_error<3>(const Geometry<3>&, const Field<3>&, int, int);
template Eigen::VectorXd quadrature_error<3>(const Geometry<3>&, const std::vector<Eigen::Index>&,
                                             const Field<3>&, int, int);

}  // namespace surf::fem
