#include "tests/bench/mumford_shah_runs.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <tuple>

#include "libsurf/io/draw.h"

namespace surf::bench {
namespace {

using curve::Image;

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
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
                     out.result.last().final_energy, found(out.result.shape, subject));
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

Outcome run_flow(const Subject& subject, flow::ScalarProduct product, flow::Scheme scheme) {
  curve::CurveOptions options = options_of(subject.mu, subject.gamma);
  options.n_coarse_steps = 0;
  options.flow.velocity.product = product;
  options.flow.velocity.scheme = scheme;
  options.open_cavities = subject.open_cavities;
  return run(subject.image, subject.start, options);
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
      const Outcome out = run_flow(subject, product, scheme);
      fmt::print("| {} | {} | {}\n", subject.name, flow_name, cells(out, subject));
      std::fflush(stdout);
      rows.back().push_back(
          {subject.image, subject.start, out.result.shape, window_of(subject.image)});
    }
  }
  pictures.write("flows", rows, 160);
}

void study_newton(const std::vector<Subject>& subjects) {
  print_header("image | tolerance | method", 3);
  for (const Subject& subject : subjects)
    for (const double tolerance : {1e-4, 1e-6})
      for (const auto& [name, method] :
           {std::pair{"H1", flow::Method::kGradientFlow}, {"Newton", flow::Method::kNewton}}) {
        curve::CurveOptions options = options_of(subject.mu, subject.gamma);
        options.n_coarse_steps = 0;
        options.flow.method = method;
        options.flow.rel_tol = tolerance;
        options.flow.energy_tol = 0;
        const Outcome out = run(subject.image, subject.start, options);
        fmt::print("| {} | {:g} | {} | {}\n", subject.name, tolerance, name, cells(out, subject));
        std::fflush(stdout);
      }
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
