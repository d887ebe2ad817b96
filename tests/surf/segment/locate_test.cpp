// The stage that moves a shape on to the edges, and what it says of how sure they are.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <numbers>
#include <stop_token>
#include <utility>

#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/segment/detail/locate_edges.h"
#include "libsurf/segment/detail/options_json.h"
#include "libsurf/segment/detail/run_stages.h"
#include "libsurf/segment/finish.h"
#include "libsurf/segment/segment.h"
#include "libsurf/segment/stages/stages.h"
#include "libsurf/volume/phantom.h"
#include "tests/surf/fixtures.h"
#include "tests/surf/io/scratch_folder.h"

namespace surf::segment {
namespace {

volume::PhantomOptions phantom(volume::PhantomKind kind, double noise, int size = 40) {
  volume::PhantomOptions out;
  out.kind = kind;
  out.noise = noise;
  out.size = {size, size, size};
  return out;
}

/// Share of the vertices whose distance to the exact surface is at most twice the deviation.
double coverage(const volume::PhantomOptions& options, const Points<3>& X,
                const Eigen::VectorXd& deviation_mm) {
  double n = 0;
  for (Eigen::Index i = 0; i < X.rows(); ++i)
    n +=
        std::abs(volume::phantom_distance_mm(options, X.row(i).transpose())) <= 2 * deviation_mm[i];
  return n / double(X.rows());
}

TEST(LocateEdges, HalvesTheDistanceAndHoldsItsWord) {
  double covered = 0;
  for (const int seed : {1, 2, 3, 4}) {
    volume::PhantomOptions options = phantom(volume::PhantomKind::kBall, 0.1);
    options.random_seed = std::uint64_t(seed);
    const volume::Volume image = volume::make_phantom(options);
    const double voxel = image.voxel_size();
    // A ball that is a quarter of a voxel off to one side, with ripples of a tenth.
    Triangles start = mesh::ball({0.25 * voxel, 0, 0}, 0.6, 2 * voxel);
    for (Eigen::Index i = 0; i < start.points.rows(); ++i)
      start.points.row(i) *= 1 + 0.1 * voxel / 0.6 * std::sin(7.3 * double(i));
    const LocatedEdges<3> located = locate_edges<3>(*make_setting(image), start, 0.6 * voxel);
    const auto distance = [&](const Points<3>& X) {
      return mesh::distances_from(
                 {X, start.elements},
                 [&](const Vector<3>& x) { return volume::phantom_distance_mm(options, x); })
                 .mean_mm /
             voxel;
    };
    EXPECT_LT(distance(located.points), 0.4 * distance(start.points));
    EXPECT_LT(distance(located.points), 0.05);
    covered += coverage(options, located.points, located.certainty.deviation_mm) / 4;
    EXPECT_EQ(located.certainty.share_without_edge, 0);
    EXPECT_FALSE(located.certainty.next_click_mm);
    // Enclosed volume: its own deviation holds it.
    const auto measures = make_setting(image)->measures({located.points, start.elements});
    EXPECT_LT(std::abs(measures.content - 4.0 / 3 * std::numbers::pi * 0.216),
              3 * located.certainty.content_deviation);
  }
  EXPECT_GT(covered, 0.92);
}

// What the assumed smoothness rounds off of the edges of a box is in the deviations, of the
// vertices and of the volume.
TEST(LocateEdges, SaysWhatItRoundsOff) {
  const volume::PhantomOptions options = phantom(volume::PhantomKind::kBox, 0.1, 64);
  const volume::Volume image = volume::make_phantom(options);
  SegmentOptions from_the_middle;
  from_the_middle.seeds_mm = {Vector<3>::Zero()};
  const SegmentResult result = segment(image, from_the_middle);
  ASSERT_TRUE(result.certainty);
  EXPECT_GT(coverage(options, result.shape.points, result.certainty->deviation_mm), 0.93);
  const auto measures = make_setting(image)->measures(result.shape);
  EXPECT_LT(std::abs(measures.content - 8 * 0.6 * 0.4 * 0.3),
            2.5 * result.certainty->content_deviation);
}

// The shape stays that of the minimiser, and the whole counts as stopped.
TEST(LocateEdges, IsStopped) {
  const auto setting = make_setting(volume::make_phantom(phantom(volume::PhantomKind::kBall, 0)));
  const Triangles start = mesh::ball({0, 0, 0}, 0.58, 0.1);
  std::stop_source stop;
  stop.request_stop();
  EXPECT_TRUE(locate_edges<3>(*setting, start, 0.03, {}, stop.get_token()).was_stopped);

  Fields<3> fields(setting);
  const Options<3> options;
  Work<3> work{{}, fields, options, {}, {}, {}, stop.get_token()};
  work.shape = start;
  StageReport minimised;
  minimised.name = "evolve";
  work.reports.push_back(minimised);
  EXPECT_FALSE(locate_stage<3>()->run(work));
  EXPECT_EQ(work.reports.back().outcome, Outcome::kStopped);
  EXPECT_EQ(work.shape.points, start.points);
  EXPECT_FALSE(work.certainty);
  const Result<3> result = to_result(std::move(work));
  EXPECT_EQ(result.outcome, Outcome::kStopped);
  EXPECT_EQ(result.main_stage()->name, "evolve");
  EXPECT_EQ(result.shape.elements.rows(), start.elements.rows());
}

// The lower half of the ball has no contrast.
TEST(LocateEdges, FadesToWhereThereIsNoEdgeAndPointsThere) {
  volume::PhantomOptions options = phantom(volume::PhantomKind::kBall, 0);
  const volume::Volume whole = volume::make_phantom(options);
  volume::PhantomOptions noise = options;
  noise.noise = 0.05;
  const volume::Volume noisy = volume::make_phantom(noise);
  std::vector<float> values;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i)
        values.push_back(k < 20 ? noisy.value(i, j, k) - whole.value(i, j, k)
                                : noisy.value(i, j, k));
  const volume::Volume image({40, 40, 40}, options.index_to_world(), values);
  const double voxel = image.voxel_size();
  const Triangles start = mesh::ball({0, 0, 0}, 0.6 - 0.2 * voxel, 2 * voxel);
  const LocatedEdges<3> located = locate_edges<3>(*make_setting(image), start, 0.6 * voxel);
  const Certainty<3>& certainty = located.certainty;
  EXPECT_NEAR(certainty.share_without_edge, 0.4,
              0.12);  // the step is seen up to 4 voxels beside it
  ASSERT_TRUE(certainty.next_click_mm);
  EXPECT_LT((*certainty.next_click_mm - Vector<3>(0, 0, -0.6)).norm(), 5 * voxel);
  for (Eigen::Index i = 0; i < start.points.rows(); ++i) {
    const double z = start.points(i, 2);
    if (z < -8 * voxel) {
      EXPECT_FALSE(certainty.has_edge[std::size_t(i)]);
      EXPECT_LT((located.points.row(i) - start.points.row(i)).norm(), 0.1 * voxel);
      EXPECT_GT(certainty.deviation_mm[i], voxel);
    }
    if (z > 9 * voxel) {  // nearer to the part without contrast levels and noise mix both
      EXPECT_TRUE(certainty.has_edge[std::size_t(i)]);
      EXPECT_LT(certainty.deviation_mm[i], 0.4 * voxel);
      EXPECT_GT(certainty.edge_strength[i], 10);
    }
  }
  // Nothing is known of half the surface within the reach.
  EXPECT_GT(certainty.content_deviation, 0.3 * 4 * std::numbers::pi * 0.36 * 2 * voxel);
}

TEST(LocateEdges, DependsOnNeitherUnitsNorScaleOfTheIntensities) {
  const volume::PhantomOptions options = phantom(volume::PhantomKind::kBall, 0.1);
  const volume::Volume image = volume::make_phantom(options);
  std::vector<float> values;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i) values.push_back(1024 * image.value(i, j, k));
  Eigen::Affine3d affine = options.index_to_world();
  affine.matrix().topRows(3) *= 16;
  const volume::Volume other({40, 40, 40}, affine, values);
  const double voxel = image.voxel_size();
  const Triangles start = mesh::ball({0, 0, 0}, 0.59, 2 * voxel);
  const LocatedEdges<3> a = locate_edges<3>(*make_setting(image), start, 0.6 * voxel);
  const LocatedEdges<3> b =
      locate_edges<3>(*make_setting(other), {16 * start.points, start.elements}, 16 * 0.6 * voxel);
  EXPECT_LT((16 * a.points - b.points).cwiseAbs().maxCoeff(), 1e-6 * 16 * voxel);
  EXPECT_LT((16 * a.certainty.deviation_mm - b.certainty.deviation_mm).cwiseAbs().maxCoeff(),
            1e-5 * 16 * voxel);
  EXPECT_LT((a.certainty.edge_strength - b.certainty.edge_strength).cwiseAbs().maxCoeff(), 1e-4);
}

std::vector<std::string> stages_of(const SegmentResult& result) {
  std::vector<std::string> out;
  for (const StageReport& stage : result.stages) out.push_back(stage.name);
  return out;
}

class LocateStage : public ::surf::test::ScratchFolder {
 protected:
  static SegmentOptions from_the_middle() {
    SegmentOptions out;
    out.seeds_mm = {Vector<3>::Zero()};
    return out;
  }
  volume::Volume image_ = volume::make_phantom(phantom(volume::PhantomKind::kBall, 0.1));
};

TEST_F(LocateStage, IsTheLastOfTheAutomaticWayUnlessTurnedOff) {
  SegmentOptions options = from_the_middle();
  const SegmentResult with = segment(image_, options);
  ASSERT_FALSE(with.stages.empty());
  EXPECT_EQ(with.stages.back().name, "locate");
  EXPECT_EQ(with.stages.back().kind, StageKind::kCorrects);
  ASSERT_TRUE(with.certainty);
  EXPECT_EQ(with.certainty->deviation_mm.size(), with.shape.points.rows());
  EXPECT_TRUE(mesh::verify(with.shape).passed());
  options.locate = false;
  const SegmentResult without = segment(image_, options);
  EXPECT_EQ(without.stages.back().name, "offset");
  EXPECT_FALSE(without.certainty);
  EXPECT_EQ(stages_of(with).size(), stages_of(without).size() + 1);
}

TEST_F(LocateStage, RunsAfterAnyEnergyIfAsked) {
  SegmentOptions options;
  options.initial = mesh::ball({0, 0, 0}, 0.55, 0.1);
  options.energies = {{"chan-vese", 1, {}}, {"area", 0.1, {}}};
  options.settle = false;
  EXPECT_FALSE(segment(image_, options).certainty);
  options.locate = true;
  EXPECT_TRUE(segment(image_, options).certainty);
}

TEST_F(LocateStage, ObeysTheClicks) {
  SegmentOptions options = from_the_middle();
  const double voxel = image_.voxel_size();
  // Just inside the true edge, where a surface on it would come nearer than half a voxel.
  options.seeds_mm.push_back({0.6 - 0.1 * voxel, 0, 0});
  const SegmentResult result = segment(image_, options);
  ASSERT_TRUE(result.certainty);
  const double away = make_setting(image_)->distance_to(result.shape)(options.seeds_mm[1]);
  EXPECT_GE(away, 0.5 * voxel);
}

TEST_F(LocateStage, IsWrittenWithTheSurfaceAndInTheSummary) {
  const auto setting = make_setting(image_);
  const SegmentResult result = segment<3>(setting, from_the_middle());
  for (const char* ending : {".vtp", ".ply"}) {
    const Finished<3> finished = finish<3>(*setting, result, ending);
    const std::string file = path(std::string("ball") + ending);
    segment::write(file, finished, {});
    const Eigen::VectorXd deviation = io::read_point_array(file, "deviation_mm");
    ASSERT_EQ(deviation.size(), result.shape.points.rows());
    EXPECT_LT((deviation - result.certainty->deviation_mm).cwiseAbs().maxCoeff(), 1e-6);
    EXPECT_EQ(io::read_point_array(file, "has_edge").minCoeff(), 1);
    EXPECT_GT(io::read_point_array(file, "edge_strength").minCoeff(), 5);
    const auto summary = nlohmann::json::parse(summary_json<3>(result, &finished)).at("certainty");
    EXPECT_EQ(summary.at("volume_deviation_mm3"), result.certainty->content_deviation);
    EXPECT_EQ(summary.at("share_without_edge"), 0);
    EXPECT_GT(summary.at("deviation_mm").at("median"), 0);
    EXPECT_FALSE(summary.contains("next_click_ras_mm"));
  }
}

// Where the surface ends because the volume does both are 0, which says nothing of the edges.
TEST(Certainty, IsThatOfTheVerticesOffTheBorderInTheSummary) {
  Result<3> result;
  Finished<3> finished;
  finished.certainty.emplace();
  finished.certainty->deviation_mm = Eigen::VectorXd{{0, 0, 0, 0.5, 0.25, 1}};
  finished.certainty->edge_strength = Eigen::VectorXd{{0, 0, 0, 20, 30, 10}};
  const auto summary = nlohmann::json::parse(summary_json<3>(result, &finished)).at("certainty");
  EXPECT_EQ(summary.at("deviation_mm").at("median"), 0.5);
  EXPECT_EQ(summary.at("edge_strength").at("median"), 20);
}

TEST(LocateOption, ComesBackFromJson) {
  for (const std::optional<bool> locate : {std::optional<bool>(), {true}, {false}}) {
    SegmentOptions options;
    options.locate = locate;
    EXPECT_EQ(to_json(options).contains("locate"), locate.has_value());
    EXPECT_EQ(options_from_json<3>(to_json(options)).locate, locate);
  }
}

// A row of segments of which the middle three have no edge.
TEST(FindDoubt, PointsToTheDeepestVertexWithoutAnEdge) {
  const auto polygon = test::unit_sphere<2>(1);
  const Segments circle{polygon.X, polygon.T};
  const auto n = Eigen::Index(circle.points.rows());
  Certainty<2> certainty;
  certainty.deviation_mm = certainty.edge_strength = Eigen::VectorXd::LinSpaced(n, 0, 11);
  certainty.has_edge.assign(std::size_t(n), 1);
  for (const int i : {4, 5, 6, 9}) certainty.has_edge[std::size_t(i)] = 0;
  find_doubt<2>(circle, std::vector<char>(std::size_t(n), 0), certainty);
  EXPECT_NEAR(certainty.share_without_edge, 4.0 / double(n), 1e-12);
  ASSERT_TRUE(certainty.next_click_mm);
  EXPECT_EQ(*certainty.next_click_mm, circle.points.row(5).transpose());
  // Of a part with other numbers.
  Segments part = circle;
  part.points = circle.points.colwise().reverse();
  const Certainty<2> of_part = certainty_of_part<2>(certainty, circle, part);
  EXPECT_EQ(of_part.deviation_mm[0], 11);
  EXPECT_EQ(of_part.has_edge[std::size_t(n - 1 - 5)], 0);
}

// As when the option to keep the largest alone takes away what has no edge.
TEST(CertaintyOfPart, SaysNothingOfWhatWent) {
  const Triangles kept = mesh::ball({0, 0, 0}, 0.5, 0.1), gone = mesh::ball({2, 0, 0}, 0.5, 0.1);
  const auto n_kept = kept.points.rows(), n = n_kept + gone.points.rows();
  Triangles both{Points<3>(n, 3), Elements<3>(kept.elements.rows() + gone.elements.rows(), 3)};
  both.points << kept.points, gone.points;
  both.elements << kept.elements, gone.elements.array() + int(n_kept);
  Certainty<3> certainty;
  certainty.deviation_mm = certainty.edge_strength = Eigen::VectorXd::Ones(n);
  certainty.has_edge.assign(std::size_t(n), 1);
  std::fill(certainty.has_edge.begin() + n_kept, certainty.has_edge.end(), 0);
  certainty.content_deviation = 1;
  find_doubt<3>(both, std::vector<char>(std::size_t(n), 0), certainty);
  EXPECT_NEAR(certainty.share_without_edge, 0.5, 1e-9);
  const Certainty<3> of_kept = certainty_of_part<3>(certainty, both, kept);
  EXPECT_EQ(of_kept.share_without_edge, 0);
  EXPECT_FALSE(of_kept.next_click_mm);
  EXPECT_NEAR(of_kept.content_deviation, std::sqrt(0.5), 1e-9);
  const Certainty<3> of_gone = certainty_of_part<3>(certainty, both, gone);
  EXPECT_EQ(of_gone.share_without_edge, 1);
}

}  // namespace
}  // namespace surf::segment
