#include "libsurf/energy/mumford_shah.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "libsurf/base/error.h"
#include "libsurf/base/option_checks.h"
#include "libsurf/energy/detail/element_terms.h"
#include "libsurf/fem/curvature.h"
#include "libsurf/fem/p1.h"
#include "libsurf/volume/cell_pieces.h"
#include "libsurf/volume/cut_cells.h"

namespace surf::energy {
namespace {

constexpr int kLeastMargin = 4;  // nodes

MumfordShahOptions checked(const MumfordShahOptions& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  return options;
}

/// A cell that the surface meets, with what is on both sides.
struct SurfaceCell {
  std::array<int, 3> at;
  volume::CellDensity inside, outside;
};

/// A point of the surface in a cell.
struct SurfacePoint {
  Eigen::Vector3d x;    ///< in the cell, [0, 1]^3
  Eigen::Vector3d phi;  ///< values of the triangle's three functions
  double weight;        ///< of the quadrature [mm^2]
};

Points<3> indices(const Points<3>& points, const volume::Grid& grid) {
  const Eigen::Affine3d to_index = grid.index_to_world.inverse();
  return (points * to_index.linear().transpose()).rowwise() + to_index.translation().transpose();
}

}  // namespace

void MumfordShahWeights::check(OptionChecks& checks) const {
  checks.require(mu > 0, "mu", mu, "> 0");
  checks.require(gamma >= 0, "gamma", gamma, ">= 0");
  checks.require(contrast > 0, "contrast", contrast, "> 0");
}

std::string MumfordShahOptions::error() const {
  OptionChecks checks("MumfordShahOptions");
  MumfordShahWeights::check(checks);
  checks.require(margin > 0, "margin", margin, "> 0");
  checks.require(solver.tolerance > 0, "solver.tolerance", solver.tolerance, "> 0");
  checks.require(solver.blend > 0 && solver.blend <= 1, "solver.blend", solver.blend,
                 "0 < blend <= 1");
  return checks.error();
}

/// Nodes lower <= (i, j, k) <= upper of the image's grid.
struct MumfordShah::Box {
  std::array<int, 3> lower, upper;

  bool contains(const Box& other) const {
    for (int axis = 0; axis < 3; ++axis)
      if (other.lower[axis] < lower[axis] || other.upper[axis] > upper[axis]) return false;
    return true;
  }
  volume::Grid grid(const volume::Grid& image) const {
    volume::Grid out = image;
    for (int axis = 0; axis < 3; ++axis) out.size[axis] = upper[axis] - lower[axis] + 1;
    out.index_to_world.translate(Eigen::Vector3d(lower[0], lower[1], lower[2]));
    return out;
  }
};

struct MumfordShah::State {
  fem::Geometry<3> shape;
  Box box;
  std::shared_ptr<const std::vector<double>> I;
  volume::ScreenedPoisson inside, outside;

  double energy(double gamma) const {
    return inside.energy() + outside.energy() + gamma * charged_measure<3>(shape);
  }
};

/// Per vertex: integrals of phi_i times what lies on both sides of the surface.
struct MumfordShah::Loads {
  Points<3> force;       ///< [1/2 ((u - I)^2 + mu |grad u|^2)] nu
  Eigen::VectorXd jump;  ///< the same without nu
  Eigen::VectorXd u;     ///< [u]
  Eigen::VectorXd bend;  ///< mu [S(grad u, grad u)], S the shape operator
};

MumfordShah::MumfordShah(std::shared_ptr<const Field<3>> I, const volume::Grid& grid,
                         const MumfordShahOptions& options)
    : I_(std::move(I)), grid_(grid), options_(checked(options)) {}

MumfordShah::~MumfordShah() = default;

/// @param margin  in multiples of sqrt(mu)
MumfordShah::Box MumfordShah::box_round(const Points<3>& points, double margin) const {
  const Points<3> index = indices(points, grid_);
  const Eigen::Matrix3d to_index = grid_.index_to_world.linear().inverse();
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    const double length = margin * std::sqrt(options_.mu) * to_index.row(axis).norm();
    const int nodes = std::max(kLeastMargin, static_cast<int>(std::ceil(std::min(length, 1e6))));
    const double low = std::floor(index.col(axis).minCoeff()) - nodes,
                 high = std::ceil(index.col(axis).maxCoeff()) + nodes;
    const int last = grid_.size[axis] - 1;
    box.lower[axis] = static_cast<int>(std::clamp(low, 0.0, double(last - 1)));
    box.upper[axis] = static_cast<int>(std::clamp(high, double(box.lower[axis] + 1), double(last)));
  }
  return box;
}

std::shared_ptr<const std::vector<double>> MumfordShah::intensities(const Box& box) const {
  const volume::Grid grid = box.grid(grid_);
  const std::size_t n_slab = std::size_t(grid.size[0]) * grid.size[1];
  auto out = std::make_shared<std::vector<double>>(n_slab * grid.size[2]);
  tbb::parallel_for(0, grid.size[2], [&](int k) {
    Points<3> points(Eigen::Index(n_slab), 3);
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i)
        points.row(Eigen::Index(j) * grid.size[0] + i) =
            grid.index_to_world * Eigen::Vector3d(i, j, k);
    Samples<3> samples;
    I_->sample(points, Derivatives::kNone, samples);
    for (std::size_t n = 0; n < n_slab; ++n)
      (*out)[k * n_slab + n] = samples.value[Eigen::Index(n)] / options_.contrast;
  });
  return out;
}

std::unique_ptr<MumfordShah::State> MumfordShah::solved(const fem::Geometry<3>& shape,
                                                        const Box& box, const State* start) const {
  const bool is_same_box = start && start->box.contains(box) && box.contains(start->box);
  auto I = is_same_box ? start->I : intensities(box);
  const volume::Grid grid = box.grid(grid_);
  const auto cells = volume::cut_cells(shape.points(), shape.elements(), grid);
  std::array<int, 3> shift{};
  for (int axis = 0; start && axis < 3; ++axis)
    shift[axis] = box.lower[axis] - start->box.lower[axis];
  const auto solution = [&](int side, const volume::ScreenedPoisson* from) {
    return volume::ScreenedPoisson(cells[side], grid, options_.mu, *I, options_.solver, from,
                                   shift);
  };
  auto inside = solution(0, start ? &start->inside : nullptr);
  auto outside = solution(1, start ? &start->outside : nullptr);
  return std::unique_ptr<State>(
      new State{shape, box, std::move(I), std::move(inside), std::move(outside)});
}

void MumfordShah::reset(const fem::Geometry<3>& shape) {
  Box box = box_round(shape.points(), options_.margin);
  if (state_ && state_->box.contains(box)) box = state_->box;
  state_ = solved(shape, box, state_.get());
  tried_.reset();
  offset_ = drift_ = 0;
}

double MumfordShah::value() const { return offset_ + state_->energy(options_.gamma) - drift_; }

/// Grows the box if points come close to its sides where the image goes on.
void MumfordShah::make_room_for(const Points<3>& points) {
  if (state_->box.contains(box_round(points, options_.margin / 2))) return;
  Box box = box_round(points, options_.margin);
  for (int axis = 0; axis < 3; ++axis) {
    box.lower[axis] = std::min(box.lower[axis], state_->box.lower[axis]);
    box.upper[axis] = std::max(box.upper[axis], state_->box.upper[axis]);
  }
  const double before = state_->energy(options_.gamma);
  state_ = solved(state_->shape, box, state_.get());
  offset_ += before - state_->energy(options_.gamma);
}

double MumfordShah::try_move(const fem::Geometry<3>& moved) {
  make_room_for(moved.points());
  tried_ = solved(moved, state_->box, state_.get());
  return offset_ + tried_->energy(options_.gamma) - drift_;
}

void MumfordShah::accept() { state_ = std::move(tried_); }

void MumfordShah::remesh(const fem::Geometry<3>& shape) {
  make_room_for(shape.points());
  state_ = solved(shape, state_->box, state_.get());
}

void MumfordShah::rebuild(const fem::Geometry<3>& shape) {
  const double before = value();
  remesh(shape);
  drift_ += value() - before;
}

/// Calls visit(t, cell, point) for the points of the rule on the parts of triangle t in each cell;
/// triangles in parallel.
template <class Visit>
void MumfordShah::for_points(const Visit& visit) const {
  const fem::Geometry<3>& shape = state_->shape;
  const Elements<3>& T = shape.elements();
  const volume::Grid grid = state_->box.grid(grid_);
  const Points<3> index = indices(shape.points(), grid);
  const volume::PieceRule& rule = volume::piece_rule();
  const auto add_part = [&](Eigen::Index t, int i, int j, int k, const volume::Piece& part) {
    const SurfaceCell cell{
        {i, j, k}, state_->inside.density(i, j, k), state_->outside.density(i, j, k)};
    const Eigen::Vector3d corner(i, j, k);
    volume::for_triangles_of(part, [&](const auto& p, const auto& q, const auto& r) {
      const double area =
          shape.measures()[t] * std::abs(p.barycentric.dot(q.barycentric.cross(r.barycentric)));
      for (std::size_t n = 0; n < rule.weights.size(); ++n) {
        const Eigen::Vector3d& l = rule.points[n];
        visit(t, cell,
              SurfacePoint{l[0] * p.index + l[1] * q.index + l[2] * r.index - corner,
                           l[0] * p.barycentric + l[1] * q.barycentric + l[2] * r.barycentric,
                           area * rule.weights[n]});
      }
    });
  };
  tbb::parallel_for(Eigen::Index(0), T.rows(), [&](Eigen::Index t) {
    const auto triangle =
        volume::whole_triangle(index.row(T(t, 0)), index.row(T(t, 1)), index.row(T(t, 2)));
    volume::for_cells_along(triangle, 2, 0, grid.size[2] - 2, [&](int k, const auto& slab) {
      volume::for_cells_along(slab, 1, 0, grid.size[1] - 2, [&](int j, const auto& row) {
        volume::for_cells_along(row, 0, 0, grid.size[0] - 2, [&](int i, const auto& part) {
          if (i >= 0 && j >= 0 && k >= 0) add_part(t, i, j, k, part);
        });
      });
    });
  });
}

MumfordShah::Loads MumfordShah::loads() const {
  const fem::Geometry<3>& shape = state_->shape;
  const Elements<3>& T = shape.elements();
  // S of derivatives along the grid's axes.
  const Eigen::Matrix3d to_index = grid_.index_to_world.linear().inverse();
  auto S = fem::shape_operators<3>(shape);
  for (Eigen::Matrix3d& of_element : S)
    of_element = options_.mu * to_index * of_element * to_index.transpose();
  Points<3> jumps = Points<3>::Zero(T.rows(), 3), of_u = jumps, bends = jumps;  // of the corners
  for_points([&](Eigen::Index t, const SurfaceCell& cell, const SurfacePoint& at) {
    const Eigen::RowVector3d phi = at.weight * at.phi.transpose();
    const Eigen::Vector3d a = cell.inside.slope(at.x), b = cell.outside.slope(at.x);
    jumps.row(t) += (cell.inside(at.x) - cell.outside(at.x)) * phi;
    of_u.row(t) += (cell.inside.difference(at.x) - cell.outside.difference(at.x)) * phi;
    bends.row(t) += (a.dot(S[t] * a) - b.dot(S[t] * b)) * phi;
  });
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(shape.n_vertices());
  Loads out{Points<3>::Zero(shape.n_vertices(), 3), none, none, none};
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (int i = 0; i < 3; ++i) {
      out.force.row(T(t, i)) += jumps(t, i) * shape.normals().row(t);
      out.jump[T(t, i)] += jumps(t, i);
      out.u[T(t, i)] += of_u(t, i);
      out.bend[T(t, i)] += bends(t, i);
    }
  return out;
}

/// d_nu I by the contrast, at the vertices.
Eigen::VectorXd MumfordShah::intensity_slope() const {
  const fem::Geometry<3>& shape = state_->shape;
  Samples<3> samples;
  I_->sample(shape.points(), Derivatives::kFirst, samples);
  return samples.gradient.cwiseProduct(shape.nodal_normals().rowwise().normalized())
             .rowwise()
             .sum() /
         options_.contrast;
}

void MumfordShah::differentiate(const fem::Curvature& curvature, double weight,
                                ShapeTerms<3>& terms) const {
  const fem::Geometry<3>& shape = state_->shape;
  const Loads at = loads();
  terms.derivative += weight * at.force;
  add_measure_terms<3>(shape, weight * options_.gamma, terms);
  // d_nu u_i = 0, so d_nu (u_i - I)^2 / 2 = -(u_i - I) d_nu I.
  terms.beta +=
      weight * (curvature.mean.cwiseProduct(at.jump) - at.u.cwiseProduct(intensity_slope()))
                   .cwiseQuotient(shape.lumped_mass());
}

/// -sum_i C_i^T K_i^-1 C_i, with C_i W = int_Gamma (mu grad u_i . grad phi + (u_i - I) phi) W dS
/// and u'_i = -K_i^-1 C_i W_i: what the last line of Theorem 2.2.11 is for these functions.
class MumfordShah::Response {
 public:
  explicit Response(const MumfordShah& energy) {
    const State& state = *energy.state_;
    const volume::Grid grid = state.box.grid(energy.grid_);
    const auto cells = volume::cut_cells(state.shape.points(), state.shape.elements(), grid);
    for (int side = 0; side < 2; ++side)
      inverses_.emplace_back(cells[side], grid, energy.options_.mu, energy.options_.solver);
    set_loads(energy, grid.size);
  }

  Eigen::VectorXd operator()(const Eigen::VectorXd& W) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(W.size());
    for (int side = 0; side < 2; ++side)
      out -= loads_[side].transpose() * inverses_[side](loads_[side] * W);
    return out;
  }

 private:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;  // (nodes, vertices)
  using Local = Eigen::Matrix<double, 8, 3>;
  struct Part {
    std::array<int, 3> cell;
    std::array<Local, 2> sides;
  };

  void set_loads(const MumfordShah& energy, const std::array<int, 3>& size) {
    const Elements<3>& T = energy.state_->shape.elements();
    std::vector<std::vector<Part>> parts(T.rows());
    energy.for_points([&](Eigen::Index t, const SurfaceCell& cell, const SurfacePoint& at) {
      auto& of_triangle = parts[t];
      if (of_triangle.empty() || of_triangle.back().cell != cell.at)
        of_triangle.push_back({cell.at, {Local::Zero(), Local::Zero()}});
      const Eigen::RowVector3d phi = at.weight * at.phi.transpose();
      of_triangle.back().sides[0] += cell.inside.by_corner(at.x) * phi;
      of_triangle.back().sides[1] += cell.outside.by_corner(at.x) * phi;
    });
    const Eigen::Index n_nodes = Eigen::Index(size[0]) * size[1] * size[2];
    for (int side = 0; side < 2; ++side) {
      std::vector<Eigen::Triplet<double>> entries;
      for (Eigen::Index t = 0; t < T.rows(); ++t)
        for (const Part& part : parts[t])
          for (int a = 0; a < 8; ++a) {
            const int i = part.cell[0] + (a & 1), j = part.cell[1] + (a >> 1 & 1),
                      k = part.cell[2] + (a >> 2);
            for (int c = 0; c < 3; ++c)
              entries.emplace_back((k * size[1] + j) * size[0] + i, T(t, c),
                                   part.sides[side](a, c));
          }
      loads_[side].resize(n_nodes, energy.state_->shape.n_vertices());
      loads_[side].setFromTriplets(entries.begin(), entries.end());
    }
  }

  std::vector<volume::ScreenedPoissonInverse> inverses_;
  std::array<Matrix, 2> loads_;
};

void MumfordShah::differentiate_twice(const fem::Curvature& curvature, double weight,
                                      SecondDerivative<3>& second) const {
  const fem::Geometry<3>& shape = state_->shape;
  const Loads at = loads();
  add_element_matrices<3>(shape, weight * options_.gamma, second.sparse, [&](Eigen::Index t) {
    const auto& gradients = shape.basis_gradients(t);
    Eigen::Matrix3d local = fem::p1_stiffness<3, 3>(gradients, shape.measures()[t]);
    double gauss = 0;  // kappa^2 - sum kappa_i^2
    for (const int i : shape.elements().row(t))
      gauss += (std::pow(curvature.mean[i], 2) - curvature.square_sum[i]) / 3;
    return Eigen::Matrix3d(local + gauss * fem::p1_mass<3>(shape.measures()[t]));
  });
  second.sparse.diagonal() += weight * (curvature.mean.cwiseProduct(at.jump) -
                                        at.u.cwiseProduct(intensity_slope()) - at.bend);
  const auto response = std::make_shared<const Response>(*this);
  second.operators.emplace_back([response, weight](const Eigen::VectorXd& W) -> Eigen::VectorXd {
    return weight * (*response)(W);
  });
}

void MumfordShah::add_density(const Points<3>& points, double weight,
                              Eigen::VectorXd& density) const {
  const volume::Grid grid = state_->box.grid(grid_);
  const auto node = [&](int i, int j, int k) {
    return (std::size_t(k) * grid.size[1] + j) * grid.size[0] + i;
  };
  double sum = 0;
  std::size_t n_outside = 0;
  for (int k = 0; k < grid.size[2]; ++k)
    for (int j = 0; j < grid.size[1]; ++j)
      for (int i = 0; i < grid.size[0]; ++i)
        if (state_->outside.is_active(i, j, k)) {
          sum += state_->outside.node_value(i, j, k);
          ++n_outside;
        }
  const double mean = n_outside > 0 ? sum / double(n_outside) : 0;
  const Points<3> index = indices(points, grid);
  for (Eigen::Index n = 0; n < points.rows(); ++n) {
    std::array<int, 3> at;
    for (int axis = 0; axis < 3; ++axis)
      at[axis] = static_cast<int>(
          std::clamp(std::round(index(n, axis)), 0.0, double(grid.size[axis] - 1)));
    const double I = (*state_->I)[node(at[0], at[1], at[2])];
    const double e = state_->inside.node_value(at[0], at[1], at[2]) - I;
    density[n] += weight / 2 * (e * e - (I - mean) * (I - mean));
  }
}

}  // namespace surf::energy
