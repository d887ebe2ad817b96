// The table of energy kinds, in volumes; in images: tests/curve/segment/energy_kind_test.cpp.
#include "libsurf/segment/energy_kind.h"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <numbers>
#include <set>
#include <thread>

#include "libsurf/base/error.h"
#include "libsurf/energy/domain_integral.h"
#include "libsurf/energy/fields.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/primitives.h"
#include "libsurf/segment/detail/surface_setting.h"
#include "libsurf/segment/detail/volume_model.h"
#include "libsurf/segment/segment.h"
#include "libsurf/volume/phantom.h"
#include "tests/surf/message_of.h"
#include "tests/surf/segment/every_kind.h"

namespace surf::segment {
namespace {

volume::Volume noisy_ball() {
  volume::PhantomOptions options;
  options.size = {40, 40, 40};
  options.noise = 0.05;
  return volume::make_phantom(options);
}

template <class Function>
std::string message(const Function& function) {
  return test::message_of<UsageError>(function);
}

std::string message(const EnergyTerm& term) {
  return message([&] { check_terms<3>(std::vector{term}); });
}

struct Scene {
  volume::Volume image = noisy_ball();
  double voxel = image.voxel_size();
  ImageModel model{
      image, extent_of(image), {.sigma_mm = voxel}, volume::DerivativeFilter::kBSpline};
  KindContext<3> context{.model = model,
                         .seeds_mm = {{0, 0, 0}},
                         .seed = {.mean = 1, .deviation = 0.1, .noise = 0.05, .radius_mm = 0.3},
                         .seed_radius_mm = 0.2};
};

TEST(EveryKind, BuildsInVolumesAndItsDerivativeIsTheDifferenceQuotient) {
  Scene scene;
  const Triangles start = mesh::ball({0.02, -0.01, 0.03}, 0.55, 0.1);
  const SurfaceSetting setting{scene.image};  // for what is fitted to a shape
  scene.context.initial = &start;
  scene.context.setting = &setting;
  test::expect_derivatives_of_every_kind<3>(scene.context, start, 1e-4, 1e-3);
}

TEST(EveryKind, RefusesWhatIsOutsideItsRanges) { test::expect_ranges_of_every_kind<3>(); }

TEST(EveryKind, CompleteTermsRoundTripThroughText) {
  Scene scene;
  for (const EnergyKind<3>* kind : all_kinds<3>()) {
    const EnergyTerm term = test::complete_term<3>(*kind, scene.context);
    EXPECT_EQ(parse_term(to_string(term)), term) << to_string(term);
    EXPECT_EQ(message(term), "accepted");
  }
}

TEST(EveryKind, HasTheDefaultsThatItHadByName) {
  Scene scene;
  const auto of = [&](const char* name) { return completed<3>({name, 1, {}}, scene.context); };
  const double cell = scene.context.cell_mm();
  const double lambda = estimate_edge_strength<3>(*scene.model.intensity(), scene.context.seeds_mm,
                                                  scene.model.extent());
  using Parameters = std::map<std::string, double>;
  EXPECT_EQ(of("area").parameters, Parameters());
  EXPECT_EQ(of("window").parameters, (Parameters{{"mean", 1}, {"half-width", 4 * 0.1}}));
  EXPECT_EQ(of("willmore").parameters, (Parameters{{"curvature", 0}}));
  EXPECT_EQ(of("anisotropic").parameters, (Parameters{{"x", 1}, {"y", 1}, {"z", 1}}));
  EXPECT_EQ(of("alignment").parameters, (Parameters{{"sign", 1}, {"scale", 4 * lambda}}));
  EXPECT_EQ(of("prescribed-curvature").parameters,
            (Parameters{{"curvature", 0}, {"lambda", lambda}}));
  EXPECT_EQ(of("mumford-shah").parameters,
            (Parameters{{"mu", std::pow(10 * cell, 2)},
                        {"gamma", 0.25 * cell},
                        {"contrast", scene.model.contrast(scene.context.seed)}}));
  const EnergyTerm balloon = of("minimal-surface");
  EXPECT_EQ(balloon.parameters, (Parameters{{"gamma0", 1},
                                            {"gamma", -std::max(1.2 * (2 / 0.2), 0.5 / cell)},
                                            {"lambda", lambda}}));
  const Triangles start = mesh::ball({0, 0, 0}, 0.3, 0.1);
  scene.context.initial = &start;
  EXPECT_EQ(of("minimal-surface").parameters.at("gamma"), 0);
}

TEST(EnergyTerms, KeepWhatIsGivenAndChooseTheRestFromIt) {
  Scene scene;
  const EnergyTerm term =
      completed<3>({"minimal-surface", 3, {{"gamma0", 2}, {"lambda", 7}}}, scene.context);
  EXPECT_EQ(term.weight, 3);
  EXPECT_EQ(term.parameters.at("lambda"), 7);
  const EnergyTerm one = completed<3>({"minimal-surface", 1, {}}, scene.context);
  EXPECT_DOUBLE_EQ(term.parameters.at("gamma"), 2 * one.parameters.at("gamma"));
}

TEST(EnergyTerms, FollowTheBlurOfALevel) {
  const std::vector<EnergyTerm> terms = {{"minimal-surface", 1, {{"gamma", 5}, {"lambda", 6}}},
                                         {"alignment", 2, {{"scale", 8}, {"sign", 1}}}};
  const auto wide = at_blur<3>(terms, 1, 4);
  EXPECT_EQ(wide[0], (EnergyTerm{"minimal-surface", 1, {{"gamma", 5}, {"lambda", 1.5}}}));
  EXPECT_EQ(wide[1], (EnergyTerm{"alignment", 2, {{"scale", 2}, {"sign", 1}}}));
}

TEST(EnergyTerms, KnowWhetherTheirMinimisersLieOnEdges) {
  const EnergyTerm regions{"chan-vese", 1, {}}, area{"area", 1, {}}, bending{"willmore", 1, {}};
  EXPECT_TRUE(settle_on_edges<3>(std::vector{regions, area}));
  EXPECT_FALSE(settle_on_edges<3>(std::vector{regions, bending}));
}

TEST(EnergyTerms, KnowTheirEdgesAndTheLengthOfTheirSteps) {
  Scene scene;
  const EnergyTerm window{"window", 1, {{"mean", 1}, {"half-width", 1}}};
  const EnergyTerm edges{"minimal-surface", 1, {{"gamma0", 1}, {"gamma", 0}, {"lambda", 3}}};
  const EnergyTerm mean_edge{"average-edge", 1, {{"lambda", 4}}};
  EXPECT_FALSE(take_long_steps<3>(std::vector{edges, window}));
  EXPECT_TRUE(take_long_steps<3>(std::vector{edges, mean_edge}));
  EXPECT_EQ(edge_strength<3>(std::vector{edges, window}), 3);
  EXPECT_EQ(edge_strength<3>(std::vector{window, mean_edge}), std::nullopt);
  EXPECT_EQ(edge_field<3>(std::vector{edges, window}, scene.context),
            scene.model.edge_indicator(3));
  EXPECT_EQ(edge_field<3>(std::vector{mean_edge}, scene.context), nullptr);
  EXPECT_EQ(integrands<3>(std::vector{edges, window, mean_edge}, scene.context).size(), 3u);
}

TEST(EnergyTerms, KnowHowTheyApproximateTheImage) {
  const EnergyTerm model{"mumford-shah", 1, {{"mu", 2}, {"gamma", 3}, {"contrast", 4}}};
  const auto parameters = piecewise_smooth<3>(std::vector{EnergyTerm{"area", 1, {}}, model});
  ASSERT_TRUE(parameters);
  EXPECT_EQ(parameters->mu, 2);
  EXPECT_EQ(parameters->gamma, 3);
  EXPECT_EQ(parameters->contrast, 4);
  EXPECT_FALSE(parameters->data_tolerance);
  EXPECT_FALSE(is_piecewise_smooth<3>(std::vector{EnergyTerm{"area", 1, {}}}));
  const auto coarse = coarse_terms<3>(std::vector{model});  // no domain meshes: the same
  ASSERT_TRUE(coarse);
  EXPECT_EQ(coarse->front().parameters, model.parameters);
  EXPECT_FALSE(coarse_terms<3>(std::vector{EnergyTerm{"area", 1, {}}}));
}

TEST(EnergyTerms, AreRefusedWithAMessageThatSaysWhatIsWrong) {
  const double nan = std::nan("");
  EXPECT_EQ(message({"snake", 1, {}}),
            "energy 'snake' is unknown; there are " + known_energies<3>());
  EXPECT_EQ(message({"windwo", 1, {}}),
            "energy 'windwo' is unknown; did you mean 'window'? There are " + known_energies<3>());
  EXPECT_EQ(message({"minimal-surface", 1, {{"lamda", 1}}}),
            "energy minimal-surface: parameter 'lamda' is unknown; did you mean 'lambda'?");
  EXPECT_EQ(message({"mumford-shah", 1, {{"data-tolerance", 1}}}),
            "energy mumford-shah: parameter 'data-tolerance' is there for images only");
  EXPECT_EQ(message({"alignment", 1, {{"sign", 2}}}),
            "energy alignment: sign = 2 is none of 1, 0, -1");
  EXPECT_EQ(message({"anisotropic", 1, {{"x", 0}}}), "energy anisotropic: x = 0 violates > 0");
  EXPECT_EQ(message({"willmore", 1, {{"curvature", -1}}}), "accepted");
  EXPECT_EQ(message({"area", nan, {}}), "energy area: weight nan is not a number");
  EXPECT_EQ(message({"area", 1, {{"gamma", 1}}}), "energy area: parameter 'gamma' is unknown");
  EXPECT_EQ(message({"window", 1, {{"mean", nan}}}), "energy window: mean = nan is not a number");
  EXPECT_EQ(message({"window", 1, {{"half-width", 0}}}),
            "energy window: half-width = 0 violates > 0");
  EXPECT_EQ(message({"minimal-surface", 1, {{"lambda", -1}}}),
            "energy minimal-surface: lambda = -1 violates > 0");
  EXPECT_EQ(message({"minimal-surface", 1, {{"gamma", -1}}}), "accepted");
}

TEST(EnergyTerms, MustBeComplete) {
  Scene scene;
  const std::vector<EnergyTerm> incomplete = {{"window", 1, {{"mean", 1}}}};
  EXPECT_EQ(message([&] { make_energy<3>(incomplete, scene.context); }),
            "energy window: parameter half-width is missing");
}

TEST(EnergyTerms, OfAnUnknownKindAreRefusedEverywhere) {
  Scene scene;
  const std::vector<EnergyTerm> terms = {{"windwo", 1, {}}};
  const auto refused = [](const auto& function) {
    EXPECT_NE(message(function).find("did you mean 'window'?"), std::string::npos)
        << message(function);
  };
  refused([&] { find_kind<3>("windwo"); });
  refused([&] { check_terms<3>(terms); });
  refused([&] { completed<3>(terms, scene.context); });
  refused([&] { at_blur<3>(terms, 1, 2); });
  refused([&] { make_energy<3>(terms, scene.context); });
  refused([&] { integrands<3>(terms, scene.context); });
  refused([&] { settle_on_edges<3>(terms); });
  refused([&] { take_long_steps<3>(terms); });
  refused([&] { edge_strength<3>(terms); });
  refused([&] { edge_field<3>(terms, scene.context); });
  refused([&] { piecewise_smooth<3>(terms); });
  refused([&] { coarse_terms<3>(terms); });
  SegmentOptions options;
  options.seeds_mm = {{0, 0, 0}};
  options.energies = terms;
  refused([&] { segment(scene.image, options); });
}

/// |x - c|^2 / r^2 - 1: negative in the ball of radius r.
class BallField : public Field<3> {
 public:
  BallField(Vector<3> center, double radius) : center_(std::move(center)), radius_(radius) {}
  void sample(const Points<3>& x, Derivatives order, Samples<3>& out) const override {
    out.resize(x.rows(), order);
    const Points<3> at = (x.rowwise() - center_.transpose()) / radius_;
    out.value = at.rowwise().squaredNorm().array() - 1;
    if (order >= Derivatives::kFirst) out.gradient = 2 / radius_ * at;
    if (order >= Derivatives::kSecond) {
      const Eigen::Matrix3d H = 2 / (radius_ * radius_) * Eigen::Matrix3d::Identity();
      out.hessian.rowwise() = Eigen::Map<const Eigen::RowVector<double, 9>>(H.data());
    }
  }

 private:
  Vector<3> center_;
  double radius_;
};

/// The ball round the first seed, of three times the seed's radius, or as large as the start is.
double default_radius(const KindContext<3>& context, const EnergyTerm&) {
  if (!context.initial) return 3 * context.seed_radius_mm;
  return std::cbrt(0.75 / std::numbers::pi * mesh::volume_mm3(*context.initial));
}

EnergyKind<3> ball_kind(const std::string& name) {
  EnergyKind<3> kind;
  kind.name = name;
  kind.formula = "int_Omega |x - c|^2 / radius^2 - 1 dx";
  kind.description = "A ball round the seed.";
  KindParameter<3> radius;
  radius.key = "radius";
  radius.unit = "mm";
  radius.range = ParameterRange::positive();
  radius.standard = ParameterDefault<3>::chosen(default_radius, "three times that of the seed");
  kind.parameters = {radius};
  const auto field = [](const KindContext<3>& context, const EnergyTerm& term) {
    return std::make_shared<const BallField>(context.seeds_mm[0], parameter(term, "radius"));
  };
  kind.build = [field](const KindContext<3>& context, const EnergyTerm& term) {
    return std::make_unique<energy::DomainIntegral<3>>(
        field(context, term),
        energy::DomainIntegralOptions{.quadrature_order = 2, .ray_spacing_mm = context.cell_mm()});
  };
  kind.integrands = [field](const KindContext<3>& context, const EnergyTerm& term) {
    return std::vector<std::shared_ptr<const Field<3>>>{field(context, term)};
  };
  return kind;
}

double volume_of_ball(double radius) { return 4 * std::numbers::pi / 3 * std::pow(radius, 3); }

TEST(RegisteredKind, IsUsedByItsNameInARun) {
  register_kind(ball_kind("test-ball"));
  EXPECT_EQ(find_kind<3>("test-ball").name, "test-ball");
  EXPECT_NE(known_energies<3>().find("test-ball"), std::string::npos);
  SegmentOptions options;
  options.seeds_mm = {{0, 0, 0}};
  options.seed_radius_mm = 0.15;
  options.energies = {parse_term("test-ball")};
  const SegmentResult result = segment(noisy_ball(), options);
  EXPECT_EQ(to_string(result.energies.at(0)),
            fmt::format("test-ball:radius={}", 3 * 0.15));  // in the object of radius 0.6
  EXPECT_NEAR(mesh::volume_mm3(result.shape), volume_of_ball(0.45), 0.02 * volume_of_ball(0.45));
}

TEST(RegisteredKind, MayBeFittedToTheShapeOfTheStart) {
  register_kind(ball_kind("test-start"));
  SegmentOptions options;
  options.seeds_mm = {{0, 0, 0}};
  options.initial = mesh::ball({0.1, 0, 0}, 0.4, 0.1);
  options.energies = {parse_term("test-start")};
  const SegmentResult result = segment(noisy_ball(), options);
  const double volume = mesh::volume_mm3(*options.initial);
  EXPECT_NEAR(mesh::volume_mm3(result.shape), volume, 0.02 * volume);
  EXPECT_LT(mesh::centroid(result.shape).norm(), 0.01);  // the seed's place, not the start's
}

// Of docs/developer.md.
EnergyKind<3> brighter_than() {
  EnergyKind<3> kind;
  kind.name = "brighter-than";
  kind.formula = "int_Omega (level - I) / contrast dx";
  kind.description = "Takes what is brighter than a level; needs area.";
  KindParameter<3> level;
  level.key = "level";
  level.unit = "intensity";
  level.meaning = "what the object is brighter than";
  level.standard = ParameterDefault<3>::chosen(
      [](const KindContext<3>& context, const EnergyTerm&) {
        return context.seed.mean - context.model.contrast(context.seed) / 2;
      },
      "half the image's contrast below the seeds");
  kind.parameters = {level};
  kind.build = [](const KindContext<3>& context, const EnergyTerm& term) {
    const double at = parameter(term, "level"), scale = context.model.contrast(context.seed);
    const auto darkness =
        surf::energy::mapped_field<3>(context.model.intensity(), [=](double intensity) {
          return std::array<double, 3>{(at - intensity) / scale, -1 / scale, 0};
        });
    return std::make_unique<surf::energy::DomainIntegral<3>>(
        darkness, surf::energy::DomainIntegralOptions{.ray_spacing_mm = context.cell_mm()});
  };
  return kind;
}

TEST(RegisteredKind, OfTheDeveloperGuideFindsTheBall) {
  EnergyKind<3> kind = brighter_than();
  kind.name = "test-brighter-than";
  register_kind(kind);
  SegmentOptions options;
  options.seeds_mm = {{0, 0, 0}};
  options.energies = {parse_term("test-brighter-than"), parse_term("area:weight=0.01")};
  const SegmentResult result = segment(noisy_ball(), options);
  const double quarter_voxel = 0.25 * 2 / 39;
  EXPECT_NEAR(std::cbrt(mesh::volume_mm3(result.shape) / volume_of_ball(1)), 0.6, quarter_voxel);
}

TEST(RegisteredKind, BelongsToItsDimension) {
  register_kind(ball_kind("test-volumes"));
  EXPECT_NE(message([] {
              find_kind<2>("test-volumes");
            }).find("energy 'test-volumes' is there for volumes only"),
            std::string::npos);
}

TEST(RegisteredKind, IsRefusedWhereItsNameIsTakenOrItCannotBe) {
  const auto refused = [](EnergyKind<3> kind, const std::string& what) {
    const std::string text = message([&] { register_kind(std::move(kind)); });
    EXPECT_NE(text.find(what), std::string::npos) << text;
  };
  refused(ball_kind("window"), "energy kind window: there is one of this name");
  for (const char* name : {"", "a b", "a:b", "a,b", "a=b", "auto", "list"})
    refused(ball_kind(name), "this cannot be a name");
  EnergyKind<3> kind = ball_kind("test-refused");
  kind.parameters.push_back(kind.parameters[0]);
  refused(kind, "parameter 'radius' is there twice");
  kind.parameters[1].key = "weight";
  refused(kind, "parameter 'weight' cannot have this name");
  kind.parameters[1].key = "c";
  kind.parameters[1].standard = ParameterDefault<3>::of(-1);
  refused(kind, "parameter 'c' has a default outside its range");
  kind = ball_kind("test-refused");
  kind.build = {};
  refused(kind, "build is missing");
  EXPECT_THROW(find_kind<3>("test-refused"), UsageError);
}

TEST(RegisteredKind, MayComeFromAnyThreadWhileOthersAreFound) {
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([t] {
      for (int i = 0; i < 20; ++i) {
        register_kind(ball_kind(fmt::format("test-thread-{}-{}", t, i)));
        EXPECT_EQ(find_kind<3>("window").name, "window");
        EXPECT_FALSE(known_energies<3>().empty());
      }
    });
  for (std::thread& thread : threads) thread.join();
  std::set<std::string> names;
  for (const EnergyKind<3>* kind : all_kinds<3>()) names.insert(kind->name);
  for (int t = 0; t < 4; ++t)
    for (int i = 0; i < 20; ++i)
      EXPECT_TRUE(names.contains(fmt::format("test-thread-{}-{}", t, i)));
}

}  // namespace
}  // namespace surf::segment
