#include "libsurf/mesh/moving_mesh.h"

#include <fmt/format.h>
#include <tbb/parallel_for.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <utility>

#include "libsurf/base/error.h"
#include "libsurf/flow/content.h"
#include "libsurf/mesh/shape_part.h"

namespace surf::mesh {
namespace {

constexpr double kLongest = 4.0 / 3, kShortest = 0.4;  // of the wanted edge length
constexpr double kResolution = 0.7;                    // of topology, likewise
constexpr double kTolerance = 0.1;                     // by which mending may move it, likewise
constexpr double kFineNear = 1;    // edge lengths: round an obstacle the shape has no longer ones
constexpr double kFurthest = 3;    // likewise: a start is moved by no more to have a held point
constexpr double kDent = 2;        // likewise: half the width of the dent that this makes, at least
constexpr double kDentStep = 0.5;  // likewise
constexpr double kClearance = 1.02;  // of the held distance: where it ends
constexpr int kMostDents = 20;
constexpr double kEdge = 0.7;  // of the indicator on both sides of an edge, at most

/// Content of the disc or ball of radius r, by r^Dim.
template <int Dim>
constexpr double kUnitBall = Dim == 2 ? std::numbers::pi : 4 * std::numbers::pi / 3;

double measure(const Points<2>& X, const Eigen::RowVector2i& t) {
  return (X.row(t[1]) - X.row(t[0])).norm();
}
double measure(const Points<3>& X, const Eigen::RowVector3i& t) {
  const Vector<3> a = X.row(t[1]) - X.row(t[0]), b = X.row(t[2]) - X.row(t[0]);
  return a.cross(b).norm() / 2;
}

template <int Dim>
std::vector<std::uint8_t> faces_of(const Points<Dim>& X, const ImageBox<Dim>& box) {
  std::vector<std::uint8_t> out;
  for (const auto& point : X.rowwise()) out.push_back(box.faces(point.transpose()));
  return out;
}

/// First i with values[i] below kEdge of the largest before it and of the largest behind it and
/// nothing smaller next to it; -1 if there is none.
Eigen::Index first_valley(const Eigen::VectorXd& values) {
  double before = 0;
  for (Eigen::Index i = 1; i + 1 < values.size(); ++i) {
    before = std::max(before, values[i - 1]);
    const double behind = values.tail(values.size() - 1 - i).maxCoeff();
    if (values[i] < kEdge * std::min(before, behind) && values[i] <= values[i - 1] &&
        values[i] <= values[i + 1])
      return i;
  }
  return -1;
}

}  // namespace

template <int Dim>
std::string MovingShapeOptions<Dim>::error() const {
  const auto message = [](const char* field, double value, const char* constraint) {
    return fmt::format("MovingShapeOptions::{} = {} violates {}", field, value, constraint);
  };
  if (!(edge_length_mm > 0)) return message("edge_length_mm", edge_length_mm, "> 0");
  if (!(coarseness >= 1)) return message("coarseness", coarseness, ">= 1");
  if (!(max_displacement_mm > 0)) return message("max_displacement_mm", max_displacement_mm, "> 0");
  if (edge_indicator && !(path_spacing_mm > 0))
    return message("path_spacing_mm", path_spacing_mm, "> 0 with an edge_indicator");
  if (!(topology_resolution_mm >= 0))
    return message("topology_resolution_mm", topology_resolution_mm, ">= 0");
  if (!(min_content >= 0)) return message("min_content", min_content, ">= 0");
  if (!(sheet_distance >= 0)) return message("sheet_distance", sheet_distance, ">= 0");
  if (!held_points.empty() && !(held_distance_mm > 0))
    return message("held_distance_mm", held_distance_mm, "> 0 with held_points");
  if (Dim == 2 && topology == Topology::kGenus0)
    return "MovingShapeOptions::topology = genus0 is for surfaces: kFree or kFixed";
  return {};
}

template <int Dim>
MovingMesh<Dim>::MovingMesh(const Options& options) : options_(options) {
  if (const std::string error = options.error(); !error.empty()) throw UsageError(error);
  is_obstacle_.assign(options.held_points.size(), 0);
}

template <int Dim>
void MovingMesh<Dim>::take_up_obstacles() {
  if (std::find(is_obstacle_.begin(), is_obstacle_.end(), 0) == is_obstacle_.end()) return;
  const std::vector<char> held =
      are_held<Dim>(simplices(), options_.held_points, options_.held_distance_mm, options_.box);
  std::vector<Vector<Dim>> points, waiting;
  for (std::size_t k = 0; k < held.size(); ++k) {
    is_obstacle_[k] |= held[k];
    (is_obstacle_[k] ? points : waiting).push_back(options_.held_points[k].point);
  }
  obstacles_ = {std::move(points), options_.held_distance_mm, options_.box};
  waiting_ = {std::move(waiting), options_.held_distance_mm, options_.box};
}

template <int Dim>
void MovingMesh<Dim>::find_obstacles() {
  is_obstacle_.assign(options_.held_points.size(), 0);
  obstacles_ = waiting_ = {};
  take_up_obstacles();
}

template <int Dim>
void MovingMesh<Dim>::approach_held_points() {
  const auto edges = std::exchange(options_.edge_indicator, {});
  for (std::size_t k = 0; k < is_obstacle_.size(); ++k)
    for (int step = 0; step < kMostDents && !is_obstacle_[k] && !options_.stop.stop_requested();
         ++step)
      if (!approach(options_.held_points[k])) break;
  options_.edge_indicator = edges;
}

/// One step of a dent or a bulge towards where the shape has the point; false if it is too far.
template <int Dim>
bool MovingMesh<Dim>::approach(const HeldPoint<Dim>& held) {
  const Simplices<Dim> shape = simplices();
  const fem::Geometry<Dim> now = geometry_of(shape);
  const NearestPlace<Dim> nearest = nearest_place<Dim>(shape, held.point, options_.box);
  const double length = options_.edge_length_mm;
  if (nearest.element < 0 || nearest.distance_mm > kFurthest * length) return false;
  const bool is_right =
      bool(are_inside<Dim>(shape, held.point.transpose()).front()) == held.is_inside;
  const double beyond = kClearance * options_.held_distance_mm,
               left = is_right ? beyond - nearest.distance_mm : beyond + nearest.distance_mm;
  Vector<Dim> way = held.is_inside ? Vector<Dim>(now.normals().row(nearest.element))
                                   : Vector<Dim>(-now.normals().row(nearest.element));
  if (nearest.distance_mm > 0.1 * options_.held_distance_mm)
    way = (is_right ? 1 : -1) * (nearest.place - held.point) / nearest.distance_mm;
  const double width = kDent * length + nearest.distance_mm,
               step = std::min({left, kDentStep * length, options_.max_displacement_mm});
  Points<Dim> to = shape.points;
  for (Eigen::Index i = 0; i < to.rows(); ++i) {
    const double at = (shape.points.row(i).transpose() - nearest.place).norm() / width;
    if (at < 1) to.row(i) += step * std::pow(1 - at * at, 2) * way.transpose();
  }
  restrict_whole(to);
  move_whole_to(to);
  mend_whole();
  return true;
}

template <int Dim>
std::vector<std::size_t> MovingMesh<Dim>::lost_obstacles() const {
  if (obstacles_.empty()) return {};
  const std::vector<char> held =
      are_held<Dim>(simplices(), options_.held_points, options_.held_distance_mm, options_.box);
  std::vector<std::size_t> out;
  std::size_t n = 0;
  for (std::size_t k = 0; k < held.size(); ++k) {
    if (!is_obstacle_[k]) continue;
    if (!held[k]) out.push_back(n);
    ++n;
  }
  return out;
}

template <int Dim>
void MovingMesh<Dim>::contest(const std::vector<std::size_t>& lost) {
  std::vector<Vector<Dim>> points = contested_.points();
  for (const std::size_t k : lost)
    if (std::find(points.begin(), points.end(), obstacles_.points()[k]) == points.end())
      points.push_back(obstacles_.points()[k]);
  contested_ = {std::move(points), options_.held_distance_mm, options_.box};
}

template <int Dim>
fem::Geometry<Dim> MovingMesh<Dim>::geometry_of(const Simplices<Dim>& shape) const {
  if (!options_.box) return {shape.points, shape.elements};
  return {shape.points,
          shape.elements,
          {options_.box->normals(), faces_of(shape.points, *options_.box)}};
}

template <int Dim>
fem::Geometry<Dim> MovingMesh<Dim>::geometry() const {
  const Simplices<Dim> shape = simplices();
  if (part_.empty()) return geometry_of(shape);
  ShapePart<Dim> part = part_of<Dim>(shape, is_left_out_);
  const double content = flow::content<Dim>(shape.points, shape.elements);
  const fem::WholeShape whole{std::move(part.is_shared),
                              std::pow(std::max(content, 0.0) / kUnitBall<Dim>, 1.0 / Dim)};
  fem::Border<Dim> border{Points<Dim>(0, Dim), std::vector<std::uint8_t>(part_.size(), 0)};
  if (options_.box) border = {options_.box->normals(), faces_of(part.shape.points, *options_.box)};
  return {std::move(part.shape.points), std::move(part.shape.elements), border, whole};
}

template <int Dim>
flow::ShapeSize MovingMesh<Dim>::size() const {
  const Simplices<Dim> shape = simplices();
  return {flow::content<Dim>(shape.points, shape.elements), shape.points.rows(),
          shape.elements.rows()};
}

template <int Dim>
std::vector<char> MovingMesh<Dim>::resting_elements() const {
  if (!options_.region) return {};
  const Simplices<Dim> shape = simplices();
  std::vector<char> is_vertex_moving;
  for (const auto& point : shape.points.rowwise())
    is_vertex_moving.push_back(options_.region->contains(point.transpose()));
  std::vector<char> out;
  for (const auto& t : shape.elements.rowwise())
    out.push_back(std::none_of(t.begin(), t.end(), [&](int i) { return is_vertex_moving[i]; }));
  return out;
}

template <int Dim>
std::vector<char> MovingMesh<Dim>::unmended_elements() const {
  std::vector<char> out = resting_elements();
  if (out.empty() || !rebuilt_) return out;
  const Simplices<Dim> shape = simplices();
  for (Eigen::Index t = 0; t < shape.elements.rows(); ++t)
    for (const int vertex : shape.elements.row(t))
      if (out[t] && rebuilt_->contains(shape.points.row(vertex).transpose())) out[t] = 0;
  return out;
}

template <int Dim>
bool MovingMesh<Dim>::is_unmended(const Eigen::Matrix<double, Dim, Dim>& corners) const {
  if (!options_.region) return false;
  for (const auto& x : corners.rowwise())
    if (options_.region->contains(x.transpose()) || (rebuilt_ && rebuilt_->contains(x.transpose())))
      return false;
  return true;
}

template <int Dim>
void MovingMesh<Dim>::note_rebuilt(const Points<Dim>& before) {
  if (!options_.region) return;
  if (!rebuilt_) rebuilt_.emplace(options_.edge_length_mm);
  using Place = std::array<double, Dim>;
  const auto place = [](const auto& point) {
    Place out;
    std::copy(point.begin(), point.end(), out.begin());
    return out;
  };
  std::set<Place> known;
  for (const auto& point : before.rowwise()) known.insert(place(point));
  const Points<Dim> now = simplices().points;
  for (const auto& point : now.rowwise())
    if (!known.contains(place(point))) rebuilt_->add(point.transpose());
}

template <int Dim>
void MovingMesh<Dim>::find_part() {
  part_.clear();
  is_left_out_ = resting_elements();
  const auto n_left_out = std::count(is_left_out_.begin(), is_left_out_.end(), 1);
  rests_ = n_left_out > 0 && std::size_t(n_left_out) == is_left_out_.size();
  if (n_left_out == 0 || rests_) return;
  part_ = part_of<Dim>(simplices(), is_left_out_).vertices;
}

template <int Dim>
double MovingMesh<Dim>::restrict_move(Points<Dim>& to) {
  if (part_.empty()) return restrict_whole(to);
  Points<Dim> whole = simplices().points;
  whole(part_, Eigen::all) = to;
  const double share = restrict_whole(whole);
  to = whole(part_, Eigen::all);
  return share;
}

template <int Dim>
void MovingMesh<Dim>::move_to(const Points<Dim>& to) {
  if (part_.empty()) return move_whole_to(to);
  Points<Dim> whole = simplices().points;
  whole(part_, Eigen::all) = to;
  move_whole_to(whole);
}

template <int Dim>
bool MovingMesh<Dim>::mend() {
  const bool has_changed = mend_whole();
  find_part();
  return has_changed;
}

template <int Dim>
std::vector<flow::TopologyEvent> MovingMesh<Dim>::take_events() {
  return std::exchange(events_, {});
}

template <int Dim>
fem::AdaptivityOptions<Dim> MovingMesh<Dim>::adaptivity() const {
  fem::AdaptivityOptions<Dim> out = options_.adaptivity;
  out.min_length_mm = kLongest * options_.edge_length_mm;
  out.max_length_mm = options_.coarseness * out.min_length_mm;
  if (!options_.held_points.empty() && options_.coarseness > 1)
    out.is_fine = [this](const Eigen::Matrix<double, Dim, Dim>& corners) {
      const double length = options_.edge_length_mm, distance = options_.held_distance_mm;
      return obstacles_.is_near(corners, kFineNear * length + distance) ||
             waiting_.is_near(corners, kFurthest * length + distance);
    };
  if (options_.region)
    out.rests = [this](const Eigen::Matrix<double, Dim, Dim>& corners) {
      return std::none_of(
          corners.rowwise().begin(), corners.rowwise().end(),
          [this](const auto& x) { return options_.region->contains(x.transpose()); });
    };
  return out;
}

template <int Dim>
double MovingMesh<Dim>::shortest_edge() const {
  return kShortest * options_.edge_length_mm;
}

template <int Dim>
double MovingMesh<Dim>::mending_tolerance() const {
  return kTolerance * options_.edge_length_mm;
}

template <int Dim>
double MovingMesh<Dim>::topology_resolution() const {
  return options_.topology_resolution_mm > 0 ? options_.topology_resolution_mm
                                             : kResolution * options_.edge_length_mm;
}

template <int Dim>
double MovingMesh<Dim>::min_content() const {
  return options_.min_content > 0 ? options_.min_content
                                  : kUnitBall<Dim> * std::pow(topology_resolution(), Dim);
}

template <int Dim>
void MovingMesh<Dim>::keep_in_box(Points<Dim>& to) const {
  if (!options_.box) return;
  for (auto point : to.rowwise()) point = options_.box->clamped(point.transpose()).transpose();
}

template <int Dim>
void MovingMesh<Dim>::bound_move(const Points<Dim>& from, const Elements<Dim>& T,
                                 Points<Dim>& to) const {
  keep_in_box(to);
  stop_at_edges(from, to);
  obstacles_.limit(from, T, to);
}

template <int Dim>
void MovingMesh<Dim>::stop_at_edges(const Points<Dim>& from, Points<Dim>& to) const {
  if (!options_.edge_indicator) return;
  tbb::parallel_for(Eigen::Index(0), to.rows(), [&](Eigen::Index i) {
    const Vector<Dim> start = from.row(i), way = to.row(i) - from.row(i);
    const auto n = static_cast<Eigen::Index>(std::ceil(way.norm() / options_.path_spacing_mm));
    if (n < 2) return;
    const Points<Dim> path = start.transpose().replicate(n + 1, 1) +
                             Eigen::VectorXd::LinSpaced(n + 1, 0, 1) * way.transpose();
    Samples<Dim> samples;
    options_.edge_indicator->sample(path, Derivatives::kNone, samples);
    const Eigen::Index edge = first_valley(samples.value);
    if (edge > 0) to.row(i) = path.row(edge);
  });
}

template <int Dim>
bool MovingMesh<Dim>::has_vanished() const {
  const Simplices<Dim> shape = simplices();
  const double least =
      kUnitBall<Dim> * std::pow(options_.min_radius * options_.edge_length_mm, Dim);
  return has_vanished_ || flow::content<Dim>(shape.points, shape.elements) < least;
}

template <int Dim>
std::string MovingMesh<Dim>::obstacle() const {
  if (has_vanished()) {  // where a step would leave nothing, the shape is still that before it
    const Simplices<Dim> shape = simplices();
    return fmt::format(
        "the object vanished: {} its {} of {:.3g} mm^{}{}",
        has_vanished_ ? "a step would leave nothing of" : "little was left with",
        Dim == 2 ? "area" : "volume", flow::content<Dim>(shape.points, shape.elements), Dim,
        has_vanished_
            ? ""
            : fmt::format(", too little for edges of {:.3g} mm", options_.edge_length_mm));
  }
  const double share = covered_border();
  if (share > options_.max_border_share)
    return fmt::format("the {} fills the {}: it covers {:.0f} % of its border",
                       Dim == 2 ? "curve" : "surface", Dim == 2 ? "image" : "volume", 100 * share);
  return {};
}

template <int Dim>
double MovingMesh<Dim>::border_share() const {
  if (!options_.box) return 0;
  const Simplices<Dim> shape = simplices();
  std::vector<char> is_on_border;
  for (const std::uint8_t faces : faces_of(shape.points, *options_.box))
    is_on_border.push_back(faces != 0);
  return share_of_vertices<Dim>(shape.points, shape.elements, is_on_border);
}

template <int Dim>
double MovingMesh<Dim>::covered_border() const {
  if (!options_.box) return 0;
  const Simplices<Dim> shape = simplices();
  const std::vector<std::uint8_t> faces = faces_of(shape.points, *options_.box);
  double sum = 0;
  for (const auto& t : shape.elements.rowwise()) {
    std::uint8_t common = 0xff;
    for (int i = 0; i < Dim; ++i) common &= faces[t[i]];
    if (common != 0) sum += measure(shape.points, t);
  }
  return sum / options_.box->border_measure();
}

template <int Dim>
double share_of_vertices(const Points<Dim>& X, const Elements<Dim>& T,
                         const std::vector<char>& is_chosen) {
  double chosen = 0, all = 0;
  for (Eigen::Index t = 0; t < T.rows(); ++t) {
    const double size = measure(X, T.row(t));
    all += Dim * size;
    for (int i = 0; i < Dim; ++i) chosen += is_chosen[T(t, i)] ? size : 0;
  }
  return all > 0 ? chosen / all : 0;
}

template <int Dim>
std::vector<char> held_vertices(const Points<Dim>& from, const Points<Dim>& wanted,
                                const Points<Dim>& to) {
  std::vector<char> is_held(to.rows());
  for (Eigen::Index i = 0; i < to.rows(); ++i)
    is_held[i] = to.row(i) == from.row(i) && wanted.row(i) != from.row(i);
  return is_held;
}

template struct MovingShapeOptions<2>;
template struct MovingShapeOptions<3>;
template class MovingMesh<2>;
template class MovingMesh<3>;
template double share_of_vertices<2>(const Points<2>&, const Elements<2>&,
                                     const std::vector<char>&);
template double share_of_vertices<3>(const Points<3>&, const Elements<3>&,
                                     const std::vector<char>&);
template std::vector<char> held_vertices<2>(const Points<2>&, const Points<2>&, const Points<2>&);
template std::vector<char> held_vertices<3>(const Points<3>&, const Points<3>&, const Points<3>&);

}  // namespace surf::mesh
