#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

/// What an energy takes from its start, as statistics of both sides, is not taken again from a
/// shape that is half way.
template <int Dim>
class GoOn : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    const Result<Dim>& before = *work.unfinished;
    work.start = before.start;
    work.energies = before.energies;
    static_cast<Lengths&>(work) = before;
    return begins(work, "go on", "from where the evolution before was stopped, with its energy");
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> go_on_stage() {
  return std::make_unique<GoOn<Dim>>();
}

template StagePointer<2> go_on_stage<2>();
template StagePointer<3> go_on_stage<3>();

}  // namespace surf::segment
