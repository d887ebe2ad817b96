#include "tests/bench/mumford_shah_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <tuple>

#include "libcurve/image/read_image.h"
#include "libcurve/mesh/distance.h"
#include "libcurve/mesh/hierarchy.h"
#include "libcurve/mesh/rasterize.h"
#include "libsurf/base/error.h"
#include "libsurf/base/random.h"
#include "libsurf/io/draw.h"
#include "libsurf/segment/contrast.h"

namespace surf::bench {
namespace {

using curve::Image;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

Image with_noise(const Subject& subject, double sigma) {
  std::vector<float> values = subject.clean.values();
  for (std::size_t at = 0; at < values.size(); ++at)
    values[at] = float(values[at] + sigma * subject.contrast * normal_random(0, at));
  return {subject.clean.size(), subject.clean.pixel_to_plane(), std::move(values)};
}

/// The sides of pixels between object and background, the object on their left as rows run down.
Segments staircase(const std::vector<std::uint8_t>& object, const std::array<int, 2>& size) {
  const auto is_object = [&](int i, int j) {
    return i >= 0 && j >= 0 && i < size[0] && j < size[1] &&
           object[std::size_t(j) * size[0] + i] != 0;
  };
  std::vector<Vector<2>> ends;
  for (int j = 0; j < size[1]; ++j)
    for (int i = 0; i < size[0]; ++i) {
      if (!is_object(i, j)) continue;
      const Vector<2> centre(i, j);
      for (const auto& [x, y] : {std::pair{1, 0}, {0, 1}, {-1, 0}, {0, -1}}) {
        if (is_object(i + x, j + y)) continue;
        const Vector<2> normal(0.5 * x, 0.5 * y), along(-normal[1], normal[0]);
        ends.push_back(centre + normal - along);
        ends.push_back(centre + normal + along);
      }
    }
  const auto n = static_cast<Eigen::Index>(ends.size());
  Segments out{Points<2>(n, 2), Elements<2>(n / 2, 2)};
  for (Eigen::Index k = 0; k < n; ++k) {
    out.points.row(k) = ends[k];
    out.elements(k / 2, k % 2) = static_cast<int>(k);
  }
  return out;
}

double dice(const Segments& curves, const Subject& subject) {
  const auto mask = curve::rasterize(curves, subject.clean.size(), subject.clean.pixel_to_plane());
  double both = 0, sum = 0;
  for (std::size_t i = 0; i < mask.size(); ++i) {
    both += mask[i] && subject.object[i];
    sum += (mask[i] != 0) + (subject.object[i] != 0);
  }
  return 2 * both / sum;
}

/// Of an image against that without noise [dB], the contrast as peak.
double psnr(const Image& image, const Subject& subject) {
  double sum = 0;
  for (std::size_t i = 0; i < image.n_pixels(); ++i)
    sum += std::pow(double(image.values()[i]) - subject.clean.values()[i], 2);
  return -10 * std::log10(sum / double(image.n_pixels()) / std::pow(subject.contrast, 2));
}

double length(const Segments& curves) {
  double sum = 0;
  for (const auto e : curves.elements.rowwise())
    sum += (curves.points.row(e[1]) - curves.points.row(e[0])).norm();
  return sum;
}

constexpr const char* kHeader = "steps | trials | seconds | J | regions | Dice | mean px |";

/// The columns of kHeader.
std::string cells(const Outcome& out, const Subject& subject) {
  return fmt::format("{} | {} | {:.1f} | {:.5g} | {} |", out.n_steps, out.n_trials, out.seconds,
                     out.result.last().final_energy, found(out, subject));
}

void print_header(const std::string& first_columns, int n_columns) {
  fmt::print("\n| {} | {}\n|", first_columns, kHeader);
  for (int k = 0; k < n_columns + 7; ++k) fmt::print("---|");
  fmt::print("\n");
}

std::array<double, 2> window_of(const Image& image) {
  return io::automatic_window({image.values().begin(), image.values().end()});
}

/// u with the curves; the image itself where nothing is left.
Panel denoised_panel(const Image& image, const Outcome& out, std::array<double, 2> window) {
  return {out.is_empty() ? image : denoised(image, out.options, out.result),
          {},
          out.result.shape,
          window};
}

}  // namespace

Subject phantom_subject(const std::string& name, const curve::PhantomOptions& phantom,
                        const Segments& start) {
  curve::PhantomOptions no_noise = phantom;
  no_noise.noise = 0;
  Subject out{.name = name,
              .clean = make_phantom(no_noise),
              .image = make_phantom(phantom),
              .contour = phantom_contour(phantom),
              .object = {},
              .start = start};
  out.object = curve::rasterize(out.contour, out.clean.size(), out.clean.pixel_to_plane());
  return out;
}

Subject image_subject(const std::string& name, const std::string& image, const std::string& mask) {
  const curve::ReadImageOptions in_pixels{.spacing_mm = Eigen::Vector2d(1, 1)};
  const Image read = curve::read_image(image, in_pixels);
  const Image reference = curve::read_image(mask, in_pixels);
  if (read.size() != reference.size())
    throw InputError(fmt::format(
        "{}: {} x {} pixels, but {} has {} x {}; give a mask of that image", mask,
        reference.size()[0], reference.size()[1], image, read.size()[0], read.size()[1]));
  Subject out{.name = name,
              .clean = read,
              .image = read,
              .contrast = segment::two_class_contrast(read.values()),
              .contour = {},
              .object = {},
              .start = {}};
  for (const float value : reference.values()) out.object.push_back(value != 0);
  out.contour = staircase(out.object, read.size());
  if (out.contour.elements.rows() == 0)
    throw InputError(fmt::format("{}: no pixel is other than 0; give a mask of the object", mask));
  return out;
}

Outcome run(const Image& image, const Segments& start, curve::CurveOptions options) {
  options.initial = start;
  const double begin = now();
  Outcome out{curve::segment(image, options), options};
  out.seconds = now() - begin;
  for (const auto& stage : out.result.stages)
    for (const auto& step : stage.flow.steps) {
      ++out.n_steps;
      out.n_trials += step.n_trials;
    }
  return out;
}

curve::CurveOptions options_of(double mu, double gamma) {
  curve::CurveOptions out;
  out.energies = {{"mumford-shah", 1, {{"mu", mu}, {"gamma", gamma}}}};
  out.flow.max_steps = 1000;
  return out;
}

std::string found(const Outcome& out, const Subject& subject) {
  if (out.is_empty()) return "0 | | ";
  return fmt::format("{} | {:.4f} | {:.3f}",
                     curve::regions(curve::curve_hierarchy(out.result.shape)).size(),
                     dice(out.result.shape, subject),
                     curve::curve_distances(out.result.shape, subject.contour).mean_mm);
}

void Pictures::write(const std::string& study, const std::vector<std::vector<Panel>>& rows,
                     int study_width) const {
  if (directory.empty()) return;
  write_montage(fmt::format("{}/{}-{}.png", directory, prefix, study), rows,
                width > 0 ? width : study_width);
}

void study_flows(const std::vector<Subject>& subjects, const Pictures& pictures) {
  print_header("image | flow", 2);
  std::vector<std::vector<Panel>> rows;
  for (const Subject& subject : subjects) {
    rows.emplace_back();
    for (const auto& [flow_name, product, scheme] :
         {std::tuple{"L2 explicit", flow::ScalarProduct::kL2, flow::Scheme::kExplicit},
          {"L2", flow::ScalarProduct::kL2, flow::Scheme::kSemiImplicit},
          {"H1", flow::ScalarProduct::kH1, flow::Scheme::kExplicit}}) {
      curve::CurveOptions options = options_of(subject.mu, subject.gamma);
      options.n_coarse_steps = 0;
      options.flow.velocity.product = product;
      options.flow.velocity.scheme = scheme;
      options.open_cavities = subject.open_cavities;
      const Outcome out = run(subject.image, subject.start, options);
      fmt::print("| {} | {} | {}\n", subject.name, flow_name, cells(out, subject));
      std::fflush(stdout);
      rows.back().push_back(
          {subject.image, subject.start, out.result.shape, window_of(subject.image)});
    }
  }
  pictures.write("flows", rows, 160);
}

void study_noise(const std::vector<Subject>& subjects, const Pictures& pictures) {
  print_header("image | noise | PSNR of I | PSNR of u | gain dB", 5);
  std::vector<std::vector<Panel>> rows;
  for (const Subject& subject : subjects) {
    auto window = window_of(subject.clean);
    const double margin = 0.25 * (window[1] - window[0]);
    window = {window[0] - margin, window[1] + margin};
    std::vector<Panel> noisy, clean;
    for (const double sigma : {0.1, 0.25, 0.5}) {
      const Image image = with_noise(subject, sigma);
      const Outcome out = run(image, subject.start, options_of(subject.mu, subject.gamma));
      const Panel u = denoised_panel(image, out, window);
      const double before = psnr(image, subject), after = psnr(u.image, subject);
      fmt::print("| {} | {} | {:.1f} | {:.1f} | {:+.1f} | {}\n", subject.name, sigma, before, after,
                 after - before, cells(out, subject));
      std::fflush(stdout);
      noisy.push_back({image, {}, out.result.shape, window, /*grey_step=*/16});
      clean.push_back(u);
    }
    rows.push_back(noisy);
    rows.push_back(clean);
  }
  pictures.write("noise", rows, 128);
}

void study_values(const std::string& study, const Subject& subject,
                  const std::vector<std::pair<double, double>>& pairs, const Pictures& pictures) {
  print_header("mu | gamma | PSNR of u | length", 4);
  std::vector<std::vector<Panel>> rows(1);
  for (const auto& [mu, gamma] : pairs) {
    const Outcome out = run(subject.image, subject.start, options_of(mu, gamma));
    rows[0].push_back(denoised_panel(subject.image, out, window_of(subject.image)));
    fmt::print("| {:g} | {:g} | {} | {:.0f} | {}\n", mu, gamma,
               out.is_empty() ? "" : fmt::format("{:.1f}", psnr(rows[0].back().image, subject)),
               length(out.result.shape), cells(out, subject));
    std::fflush(stdout);
  }
  pictures.write(study, rows, 192);
}

void study_starts(const Subject& subject,
                  const std::vector<std::pair<std::string, Segments>>& starts,
                  const Pictures& pictures) {
  print_header("start", 1);
  std::vector<std::vector<Panel>> rows(1);
  for (const auto& [name, start] : starts) {
    const Outcome out = run(subject.image, start, options_of(subject.mu, subject.gamma));
    fmt::print("| {} | {}\n", name, cells(out, subject));
    std::fflush(stdout);
    rows[0].push_back({subject.image, start, out.result.shape, window_of(subject.image)});
  }
  pictures.write("start", rows, 192);
}

}  // namespace surf::bench
