#include <algorithm>

#include "libsurf/segment/clicks.h"
#include "libsurf/segment/detail/amend.h"
#include "libsurf/segment/detail/run_stages.h"
#include "libsurf/segment/object_box.h"
#include "libsurf/segment/result.h"
#include "libsurf/segment/stages/stages.h"

namespace surf::segment {
namespace {

constexpr double kMostShown = 0.2;  // of the grid
// Nodes from a region's boundary: what an evolution may make of it.
constexpr double kReachNodes = 5;
// Of a proposal that evolves before a click that may answer it; the evolution leaves 0.1 to 0.4.
template <int Dim>
constexpr Eigen::Index kMostElements = Dim == 3 ? 50000 : 5000;

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
    return clicks_in_box<Dim>(work.setting().extent(), work.options.box_mm, std::move(out));
  }

  /// What earlier clicks have found.
  static ClickSearchPointer<Dim> known(const Work<Dim>& work) {
    return work.settled ? work.search : before_evolutions<Dim>(work.search);
  }

  static ClickSearchPointer<Dim> with_inside(const Work<Dim>& work, const SearchGrid<Dim>& grid,
                                             const ClickSearchPointer<Dim>& found,
                                             const Simplices<Dim>& shape) {
    const NodeSet<Dim> inside(
        grid.box(), work.setting().rasterized(shape, grid.box().size, grid.node_to_world()));
    return inside.is_empty() ? nullptr : with_evolved<Dim>(found, inside);
  }

  /// And what an evolution has made of it; null if none has.
  static ClickSearchPointer<Dim> known_evolved(const Work<Dim>& work, const SearchGrid<Dim>& grid) {
    if (!work.settled || !work.search || work.search != work.settled->search ||
        work.search->found.empty())
      return nullptr;
    return with_inside(work, grid, work.search, work.settled->shape);
  }

  /// Whether an evolution may have left the click on the wrong side of a boundary that has it on
  /// the right one, and whoever made it has seen that: a stroke may be painted before anything is,
  /// and clicks of other objects say nothing of this one.
  static bool may_answer_evolution(const Work<Dim>& work, const SearchGrid<Dim>& grid,
                                   const ClickSearch<Dim>& found, const Click<Dim>& next) {
    const auto end_of_others = work.clicks.begin() + std::ptrdiff_t(work.n_others);
    if (!work.options.energies.empty() || !next.stroke_mm.empty() ||
        std::find(work.clicks.begin(), end_of_others, next) != end_of_others)
      return false;
    const NodeSet<Dim> inside = found.inside();
    const NodeSet<Dim> beyond = next.side == Side::kInside ? inside.complement() : inside;
    const NodeSet<Dim> near = beyond.dilated(kReachNodes);
    const auto nodes =
        nearest_nodes<Dim>(grid.node_to_world().inverse() * next.point_mm, grid.box().size);
    return std::any_of(nodes.begin(), nodes.end(),
                       [&](const auto& node) { return near.contains(node); });
  }

  /// What comes of what was found where the next click is made after an evolution: that is made if
  /// it has not been. Null if it is not worth its time, or has the click right.
  static ClickSearchPointer<Dim> evolved(Work<Dim>& work, const SearchGrid<Dim>& grid,
                                         const ClickSearchPointer<Dim>& found,
                                         const Click<Dim>& next, int n_done) {
    if (work.settled && found == work.settled->search)
      return heeds<Dim>(work.settled->shape, {next}) ? nullptr : known_evolved(work, grid);
    if (!may_answer_evolution(work, grid, *found, next)) return nullptr;
    Work<Dim> before{{},
                     work.fields,
                     work.options,
                     points_on<Dim>(Side::kInside, found->clicks),
                     found->clicks,
                     [&](const std::string&, const flow::StepRecord&, const auto& shape) {
                       flow::StepRecord record;
                       record.k = n_done;
                       return work.tell("propose", record, shape);
                     },
                     work.stop};
    before.search = found;
    before.proposals = proposals<Dim>(work.setting(), grid, *found);
    const auto chosen =
        std::find_if(before.proposals.begin(), before.proposals.end(),
                     [&](const Proposal<Dim>& each) { return each.place == found->chosen; });
    if (chosen == before.proposals.end() || chosen->shape.elements.rows() > kMostElements<Dim>)
      return nullptr;
    before.chosen = std::size_t(chosen - before.proposals.begin());
    before.shape = chosen->shape;
    before.start_is_given = true;
    run_stages(before);
    const Result<Dim> result = to_result(std::move(before));
    if (work.is_stopped() || !has_shape(result.outcome) || heeds<Dim>(result.shape, {next}))
      return nullptr;
    return with_inside(work, grid, found, result.shape);
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
    const std::shared_ptr<const SearchGrid<Dim>> kept = work.fields.search_grid(
        field_options(work.options, 0), work.options.sigma_mm, work.options.box_mm);
    const SearchGrid<Dim>& grid = *kept;
    work.chosen = 0;
    work.proposals.clear();
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
    ClickSearchPointer<Dim> before = known(work);
    if (work.settled && is_amended<Dim>(work.settled->shape))
      if (const ClickSearchPointer<Dim> evolved = known_evolved(work, grid)) before = evolved;
    ClickSearchPointer<Dim> found = search_clicks<Dim>(
        grid, in_order_of(before, work.settled != nullptr, clicks_of(work)), before, {}, told,
        work.stop, [&](const ClickSearchPointer<Dim>& so_far, const Click<Dim>& next) {
          return evolved(work, grid, so_far, next, n_done);
        });
    if (!found) return;
    work.proposals = proposals<Dim>(work.setting(), grid, *found);
    // What the last click has made of it has no sound boundary: it stays as it was before.
    for (auto at = found->before; work.proposals.empty() && at && !at->found.empty();
         at = at->before) {
      found = with_regions<Dim>(*found, *at);
      work.proposals = proposals<Dim>(work.setting(), grid, *found);
    }
    // Nor may the best of several regions have one: the others are looked at, and the first of them
    // is what a further click corrects.
    const auto has_chosen = [&](const Proposal<Dim>& each) { return each.place == found->chosen; };
    if (!work.proposals.empty() &&
        std::none_of(work.proposals.begin(), work.proposals.end(), has_chosen))
      found = with_choice<Dim>(*found, work.proposals.front().place);
    work.search = found;
    work.verdict = verdict(grid, *found);
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
