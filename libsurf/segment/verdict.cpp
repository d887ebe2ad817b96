#include "libsurf/segment/verdict.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "libsurf/base/names.h"
#include "libsurf/segment/detail/point_text.h"

namespace surf::segment {
namespace {

constexpr int kMargin = 3;  // nodes, for the shell

using F = VerdictFeatures;
// Stand for them where they are not known: kept after corrections, consent before.
constexpr double kUsuallyKept = 0.943, kUsualConsent = 0.933;

/// A term of the logit, and what it means where it is low.
struct Term {
  double (*value)(const VerdictFeatures&);
  double weight, usual;  ///< mean of the value among right answers
  const char* doubt;
};

// Fitted with the constant to surfaces after one to three clicks, two first clicks in each of 26
// structures of 12 scans, with and without a box; see docs/clicks.md. What competes with a first
// region speaks for it as often as against it; what differs from a correction does not.
const std::array kTerms = {
    Term{[](const F& f) { return f.separation; }, 3.376, 0.794,
         "what lies inside and outside of its boundary looks much alike"},
    Term{[](const F& f) { return f.consent ? kUsuallyKept : f.kept; }, 15.531, 0.933,
         "the edges near by are not where its intensities end"},
    Term{[](const F& f) { return f.consent.value_or(kUsualConsent); }, 18.272, kUsualConsent,
         "other corrections fit nearly as well, and differ"}};
constexpr double kConstant = -32.920;
constexpr double kTrusted = 0.82, kDoubtful = 0.7;
// What the volume cuts off over more of its boundary is not trusted: where it would go on nobody
// can see.
constexpr double kMostOnBorder = 0.1;
// Of that which it cuts off over nearly half of its boundary hardly anything is known: 0.3 of the
// nodes' faces is about 0.4 of a surface.
constexpr double kMostOnBorderToCheck = 0.3;
constexpr double kMostWithoutEdge = 0.5;  // of the area of what is trusted
struct Cases {
  int n_right, n;
};
// Surfaces, each judged by a fit without its person.
constexpr Cases kOfTrusted{126, 133}, kOfCheck{42, 58}, kOfDoubtful{48, 121};

// Nodes from the region: where another one goes on far beyond, it is there that it leaves this one.
constexpr double kNearRegion = 5;

/// The deepest node of where two regions differ near the chosen one; of the region if they do not.
template <int Dim>
Vector<Dim> disputed_place(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search) {
  const NodeSet<Dim> inside = search.inside();
  NodeSet<Dim> disputed = inside;
  double best = -1;
  for (std::size_t n = 0; n < search.found.size(); ++n) {
    const Rung<Dim>& other = search.found[n];
    if (n == search.chosen || other.score <= best) continue;
    best = other.score;
    disputed = inside ^ other.inside.in(grid.box());
  }
  disputed &= inside.dilated(kNearRegion);
  if (disputed.is_empty()) disputed = inside;
  const NodeBox<Dim> box = disputed.bounds(1);
  const std::vector<float> depth =
      exact_squared_distances(box, disputed.in(box).complement().flags());
  std::size_t deepest = 0;
  for (std::size_t at = 0; at < depth.size(); ++at)
    if (std::isfinite(depth[at]) && depth[at] > depth[deepest]) deepest = at;
  const auto node = box.node(deepest);
  Vector<Dim> index;
  for (int axis = 0; axis < Dim; ++axis) index[axis] = node[axis];
  return grid.node_to_world() * index;
}

/// An inside click round which nothing stood out, and which was heeded after a later one; null if
/// there is none.
template <int Dim>
const Click<Dim>* unfound_click(const ClickSearch<Dim>& search) {
  for (const ClickSearch<Dim>* at = &search; at; at = at->before.get())
    if (at->found.empty())
      for (const Click<Dim>& click : at->clicks)
        if (click.side == Side::kInside) return &click;
  return nullptr;
}

/// Whether the region, or that which clicks that say little have left as it was, is another than
/// the best.
template <int Dim>
bool has_choice(const ClickSearch<Dim>& search) {
  const ClickSearch<Dim>* at = &search;
  while (at->chosen == 0 && at->says_little && at->before) at = at->before.get();
  return at->chosen != 0;
}

}  // namespace

std::string to_string(Trust trust) {
  using enum Trust;
  return name_of(trust, {{kTrusted, "trusted"}, {kCheck, "check"}, {kDoubtful, "doubtful"}});
}

double likelihood_of_right(const VerdictFeatures& features) {
  double logit = kConstant;
  for (const Term& term : kTerms) logit += term.weight * term.value(features);
  return 1 / (1 + std::exp(-logit));
}

std::string doubt(const VerdictFeatures& features) {
  const Term* worst = nullptr;
  double least = 0;
  for (const Term& term : kTerms) {
    const double against = term.weight * (term.value(features) - term.usual);
    if (against >= least) continue;
    least = against;
    worst = &term;
  }
  return worst ? worst->doubt : "little speaks against it";
}

template <int Dim>
std::string Verdict<Dim>::words() const {
  return n_cases > 0 ? fmt::format("right in {} of {} such cases; {}", n_right, n_cases, reason)
                     : reason;
}

template <int Dim>
std::string Verdict<Dim>::text() const {
  return fmt::format(
      "{}: {}{}", to_string(trust), words(),
      trust == Trust::kTrusted ? "" : fmt::format("; look at ({}) mm", point_text<Dim>(place_mm)));
}

template <int Dim>
void Verdict<Dim>::heed(const Certainty<Dim>& certainty) {
  if (trust != Trust::kTrusted || !(certainty.share_without_edge > kMostWithoutEdge)) return;
  trust = Trust::kCheck;
  n_right = kOfCheck.n_right;
  n_cases = kOfCheck.n;
  reason = fmt::format("along {:.0f} % of it no edge is found", 100 * certainty.share_without_edge);
  if (certainty.next_click_mm) place_mm = *certainty.next_click_mm;
}

template <int Dim>
std::optional<Verdict<Dim>> verdict(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search) {
  if (Dim == 2 || search.found.empty() || has_choice(search)) return std::nullopt;
  const VerdictFeatures features = verdict_features(grid, search);
  Verdict<Dim> out;
  out.likelihood = likelihood_of_right(features);
  const bool is_cut_off = features.border_share > kMostOnBorder;
  // Where there are few slices all objects are cut off.
  bool is_hardly_seen = features.border_share > kMostOnBorderToCheck;
  for (int axis = 0; axis < Dim; ++axis) is_hardly_seen &= !has_few_slices(grid.box(), axis);
  const Click<Dim>* unfound = unfound_click(search);
  if (out.likelihood < kDoubtful || is_hardly_seen)
    out.trust = Trust::kDoubtful;
  else
    out.trust =
        out.likelihood >= kTrusted && !is_cut_off && !unfound ? Trust::kTrusted : Trust::kCheck;
  const Cases& cases = out.trust == Trust::kTrusted ? kOfTrusted
                       : out.trust == Trust::kCheck ? kOfCheck
                                                    : kOfDoubtful;
  out.n_right = cases.n_right;
  out.n_cases = cases.n;
  out.reason = out.trust == Trust::kTrusted ? "it differs from what surrounds it, and edges hold it"
               : out.likelihood < kTrusted && !is_hardly_seen ? doubt(features)
               : is_cut_off ? "the border of the volume cuts it off"
                            : "nothing stands out round one of its inside clicks";
  out.place_mm = unfound && !is_cut_off && out.likelihood >= kTrusted
                     ? unfound->point_mm
                     : disputed_place(grid, search);
  return out;
}

template <int Dim>
VerdictFeatures verdict_features(const SearchGrid<Dim>& grid, const ClickSearch<Dim>& search) {
  const NodeSet<Dim> all = search.inside();
  const SearchGrid<Dim> part = grid.part(all.bounds(kMargin));
  const SeedView<Dim> view(part, {search.on_grid.front().seed}, search.noise);
  Rung<Dim> region;
  region.inside = all.in(all.bounds(kMargin)).moved_to({});
  measure(part.box(), part.level(), view.edge, region);
  VerdictFeatures out;
  out.separation = region.features.separation;
  out.border_share = region.border_share;
  out.kept = search.found[search.chosen].kept;
  out.consent = search.consent;
  return out;
}

template struct Verdict<2>;
template struct Verdict<3>;
template std::optional<Verdict<2>> verdict<2>(const SearchGrid<2>&, const ClickSearch<2>&);
template std::optional<Verdict<3>> verdict<3>(const SearchGrid<3>&, const ClickSearch<3>&);
template VerdictFeatures verdict_features<2>(const SearchGrid<2>&, const ClickSearch<2>&);
template VerdictFeatures verdict_features<3>(const SearchGrid<3>&, const ClickSearch<3>&);

}  // namespace surf::segment
