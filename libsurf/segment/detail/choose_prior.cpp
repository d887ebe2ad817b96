#include "libsurf/segment/detail/choose_prior.h"

#include <tbb/parallel_for.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "libsurf/mesh/shape_part.h"

namespace surf::segment {
namespace {

constexpr std::array kLengths = {4.0, 6.0, 8.0, 12.0, 16.0, 24.0};  // cells
constexpr int kMiddle = 3;                                          // of the lengths
constexpr int kPatches = 4;
constexpr Eigen::Index kOfPatch = 1500;  // vertices
constexpr Eigen::Index kWhole = kPatches * kOfPatch;

/// A patch of a shape, on which lengths are compared.
template <int Dim>
struct Patch {
  std::vector<int> vertices;  // of the shape
  fem::Geometry<Dim> geometry;
  BendingMatrices bending;
  std::array<Observations, 2> halves;
};

/// Flags of so many vertices round one of them as a patch has, ring by ring.
std::vector<char> vertices_round(const Eigen::SparseMatrix<double>& neighbours, int vertex) {
  std::vector<int> found = {vertex};
  std::vector<char> out(std::size_t(neighbours.cols()), 0);
  out[std::size_t(vertex)] = 1;
  for (std::size_t next = 0; next < found.size(); ++next)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(neighbours, found[next]); entry;
         ++entry) {
      char& is_found = out[std::size_t(entry.row())];
      if (is_found || Eigen::Index(found.size()) >= kOfPatch) continue;
      is_found = 1;
      found.push_back(int(entry.row()));
    }
  return out;
}

/// What is observed of some vertices while the others stay at their moves.
Observations conditioned(const Observations& whole, const Eigen::VectorXd& u,
                         const std::vector<int>& vertices) {
  std::vector<int> row_of(std::size_t(u.size()), -1);
  Eigen::VectorXd of_others = u;
  for (std::size_t row = 0; row < vertices.size(); ++row) {
    row_of[std::size_t(vertices[row])] = int(row);
    of_others[vertices[row]] = 0;
  }
  const Eigen::VectorXd b = whole.b - whole.P * of_others;
  std::vector<Eigen::Triplet<double>> entries;
  for (const int i : vertices)
    for (Eigen::SparseMatrix<double>::InnerIterator entry(whole.P, i); entry; ++entry)
      if (const int row = row_of[std::size_t(entry.row())]; row >= 0)
        entries.emplace_back(row, row_of[std::size_t(i)], entry.value());
  Observations out;
  out.b = b(vertices);
  out.P.resize(out.b.size(), out.b.size());
  out.P.setFromTriplets(entries.begin(), entries.end());
  return out;
}

template <int Dim>
std::unique_ptr<Patch<Dim>> patch_round(const fem::Geometry<Dim>& geometry,
                                        const std::array<Observations, 2>& halves,
                                        const Eigen::VectorXd& u, int vertex) {
  const Elements<Dim>& T = geometry.elements();
  const std::vector<char> is_near = vertices_round(geometry.topology().pattern(), vertex);
  std::vector<char> is_left_out(std::size_t(T.rows()), 0);
  for (Eigen::Index t = 0; t < T.rows(); ++t)
    for (const int i : T.row(t)) is_left_out[std::size_t(t)] |= !is_near[std::size_t(i)];
  mesh::ShapePart<Dim> part = mesh::part_of<Dim>({geometry.points(), T}, is_left_out);
  for (std::size_t row = 0; row < part.vertices.size(); ++row)
    part.is_shared[row] |= geometry.is_on_border(part.vertices[row]);
  const fem::Border<Dim> none{{}, std::vector<std::uint8_t>(part.vertices.size(), 0)};
  fem::Geometry<Dim> of_part(part.shape.points, part.shape.elements, none, {part.is_shared, 0});
  std::array conditioned_halves = {conditioned(halves[0], u, part.vertices),
                                   conditioned(halves[1], u, part.vertices)};
  BendingMatrices bending(of_part, conditioned_halves[0].P);
  return std::make_unique<Patch<Dim>>(Patch<Dim>{std::move(part.vertices), std::move(of_part),
                                                 std::move(bending),
                                                 std::move(conditioned_halves)});
}

/// Patches in the middles of equal parts of a shape along its longest axis, round vertices that see
/// cells and lie in no patch before them. None if there are no such vertices.
template <int Dim>
std::vector<std::unique_ptr<Patch<Dim>>> patches_of(const fem::Geometry<Dim>& geometry,
                                                    const std::array<Observations, 2>& halves,
                                                    const Eigen::VectorXd& u) {
  const Points<Dim>& X = geometry.points();
  const Points<Dim> from_centre = X.rowwise() - X.colwise().mean();
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, Dim, Dim>> axes(
      from_centre.transpose() * from_centre);
  const Eigen::VectorXd along = from_centre * axes.eigenvectors().col(Dim - 1);
  const Eigen::VectorXd information = halves[0].P.diagonal() + halves[1].P.diagonal();
  std::vector<int> order;
  for (int i = 0; i < int(X.rows()); ++i)
    if (information[i] > 0) order.push_back(i);
  std::sort(order.begin(), order.end(),
            [&](int a, int b) { return std::pair(along[a], a) < std::pair(along[b], b); });
  std::vector<char> is_in_one(std::size_t(X.rows()), 0);
  std::vector<std::unique_ptr<Patch<Dim>>> out;
  for (int k = 0; k < kPatches; ++k)
    for (std::size_t at = order.size() * std::size_t(2 * k + 1) / (2 * kPatches); at < order.size();
         ++at) {
      if (is_in_one[std::size_t(order[at])]) continue;
      out.push_back(patch_round<Dim>(geometry, halves, u, order[at]));
      for (const int i : out.back()->vertices) is_in_one[std::size_t(i)] = 1;
      break;
    }
  return out;
}

}  // namespace

template <int Dim>
PriorChoice<Dim> choose_prior(const fem::Geometry<Dim>& geometry, const BendingMatrices& bending,
                              const Points<Dim>& normals, const std::array<Observations, 2>& halves,
                              const Eigen::VectorXd& u, double cell_mm, double most_mm,
                              const std::stop_token& stop) {
  std::vector<std::unique_ptr<Patch<Dim>>> patches;
  if (geometry.n_vertices() > kWhole) patches = patches_of<Dim>(geometry, halves, u);
  using Losses = std::array<double, 2>;
  const auto losses_of = [&](const SmoothMoves<Dim>& prior, const BendingMatrices& bent,
                             const fem::Geometry<Dim>& shape,
                             const std::array<Observations, 2>& seen) {
    Losses out{};
    tbb::parallel_for(0, 2, [&](int half) {
      if (stop.stop_requested()) return;
      const Eigen::VectorXd moves =
          posterior<Dim>(prior, bent, shape, seen[half], prior.smoothing())
              .mean()
              .cwiseMax(-most_mm)
              .cwiseMin(most_mm);
      out[half] = moves.dot(seen[1 - half].P * moves) / 2 - seen[1 - half].b.dot(moves);
    });
    return out;
  };
  std::array<std::optional<SmoothMoves<Dim>>, kLengths.size()> priors;
  std::array<Losses, kLengths.size()> losses{};
  const auto compare = [&](int first, int n) {
    tbb::parallel_for(first, first + n, [&](int k) {
      const double length_mm = kLengths[k] * cell_mm;
      const SmoothMoves<Dim>& prior = priors[k].emplace(bending, geometry, normals, length_mm);
      if (patches.empty()) losses[k] = losses_of(prior, bending, geometry, halves);
      std::vector<Losses> of_patch(patches.size());
      tbb::parallel_for(std::size_t(0), patches.size(), [&](std::size_t i) {
        const Patch<Dim>& patch = *patches[i];
        const auto local = SmoothMoves<Dim>::of_part(patch.bending, patch.geometry,
                                                     prior.smoothing()(patch.vertices), length_mm);
        of_patch[i] = losses_of(local, patch.bending, patch.geometry, patch.halves);
      });
      for (const Losses& one : of_patch)
        for (int half = 0; half < 2; ++half) losses[k][half] += one[half];
    });
  };
  const auto is_better = [&](int shorter, int longer) {
    return losses[shorter][0] < losses[longer][0] && losses[shorter][1] < losses[longer][1];
  };
  compare(kMiddle - 1, 2);
  const int step = is_better(kMiddle - 1, kMiddle) ? -1 : 1;
  int best = step == 1 ? kMiddle : kMiddle - 1;
  for (int next = best + step; !stop.stop_requested() && next >= 0 && next < int(kLengths.size());
       next += step) {
    compare(next, 1);
    if (step == 1 ? is_better(best, next) : !is_better(next, best)) break;
    best = next;
  }
  return {kLengths[best] * cell_mm, *std::move(priors[best])};
}

template PriorChoice<2> choose_prior<2>(const fem::Geometry<2>&, const BendingMatrices&,
                                        const Points<2>&, const std::array<Observations, 2>&,
                                        const Eigen::VectorXd&, double, double,
                                        const std::stop_token&);
template PriorChoice<3> choose_prior<3>(const fem::Geometry<3>&, const BendingMatrices&,
                                        const Points<3>&, const std::array<Observations, 2>&,
                                        const Eigen::VectorXd&, double, double,
                                        const std::stop_token&);

}  // namespace surf::segment
