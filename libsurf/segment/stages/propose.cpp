#include <algorithm>

#include "libsurf/segment/clicks.h"
#include "libsurf/segment/detail/amend.h"
#include "libsurf/segment/object_box.h"
#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr double kMostShown = 0.2;  // of the grid

template <int Dim>
class Propose : public Stage<Dim> {
 public:
  bool run(Work<Dim>& work) const override {
    StageReport report;
    report.name = "propose";
    report.kind = StageKind::kProposes;
    int n_done = 0;
    search(work, n_done);
    if (!work.proposals.empty()) {
      work.shape = work.proposals[work.chosen].shape;
      report.outcome = Outcome::kProposed;
      report.message = to_string(work.proposals[work.chosen]);
      tell(work, n_done);  // so that it is seen before the evolution begins
    } else {
      report.outcome = Outcome::kNoObject;
      report.message =
          "no region of like intensities round the clicks stands out from what surrounds it";
    }
    if (work.is_stopped()) {
      report.outcome = Outcome::kStopped;
      report.message = "interrupted while regions were looked for";
    }
    work.reports.push_back(std::move(report));
    return work.reports.back().outcome == Outcome::kProposed;
  }

 private:
  /// All, or if none is inside the places where the image is looked at before them.
  static std::vector<Click<Dim>> clicks_of(const Work<Dim>& work) {
    std::vector<Click<Dim>> out = work.clicks;
    if (std::none_of(out.begin(), out.end(),
                     [](const Click<Dim>& click) { return click.side == Side::kInside; }))
      for (const Vector<Dim>& seed : work.seeds_mm) out.push_back({seed, Side::kInside});
    // Beyond the box there is nothing of the object anyway.
    if (work.options.box_mm) {
      const ImageExtent<Dim>& extent = work.setting().extent();
      const NodeBox<Dim> box = cells_of_box(extent, *work.options.box_mm);
      const auto is_beyond = [&](const Vector<Dim>& point) {
        return !is_in_cells(extent, box, point);
      };
      for (Click<Dim>& click : out) {
        std::erase_if(click.stroke_mm, is_beyond);
        if (is_beyond(click.point_mm) && !click.stroke_mm.empty())
          click.point_mm = click.stroke_mm.front();
      }
      std::erase_if(out, [&](const Click<Dim>& click) { return is_beyond(click.point_mm); });
    }
    return out;
  }

  /// What earlier clicks have found.
  static ClickSearchPointer<Dim> known(const Work<Dim>& work) {
    return work.settled ? work.search : before_evolutions<Dim>(work.search);
  }

  /// And what an evolution has made of it; null if none has.
  static ClickSearchPointer<Dim> known_evolved(const Work<Dim>& work, const SearchGrid<Dim>& grid) {
    if (!work.settled || !work.search || work.search != work.settled->search ||
        work.search->found.empty())
      return nullptr;
    const NodeSet<Dim> inside(
        grid.box(),
        work.setting().rasterized(work.settled->shape, grid.box().size, grid.node_to_world()));
    return inside.is_empty() ? nullptr : with_evolved<Dim>(work.search, inside);
  }

  /// Those that an evolution has heeded first, whatever clicks of other objects came since.
  static std::vector<Click<Dim>> in_order_of(const ClickSearchPointer<Dim>& known, bool is_evolved,
                                             std::vector<Click<Dim>> clicks) {
    if (!known || !is_evolved || !contains_all<Dim>(clicks, known->clicks)) return clicks;
    std::vector<Click<Dim>> out = known->clicks;
    for (Click<Dim>& click : clicks)
      if (std::find(known->clicks.begin(), known->clicks.end(), click) == known->clicks.end())
        out.push_back(std::move(click));
    return out;
  }

  static bool tell(Work<Dim>& work, int n_done) {
    flow::StepRecord record;
    record.k = n_done;
    return work.tell("propose", record, [&] { return work.shape; });
  }

  /// @param n_done  windows that were looked at
  static void search(Work<Dim>& work, int& n_done) {
    const SearchGrid<Dim>& grid = work.fields.search_grid(
        field_options(work.options, 0), work.options.sigma_mm, work.options.box_mm, work.stop);
    work.chosen = 0;
    work.proposals.clear();
    if (!grid.is_whole()) return;
    const SearchProgress<Dim> told = [&](int n, const Rung<Dim>* seen) {
      n_done = n;
      flow::StepRecord record;
      record.k = n;
      return work.tell("propose", record, [&] {
        // What nearly fills the image is a leak, and slow to draw.
        const bool is_shown = seen && double(seen->n_nodes) < kMostShown * double(grid.box().n());
        return is_shown ? preview<Dim>(work.setting(), grid, *seen) : work.shape;
      });
    };
    const auto found_after = [&](const ClickSearchPointer<Dim>& before) {
      return search_clicks<Dim>(grid, in_order_of(before, work.settled != nullptr, clicks_of(work)),
                                before, {}, told, work.stop);
    };
    ClickSearchPointer<Dim> before = known(work);
    if (work.settled && is_amended<Dim>(work.settled->shape))
      if (const ClickSearchPointer<Dim> evolved = known_evolved(work, grid)) before = evolved;
    ClickSearchPointer<Dim> found = found_after(before);
    // Clicks that the region has on their side already speak of what became of it.
    if (found && before && !before->has_evolved && found->clicks.size() > before->clicks.size() &&
        found->inside() == before->inside())
      if (const ClickSearchPointer<Dim> evolved = known_evolved(work, grid))
        found = found_after(evolved);
    if (!found) return;
    work.search = found;
    work.verdict = verdict(grid, *found);
    work.proposals = proposals<Dim>(work.setting(), grid, *found);
    for (std::size_t n = 0; n < work.proposals.size(); ++n)
      if (work.proposals[n].place == found->chosen) work.chosen = n;
  }
};

}  // namespace

template <int Dim>
StagePointer<Dim> propose_stage() {
  return std::make_unique<Propose<Dim>>();
}

template StagePointer<2> propose_stage<2>();
template StagePointer<3> propose_stage<3>();

}  // namespace surf::segment
