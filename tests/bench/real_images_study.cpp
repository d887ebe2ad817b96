// The study of thesis 5.1.2: L2 against H1, one seed against several, selective smoothing on and
// off. Tables and pictures of docs/real-images.md (tools/real-images.sh): on a phantom, or with
// --image on an image or a slice of a volume.
//
//   real_images_study [--pictures DIR]
//   real_images_study --image FILE --reference MASK --start NAME=X,Y,RADIUS... [--pictures DIR]
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "libcurve/image/read_image.h"
#include "libcurve/image/slice.h"
#include "libcurve/mesh/primitives.h"
#include "libsurf/base/error.h"
#include "libsurf/volume/read_volume.h"
#include "tests/bench/montage.h"
#include "tests/bench/real_image_runs.h"

namespace {

using namespace surf;
using namespace surf::bench;
using curve::Image;

struct Arguments {
  std::string image, reference, name, pictures;
  std::optional<int> slice;
  std::vector<double> window;
  std::vector<int> crop;
  std::vector<std::string> starts;
  int panel = 160;
  RealImageParameters parameters;

  /// Of the pictures' paths; empty if there are to be none.
  std::string prefix(const std::string& image_name) const {
    return pictures.empty() ? "" : fmt::format("{}/real-images-{}", pictures, image_name);
  }
};

using Start = std::pair<std::string, Segments>;

/// An image file or an axial slice, cut off; lengths in pixels.
Image read(const std::string& path, const Arguments& a) {
  const Image image =
      a.slice
          ? curve::VoxelSlices(volume::read_volume(path), curve::SlicePlane::kAxial).slice(*a.slice)
          : curve::read_image(path);
  const auto [width, height] = image.size();
  const std::vector<int> box = a.crop.empty() ? std::vector{0, 0, width, height} : a.crop;
  if (std::min(box[0], box[1]) < 0 || box[0] + box[2] > width || box[1] + box[3] > height)
    throw UsageError(
        fmt::format("--crop: reaches out of the {} x {} pixels of {}", width, height, path));
  std::vector<float> values;
  for (int j = box[1]; j < box[1] + box[3]; ++j)
    for (int i = box[0]; i < box[0] + box[2]; ++i) values.push_back(image.value(i, j));
  return {{box[2], box[3]}, Eigen::Affine2d::Identity(), std::move(values)};
}

/// "NAME=X,Y,RADIUS", further circles after a +.
Start start_of(const std::string& text) {
  const std::size_t equals = text.find('=');
  std::vector<Segments> circles;
  std::istringstream parts(equals == std::string::npos ? "" : text.substr(equals + 1));
  for (std::string part; std::getline(parts, part, '+');) {
    double x = 0, y = 0, radius = 0;
    if (std::sscanf(part.c_str(), "%lf,%lf,%lf", &x, &y, &radius) != 3 || radius <= 0) {
      circles.clear();
      break;
    }
    circles.push_back(curve::circle({x, y}, radius, std::min(1.0, radius / 2)));
  }
  if (circles.empty())
    throw UsageError(fmt::format(
        "--start: expected NAME=X,Y,RADIUS+X,Y,RADIUS... in pixels, such as one=40,30,5; got '{}'",
        text));
  return {text.substr(0, equals), curve::joined(circles)};
}

/// The steps at which the share of what J falls by passes these; the last is the end.
constexpr double kShares[] = {0, 0.25, 0.5, 0.75, 0.95};

struct Frame {
  int k;
  double J;
  Segments curves;
};

std::vector<Frame> chosen(const std::vector<Frame>& all) {
  std::vector<Frame> out;
  const double first = all.front().J, last = all.back().J;
  for (const double share : kShares)
    for (const Frame& frame : all)
      if ((first - frame.J) >= share * (first - last)) {
        out.push_back(frame);
        break;
      }
  out.push_back(all.back());
  return out;
}

void run(const Subject& subject, const RealImageParameters& parameters,
         const std::vector<Start>& starts, const std::string& prefix, int panel_width) {
  const Prepared prepared[] = {prepare(subject.image, parameters, true),
                               prepare(subject.image, parameters, false)};
  fmt::print(
      "\n| image | start | selective | flow | steps | trials | seconds | J_0 | J | regions | Dice "
      "| mean px | stop |\n|---|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  std::string frames_text;
  for (const auto& [start_name, start] : starts) {
    std::vector<std::vector<Panel>> rows;
    for (const bool is_selective : {true, false})
      for (const auto product : {flow::ScalarProduct::kL2, flow::ScalarProduct::kH1}) {
        const std::string flow_name = product == flow::ScalarProduct::kL2 ? "L2" : "H1";
        std::vector<Frame> frames;
        const Descended out = descend(prepared[is_selective ? 0 : 1], parameters, start, product,
                                      [&](const flow::StepRecord& record, const Segments& curves) {
                                        frames.push_back({record.k, record.energy, curves});
                                      });
        fmt::print("| {} | {} | {} | {} | {} | {} | {:.1f} | {:.4f} | {:.4f} | {} | {} |\n",
                   subject.name, start_name, is_selective ? "on" : "off", flow_name, out.n_steps,
                   out.n_trials, out.seconds, out.J_first, out.J_last, found(out.curves, subject),
                   out.stop);
        std::fflush(stdout);
        if (frames.empty()) continue;
        frames.insert(frames.begin(), {0, out.J_first, start});
        rows.emplace_back();
        frames_text += fmt::format("{}{} {}{}: k", frames_text.empty() ? "" : "; ", start_name,
                                   flow_name, is_selective ? "" : " without selective smoothing");
        for (const Frame& frame : chosen(frames)) {
          rows.back().push_back({subject.image, {}, frame.curves, parameters.window});
          frames_text += fmt::format(" {}", frame.k);
        }
        rows.back().back().start = subject.contour;
      }
    if (!prefix.empty()) write_montage(prefix + "-" + start_name + ".png", rows, panel_width);
  }
  fmt::print("\nSteps shown, {}.\n", frames_text);
  if (prefix.empty()) return;
  std::vector<std::vector<Panel>> rows;
  for (const Prepared& one : prepared)
    rows.push_back({{subject.image, {}, {}, parameters.window},
                    {sampled(*one.intensity, one), {}, {}, {0, 1}},
                    {sampled(*one.H, one), {}, {}, {0, 1}}});
  write_montage(prefix + "-fields.png", rows, panel_width);
}

void run_on_phantom(const Arguments& a) {
  constexpr int kPixels = 192;
  const Subject subject = vertebra_phantom({.n_pixels = kPixels, .noise = 0.06, .texture = 0.06});
  run(subject, vertebra_parameters(),
      {{"one", vertebra_seeds(kPixels, 1)}, {"three", vertebra_seeds(kPixels, 3)}},
      a.prefix(subject.name), a.panel);
}

void run_on_image(const Arguments& a) {
  const Subject subject =
      image_subject(a.name.empty() ? std::filesystem::path(a.image).stem().string() : a.name,
                    read(a.image, a), read(a.reference, a));
  RealImageParameters parameters = a.parameters;
  const auto [low, high] = subject.image.range();
  parameters.window = {low, high};
  if (!a.window.empty()) parameters.window = {a.window[0], a.window[1]};
  std::vector<Start> starts;
  for (const std::string& text : a.starts) starts.push_back(start_of(text));
  run(subject, parameters, starts, a.prefix(subject.name), a.panel);
}

void add_options(CLI::App& app, Arguments& a) {
  app.add_option("--pictures", a.pictures, "Folder for pictures");
  app.add_option("--panel", a.panel, "Width of a panel of the pictures [pixels]")
      ->capture_default_str();
  const auto image = app.add_option("--image", a.image, "An image or a volume, not the phantom");
  const auto of_image = [&](const char* option, auto& value, const char* help) {
    return app.add_option(option, value, help)->needs(image)->capture_default_str();
  };
  const auto reference = of_image("--reference", a.reference, "Mask of the object in the image");
  const auto start =
      of_image("--start", a.starts, "NAME=X,Y,RADIUS[+X,Y,RADIUS...] in pixels; repeat for more")
          ->take_all()
          ->allow_extra_args(false);
  image->needs(reference)->needs(start);
  of_image("--name", a.name, "Name of the image in tables and files [that of its file]");
  of_image("--slice", a.slice, "Axial slice of a volume and of its mask, from 0");
  of_image("--crop", a.crop, "X,Y,WIDTH,HEIGHT: this part alone [pixels]; starts count from it")
      ->delimiter(',')
      ->expected(4);
  of_image("--window", a.window, "LOW,HIGH: what becomes 0 and 1 [the range]")
      ->delimiter(',')
      ->expected(2);
  RealImageParameters& p = a.parameters;
  of_image("--selective-sigma", p.selective_sigma_px, "Of the selective blur [pixels]");
  of_image("--selective-threshold", p.selective_threshold, "Of the selective blur, in [0, 1]");
  of_image("--sigma", p.sigma_px, "Of the Gaussian blur [pixels]");
  of_image("--gamma0", p.gamma_0, "gamma_0 of (5.1)");
  of_image("--gamma", p.gamma, "gamma of (5.1); below 0 curves expand");
  of_image("--lambda", p.lambda, "lambda of (5.1)");
  of_image("--tol-l2", p.tolerance_L2, "tol of (5.2) of the L2 flow");
  of_image("--tol-h1", p.tolerance_H1, "tol of (5.2) of the H1 flow");
}

}  // namespace

int main(int argc, char** argv) {
  Arguments a;
  CLI::App app{"The minimal surface model on images.", "real_images_study"};
  add_options(app, a);
  CLI11_PARSE(app, argc, argv);
  try {
    a.image.empty() ? run_on_phantom(a) : run_on_image(a);
  } catch (const Error& error) {
    fmt::print(stderr, "real_images_study: error: {}\n", error.what());
    return 1;
  }
}
