// First and second derivatives of every shape energy against differences, on random smooth shapes,
// with analytic fields and with those of images. The tables of docs/energy-derivatives.md.
//
//   derivative_study [flows]   flows: the velocities of the flows alone
#include <fmt/format.h>

#include <cmath>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

#include "libcurve/energy/mumford_shah.h"
#include "libcurve/image/image_fields.h"
#include "libcurve/image/phantom.h"
#include "libsurf/energy/mumford_shah.h"
#include "libsurf/fem/stiffness.h"
#include "libsurf/flow/velocity.h"
#include "libsurf/volume/image_fields.h"
#include "libsurf/volume/phantom.h"
#include "tests/surf/energy/energies.h"

namespace {

using namespace surf;

constexpr int kShapes = 5;
constexpr double kSmallStep = 2e-3;  // [mm] of the difference quotients' limit
constexpr double kRounding = 1e-9;   // relative errors below have no order

/// Errors of one energy per entry of a ladder, over all shapes.
struct Errors {
  std::vector<double> squares;
  std::vector<double> scales;

  void add(std::size_t rung, double error, double scale) {
    squares.resize(std::max(squares.size(), rung + 1));
    scales.resize(squares.size());
    squares[rung] += error * error;
    scales[rung] += scale * scale;
  }
  /// Root mean square of the error over that of the derivative.
  double relative(std::size_t rung) const { return std::sqrt(squares[rung] / scales[rung]); }
  bool has(std::size_t rung) const { return rung < squares.size(); }
};

/// In the order of every_energy.
class Table {
 public:
  Errors& row(const std::string& name) {
    if (!rows_.contains(name)) names_.push_back(name);
    return rows_[name];
  }
  template <class Visit>
  void for_each(const Visit& visit) const {
    for (const auto& name : names_) visit(name, rows_.at(name));
  }
  /// @param from, to  the rungs that the order is taken from
  void print(const std::vector<std::string>& heads, double ratio, std::size_t from,
             std::size_t to) const {
    fmt::print("| energy |");
    for (const auto& head : heads) fmt::print(" {} |", head);
    fmt::print(" order |\n|---|");
    for (std::size_t i = 0; i <= heads.size(); ++i) fmt::print("---|");
    fmt::print("\n");
    for (const auto& name : names_) {
      const Errors& errors = rows_.at(name);
      fmt::print("| {} |", name);
      for (std::size_t i = 0; i < heads.size(); ++i)
        fmt::print(" {} |", errors.has(i) ? fmt::format("{:.1e}", errors.relative(i)) : "-");
      const std::size_t last = std::min(to, errors.squares.size() - 1), first = last + from - to;
      const double order = std::log(errors.relative(first) / errors.relative(last)) /
                           (double(to - from) * std::log(ratio));
      fmt::print(" {} |\n",
                 errors.relative(last) > kRounding ? fmt::format("{:.2f}", order) : "exact");
    }
    fmt::print("\n");
    std::fflush(stdout);
  }

 private:
  std::vector<std::string> names_;
  std::map<std::string, Errors> rows_;
};

/// A field in coordinates about another origin.
template <int Dim>
class ShiftedField : public Field<Dim> {
 public:
  ShiftedField(std::shared_ptr<const Field<Dim>> field, const Vector<Dim>& origin)
      : field_(std::move(field)), origin_(origin) {}
  void sample(const Points<Dim>& x, Derivatives order, Samples<Dim>& out) const override {
    field_->sample(x.rowwise() + origin_.transpose(), order, out);
  }

 private:
  std::shared_ptr<const Field<Dim>> field_;
  Vector<Dim> origin_;
};

constexpr int kCells = 96;
constexpr double kSide = 5;  // of the images [mm]; the shapes have radii of about 1
constexpr double kCell = kSide / kCells;
constexpr double kSigma = 0.2, kLambda = 1;

template <int Dim>
energy::ImageTotals totals_of(const Field<Dim>& I) {
  Points<Dim> points(std::lround(std::pow(kCells, Dim)), Dim);
  for (Eigen::Index i = 0; i < points.rows(); ++i)
    for (Eigen::Index axis = 0, rest = i; axis < Dim; ++axis, rest /= kCells)
      points(i, axis) = (double(rest % kCells) + 0.5) * kCell - kSide / 2;
  Samples<Dim> samples;
  I.sample(points, Derivatives::kNone, samples);
  const double cell = std::pow(kCell, Dim);
  return {cell * double(points.rows()), cell * samples.value.sum(),
          cell * samples.value.squaredNorm()};
}

template <int Dim>
test::EnergyFields<Dim> complete(std::shared_ptr<const Field<Dim>> H,
                                 std::shared_ptr<const Field<Dim>> I) {
  test::EnergyFields<Dim> fields;
  fields.H = std::move(H);
  fields.I = std::move(I);
  fields.totals = totals_of<Dim>(*fields.I);
  fields.third_step_mm = 0.01 * kCell;
  return fields;
}

/// A noisy object whose boundary the shapes cross.
test::EnergyFields<2> image_fields(test::Dim_<2>) {
  curve::PhantomOptions options;
  options.size = {kCells, kCells};
  options.spacing_mm.setConstant(kCell);
  options.edge_width = 0.2;
  options.noise = 0.05;
  const curve::Image image = curve::make_phantom(options);
  curve::FieldOptions smoothing;
  smoothing.smoothing.sigma_mm = kSigma;
  const Vector<2> centre = options.unit_to_plane().translation();
  const auto shifted = [&](std::shared_ptr<const Field<2>> field) {
    return std::make_shared<const ShiftedField<2>>(std::move(field), centre);
  };
  return complete<2>(shifted(curve::edge_indicator(image, smoothing, kLambda)),
                     shifted(curve::intensity_field(image, smoothing)));
}

test::EnergyFields<3> image_fields(test::Dim_<3>) {
  volume::PhantomOptions options;
  options.size = {kCells, kCells, kCells};
  options.spacing_mm = Eigen::Vector3d::Constant(kCell);
  options.kind = volume::PhantomKind::kBox;
  options.edge_width_mm = 0.4;
  options.noise = 0.05;
  const volume::Volume volume = volume::make_phantom(options);
  const volume::SmoothingOptions smoothing{.sigma_mm = kSigma};
  return complete<3>(volume::edge_indicator(volume, smoothing, kLambda),
                     volume::intensity_field(volume, smoothing));
}

/// One random shape with two smooth normal velocities.
template <int Dim>
struct Probe {
  Probe(unsigned seed, int level)
      : smooth(test::smooth_shape<Dim>(seed, level)),
        shape(smooth.X, smooth.T),
        A(fem::stiffness<Dim>(shape, Eigen::VectorXd::Ones(shape.n_elements()))),
        curvature(fem::curvature<Dim>(shape, A)),
        V(test::smooth_function<Dim>(smooth.X, 100 + seed)),
        W(test::smooth_function<Dim>(smooth.X, 200 + seed)) {}

  double first(const energy::ShapeEnergy<Dim>& J) const {
    energy::ShapeTerms<Dim> terms(shape);
    J.differentiate(curvature, 1, terms);
    return terms.derivative.cwiseProduct(V.asDiagonal() * smooth.normals).sum();
  }
  double second(const energy::ShapeEnergy<Dim>& J) const {
    energy::SecondDerivative<Dim> d2J(shape);
    J.differentiate_twice(curvature, 1, d2J);
    return V.dot(d2J.times(shape, A, W));
  }
  double first_difference(energy::ShapeEnergy<Dim>& J, double step) const {
    return test::first_difference<Dim>(J, shape, V.asDiagonal() * smooth.normals, step);
  }
  double second_difference(energy::ShapeEnergy<Dim>& J, double step) const {
    return test::second_difference<Dim>(J, shape, V.asDiagonal() * smooth.normals,
                                        W.asDiagonal() * smooth.normals, step);
  }

  /// Richardson's extrapolation to step 0; truncation ~ kSmallStep^4.
  double second_limit(energy::ShapeEnergy<Dim>& J) const {
    return (4 * second_difference(J, kSmallStep) - second_difference(J, 2 * kSmallStep)) / 3;
  }

  test::SmoothShape<Dim> smooth;
  fem::Geometry<Dim> shape;
  SparseMatrix A;
  fem::Curvature curvature;
  Eigen::VectorXd V, W;
};

struct Flow {
  const char* name;
  flow::ScalarProduct product;
  flow::Scheme scheme;
};
constexpr Flow kFlows[] = {
    {"L2 explicit", flow::ScalarProduct::kL2, flow::Scheme::kExplicit},
    {"L2 semi-implicit", flow::ScalarProduct::kL2, flow::Scheme::kSemiImplicit},
    {"H1 explicit", flow::ScalarProduct::kH1, flow::Scheme::kExplicit},
    {"H1 semi-implicit", flow::ScalarProduct::kH1, flow::Scheme::kSemiImplicit},
    {"H^-1 explicit", flow::ScalarProduct::kHMinus1, flow::Scheme::kExplicit},
    {"H^-1 semi-implicit", flow::ScalarProduct::kHMinus1, flow::Scheme::kSemiImplicit}};
constexpr double kFlowSteps[] = {2e-3, 1e-3};  // [mm], of the fastest vertex
constexpr double kTimeStep = 1e-3;             // of the semi-implicit schemes

/// Errors of dJ(V) for the velocities V of all flows, entry 2 f + s of flow f and step s.
template <int Dim>
void add_flows(const Probe<Dim>& probe, energy::ShapeEnergy<Dim>& J, Errors& errors) {
  energy::ShapeTerms<Dim> terms(probe.shape);
  J.differentiate(probe.curvature, 1, terms);
  for (std::size_t f = 0; f < std::size(kFlows); ++f) {
    const flow::VelocityOptions options{.product = kFlows[f].product, .scheme = kFlows[f].scheme};
    const flow::VelocitySystem<Dim> system(probe.shape, terms, probe.A, options);
    const flow::Velocity<Dim> velocity = system.solve(kTimeStep);
    const Points<Dim> V = velocity.vector / velocity.vector.rowwise().norm().maxCoeff();
    const double dJ = terms.derivative.cwiseProduct(V).sum();
    for (std::size_t s = 0; s < std::size(kFlowSteps); ++s)
      errors.add(2 * f + s, dJ - test::first_difference<Dim>(J, probe.shape, V, kFlowSteps[s]), dJ);
  }
}

// Of the model of Mumford and Shah, on a square or cube that holds the shapes. Its meshes and grids
// are as fine as the shape's elements, which leaves out those that would cost minutes.
constexpr int kMostSegments = 600;
constexpr energy::MumfordShahWeights kWeights{.mu = 0.1, .gamma = 0.05, .contrast = 0.7};
constexpr double kHalfSide = 1.8;  // [mm]

std::unique_ptr<energy::ShapeEnergy<2>> mumford_shah(std::shared_ptr<const Field<2>> I,
                                                     const fem::Geometry<2>& shape) {
  curve::MumfordShahOptions options;
  static_cast<energy::MumfordShahWeights&>(options) = kWeights;
  options.outer.resize(4, 2);
  options.outer << -1, -1, 1, -1, 1, 1, -1, 1;
  options.outer *= kHalfSide;
  options.pixel_mm = shape.measure() / double(shape.n_elements());
  options.max_size_mm = 4 * options.pixel_mm;
  options.data_tolerance = 0;
  return std::make_unique<curve::MumfordShah>(std::move(I), options);
}

std::unique_ptr<energy::ShapeEnergy<3>> mumford_shah(std::shared_ptr<const Field<3>> I,
                                                     const fem::Geometry<3>& shape) {
  energy::MumfordShahOptions options;
  static_cast<energy::MumfordShahWeights&>(options) = kWeights;
  options.solver.tolerance = 1e-11;
  const int n = int(std::ceil(
      2 * kHalfSide / std::sqrt(4 / std::sqrt(3) * shape.measure() / double(shape.n_elements()))));
  volume::Grid grid{{n + 1, n + 1, n + 1}, Eigen::Affine3d::Identity()};
  grid.index_to_world = Eigen::Translation3d(Eigen::Vector3d::Constant(-kHalfSide)) *
                        Eigen::Scaling(2 * kHalfSide / n);
  return std::make_unique<energy::MumfordShah>(std::move(I), grid, options);
}

/// @param visit  called with the name and the energy, reset to the shape of the probe
template <int Dim, class Visit>
void for_every_energy(const Probe<Dim>& probe, const test::EnergyFields<Dim>& fields,
                      const Visit& visit) {
  auto cases = test::every_energy<Dim>(fields);
  if (Dim == 3 || probe.shape.n_elements() <= kMostSegments)
    cases.push_back({"mumford-shah", mumford_shah(fields.I, probe.shape)});
  for (auto& [name, J] : cases) {
    J->reset(probe.shape);
    visit(name, *J);
  }
}

template <int Dim, class FieldsOfSeed>
void study(const std::string& title, const FieldsOfSeed& fields_of) {
  const char* elements = Dim == 2 ? "segments" : "triangles";
  const std::vector<double> first_steps = {4e-2, 2e-2, 1e-2, 5e-3, 1e-4};
  const std::vector<double> second_steps = {0.04, 0.02, 0.01, 0.005};
  const int coarsest = Dim == 2 ? 3 : 2, finest = Dim == 2 ? 8 : 5;
  const auto heads = [](const std::vector<double>& steps) {
    std::vector<std::string> out;
    for (const double step : steps) out.push_back(fmt::format("{:g}", step));
    return out;
  };
  Table first, second, mesh;
  std::vector<std::string> mesh_heads;
  for (int level = coarsest; level <= finest; ++level)
    for (int seed = 1; seed <= kShapes; ++seed) {
      const Probe<Dim> probe(seed, level);
      if (seed == 1) mesh_heads.push_back(fmt::format("{} {}", probe.shape.n_elements(), elements));
      for_every_energy<Dim>(probe, fields_of(seed), [&](const std::string& name, auto& J) {
        const double d2J = probe.second(J), limit = probe.second_limit(J);
        mesh.row(name).add(level - coarsest, d2J - limit, d2J);
        if (level == finest)
          for (std::size_t i = 0; i < second_steps.size(); ++i)
            second.row(name).add(i, limit - probe.second_difference(J, second_steps[i]), d2J);
        if (level != coarsest + 1) return;
        const double dJ = probe.first(J);
        for (std::size_t i = 0; i < first_steps.size(); ++i)
          first.row(name).add(i, dJ - probe.first_difference(J, first_steps[i]), dJ);
      });
    }
  fmt::print("## {}\n\n", title);
  fmt::print("|dJ(V) - difference| / |dJ(V)| by step [mm], {}; the order from the first two:\n\n",
             mesh_heads[1]);
  first.print(heads(first_steps), 2, 0, 1);
  fmt::print(
      "|d2J(V, W) - limit of the differences| / |d2J(V, W)| by mesh; the order from the last "
      "two:\n\n");
  mesh.print(mesh_heads, 2, mesh_heads.size() - 2, mesh_heads.size() - 1);
  fmt::print(
      "|difference - its limit| / |d2J(V, W)| by step [mm] on {}; the order from the last two:\n\n",
      mesh_heads.back());
  second.print(heads(second_steps), 2, 2, 3);
}

template <int Dim>
void study_dimension(const std::string& shapes) {
  study<Dim>(shapes + ", analytic fields",
             [](unsigned seed) { return test::wave_fields<Dim>(seed); });
  const auto image = image_fields(test::Dim_<Dim>());
  study<Dim>(shapes + ", fields of an image", [&](unsigned) { return image; });
}

template <int Dim, class FieldsOfSeed>
void study_flows(const std::string& title, const FieldsOfSeed& fields_of) {
  Table table;
  for (int seed = 1; seed <= kShapes; ++seed) {
    const Probe<Dim> probe(seed, Dim == 2 ? 4 : 3);
    for_every_energy<Dim>(probe, fields_of(seed), [&](const std::string& name, auto& J) {
      add_flows<Dim>(probe, J, table.row(name));
    });
  }
  fmt::print(
      "## {}\n\n|dJ(V) - difference| / |dJ(V)| for the velocities V of the flows, fastest vertex "
      "moved by {:g} mm, and the order from {:g} mm:\n\n",
      title, kFlowSteps[1], kFlowSteps[0]);
  fmt::print("| energy |");
  for (const Flow& flow : kFlows) fmt::print(" {} |", flow.name);
  fmt::print("\n|---|---|---|---|---|---|---|\n");
  table.for_each([](const std::string& name, const Errors& errors) {
    fmt::print("| {} |", name);
    for (std::size_t f = 0; f < std::size(kFlows); ++f) {
      const double coarse = errors.relative(2 * f), fine = errors.relative(2 * f + 1);
      fmt::print(" {:.1e}{} |", fine,
                 fine > kRounding ? fmt::format(", {:.2f}", std::log2(coarse / fine)) : "");
    }
    fmt::print("\n");
  });
  fmt::print("\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  const std::string part = argc > 1 ? argv[1] : "";
  if (!part.empty() && part != "flows") {
    fmt::print(stderr, "derivative_study: expected no argument or 'flows'; got '{}'\n", part);
    return 2;
  }
  study_flows<2>("Flows of curves", [](unsigned seed) { return test::wave_fields<2>(seed); });
  study_flows<3>("Flows of surfaces", [](unsigned seed) { return test::wave_fields<3>(seed); });
  if (part == "flows") return 0;
  study_dimension<2>("Curves");
  study_dimension<3>("Surfaces");
}
