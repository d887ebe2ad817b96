// From a phantom to a scored surface through the program, and what its options promise.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "libsurf/base/error.h"
#include "libsurf/io/read_surface.h"
#include "libsurf/mesh/distance.h"
#include "libsurf/mesh/measure.h"
#include "libsurf/mesh/point_obstacles.h"
#include "libsurf/mesh/rasterize.h"
#include "libsurf/mesh/verify.h"
#include "libsurf/volume/read_volume.h"
#include "libsurf/volume/write_volume.h"
#include "tests/cli/ball.h"
#include "tests/surf/not_root.h"
#include "tools/common/outputs.h"

namespace surfseg::test {
namespace {

class Segment : public BallTest {};

TEST_F(Segment, FindsABallFromOneSeed) {
  for (const std::string noise : {"0", "0.1"}) {
    make_ball({"--spacing", "1", "--noise", noise});
    EXPECT_NE(must({"info", "ball.nii.gz"}).out.find("40 x 40 x 40"), std::string::npos);
    must(segment({"-o", "s.stl", "--json", "s.json"}));
    EXPECT_GT(dice("s.stl"), 0.98) << "noise " << noise;
    EXPECT_NEAR(json("s.json")["volume_mm3"], kVolumeMm3, kVolumeToleranceMm3) << noise;
  }
}

// A cube of nodes round the click holds nearly half of so small a grid, and in it crumbs of noise.
TEST_F(Segment, FindsAWholeNoisyTorusInASmallVolume) {
  for (const char* seed : {"0", "1"}) {
    must({"phantom", "torus", "--size", "64", "--noise", "0.1", "--random-seed", seed, "-o",
          "torus.nii"});
    must(
        {"segment", "torus.nii", "--seed", "0.5,0,0", "-o", "torus.stl", "--json", "s.json", "-q"});
    const double volume = 2 * std::numbers::pi * std::numbers::pi * 0.5 * 0.2 * 0.2;
    EXPECT_NEAR(json("s.json")["volume_mm3"].get<double>(), volume, 0.01 * volume) << seed;
  }
}

// The result obeys, its summary as a config gives it again, and so does its recipe.
TEST_F(Segment, HasAnOutsidePointOutside) {
  make_ball();
  const Words run = segment({"--outside", "0,9.3,0", "--space", "ras"});
  must(joined(run, {"-o", "s.vtp", "--json", "s.json", "--recipe", "r.json"}));
  const surf::Triangles surface = surf::io::read_surface(file("s.vtp"));
  const surf::mesh::DistanceToSurface distance(surface);
  EXPECT_GE(distance({0, 9.3, 0}), 0.5);
  surf::Points<3> points(2, 3);
  points << 0, 9.3, 0, 0, 0, 0;
  EXPECT_EQ(surf::mesh::are_inside<3>(surface, points), (std::vector<char>{0, 1}));
  must({"segment", "ball.nii.gz", "--config", "s.json", "-o", "again.vtp", "-q"});
  EXPECT_EQ(bytes("again.vtp"), bytes("s.vtp"));
  must({"replay", "r.json", "-o", "third.vtp", "-q"});
  EXPECT_EQ(bytes("third.vtp"), bytes("s.vtp"));
}

TEST_F(Segment, SummaryHasEveryKey) {
  make_ball();
  must(segment({"-o", "s.stl", "--json", "s.json"}));
  const auto summary = json("s.json");
  for (const char* key : {"energy", "iterations", "outcome", "vertices", "triangles", "volume_mm3",
                          "area_mm2", "closed", "manifold", "self_intersections", "min_angle_deg",
                          "time_s", "peak_memory_mb", "config", "exit_code", "chosen", "notes"})
    EXPECT_TRUE(summary.contains(key)) << key;
  EXPECT_EQ(summary["closed"], true);
  EXPECT_EQ(summary["manifold"], true);
  EXPECT_EQ(summary["self_intersections"], 0);
  EXPECT_EQ(summary["outcome"], "converged");
  EXPECT_EQ(summary["triangles"], 2 * summary["vertices"].get<int>() - 4);  // Euler: a sphere
  for (const char* stage : {"read", "segment", "verify", "write"}) {
    EXPECT_GE(summary["stages"][stage]["time_s"], 0) << stage;
    EXPECT_GT(summary["stages"][stage]["peak_memory_mb"], 0) << stage;
  }
}

TEST_F(Segment, ProfileSaysWhereTheTimeWent) {
  make_ball();
  const Words aloud = {"segment", "ball.nii.gz", "--seed", "0,0,0", "-o", "s.stl"};
  const Outcome outcome = run(joined(aloud, {"--profile", "--json", "s.json"}));
  ASSERT_EQ(outcome.exit_code, 0) << outcome.err;
  for (const char* line : {"\nprofile ", "\nread ", "\nsegment ", "\n  propose ", "\n  evolve ",
                           "\n  locate ", "\nverify ", "\nwrite ", "\nin all "})
    EXPECT_NE(outcome.err.find(line), std::string::npos) << line << outcome.err;
  const auto summary = json("s.json");
  double sum = 0;
  for (const auto& stage : summary["evolution"]) {
    sum += stage["time_s"].get<double>();
    EXPECT_GE(stage["cpu_s"], 0);
    EXPECT_GT(stage["peak_memory_mb"], 0);
  }
  const double whole = summary["stages"]["segment"]["time_s"];
  EXPECT_LE(sum, whole + 0.002);  // which is rounded
  EXPECT_GE(sum, 0.8 * whole);
  EXPECT_EQ(run(aloud).err.find("profile"), std::string::npos);
}

TEST_F(Segment, WritesEveryFormat) {
  make_ball();
  must(segment({"-o", "s.vtp"}));
  for (const char* name : {"s.stl", "s.obj", "s.ply"}) {
    must(segment({"-o", name}));
    must({"evaluate", name, "--reference", "s.vtp", "--json", "e.json"});
    EXPECT_LT(json("e.json")["distance"]["max_mm"], 1e-5) << name;  // float32 of 12 mm
    EXPECT_TRUE(json("e.json")["quality"]["passed"]) << name;
  }
}

TEST_F(Segment, OutputSpaceIsStatedAndReadBack) {
  make_ball();
  must(segment({"-o", "lps.ply"}));
  must(segment({"-o", "ras.ply", "--output-space", "ras"}));
  EXPECT_NE(bytes("lps.ply").find("SPACE=LPS"), std::string::npos);
  EXPECT_NE(bytes("ras.ply").find("SPACE=RAS"), std::string::npos);
  const auto lps = surf::io::read_surface(file("lps.ply"));
  const auto ras = surf::io::read_surface(file("ras.ply"));
  EXPECT_EQ(lps.points, ras.points);
}

TEST_F(Segment, MaskAgreesWithTheSurface) {
  make_ball();
  must(segment({"-o", "s.vtp", "--mask", "mask.nii.gz"}));
  const auto surface = surf::io::read_surface(file("s.vtp"));
  const auto volume = surf::volume::read_volume(file("ball.nii.gz"));
  const auto mask = surf::volume::read_volume(file("mask.nii.gz"));
  ASSERT_EQ(mask.size(), volume.size());
  EXPECT_TRUE(mask.index_to_world().isApprox(volume.index_to_world(), 1e-6));
  const auto inside = surf::mesh::rasterize(surface, volume.size(), volume.index_to_world());
  std::size_t n = 0, n_wrong = 0, n_inside = 0;
  for (int k = 0; k < 40; ++k)
    for (int j = 0; j < 40; ++j)
      for (int i = 0; i < 40; ++i, ++n) {
        n_inside += inside[n] != 0;
        n_wrong += (mask.value(i, j, k) != 0) != (inside[n] != 0);
      }
  EXPECT_EQ(n_wrong, 0u);
  EXPECT_NEAR(double(n_inside), kVolumeMm3, kVolumeToleranceMm3);
}

// The same voxels stored along other axes, or backwards: the mask is on the file's grid.
TEST_F(Segment, TheMaskIsOnTheGridOfAFileInAnyOrderOfAxes) {
  const std::array<int, 3> size = {24, 30, 36};
  const Eigen::Vector3d center(9, 12, 22);
  constexpr double kRadius = 6;
  for (const std::array<int, 3>& axes : {std::array{0, 1, 2}, {1, 2, 0}, {2, 1, 0}}) {
    Eigen::Affine3d at = Eigen::Affine3d::Identity();  // LPS, with its axes exchanged
    at.linear().setZero();
    std::array<int, 3> stored;
    for (int n = 0; n < 3; ++n) {
      stored[n] = size[axes[n]];
      at.linear()(axes[n], n) = axes[n] == 2 ? 1 : -1;
      at.translation()[axes[n]] = axes[n] == 2 ? 0 : size[axes[n]] - 1;
    }
    std::vector<float> values;
    std::vector<std::uint8_t> is_inside;
    for (int k = 0; k < stored[2]; ++k)
      for (int j = 0; j < stored[1]; ++j)
        for (int i = 0; i < stored[0]; ++i) {
          const double depth = kRadius - (at * Eigen::Vector3d(i, j, k) - center).norm();
          values.push_back(float(std::clamp(depth + 0.5, 0.0, 1.0)));
          is_inside.push_back(depth > 0);
        }
    surf::volume::write_volume(file("stored.nii.gz"), {stored, at, values});
    must({"segment", "stored.nii.gz", "--seed", "9,12,22", "--space", "ras", "-o", "s.vtp",
          "--mask", "m.nii.gz", "-q"});
    const auto mask = surf::volume::read_volume(file("m.nii.gz"));
    ASSERT_EQ(mask.size(), stored);
    EXPECT_TRUE(mask.index_to_world().isApprox(at, 1e-6));
    std::vector<float> labels(values.size());
    mask.copy_box({0, 0, 0}, stored, labels.data());
    int n_wrong = 0;
    for (std::size_t n = 0; n < labels.size(); ++n) n_wrong += (labels[n] == 1) != is_inside[n];
    EXPECT_LT(n_wrong, 20) << axes[0] << axes[1] << axes[2];  // of 905
  }
}

TEST_F(Segment, MumfordShahFindsANoisyBallAndItsDenoisedVolume) {
  make_ball({"--spacing", "1", "--noise", "0.25"});
  must({"segment", "ball.nii.gz", "-q", "--initial-ball", "1,0,0,8mm", "--energy", "mumford-shah",
        "-o", "s.vtp", "--denoised", "u.nii.gz", "--json", "s.json"});
  EXPECT_GT(dice("s.vtp"), 0.97);
  const auto image = surf::volume::read_volume(file("ball.nii.gz"));
  const auto u = surf::volume::read_volume(file("u.nii.gz"));
  ASSERT_EQ(u.size(), image.size());
  EXPECT_TRUE(u.index_to_world().isApprox(image.index_to_world(), 1e-6));
  EXPECT_GT(u.value(20, 20, 20), 0.8);
  EXPECT_LT(u.value(1, 1, 1), 0.2);
  EXPECT_LT(u.range()[1] - u.range()[0], 0.6 * (image.range()[1] - image.range()[0]));
}

TEST_F(Segment, MumfordShahBeginsCoarselyWhereThatIsAskedFor) {
  make_ball({"--spacing", "1", "--noise", "0.25"});
  const auto stages = [&](const Words& more) {
    must(joined({"segment", "ball.nii.gz", "-q", "--initial-ball", "1,0,0,8mm", "--energy",
                 "mumford-shah", "-o", "s.stl", "--json", "s.json"},
                more));
    std::vector<std::string> out;
    const auto summary = json("s.json");
    for (const auto& stage : summary["evolution"]) out.push_back(stage["stage"]);
    return out;
  };
  EXPECT_EQ(stages({}).front(), "evolve");
  const auto with = stages({"--coarse-steps", "150", "--one-way"});
  EXPECT_EQ(with.front(), "coarse");
  EXPECT_EQ(with.back(), "evolve");
  EXPECT_GT(dice("s.stl"), 0.97);
}

TEST_F(Segment, DenoisedNeedsTheMumfordShahModel) {
  make_ball();
  const auto result = run(segment({"-o", "s.vtp", "--denoised", "u.nii.gz"}));
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_NE(result.err.find("--denoised"), std::string::npos) << result.err;
  const auto name =
      run(segment({"-o", "s.vtp", "--energy", "mumford-shah", "--denoised", "u.png"}));
  EXPECT_EQ(name.exit_code, 2);
  EXPECT_NE(name.err.find("u.png"), std::string::npos) << name.err;
}

TEST_F(Segment, SameBytesAgainAndForAnyNumberOfThreads) {
  make_ball({"--spacing", "1", "--noise", "0.1"});
  must(segment({"-o", "a.stl"}));
  for (const char* threads : {"0", "1", "2"}) {
    must(segment({"-o", "b.stl", "--threads", threads}));
    EXPECT_EQ(bytes("a.stl"), bytes("b.stl")) << threads;
  }
}

TEST_F(Segment, SummaryIsAConfigThatTheCommandLineOverrides) {
  make_ball();
  must(segment({"-o", "a.stl", "--json", "a.json", "--radius", "3mm", "--seed", "1,-2,8",
                "--energy", "window:mean=1,half-width=0.5", "--energy", "area:weight=0.1",
                "--edge-length", "2mm"}));
  must({"segment", "--config", "a.json", "-o", "b.stl", "--json", "b.json"});
  EXPECT_EQ(bytes("a.stl"), bytes("b.stl"));
  EXPECT_EQ(json("b.json")["config"]["seed"].size(), 2u);
  must(
      {"segment", "--config", "a.json", "-o", "c.stl", "--json", "c.json", "--edge-length", "3mm"});
  EXPECT_LT(json("c.json")["triangles"], json("a.json")["triangles"]);
  EXPECT_EQ(json("c.json")["config"]["edge-length"], "3mm");
}

// What a run was not told is in its summary, too, and need not go together with what it was told.
TEST_F(Segment, SummaryIsAConfigWhateverTheRunWasTold) {
  make_ball();
  for (const Words& more : {Words{"--gamma=-1"}, Words{"--energy", "chan-vese", "--energy",
                                                       "area:weight=0.1", "--flow", "lbfgs"}}) {
    must(segment(joined({"-o", "a.stl", "--json", "a.json"}, more)));
    must({"segment", "--config", "a.json", "-o", "b.stl", "-q"});
    EXPECT_EQ(bytes("a.stl"), bytes("b.stl"));
  }
  must(segment({"-o", "a.stl", "--json", "a.json"}));
  EXPECT_NE(run({"segment", "--config", "a.json", "-o", "b.stl", "--gamma=-1"}).exit_code, 2);
}

// What a summary has it has against a preset, also where that is what holds without any.
TEST_F(Segment, ASummaryWinsOverAPreset) {
  make_ball();
  must(segment({"-o", "a.stl", "--json", "a.json", "--energy", "minimal-surface"}));
  std::ofstream(file("p.json")) << R"({"description": "coarse", "coarseness": 1})";
  setenv("SURFSEG_PRESETS", file("").c_str(), 1);
  const Outcome outcome =
      run({"segment", "--config", "a.json", "--preset", "p", "-o", "b.stl", "--json", "b.json"});
  unsetenv("SURFSEG_PRESETS");
  EXPECT_EQ(outcome.exit_code, 0) << outcome.err;
  EXPECT_EQ(json("b.json")["config"]["coarseness"], json("a.json")["config"]["coarseness"]);
}

TEST_F(Segment, ConfigTakesEveryOption) {
  make_ball();
  const nlohmann::json config = {{"VOLUME", "ball.nii.gz"},
                                 {"output", "s.obj"},
                                 {"frame-index", 0},
                                 {"seed", {"17,17,17", "18,17,17"}},
                                 {"space", "ijk"},
                                 {"radius", "4mm"},
                                 {"initial-ball", "18,18,18,5vox"},
                                 {"initial-label", 2},
                                 {"sigma", "1mm"},
                                 {"selective-sigma", "0.5vox"},
                                 {"selective-threshold", 0.2},
                                 {"derivatives", "scharr"},
                                 {"energy", {"minimal-surface", "area:weight=0.01"}},
                                 {"lambda", 0.1},
                                 {"gamma", -1.5},
                                 {"gamma0", 1},
                                 {"no-settle", true},
                                 {"topology", "fixed"},
                                 {"topology-resolution", "1vox"},
                                 {"sheet-distance", "1vox"},
                                 {"open-cavities", true},
                                 {"min-component", 20},
                                 {"fill-cavities", true},
                                 {"keep", "seeded"},
                                 {"edge-length", "2vox"},
                                 {"coarseness", 3},
                                 {"levels", 2},
                                 {"geometry-tolerance", "0.5vox"},
                                 {"integral-tolerance", 0.02},
                                 {"flow", "l2"},
                                 {"scheme", "semi-implicit"},
                                 {"step-rule", "backtracking"},
                                 {"max-iterations", 100},
                                 {"tolerance", 1e-3},
                                 {"alpha", 0.2},
                                 {"beta", 0.8},
                                 {"epsilon-tau", 0.7},
                                 {"tau-min", 1e-9},
                                 {"tau-max", 10},
                                 {"gamma-refine", 0.8},
                                 {"gamma-coarsen", 0.6},
                                 {"output-space", "ras"},
                                 {"mask", "m.mha"},
                                 {"candidates", true},
                                 {"json", "s.json"},
                                 {"threads", 1},
                                 {"quiet", true},
                                 {"verbose", false}};
  std::ofstream(file("c.json")) << config;
  const Outcome outcome = run({"segment", "--config", "c.json"});
  EXPECT_TRUE(outcome.exit_code == 0 || outcome.exit_code == 5) << outcome.err;
  EXPECT_EQ(outcome.err, "");
  EXPECT_TRUE(exists("m.mha"));
  EXPECT_NE(bytes("s.obj").find("SPACE=RAS"), std::string::npos);
  const auto used = json("s.json")["config"];
  for (const auto& [key, value] : config.items())
    EXPECT_TRUE(key == "json" || used.contains(key)) << key;
}

TEST_F(Segment, WritesTheCandidatesOfEveryClickAndSaysWhere) {
  make_ball();
  const Outcome outcome = must({"segment", "ball.nii.gz", "--seed", "0,0,0", "--outside", "0,8,0",
                                "-o", "s.ply", "--json", "s.json", "--candidates"});
  const auto candidates = json("s.json")["candidates"];
  ASSERT_GE(candidates.size(), 2u);
  EXPECT_EQ(candidates.front()["click"], 2);
  EXPECT_EQ(candidates.back()["click"], 1);
  double volume_mm3 = 0;
  for (std::size_t n = 0; n < candidates.size(); ++n) {
    const std::string path = "s.candidate-" + std::to_string(n + 1) + ".ply";
    EXPECT_EQ(candidates[n]["file"], path);
    EXPECT_NE(outcome.err.find(": " + path + "\n"), std::string::npos) << outcome.err;
    const surf::Triangles surface = surf::io::read_surface(file(path));
    EXPECT_TRUE(surf::mesh::verify(surface).passed()) << path;
    EXPECT_NEAR(surf::mesh::volume_mm3(surface), candidates[n]["volume_mm3"], 0.01) << path;
    EXPECT_NE(candidates[n]["volume_mm3"], volume_mm3) << path;
    volume_mm3 = candidates[n]["volume_mm3"];
  }
  EXPECT_FALSE(exists("s.candidate-" + std::to_string(candidates.size() + 1) + ".ply"));
}

TEST_F(Segment, TakesAwayTheCandidatesOfARunBefore) {
  make_ball();
  for (int k = 1; k <= 6; ++k)
    write("files/s.candidate-" + std::to_string(k) + ".stl", "of another scan");
  must({"segment", "ball.nii.gz", "--seed", "0,0,0", "-o", "s.stl", "--json", "s.json",
        "--candidates", "-q"});
  const std::size_t n = json("s.json")["candidates"].size();
  ASSERT_LT(n, 6u);
  for (std::size_t k = 1; k <= 6; ++k)
    EXPECT_EQ(exists("s.candidate-" + std::to_string(k) + ".stl"), k <= n) << k;
}

TEST_F(Segment, TakesAwayNoCandidatesWhereItLooksForNone) {
  make_ball();
  write("files/s.candidate-1.stl", "of a run before");
  must({"segment", "ball.nii.gz", "--initial", "ball.nii.gz", "--energy", "minimal-surface", "-o",
        "s.stl", "--candidates", "-q"});
  EXPECT_EQ(bytes("s.candidate-1.stl"), "of a run before");
}

TEST_F(Segment, SaysThatASummaryDoesNotHoldTheOrderOfClicks) {
  make_ball();
  must({"segment", "ball.nii.gz", "--seed", "0,0,0", "--outside", "0,17,0", "--seed", "0,2,0", "-o",
        "s.stl", "--json", "s.json"});
  const Outcome outcome = must({"segment", "--config", "s.json", "-o", "again.stl"});
  EXPECT_NE(outcome.err.find("note: --config does not hold in which order"), std::string::npos)
      << outcome.err;
}

// In a container every program has the same number.
TEST_F(Segment, WhatAKilledCheckOfAFolderHasLeftIsInNobodysWay) {
  write("files/.surfseg-" + std::to_string(::getpid()) + "-probe", "");
  EXPECT_NO_THROW(check_outputs({{"-o", file("s.stl")}}));
  EXPECT_EQ(files().size(), 1u);
}

TEST_F(Segment, WriteProtectedOutputsAreRefusedBeforeTheWork) {
  write("files/s.stl", "kept");
  std::filesystem::permissions(file("s.stl"), std::filesystem::perms(0444));
  for (const std::string& folder : {path(""), path("files")})
    std::filesystem::permissions(folder, std::filesystem::perms::all);
  const surf::test::NotRoot anybody;
  if (!anybody.may_enter(path("files"))) GTEST_SKIP() << "root cannot become anybody here";
  EXPECT_NO_THROW(check_outputs({{"-o", file("t.stl")}}));
  EXPECT_THROW(check_outputs({{"-o", file("s.stl")}}), surf::OutputError);
}

// What a run reads it does not write over.
TEST_F(Segment, OutputsAreNoInputs) {
  make_ball();
  must({"segment", "ball.nii.gz", "--seed", "0,0,0", "-o", "s.stl", "--mask", "m.nii.gz", "--json",
        "s.json", "-q"});
  write("files/points.txt", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 1\n");
  for (const char* name : {"t.candidate-2.stl", "a.candidate-1.stl"})
    write(std::string("files/") + name, bytes("s.stl"));
  const std::vector<Words> all = {
      {"--marks", "m.nii.gz", "--mask", "m.nii.gz", "-o", "t.stl"},
      {"--reference", "m.nii.gz", "--mask", "m.nii.gz", "--seed", "0,0,0", "-o", "t.stl"},
      {"--initial", "s.stl", "--energy", "area", "-o", "s.stl"},
      {"--landmarks", "points.txt", "--energy", "area", "-o", "t.stl", "--json", "points.txt"},
      {"--config", "s.json", "-o", "t.stl", "--recipe", "s.json"},
      {"--initial", "t.candidate-2.stl", "-o", "t.stl", "--candidates"},
      {"--reference", "a.candidate-1.stl", "--object", "a", "--seed", "0,0,0", "-o", "{object}.stl",
       "--candidates"}};
  for (const Words& words : all) {
    Words command = {"segment", "ball.nii.gz"};
    command.insert(command.end(), words.begin(), words.end());
    const std::string option = words.front(), before = bytes(words[1]);
    const Outcome outcome = run(command);
    EXPECT_EQ(outcome.exit_code, 2) << option;
    EXPECT_NE(outcome.err.find("is " + option + " too; give another file name"), std::string::npos)
        << outcome.err;
    EXPECT_EQ(bytes(words[1]), before) << option;
  }
  const Outcome outcome = run({"evaluate", "s.stl", "--reference", "m.nii.gz", "--json", "s.stl"});
  EXPECT_EQ(outcome.exit_code, 2);
  EXPECT_NE(outcome.err.find("is the surface too"), std::string::npos) << outcome.err;
}

/// Radii 11.7 and 5.85 mm; the surface starts on the voxels' stairs, cavity included.
TEST_F(Segment, CavitiesAreReportedAndFilled) {
  must({"phantom", "shell", "--size", "40", "--spacing", "1", "-o", "shell.nii.gz"});
  const Words start = {"segment",  "shell.nii.gz",    "--initial", "shell.nii.gz",
                       "--energy", "minimal-surface", "-q",        "-o",
                       "s.stl",    "--json",          "s.json"};
  must(start);
  const auto shell = json("s.json")["shells"];
  ASSERT_EQ(shell.size(), 1u);
  ASSERT_EQ(shell[0]["cavities"].size(), 1u);
  EXPECT_NEAR(shell[0]["volume_mm3"], kVolumeMm3, kVolumeToleranceMm3);
  constexpr double kQuarterVoxelMm = 0.25;
  EXPECT_NEAR(shell[0]["cavities"][0]["volume_mm3"], kVolumeMm3 / 8,
              kQuarterVoxelMm * M_PI * kRadiusMm * kRadiusMm);  // its area: 4 pi (R / 2)^2
  EXPECT_EQ(shell[0]["genus"], 0);
  EXPECT_FALSE(json("s.json").contains("removed"));
  must(joined(start, {"--fill-cavities"}));
  EXPECT_EQ(json("s.json")["shells"][0]["cavities"].size(), 0u);
  EXPECT_NEAR(json("s.json")["volume_mm3"], kVolumeMm3, kVolumeToleranceMm3);
  EXPECT_EQ(json("s.json")["removed"][0]["what"], "filled cavity");
}

TEST_F(Segment, ComponentsAreKeptBySizeAndSeed) {
  must({"phantom", "separate-balls", "--size", "40", "--spacing", "1", "-o", "balls.nii.gz"});
  const double volume = kVolumeMm3 / 8;
  const Words start = {"segment",  "balls.nii.gz",    "--initial", "balls.nii.gz",
                       "--energy", "minimal-surface", "-q",        "-o",
                       "s.stl",    "--json",          "s.json"};
  const auto shells = [&](const Words& more) {
    must(joined(start, more));
    return json("s.json")["shells"];
  };
  EXPECT_EQ(shells({}).size(), 2u);
  EXPECT_EQ(shells({"--min-component", std::to_string(0.9 * volume)}).size(), 2u);
  EXPECT_EQ(shells({"--min-component", fmt::format("{}ml", 0.9e-3 * volume)}).size(), 2u);
  EXPECT_EQ(shells({"--keep", "largest"}).size(), 1u);
  for (const double x : {-9.75, 9.75}) {
    const auto kept = shells({"--keep", "seeded", "--seed", std::to_string(x) + ",0,0"});
    ASSERT_EQ(kept.size(), 1u);
    constexpr double kVoxel = 1;
    EXPECT_NEAR(kept[0]["center_ras_mm"][0], x, kVoxel);
    EXPECT_NEAR(json("s.json")["removed"][0]["center_ras_mm"][0], -x, kVoxel);
  }
}

TEST_F(Segment, NothingIsWrittenIfNoComponentIsLeft) {
  make_ball();
  const Outcome outcome = run(segment({"-o", "s.stl", "--min-component", "1e6"}));
  EXPECT_EQ(outcome.exit_code, 6);
  EXPECT_NE(outcome.err.find("removed: 1 small component"), std::string::npos) << outcome.err;
  EXPECT_FALSE(exists("s.stl"));
}

TEST_F(Segment, IterationLimitWritesTheResultWithItsCode) {
  make_ball();
  const Outcome outcome =
      run(segment({"-o", "s.stl", "--json", "s.json", "--energy", "minimal-surface", "--radius",
                   "3mm", "--max-iterations", "3"}));
  EXPECT_EQ(outcome.exit_code, 5) << outcome.err;
  EXPECT_EQ(json("s.json")["outcome"], "stopped at a limit");
  EXPECT_EQ(json("s.json")["exit_code"], 5);
  must({"evaluate", "s.stl", "--reference", "s.stl"});
}

TEST_F(Segment, ProgressIsPlainInAPipeAndSilentWhenQuiet) {
  make_ball();
  const Words plain = {"segment", "ball.nii.gz", "--seed", "0,0,0", "-o", "s.stl"};
  const Outcome normal = must(plain), verbose = must(joined(plain, {"-v"})),
                quiet = must(joined(plain, {"--quiet"}));
  EXPECT_NE(normal.err.find(" step "), std::string::npos) << normal.err;
  EXPECT_NE(normal.err.find("s.stl: "), std::string::npos) << normal.err;
  EXPECT_GT(verbose.err.size(), normal.err.size());
  for (const std::string& text : {normal.err, verbose.err}) {
    EXPECT_EQ(text.find('\x1b'), std::string::npos);
    EXPECT_EQ(text.find('\r'), std::string::npos);
  }
  EXPECT_EQ(quiet.err, "");
  EXPECT_EQ(quiet.out, "");
}

TEST_F(Segment, VolumeMayComeLast) {
  make_ball();
  must({"segment", "-q", "-o", "s.stl", "--seed", "-1,2,3", "ball.nii.gz"});
}

TEST_F(Program, MakesEveryPhantom) {
  const std::string help = must({"phantom", "--help"}).out;
  for (const std::string kind :
       {"ball", "two-balls", "separate-balls", "box", "torus", "shell", "vessel", "tree", "rods"}) {
    must({"phantom", kind, "--size", "12", "-o", kind + ".nii"});
    EXPECT_TRUE(exists(kind + ".nii"));
    EXPECT_NE(help.find("\n  " + kind + "  "), std::string::npos) << kind;
  }
}

TEST_F(Program, HelpNamesTheOptions) {
  const auto expect_in_help = [&](const std::string& verb, const Words& names) {
    const Outcome help = must({verb, "--help"});
    EXPECT_EQ(help.err, "");
    for (const std::string& name : names)
      EXPECT_NE(help.out.find(name), std::string::npos) << verb << " " << name;
  };
  expect_in_help("segment", {"--seed",
                             "--radius",
                             "-o,",
                             "--space",
                             "--energy",
                             "--flow",
                             "--scheme",
                             "--sigma",
                             "--lambda",
                             "--gamma",
                             "--gamma0",
                             "--edge-length",
                             "--max-iterations",
                             "--tolerance",
                             "--threads",
                             "--mask",
                             "--json",
                             "--config",
                             "--quiet",
                             "-v,",
                             "--initial-ball",
                             "--initial-ellipsoid",
                             "--initial-box",
                             "--min-component",
                             "--fill-cavities",
                             "--keep",
                             "Exit codes"});
  expect_in_help("info", {"FILE", "--json", "--frame-index"});
  expect_in_help("phantom", {"KIND", "--size", "--spacing", "--direction", "--edge-width",
                             "--noise", "--random-seed"});
  expect_in_help("evaluate", {"SURFACE", "--reference", "--label", "--json"});
  const Outcome all = must({"--help"});
  for (const char* verb : {"segment", "info", "phantom", "evaluate"})
    EXPECT_NE(all.out.find(verb), std::string::npos) << verb;
  EXPECT_TRUE(must({"--version"}).out.starts_with("surfseg 0."));
}

}  // namespace
}  // namespace surfseg::test
