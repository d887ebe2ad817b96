// Velocities of degree 2 on flat elements, against those of degree 1: the tables of docs/flows.md.
//   quadratic_velocities [velocity|boundary]
#include <fmt/format.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCholesky>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <map>
#include <numbers>
#include <string>
#include <utility>
#include <vector>

#include "libcurve/mesh/primitives.h"
#include "libsurf/fem/geometry.h"
#include "libsurf/fem/quadrature.h"
#include "libsurf/mesh/primitives.h"

namespace {

using namespace surf;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

enum class Degree { kLumped, kLinear, kQuadratic };

const char* name_of(Degree degree) {
  return degree == Degree::kLumped ? "P1, lumped" : degree == Degree::kLinear ? "P1" : "P2";
}

/// Lagrange elements of degree 1 or 2: unknowns at the vertices, then at the middles of edges.
template <int Dim>
class Space {
 public:
  static constexpr int kEdges = Dim * (Dim - 1) / 2;

  Space(const fem::Geometry<Dim>& shape, Degree degree)
      : shape_(shape), degree_(degree), size_(shape.n_vertices()) {
    if (degree != Degree::kQuadratic) return;
    std::map<std::pair<int, int>, int> edges;
    for (Eigen::Index t = 0; t < shape.n_elements(); ++t)
      for (int i = 0; i < Dim; ++i)
        for (int j = i + 1; j < Dim; ++j) {
          const auto [at, is_new] = edges.try_emplace(
              std::minmax(shape.elements()(t, i), shape.elements()(t, j)), int(size_));
          size_ += is_new;
          of_edges_.push_back(at->second);
        }
  }

  Eigen::Index size() const { return size_; }
  int n_local() const { return degree_ == Degree::kQuadratic ? Dim + kEdges : Dim; }
  int unknown(Eigen::Index t, int k) const {
    return k < Dim ? shape_.elements()(t, k) : of_edges_[t * kEdges + k - Dim];
  }

  using Local = Eigen::Matrix<double, Dim + kEdges, 1>;
  using LocalGradients = Eigen::Matrix<double, Dim + kEdges, Dim>;

  /// Of the basis functions of an element at a point: lambda_i (2 lambda_i - 1), 4 lambda_i
  /// lambda_j.
  Local values(const Vector<Dim>& lambda) const {
    Local out = Local::Zero();
    if (degree_ != Degree::kQuadratic) {
      out.template head<Dim>() = lambda;
      return out;
    }
    int k = Dim;
    for (int i = 0; i < Dim; ++i) {
      out[i] = lambda[i] * (2 * lambda[i] - 1);
      for (int j = i + 1; j < Dim; ++j) out[k++] = 4 * lambda[i] * lambda[j];
    }
    return out;
  }
  LocalGradients gradients(Eigen::Index t, const Vector<Dim>& lambda) const {
    const auto& of_lambda = shape_.basis_gradients(t);
    LocalGradients out = LocalGradients::Zero();
    if (degree_ != Degree::kQuadratic) {
      out.template topRows<Dim>() = of_lambda;
      return out;
    }
    int k = Dim;
    for (int i = 0; i < Dim; ++i) {
      out.row(i) = (4 * lambda[i] - 1) * of_lambda.row(i);
      for (int j = i + 1; j < Dim; ++j)
        out.row(k++) = 4 * (lambda[i] * of_lambda.row(j) + lambda[j] * of_lambda.row(i));
    }
    return out;
  }

  /// Calls visit(t, lambda, x, weight) at every point of a rule of degree 5.
  template <class Visit>
  void integrate(const Visit& visit) const {
    const auto& rule = fem::quadrature<Dim>(5);
    for (Eigen::Index t = 0; t < shape_.n_elements(); ++t)
      for (Eigen::Index q = 0; q < rule.size(); ++q) {
        const Vector<Dim> lambda = rule.points.row(q);
        Vector<Dim> x = Vector<Dim>::Zero();
        for (int i = 0; i < Dim; ++i)
          x += lambda[i] * shape_.points().row(shape_.elements()(t, i)).transpose();
        visit(t, lambda, x, rule.weights[q] * shape_.measures()[t]);
      }
  }

  /// A_alpha + M_beta (3.8) with constant weights.
  SparseMatrix product(double alpha, double beta) const {
    std::vector<Eigen::Triplet<double>> entries;
    const auto& rule = fem::quadrature<Dim>(degree_ == Degree::kQuadratic ? 4 : 2);
    const int n = n_local();
    for (Eigen::Index t = 0; t < shape_.n_elements(); ++t) {
      Eigen::Matrix<double, Dim + kEdges, Dim + kEdges> local;
      local.setZero();
      for (Eigen::Index q = 0; q < rule.size(); ++q) {
        const Vector<Dim> lambda = rule.points.row(q);
        const double weight = rule.weights[q] * shape_.measures()[t];
        const Local v = values(lambda);
        const LocalGradients g = gradients(t, lambda);
        local += weight * alpha * g * g.transpose();
        if (degree_ == Degree::kLumped)
          local.diagonal() += weight * beta * v;
        else
          local += weight * beta * v * v.transpose();
      }
      for (int i = 0; i < n; ++i)
        for (int j = 0; j < n; ++j) entries.emplace_back(unknown(t, i), unknown(t, j), local(i, j));
    }
    SparseMatrix out(size_, size_);
    out.setFromTriplets(entries.begin(), entries.end());
    return out;
  }

  /// <f, phi_i>.
  Eigen::VectorXd load(const std::function<double(const Vector<Dim>&)>& f) const {
    Eigen::VectorXd out = Eigen::VectorXd::Zero(size_);
    integrate([&](Eigen::Index t, const Vector<Dim>& lambda, const Vector<Dim>& x, double weight) {
      const Local v = values(lambda);
      const double at = weight * f(x);
      for (int k = 0; k < n_local(); ++k) out[unknown(t, k)] += at * v[k];
    });
    return out;
  }

  double value(const Eigen::VectorXd& V, Eigen::Index t, const Vector<Dim>& lambda) const {
    const Local v = values(lambda);
    double out = 0;
    for (int k = 0; k < n_local(); ++k) out += v[k] * V[unknown(t, k)];
    return out;
  }

 private:
  const fem::Geometry<Dim>& shape_;
  Degree degree_;
  Eigen::Index size_;
  std::vector<int> of_edges_;
};

/// Directly on curves, else by conjugate gradients, as VelocitySystem does.
template <int Dim>
Eigen::VectorXd solved(const SparseMatrix& matrix, const Eigen::VectorXd& load) {
  if constexpr (Dim == 2) {
    return Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>>(matrix).solve(load);
  } else {
    Eigen::ConjugateGradient<SparseMatrix, Eigen::Lower | Eigen::Upper> cg(matrix);
    cg.setTolerance(1e-11);
    return cg.solve(load);
  }
}

/// The unit circle or sphere with its vertices on it. Edges are halved where `parts` are doubled;
/// P2 has as many unknowns then as P1 has with twice the parts.
template <int Dim>
fem::Geometry<Dim> sphere(int parts) {
  if constexpr (Dim == 2) {
    const Segments out = curve::circle({0, 0}, 1, 2 * std::numbers::pi / (8 * parts) * (1 + 1e-9));
    return {out.points, out.elements};
  } else {
    const Triangles out = mesh::ball({0, 0, 0}, 1, 1.22 / parts);
    return {out.points, out.elements};
  }
}

template <int Dim>
constexpr const char* kShape = Dim == 2 ? "circle" : "sphere";

/// x^3 - 3 x y^2 of x / |x|: a harmonic with -Lap Y = 3 (Dim + 1) Y.
template <int Dim>
double harmonic(const Vector<Dim>& x) {
  const Vector<Dim> n = x.normalized();
  return n[0] * (n[0] * n[0] - 3 * n[1] * n[1]);
}

std::string order(double before, double after) {
  return before > 0 ? fmt::format("{:.2f}", std::log2(before / after)) : "-";
}

/// -alpha Lap V + beta V = f.
template <int Dim>
void print_velocities() {
  constexpr double kAlpha = 0.1, kBeta = 1, kFactor = 3 * (Dim + 1) * kAlpha + kBeta;
  for (const Degree degree : {Degree::kLumped, Degree::kLinear, Degree::kQuadratic}) {
    std::array<double, 2> before{};
    for (int parts = 4; parts <= 32; parts *= 2) {
      const fem::Geometry<Dim> shape = sphere<Dim>(parts);
      constexpr int kRepeats = 3;
      double seconds = 1e9;
      Eigen::VectorXd V;
      const Space<Dim> space(shape, degree);
      for (int repeat = 0; repeat < kRepeats; ++repeat) {
        const double start = now();
        V = solved<Dim>(space.product(kAlpha, kBeta), space.load([&](const Vector<Dim>& x) {
          return kFactor * harmonic<Dim>(x);
        }));
        seconds = std::min(seconds, now() - start);
      }
      std::array<double, 2> error{};
      for (Eigen::Index i = 0; i < shape.n_vertices(); ++i)
        error[0] =
            std::max(error[0], std::abs(V[i] - harmonic<Dim>(shape.points().row(i).transpose())));
      space.integrate(
          [&](Eigen::Index t, const Vector<Dim>& lambda, const Vector<Dim>& x, double weight) {
            error[1] += weight * std::pow(space.value(V, t, lambda) - harmonic<Dim>(x), 2);
          });
      error[1] = std::sqrt(error[1]);
      fmt::print("| {} | {} | {} | {} | {:.2e} | {} | {:.2e} | {} | {:.2f} |\n", kShape<Dim>,
                 name_of(degree), shape.n_vertices(), space.size(), error[0],
                 order(before[0], error[0]), error[1], order(before[1], error[1]), 1e3 * seconds);
      before = error;
    }
  }
}

/// The boundary of the minimiser of int_Omega (|x| - R) dx: |x| = R(x / |x|).
template <int Dim>
double excess(const Vector<Dim>& x) {
  return x.norm() - 1 - 0.15 * harmonic<Dim>(x);
}

/// The area or volume within R, by the finest sphere.
template <int Dim>
double exact_content() {
  const fem::Geometry<Dim> shape = sphere<Dim>(Dim == 2 ? 4096 : 256);
  double sum = 0;
  const Space<Dim> space(shape, Degree::kLinear);
  space.integrate([&](Eigen::Index t, const Vector<Dim>&, const Vector<Dim>& x, double weight) {
    // The cone over dS has (x . nu) dS / |x|^Dim of the sphere.
    const double angle = weight * x.dot(shape.normals().row(t)) / std::pow(x.norm(), Dim);
    sum += angle * std::pow(1 + 0.15 * harmonic<Dim>(x), Dim) / Dim;
  });
  return sum;
}

template <int Dim>
void print_boundaries() {
  constexpr double kAlpha = 1e-3;  // beta = 1, the normal derivative of the integrand
  const double exact = exact_content<Dim>();
  for (const Degree degree : {Degree::kLumped, Degree::kQuadratic}) {
    std::array<double, 2> before{};
    for (int parts = 4; parts <= (Dim == 2 ? 32 : 16); parts *= 2) {
      fem::Geometry<Dim> shape = sphere<Dim>(parts);
      Eigen::Index n_unknowns = 0;
      int n_steps = 0;
      const double start = now();
      for (double moved = 1; moved > 1e-9 && n_steps < 2000; ++n_steps) {
        const Space<Dim> space(shape, degree);
        n_unknowns = space.size();
        const Eigen::VectorXd V =
            solved<Dim>(space.product(kAlpha, 1),
                        -space.load([](const Vector<Dim>& x) { return excess<Dim>(x); }));
        const Eigen::VectorXd at_vertices = V.head(shape.n_vertices());
        moved = at_vertices.cwiseAbs().maxCoeff();
        shape = shape.moved_to(shape.points() + at_vertices.asDiagonal() *
                                                    shape.nodal_normals().rowwise().normalized());
      }
      const double seconds = now() - start;
      double at_vertices = 0, mean = 0;
      for (Eigen::Index i = 0; i < shape.n_vertices(); ++i)
        at_vertices =
            std::max(at_vertices, std::abs(excess<Dim>(shape.points().row(i).transpose())));
      Space<Dim>(shape, degree)
          .integrate([&](Eigen::Index, const Vector<Dim>&, const Vector<Dim>& x, double weight) {
            mean += weight * std::abs(excess<Dim>(x));
          });
      mean /= shape.measure();
      const double content = std::abs(shape.enclosed() / exact - 1);
      fmt::print("| {} | {} | {} | {} | {:.2e} | {} | {:.2e} | {:.2e} | {} | {} | {:.1f} |\n",
                 kShape<Dim>, degree == Degree::kLumped ? "P1" : "P2", shape.n_vertices(),
                 n_unknowns, mean, order(before[0], mean), at_vertices, content,
                 order(before[1], content), n_steps, 1e3 * seconds / n_steps);
      std::fflush(stdout);
      before = {mean, content};
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const std::string what = argc > 1 ? argv[1] : "all";
  if (what == "velocity" || what == "all") {
    fmt::print(
        "| shape | V | vertices | unknowns | largest error at vertices | order | L2 error | order "
        "| "
        "ms |\n|---|---|---|---|---|---|---|---|---|\n");
    print_velocities<2>();
    print_velocities<3>();
  }
  if (what == "boundary" || what == "all") {
    fmt::print(
        "\n| shape | V | vertices | unknowns | mean distance | order | largest at vertices | error "
        "of the content | order | steps | step ms "
        "|\n|---|---|---|---|---|---|---|---|---|---|---|\n");
    print_boundaries<2>();
    print_boundaries<3>();
  }
}
