#include "tools/studio/itksnap.h"

#include <fmt/format.h>

#include <cstring>
#include <nlohmann/json.hpp>

#include "libsurf/base/error.h"
#include "libsurf/segment/segment.h"
#include "tools/studio/access.h"
#include "tools/studio/gzip.h"

namespace surfseg::studio {
namespace {

using surf::segment::Click;
using surf::segment::Side;

constexpr std::size_t kMostSessions = 4;

struct Header {
  std::array<int, 3> size;
  Eigen::Affine3d index_to_world;  ///< RAS mm
  std::size_t n_voxels() const { return std::size_t(size[0]) * size[1] * size[2]; }
};

Header header_of(const std::string& metadata) {
  try {
    const auto json = nlohmann::json::parse(metadata);
    const auto size = json.at("dimensions").get<std::array<int, 3>>();
    const auto spacing = json.at("spacing").get<std::array<double, 3>>(),
               origin = json.at("origin").get<std::array<double, 3>>();
    const auto direction = json.at("direction").get<std::array<double, 9>>();
    if (json.value("components_per_pixel", 1) != 1)
      throw surf::InputError("the image has several values in a voxel; one is needed");
    for (const int n : size)
      if (n < 1 || n > 1 << 15) throw surf::InputError("dimensions: expected 1 to 32768");
    Header out;
    out.size = size;
    Eigen::Affine3d lps;
    lps.makeAffine();
    lps.linear() =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(direction.data()) *
        Eigen::Map<const Eigen::Vector3d>(spacing.data()).asDiagonal();
    lps.translation() = Eigen::Map<const Eigen::Vector3d>(origin.data());
    out.index_to_world = Eigen::Scaling(-1.0, -1.0, 1.0) * lps;
    return out;
  } catch (const nlohmann::json::exception& error) {
    throw surf::InputError(fmt::format("metadata: {}", error.what()));
  }
}

std::vector<float> values_of(const std::string& raw, const Header& header) {
  const std::string bytes = gunzip(raw, header.n_voxels() * sizeof(float));
  std::vector<float> out(header.n_voxels());
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

}  // namespace

void ItkSnapSession::set_image(const std::string& raw, const std::string& metadata) {
  const Header header = header_of(metadata);
  surf::volume::Volume volume(header.size, header.index_to_world, values_of(raw, header));
  std::lock_guard lock(mutex_);
  setting_ = surf::segment::make_setting(volume);
  volume_ = std::move(volume);
  segmentation_ = std::make_unique<surf::segment::Segmentation<3>>(setting_);
  object_ = segmentation_->add_object();
}

std::string ItkSnapSession::answer(const Click<3>& click) {
  segmentation_->add_click(object_, click);
  try {
    segmentation_->evolve(object_);
  } catch (...) {
    segmentation_->undo(object_);
    throw;
  }
  const auto& result = *segmentation_->object(object_).result;
  std::vector<std::uint8_t> labels(volume_->n_voxels());
  if (surf::segment::has_shape(result.outcome) && result.shape.elements.rows() > 0)
    labels = setting_->rasterized(result.shape, volume_->size(), volume_->index_to_world());
  Gzip gzip;
  gzip.add(labels.data(), labels.size());
  return gzip.finish();
}

std::string ItkSnapSession::click(const std::array<int, 3>& index, bool is_inside) {
  std::lock_guard lock(mutex_);
  if (!segmentation_) throw surf::UsageError("no image has been sent");
  const Eigen::Vector3d voxel(index[0], index[1], index[2]);
  return answer({volume_->index_to_world() * voxel, is_inside ? Side::kInside : Side::kOutside});
}

std::string ItkSnapSession::stroke(const std::string& raw, const std::string& metadata,
                                   bool is_inside) {
  const Header header = header_of(metadata);
  const std::vector<float> mask = values_of(raw, header);
  std::lock_guard lock(mutex_);
  if (!segmentation_) throw surf::UsageError("no image has been sent");
  if (header.size != volume_->size())
    throw surf::InputError("the stroke is not on the image's grid");
  std::vector<surf::Vector<3>> points;
  std::size_t at = 0;
  for (int k = 0; k < header.size[2]; ++k)
    for (int j = 0; j < header.size[1]; ++j)
      for (int i = 0; i < header.size[0]; ++i, ++at)
        if (mask[at] != 0) points.push_back(volume_->index_to_world() * Eigen::Vector3d(i, j, k));
  if (points.empty()) throw surf::InputError("the stroke is empty");
  Click<3> click{points.front(), is_inside ? Side::kInside : Side::kOutside};
  click.stroke_mm.assign(points.begin() + 1, points.end());
  return answer(click);
}

void ItkSnapSession::reset() {
  std::lock_guard lock(mutex_);
  if (!segmentation_) return;
  segmentation_->remove_object(object_);
  object_ = segmentation_->add_object();
}

std::string ItkSnapSessions::start() {
  std::lock_guard lock(mutex_);
  if (sessions_.size() == kMostSessions) sessions_.erase(sessions_.begin());
  std::string name = random_token();
  sessions_[++n_started_] = {name, std::make_shared<ItkSnapSession>()};
  return name;
}

std::shared_ptr<ItkSnapSession> ItkSnapSessions::find(const std::string& name) {
  std::lock_guard lock(mutex_);
  for (const auto& [number, session] : sessions_)
    if (session.first == name) return session.second;
  throw surf::UsageError("there is no such session");
}

void ItkSnapSessions::end(const std::string& name) {
  std::lock_guard lock(mutex_);
  std::erase_if(sessions_, [&](const auto& entry) { return entry.second.first == name; });
}

}  // namespace surfseg::studio
