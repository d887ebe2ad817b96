// A fingerprint of an image's content.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <span>
#include <string>
#include <string_view>

namespace surf {

/// SHA-1 (by OpenSSL) of the bytes of numbers, in the order in which they are added: tells images
/// apart, and is no safeguard against somebody who wants two alike.
class ContentHash {
 public:
  ContentHash();
  ~ContentHash();

  void add(std::span<const float> values);
  void add(std::span<const int> values);
  void add(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
  /// As they are in a file.
  void add_bytes(std::string_view bytes);
  /// 40 hexadecimal digits of what has been added so far.
  std::string digits() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surf
