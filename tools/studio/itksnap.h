// The routes that ITK-SNAP's deep-learning client asks for, so that its clicks give our object.
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "libsurf/segment/segmentation.h"
#include "libsurf/volume/volume.h"

namespace surfseg::studio {

/// One image that ITK-SNAP has sent, and its object. Calls take turns.
class ItkSnapSession {
 public:
  /// @param raw       gzip of float32, first index fastest
  /// @param metadata  JSON: dimensions, spacing, origin, direction (row-major, LPS)
  /// @throws surf::InputError  they do not fit each other
  void set_image(const std::string& raw, const std::string& metadata);
  /// A click into a voxel, and the object's mask then.
  /// @return  gzip of int8, 1 inside, first index fastest
  /// @throws surf::Error  no image yet, or as Segmentation
  std::string click(const std::array<int, 3>& index, bool is_inside);
  /// The voxels of a mask as one stroke.
  std::string stroke(const std::string& raw, const std::string& metadata, bool is_inside);
  void reset();

 private:
  std::string answer(const surf::segment::Click<3>& click);

  std::mutex mutex_;
  std::shared_ptr<const surf::segment::Setting<3>> setting_;
  std::optional<surf::volume::Volume> volume_;  ///< as it was sent: the client's voxels
  std::unique_ptr<surf::segment::Segmentation<3>> segmentation_;
  int object_ = 0;
};

/// All that are open: at most a few, the oldest goes first.
class ItkSnapSessions {
 public:
  std::string start();
  /// @throws surf::UsageError  there is none of this name
  std::shared_ptr<ItkSnapSession> find(const std::string& name);
  void end(const std::string& name);

 private:
  std::mutex mutex_;
  int n_started_ = 0;
  std::map<int, std::pair<std::string, std::shared_ptr<ItkSnapSession>>> sessions_;
};

}  // namespace surfseg::studio
