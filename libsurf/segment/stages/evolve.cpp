#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

template <int Dim>
class Evolve : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    Minimisation<Dim> out;
    out.name = "evolve";
    out.terms = work.energies;
    out.sigma_mm = work.sigma_mm;
    out.flow = work.options.flow;
    out.shape = shape_options(work, work.edge_length_mm, work.sigma_mm);
    return minimise(work, out);
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> evolve_stage() {
  return std::make_unique<Evolve<Dim>>();
}

template StagePointer<2> evolve_stage<2>();
template StagePointer<3> evolve_stage<3>();

}  // namespace surf::segment
