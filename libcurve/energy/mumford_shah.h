// The Mumford-Shah model in the plane (thesis 2.2.3 and 5.2).
#pragma once

#include <memory>
#include <string>
#include <utility>

#include "libcurve/energy/neumann.h"
#include "libcurve/mesh/mesh_motion.h"
#include "libsurf/energy/mumford_shah_weights.h"
#include "libsurf/energy/shape_energy.h"

namespace surf::curve {

struct MumfordShahOptions : energy::MumfordShahWeights {
  /// Corners of the box D, convex, counter-clockwise, with the curves strictly inside: (k, 2).
  Points<2> outer;
  double pixel_mm = 1;  ///< side of a pixel: what quadrature resolves, > 0
  /// Longest edges of the domain meshes [mm]; 0 = sqrt(mu) / 2. Never more than 32 pixels.
  double max_size_mm = 0;
  /// Shortest edges to which Alg. 8 refines [mm]; 0 = 1.5 pixels.
  double min_size_mm = 0;
  /// epsilon_data of Alg. 8 per area, for I / contrast: triangles are refined while the mean square
  /// of the interpolation error of I is larger; 0 = not used. What Alg. 8 bounds is how well the
  /// meshes resolve I; quadrature does without them.
  double data_tolerance = 0.05;  // thesis 5.2
  /// gamma_C of Alg. 8: sizes are raised again only where triangles have less than this share of
  /// the largest error; 0 = never. In [0, 1).
  double gamma_coarsen = 0.3;  // thesis 5.2
  /// In the scalar product beta is at least |G| over this length [mm]: it bounds how far a full
  /// step moves the curve, and far from the optimum, where the second derivative knows nothing of
  /// it, all parts move alike. 0 = 4 pixels.
  double step_mm = 0;
  bool reuse_nodes = true;  ///< a new mesh begins with the nodes of the last one

  std::string error() const;  ///< empty if valid
};

/// J(Gamma) = sum_i 1/2 int_{Omega_i} ((u_i - I)^2 + mu |grad u_i|^2) + gamma |Gamma| (5.4) with
/// -mu Lap u_i + u_i = I in Omega_i, d_nu u_i = 0, I the intensity less its mean over the box, by
/// the contrast. In mm^2.
///
/// J is that of P1 functions on a mesh of the box. Trial steps deform the mesh (MeshMotion), and
/// the derivative is the exact one of this J: it converges to the boundary form of Theorem 2.2.10,
/// shape_gradient(). Where a step would turn triangles over, J is that of a new mesh; where curves
/// would cross, that of the domain which topology surgery makes of them.
///
/// Scalar product of 5.2: alpha = gamma,
/// beta = max(1/2 (kappa ([|u - I|^2] + mu [|grad u|^2]) + d_nu [|u - I|^2]), |G| / step).
class MumfordShah : public energy::ShapeEnergy<2> {
 public:
  /// @throws UsageError  options.error() is not empty
  MumfordShah(std::shared_ptr<const Field<2>> I, const MumfordShahOptions& options);
  ~MumfordShah() override;

  std::string name() const override { return "mumford-shah"; }
  /// @throws InvalidMesh  the curves meet one another or leave the box
  void reset(const fem::Geometry<2>& shape) override;
  double value() const override;
  double try_move(const fem::Geometry<2>& moved) override;
  void accept() override;
  double drift() const override { return drift_; }
  void remesh(const fem::Geometry<2>& shape) override;
  /// J jumps where surgery joins what a thin sheet has parted: steps that gain are not taken for
  /// ones that lose.
  void rebuild(const fem::Geometry<2>& shape) override;
  /// @throws InvalidMesh  the current curves meet one another
  void differentiate(const fem::Curvature&, double, energy::ShapeTerms<2>&) const override;
  /// Theorem 2.2.11. Its last line, with u' of the velocity, is an operator (SolutionResponse).
  /// @throws InvalidMesh  the current curves meet one another
  void differentiate_twice(const fem::Curvature& curvature, double weight,
                           energy::SecondDerivative<2>& second) const override;
  /// With the mean of u_2 in place of what u would be in the hole:
  /// F = 1/2 ((I - u_1)^2 - (I - mean)^2).
  void add_density(const Points<2>&, double, Eigen::VectorXd&) const override;

  /// What is on both sides of each vertex of the curves.
  struct Traces {
    Eigen::VectorXd inside, outside;              ///< u_1, u_2
    Eigen::VectorXd slope_inside, slope_outside;  ///< |grad_Gamma u_i|^2 [1/mm^2]
    Eigen::VectorXd intensity, intensity_slope;   ///< I, d_nu I [1/mm], as above
  };
  /// @throws InvalidMesh  the current curves meet one another
  Traces traces() const;
  /// G = 1/2 [|u - I|^2] + mu/2 [|grad_Gamma u|^2] + gamma kappa at the vertices (Theorem 2.2.10).
  Eigen::ArrayXd shape_gradient(const Traces& at, const Eigen::VectorXd& curvature) const;

  /// The mesh and u, in multiples of the contrast above offset().
  const Neumann& solution() const;
  double offset() const { return neumann_.offset; }
  /// u at points of the box in the image's unit: u_1 inside the curves, u_2 outside; (n).
  Eigen::VectorXd denoised(const Points<2>& points) const;

 private:
  struct State;
  std::unique_ptr<State> made(const fem::Geometry<2>& shape) const;
  double energy_of(const State& state) const;
  std::pair<DomainMesh, ImageIntegrals> adapted_mesh(const Segments& curves) const;
  bool lower_sizes(const DomainMesh& mesh, const Eigen::VectorXd& errors) const;
  void raise_sizes();
  void refresh() const;

  std::shared_ptr<const Field<2>> I_;
  MumfordShahOptions options_;
  NeumannOptions neumann_;
  double constant_ = 0;  // 1/2 int (I - offset)^2 / contrast^2 over the box
  double drift_ = 0;
  mutable SizeField sizes_;
  mutable std::unique_ptr<State> state_;
  std::unique_ptr<State> tried_;
};

}  // namespace surf::curve
