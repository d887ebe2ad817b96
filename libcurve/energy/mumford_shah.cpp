#include "libcurve/energy/mumford_shah.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <unordered_map>

#include "libcurve/energy/solution_response.h"
#include "libcurve/mesh/curve_mesh.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/intersections.h"
#include "libcurve/mesh/surgery.h"
#include "libsurf/base/error.h"
#include "libsurf/base/option_checks.h"
#include "libsurf/base/products.h"
#include "libsurf/energy/detail/element_terms.h"
#include "libsurf/fem/indicators.h"
#include "libsurf/fem/p1.h"

namespace surf::curve {
namespace {

constexpr double kMostPixels = 32;   // longest edge of a mesh
constexpr int kAdaptiveRounds = 4;   // of Alg. 8 for one mesh
constexpr double kRaisedTo = 0.9;    // of its tolerance, to which coarsening may bring the error
constexpr double kLeastShare = 0.2;  // of its area that a triangle may keep in a trial step
constexpr double kWorn = 12;         // degrees: a mesh with smaller angles is made anew
constexpr double kSizeCell = 4;      // pixels

Segments segments_of(const fem::Geometry<2>& shape) { return {shape.points(), shape.elements()}; }

/// Twice the areas of the triangles.
Eigen::VectorXd areas(const PlaneTriangles& triangles, const Points<2>& X) {
  Eigen::VectorXd out(triangles.rows());
  for (Eigen::Index t = 0; t < triangles.rows(); ++t) {
    const Vector<2> p = X.row(triangles(t, 0)), a = X.row(triangles(t, 1)).transpose() - p,
                    b = X.row(triangles(t, 2)).transpose() - p;
    out[t] = cross(a, b);
  }
  return out;
}

/// Where the last solution has a value at the same place on the same side, it; elsewhere the mean
/// of neighbours that have one.
Eigen::VectorXd start_from(const Neumann& last, const DomainMesh& mesh, const Unknowns& unknowns) {
  const auto bits = [](const Points<2>& X, Eigen::Index i) {
    return std::hash<double>()(X(i, 0)) * 31 + std::hash<double>()(X(i, 1));
  };
  std::unordered_multimap<std::size_t, int> places;
  const Points<2>& old = last.mesh().points;
  for (Eigen::Index i = 0; i < old.rows(); ++i) places.emplace(bits(old, i), int(i));
  Eigen::VectorXd u = Eigen::VectorXd::Zero(unknowns.size);
  std::vector<char> is_known(unknowns.size, 0);
  for (Eigen::Index i = 0; i < mesh.points.rows(); ++i) {
    auto [at, end] = places.equal_range(bits(mesh.points, i));
    while (at != end && old.row(at->second) != mesh.points.row(i)) ++at;
    if (at == end) continue;
    for (int side = 0; side < 2; ++side) {
      const int here = unknowns.of_node(i, side), there = last.unknowns().of_node(at->second, side);
      if (here < 0 || there < 0) continue;
      u[here] = last.u()[there];
      is_known[here] = 1;
    }
  }
  const auto means = last.means();
  for (int sweep = 0; sweep < 3; ++sweep) {
    Eigen::VectorXd sum = Eigen::VectorXd::Zero(u.size()), weight = sum;
    for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t)
      for (int i = 0; i < 3; ++i)
        for (int j = 0; j < 3; ++j) {
          const int to = unknowns.of_node(mesh.triangles(t, i), int(mesh.is_inside[t])),
                    from = unknowns.of_node(mesh.triangles(t, j), int(mesh.is_inside[t]));
          if (is_known[to] || !is_known[from]) continue;
          sum[to] += u[from];
          weight[to] += 1;
        }
    for (Eigen::Index k = 0; k < u.size(); ++k)
      if (weight[k] > 0) {
        u[k] = sum[k] / weight[k];
        is_known[k] = 1;
      }
  }
  for (Eigen::Index i = 0; i < unknowns.of_node.rows(); ++i)
    for (int side = 0; side < 2; ++side)
      if (const int k = unknowns.of_node(i, side); k >= 0 && !is_known[k]) u[k] = means[side];
  return u;
}

/// Whether the curves are simple and their components alternate, so that none has shrunk through
/// itself.
bool bounds_domain(const Segments& curves) {
  if (!intersections(curves.points, curves.elements).empty()) return false;
  const auto components = curve_hierarchy(curves).components;
  return std::all_of(components.begin(), components.end(),
                     [](const Component& component) { return component.is_real(); });
}

/// Curves that may cross as the boundary of the domain round which they wind.
Segments resolved(const Segments& curves) {
  CurveMesh mesh(curves);
  if (!operate(mesh, {}).is_resolved)
    throw InvalidMesh("mumford-shah: curves that cross could not be resolved");
  return mesh.segments();
}

/// Mean and mean square of I over a parallelogram of this origin and these sides, by 2 x 2 Gauss
/// points on cells no larger than `spacing`.
std::array<double, 2> moments(const Field<2>& I, const Vector<2>& origin, const Vector<2>& a,
                              const Vector<2>& b, double spacing, double shift) {
  const int n = std::max(1, int(std::ceil(a.norm() / spacing - 1e-9))),
            m = std::max(1, int(std::ceil(b.norm() / spacing - 1e-9)));
  const double gauss = 0.5 / std::sqrt(3.0);
  Points<2> x(4 * n, 2);
  Samples<2> samples;
  double sum = 0, squares = 0;
  for (int j = 0; j < m; ++j) {
    for (int i = 0; i < n; ++i)
      for (int q = 0; q < 4; ++q)
        x.row(4 * i + q) = (origin + (i + 0.5 + (q % 2 ? gauss : -gauss)) / n * a +
                            (j + 0.5 + (q / 2 ? gauss : -gauss)) / m * b)
                               .transpose();
    I.sample(x, Derivatives::kNone, samples);
    sum += (samples.value.array() - shift).sum();
    squares += (samples.value.array() - shift).square().sum();
  }
  const double points = 4.0 * n * m;
  return {shift + sum / points, squares / points};
}

}  // namespace

std::string MumfordShahOptions::error() const {
  OptionChecks checks("MumfordShahOptions");
  MumfordShahWeights::check(checks);
  checks.require(pixel_mm > 0, "pixel_mm", pixel_mm, "> 0");
  checks.require(max_size_mm >= 0, "max_size_mm", max_size_mm, ">= 0");
  checks.require(step_mm >= 0, "step_mm", step_mm, ">= 0");
  checks.require(min_size_mm >= 0, "min_size_mm", min_size_mm, ">= 0");
  checks.require(data_tolerance >= 0, "data_tolerance", data_tolerance, ">= 0");
  checks.require(gamma_coarsen >= 0 && gamma_coarsen < 1, "gamma_coarsen", gamma_coarsen,
                 "0 <= gamma_coarsen < 1");
  checks.require(outer.rows() == 4, "outer.rows()", double(outer.rows()), "= 4");
  return checks.error();
}

struct MumfordShah::State {
  State(const fem::Geometry<2>& the_shape, Neumann the_solution, bool does_follow,
        double the_length)
      : shape(the_shape),
        solution(std::move(the_solution)),
        follows_shape(does_follow),
        length(the_length) {}

  /// The motion of the mesh with the curves, made when it is first asked for.
  const MeshMotion& motion() const {
    if (!motion_) motion_.emplace(solution.mesh(), shape.elements(), shape.n_vertices());
    return *motion_;
  }

  /// @throws InvalidMesh  what is known belongs to the domain that surgery has made of the curves
  void require_simple() const {
    if (!follows_shape) throw InvalidMesh("mumford-shah: the curves meet one another");
  }

  fem::Geometry<2> shape;
  Neumann solution;
  bool follows_shape;  // the mesh has the shape's vertices: nothing had to be resolved
  double length;
  bool is_worn = false;  // its triangles have become thin

 private:
  mutable std::optional<MeshMotion> motion_;
};

namespace {

double largest_size(const MumfordShahOptions& options) {
  const double wanted = options.max_size_mm > 0 ? options.max_size_mm : std::sqrt(options.mu) / 2;
  return std::clamp(wanted, options.pixel_mm, kMostPixels * options.pixel_mm);
}

MumfordShahOptions checked(const MumfordShahOptions& options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  return options;
}

}  // namespace

MumfordShah::MumfordShah(std::shared_ptr<const Field<2>> I, const MumfordShahOptions& options)
    : I_(std::move(I)),
      options_(checked(options)),
      sizes_(options.outer, largest_size(options), kSizeCell * options.pixel_mm) {
  const Vector<2> origin = options.outer.row(0);
  const Vector<2> a = options.outer.row(1).transpose() - origin,
                  b = options.outer.row(3).transpose() - origin;
  neumann_.mu = options.mu;
  neumann_.spacing_mm = options.pixel_mm;
  neumann_.scale = options.contrast;
  neumann_.offset = moments(*I_, origin, a, b, options.pixel_mm, 0)[0];
  constant_ = 0.5 * std::abs(cross(a, b)) *
              moments(*I_, origin, a, b, options.pixel_mm, neumann_.offset)[1] /
              (options.contrast * options.contrast);
}

MumfordShah::~MumfordShah() = default;

/// Alg. 8: what is marked is halved where the bounds on sizes are lowered, and those stay until
/// raise_sizes().
std::pair<DomainMesh, ImageIntegrals> MumfordShah::adapted_mesh(const Segments& curves) const {
  const Neumann* last = state_ ? &state_->solution : nullptr;
  const auto meshed = [&](const DomainMesh* from) {
    return mesh_domain(
        curves, options_.outer, sizes_,
        from && options_.reuse_nodes ? reusable_nodes(*from, curves, sizes_) : Points<2>(0, 2));
  };
  DomainMesh mesh = meshed(last ? &last->mesh() : nullptr);
  ImageIntegrals integrals = image_integrals(mesh, *I_, neumann_, last ? &last->mesh() : nullptr,
                                             last ? &last->integrals() : nullptr);
  for (int round = 0; round < kAdaptiveRounds && lower_sizes(mesh, integrals.errors); ++round) {
    DomainMesh finer = meshed(&mesh);
    integrals = image_integrals(finer, *I_, neumann_, &mesh, &integrals);
    mesh = std::move(finer);
  }
  return {std::move(mesh), std::move(integrals)};
}

/// Marks and lowers the bounds where a triangle is marked; false if none is.
bool MumfordShah::lower_sizes(const DomainMesh& mesh, const Eigen::VectorXd& errors) const {
  if (options_.data_tolerance == 0) return false;
  const double finest = options_.min_size_mm > 0 ? options_.min_size_mm : 1.5 * options_.pixel_mm;
  const Eigen::VectorXd twice_areas = areas(mesh.triangles, mesh.points);
  const auto marks = fem::mark_function(
      errors, twice_areas / 2, {.tolerance = options_.data_tolerance * twice_areas.sum() / 2});
  bool is_changed = false;
  for (Eigen::Index t = 0; t < mesh.triangles.rows(); ++t) {
    const double size = std::sqrt(twice_areas[t]);  // about the longest edge
    if (marks[t] != fem::Mark::kRefine || size / 2 < finest) continue;
    const auto nodes = mesh.triangles.row(t);
    sizes_.limit((mesh.points.row(nodes[0]) + mesh.points.row(nodes[1]) + mesh.points.row(nodes[2]))
                         .transpose() /
                     3,
                 size / 2, errors[t] / (twice_areas[t] / 2));
    is_changed = true;
  }
  return is_changed;
}

/// The second half of Alg. 8, for the meshes to come: bounds that the error does without. It may
/// grow by what was measured when they were lowered, to less than the tolerance; so nothing is
/// refined and coarsened by turns. Not for trial steps, whose J is compared with that of this mesh.
void MumfordShah::raise_sizes() {
  if (!state_ || options_.data_tolerance == 0 || options_.gamma_coarsen == 0) return;
  const DomainMesh& mesh = state_->solution.mesh();
  const Eigen::VectorXd& errors = state_->solution.integrals().errors;
  const double tolerance = options_.data_tolerance * areas(mesh.triangles, mesh.points).sum() / 2;
  const double budget = kRaisedTo * tolerance - errors.sum();
  if (budget <= 0) return;
  const double bound = options_.gamma_coarsen * errors.maxCoeff();
  std::vector<char> is_held(errors.size());
  for (Eigen::Index t = 0; t < errors.size(); ++t) is_held[t] = errors[t] >= bound;
  sizes_.raise(mesh, is_held, budget);
}

std::unique_ptr<MumfordShah::State> MumfordShah::made(const fem::Geometry<2>& shape) const {
  const Segments curves = segments_of(shape);
  const bool is_simple = bounds_domain(curves);
  const Segments simple = is_simple ? curves : resolved(curves);
  auto [mesh, integrals] = adapted_mesh(simple);
  double length = 0;
  for (const TraceEdge& edge : mesh.trace)
    length += (mesh.points.row(edge.end) - mesh.points.row(edge.start)).norm();
  // What runs along the border of the image costs nothing.
  if (shape.has_border())
    length = energy::charged_measure<2>(shape) + (is_simple ? 0 : length - shape.measure());
  Eigen::VectorXd start;
  if (state_) start = start_from(state_->solution, mesh, unknowns(mesh));
  return std::make_unique<State>(
      shape, Neumann(std::move(mesh), std::move(integrals), I_, neumann_, start), is_simple,
      length);
}

void MumfordShah::reset(const fem::Geometry<2>& shape) {
  raise_sizes();
  state_ = made(shape);
  state_->require_simple();
  drift_ = 0;
}

double MumfordShah::energy_of(const State& state) const {
  return constant_ + state.solution.energy() + options_.gamma * state.length;
}

double MumfordShah::value() const { return energy_of(*state_) - drift_; }

void MumfordShah::remesh(const fem::Geometry<2>& shape) {
  const double drift = drift_;
  reset(shape);
  drift_ = drift;
}

void MumfordShah::rebuild(const fem::Geometry<2>& shape) {
  const double before = value();
  reset(shape);
  drift_ = energy_of(*state_) - before;
}

/// A mesh whose triangles have become thin is made anew, when the derivative is asked for: by then
/// a moving curve has been mended and may have been given a new mesh anyway.
void MumfordShah::refresh() const {
  if (state_->is_worn) state_ = made(state_->shape);
}

double MumfordShah::try_move(const fem::Geometry<2>& moved) {
  tried_.reset();
  if (state_->follows_shape) {
    const Neumann& now = state_->solution;
    const Points<2> points = state_->motion().moved(moved.points() - state_->shape.points());
    const Eigen::ArrayXd ratio = areas(now.mesh().triangles, points).array() /
                                 areas(now.mesh().triangles, now.mesh().points).array();
    if (ratio.minCoeff() > kLeastShare)
      tried_ = std::make_unique<State>(moved, now.moved_to(points), true,
                                       energy::charged_measure<2>(moved));
  }
  if (!tried_) tried_ = made(moved);
  return energy_of(*tried_) - drift_;
}

void MumfordShah::accept() {
  state_ = std::move(tried_);
  state_->is_worn = smallest_angle(state_->solution.mesh()) < kWorn;
}

const Neumann& MumfordShah::solution() const { return state_->solution; }

void MumfordShah::differentiate(const fem::Curvature& curvature, double weight,
                                energy::ShapeTerms<2>& terms) const {
  state_->require_simple();
  refresh();
  const fem::Geometry<2>& shape = state_->shape;
  terms.derivative +=
      weight * state_->motion().transposed(state_->solution.gradient(state_->motion().moving()));
  energy::add_measure_terms<2>(shape, weight * options_.gamma, terms);
  const Traces at = traces();
  const Eigen::ArrayXd a = at.inside - at.intensity, b = at.outside - at.intensity;
  const Eigen::ArrayXd jump = a.square() - b.square();
  const Eigen::ArrayXd slopes = at.slope_inside - at.slope_outside;
  // d_nu u_i = 0, so d_nu (u_i - I)^2 = -2 (u_i - I) d_nu I.
  const Eigen::ArrayXd second = 0.5 * curvature.mean.array() * (jump + options_.mu * slopes) -
                                (at.inside - at.outside).array() * at.intensity_slope.array();
  const Eigen::ArrayXd G = shape_gradient(at, curvature.mean);
  const double step = options_.step_mm > 0 ? options_.step_mm : 4 * options_.pixel_mm;
  terms.beta.array() += weight * second.max(G.abs() / step);
}

void MumfordShah::differentiate_twice(const fem::Curvature& curvature, double weight,
                                      energy::SecondDerivative<2>& second) const {
  state_->require_simple();
  refresh();
  const fem::Geometry<2>& shape = state_->shape;
  const Traces at = traces();
  const Eigen::ArrayXd a = at.inside - at.intensity, b = at.outside - at.intensity;
  // As d_nu u = 0 all along the curve, d_nu |grad u|^2 = -2 kappa |grad_Gamma u|^2 there.
  const Eigen::ArrayXd density =
      0.5 * curvature.mean.array() *
          (a.square() - b.square() - options_.mu * (at.slope_inside - at.slope_outside).array()) -
      (at.inside - at.outside).array() * at.intensity_slope.array();
  energy::add_element_matrices<2>(
      shape, weight * options_.gamma, second.sparse, [&](Eigen::Index t) {
        return fem::p1_stiffness<2, 2>(shape.basis_gradients(t), shape.measures()[t]);
      });
  second.sparse.diagonal() += weight * density.matrix().cwiseProduct(shape.lumped_mass());
  const auto response = std::make_shared<const SolutionResponse>(state_->solution, shape.elements(),
                                                                 shape.n_vertices());
  second.operators.emplace_back([response, weight](const Eigen::VectorXd& W) -> Eigen::VectorXd {
    return weight * (*response)(W);
  });
}

MumfordShah::Traces MumfordShah::traces() const {
  state_->require_simple();
  const fem::Geometry<2>& shape = state_->shape;
  const Neumann& solution = state_->solution;
  const Eigen::Index n = shape.n_vertices();
  Traces out{Eigen::VectorXd(n),       Eigen::VectorXd(n),       Eigen::VectorXd::Zero(n),
             Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n), Eigen::VectorXd::Zero(n)};
  for (Eigen::Index i = 0; i < n; ++i) {
    out.inside[i] = solution.value(int(i), true);
    out.outside[i] = solution.value(int(i), false);
  }
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(n);
  for (const TraceEdge& edge : solution.mesh().trace) {
    const double length =
        (solution.mesh().points.row(edge.end) - solution.mesh().points.row(edge.start)).norm();
    const double in = (solution.value(edge.end, true) - solution.value(edge.start, true)) / length;
    const double out_ =
        (solution.value(edge.end, false) - solution.value(edge.start, false)) / length;
    for (const int node : {edge.start, edge.end}) {
      if (node >= n) continue;
      out.slope_inside[node] += length * in * in;
      out.slope_outside[node] += length * out_ * out_;
      weight[node] += length;
    }
  }
  out.slope_inside.array() /= weight.array();
  out.slope_outside.array() /= weight.array();
  Samples<2> samples;
  I_->sample(shape.points(), Derivatives::kFirst, samples);
  out.intensity = (samples.value.array() - neumann_.offset) / neumann_.scale;
  out.intensity_slope =
      samples.gradient.cwiseProduct(shape.nodal_normals().rowwise().normalized()).rowwise().sum() /
      neumann_.scale;
  return out;
}

Eigen::ArrayXd MumfordShah::shape_gradient(const Traces& at,
                                           const Eigen::VectorXd& curvature) const {
  const Eigen::ArrayXd a = at.inside - at.intensity, b = at.outside - at.intensity;
  const Eigen::ArrayXd slopes = at.slope_inside - at.slope_outside;
  return 0.5 * (a.square() - b.square() + options_.mu * slopes) +
         options_.gamma * curvature.array();
}

Eigen::VectorXd MumfordShah::denoised(const Points<2>& points) const {
  const Neumann& solution = state_->solution;
  const DomainMesh& mesh = solution.mesh();
  const TriangleFinder find(mesh);
  Eigen::VectorXd out(points.rows());
  for (Eigen::Index i = 0; i < points.rows(); ++i) {
    const auto [t, barycentric] = find(points.row(i));
    double u = 0;
    for (int k = 0; k < 3; ++k)
      u += barycentric[k] * solution.value(mesh.triangles(t, k), mesh.is_inside[t]);
    out[i] = neumann_.offset + neumann_.scale * u;
  }
  return out;
}

void MumfordShah::add_density(const Points<2>& points, double weight,
                              Eigen::VectorXd& density) const {
  const Eigen::ArrayXd u = denoised(points);
  Samples<2> samples;
  I_->sample(points, Derivatives::kNone, samples);
  const double outside = neumann_.offset + neumann_.scale * state_->solution.means()[0];
  density.array() +=
      weight / (2 * neumann_.scale * neumann_.scale) *
      ((samples.value.array() - u).square() - (samples.value.array() - outside).square());
}

}  // namespace surf::curve
