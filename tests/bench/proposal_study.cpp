// Proposals round one click against reference masks:
//
//   proposal_study DATA_DIR [WORD [shift]]
//   proposal_study noise | balls
//
// noise: images and volumes of nothing but noise, white and blurred: the best score, from which
// the least one that counts is set. balls: the phantom with noise at several
// sizes, its region's volume against the ball's.
//
// DATA_DIR holds seeds.json: {"entries": [{"volume" or "image", "structure", "mask",
// "calm_seed_ras_mm" or "seed_pixel_xy"}]} and the files it names; WORD picks the entries that
// have it in a name. For each: Dice of the proposals at the cells' centres, best score first; the
// seconds that grid and search took; with `shift`, by how much the first one's content changes, in
// percent, at most if the seed moves by 0.3 cells, in the mean if it moves by one.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <memory>
#include <nlohmann/json.hpp>
#include <numbers>
#include <random>

#include "libcurve/image/read_image.h"
#include "libcurve/segment/detail/curve_setting.h"
#include "libsurf/segment/detail/surface_setting.h"
#include "libsurf/segment/proposal.h"
#include "libsurf/volume/phantom.h"
#include "libsurf/volume/read_volume.h"
#include "tests/surf/segment/lattice_image.h"

namespace {

using namespace surf;
using Json = nlohmann::json;

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

std::vector<std::uint8_t> flags_of(const volume::Volume& mask) {
  std::vector<float> values(mask.n_voxels());
  mask.copy_box({0, 0, 0}, mask.size(), values.data());
  return {values.begin(), values.end()};
}

double dice(const std::vector<std::uint8_t>& a, const std::vector<std::uint8_t>& b) {
  double n_a = 0, n_b = 0, n_both = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    n_a += a[i] != 0;
    n_b += b[i] != 0;
    n_both += a[i] && b[i];
  }
  return 2 * n_both / (n_a + n_b);
}

/// Sums over rows.
template <int Dim>
std::vector<segment::Proposal<Dim>> proposals_at(const segment::Setting<Dim>& setting,
                                                 const segment::SearchGrid<Dim>& grid,
                                                 const Vector<Dim>& seed) {
  const std::array clicks{segment::Click<Dim>{seed}};
  return segment::proposals<Dim>(setting, grid, *segment::search_clicks<Dim>(grid, clicks));
}

struct Totals {
  double dice = 0, best = 0, seconds = 0;
  int n = 0;
};

template <int Dim>
class Study {
 public:
  Study(const segment::Setting<Dim>& setting, bool has_shifts, Totals& totals)
      : setting_(setting), has_shifts_(has_shifts), totals_(totals) {
    const auto start = std::chrono::steady_clock::now();
    grid_ = std::make_unique<segment::SearchGrid<Dim>>(segment::search_grid<Dim>(setting_, {}));
    grid_->make_all();
    grid_seconds_ = seconds_since(start);
  }

  void row(const std::string& name, const Vector<Dim>& seed,
           const std::vector<std::uint8_t>& mask) {
    const auto start = std::chrono::steady_clock::now();
    const auto found = proposals(seed);
    const double seconds = seconds_since(start);
    std::string values;
    double first = 0, best = 0;
    for (std::size_t i = 0; i < found.size(); ++i) {
      const double d = dice(setting_.rasterized(found[i].shape, setting_.extent().size,
                                                setting_.extent().index_to_world),
                            mask);
      if (i == 0) first = d;
      best = std::max(best, d);
      values += fmt::format(" {:.3f} ({:.2f})", d, found[i].score);
    }
    totals_.dice += first;
    totals_.best += best;
    totals_.seconds += seconds;
    ++totals_.n;
    const std::string shift =
        found.empty() || !has_shifts_ ? "" : shifts(seed, found.front().enclosed);
    fmt::print("{:<42} {:.3f} best {:.3f} | {:<56} | grid {:.1f} s, search {:.1f} s{}\n", name,
               first, best, values, grid_seconds_, seconds, shift);
    if (!found.empty()) {
      const auto& f = found.front().features;
      fmt::print(
          "    within {:.4g} of {:.4g}, neck {:.3g} mm, node {:.3g} mm, sep {:.2f} edge {:.2f} "
          "round {:.2f} in {:.2f} out {:.2f}\n",
          found.front().half_width, found.front().mean, found.front().neck_radius_mm,
          found.front().node_mm, f.separation, f.edge_share, f.sphericity, f.growth_in,
          f.growth_out);
    }
    std::fflush(stdout);
  }

 private:
  std::vector<segment::Proposal<Dim>> proposals(const Vector<Dim>& seed) const {
    return proposals_at<Dim>(setting_, *grid_, seed);
  }

  std::string shifts(const Vector<Dim>& seed, double enclosed) const {
    double most = 0, sum = 0;
    int n = 0;
    for (int axis = 0; axis < Dim; ++axis)
      for (const double by : {-1.0, -0.3, 0.3, 1.0}) {
        const Vector<Dim> moved = seed + by * setting_.extent().index_to_world.linear().col(axis);
        const auto found = proposals(moved);
        const double change = found.empty() ? 1 : std::abs(found.front().enclosed / enclosed - 1);
        if (std::abs(by) < 0.5) {
          most = std::max(most, change);
          continue;
        }
        sum += std::min(change, 1.0);
        ++n;
      }
    return fmt::format(", moved by 0.3: {:.2f} %, by 1: mean {:.2f} %", 100 * most, 100 * sum / n);
  }

  const segment::Setting<Dim>& setting_;
  bool has_shifts_;
  Totals& totals_;
  std::unique_ptr<segment::SearchGrid<Dim>> grid_;
  double grid_seconds_ = 0;
};

/// Gaussian noise of deviation 1, a blur of so many cells before it.
template <int Dim>
void noise_row(int size, int n_blurs, unsigned seed) {
  const auto box = segment::NodeBox<Dim>::cube(0, size);
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<float> values(box.n());
  for (float& value : values) value = float(normal(random));
  for (int i = 0; i < n_blurs; ++i) segment::blur(box, values);
  const test::LatticeImage<Dim> image(
      box.size, Eigen::Transform<double, Dim, Eigen::Affine>::Identity(), values);
  const segment::SearchGrid<Dim> grid(image, image.extent(), {image.extent(), 1.5e6});
  const auto found =
      segment::search_rungs<Dim>(grid, std::vector<Vector<Dim>>{Vector<Dim>::Constant(size / 2)})
          .found;
  fmt::print("{}-D, {:3} cells, {} blurs: ", Dim, size, n_blurs);
  for (const segment::Rung<Dim>& region : found)
    fmt::print(" {:.3f} (sep {:.2f} edge {:.2f} round {:.2f} in {:.2f} out {:.2f}, {:.0f})",
               region.score, region.features.separation, region.features.edge_share,
               region.features.sphericity, region.features.growth_in, region.features.growth_out,
               double(region.n_nodes) * std::pow(grid.node_mm(), Dim));
  fmt::print("\n");
  std::fflush(stdout);
}

void study_noise() {
  for (const int n_blurs : {0, 1, 4}) {
    for (const int size : {24, 48, 96})
      for (unsigned seed = 0; seed < 3; ++seed) noise_row<3>(size, n_blurs, seed);
    for (const int size : {48, 128, 512})
      for (unsigned seed = 0; seed < 3; ++seed) noise_row<2>(size, n_blurs, seed);
  }
}

void study_balls() {
  for (const auto& [size, noise] : std::vector<std::pair<int, double>>{
           {64, 0.0}, {64, 0.1}, {128, 0.0}, {128, 0.1}, {256, 0.1}, {512, 0.05}}) {
    volume::PhantomOptions options;
    options.size = {size, size, size};
    options.noise = noise;
    const segment::SurfaceSetting setting(volume::make_phantom(options));
    const auto start = std::chrono::steady_clock::now();
    const auto grid = segment::search_grid<3>(setting, {});
    grid.make_all();
    const double grid_seconds = seconds_since(start);
    const auto found = proposals_at<3>(setting, grid, Vector<3>::Zero());
    fmt::print("ball {} noise {}: ", size, noise);
    for (const auto& proposal : found)
      fmt::print(" {:+.1f} % ({:.2f})",
                 100 * (proposal.enclosed / (4 * std::numbers::pi / 3 * 0.216) - 1),
                 proposal.score);
    fmt::print(" | grid {:.1f} s, search {:.1f} s\n", grid_seconds,
               seconds_since(start) - grid_seconds);
    std::fflush(stdout);
  }
}

void print(const char* what, const Totals& totals) {
  if (totals.n > 0)
    fmt::print("{}: {} rows, mean Dice {:.4f}, best of all {:.4f}, {:.1f} s of search\n", what,
               totals.n, totals.dice / totals.n, totals.best / totals.n, totals.seconds);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    fmt::print(stderr, "usage: proposal_study DATA_DIR [WORD] | noise | balls\n");
    return 2;
  }
  if (argv[1] == std::string("noise")) {
    study_noise();
    return 0;
  }
  if (argv[1] == std::string("balls")) {
    study_balls();
    return 0;
  }
  const std::string folder = std::string(argv[1]) + "/";
  const std::string word = argc > 2 ? argv[2] : "";
  const bool has_shifts = argc > 3 && argv[3] == std::string("shift");
  const Json entries = Json::parse(std::ifstream(folder + "seeds.json")).at("entries");
  Totals volumes, images;
  std::string open;  // the volume at hand
  std::unique_ptr<segment::SurfaceSetting> surfaces;
  std::unique_ptr<Study<3>> study;
  for (const Json& entry : entries) {
    const bool is_volume = entry.contains("volume");
    const std::string file = entry.at(is_volume ? "volume" : "image"),
                      name = file + " " + std::string(entry.at("structure"));
    if (name.find(word) == std::string::npos) continue;
    const std::string mask = folder + std::string(entry.at("mask"));
    if (is_volume) {
      if (open != file) {
        study.reset();
        surfaces = std::make_unique<segment::SurfaceSetting>(volume::read_volume(folder + file));
        study = std::make_unique<Study<3>>(*surfaces, has_shifts, volumes);
        open = file;
      }
      const auto at = entry.at("calm_seed_ras_mm").get<std::array<double, 3>>();
      study->row(name, {at[0], at[1], at[2]}, flags_of(volume::read_volume(mask)));
    } else {
      const curve::Image image = curve::read_image(folder + file);
      const curve::CurveSetting setting(image);
      const auto at = entry.at("seed_pixel_xy").get<std::array<double, 2>>();
      const std::vector<float> values = curve::read_image(mask).values();
      Study<2>(setting, has_shifts, images)
          .row(name, image.pixel_to_plane() * Vector<2>(at[0], at[1]),
               {values.begin(), values.end()});
    }
  }
  print("volumes", volumes);
  print("images", images);
  return 0;
}
