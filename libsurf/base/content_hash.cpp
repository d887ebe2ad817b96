#include "libsurf/base/content_hash.h"

#include <fmt/format.h>

#include <boost/uuid/detail/sha1.hpp>

namespace surf {

struct ContentHash::Impl {
  boost::uuids::detail::sha1 sha;
};

ContentHash::ContentHash() : impl_(std::make_unique<Impl>()) {}
ContentHash::~ContentHash() = default;

void ContentHash::add(std::span<const float> values) {
  impl_->sha.process_bytes(values.data(), values.size_bytes());
}

void ContentHash::add(std::span<const int> values) {
  impl_->sha.process_bytes(values.data(), values.size_bytes());
}

void ContentHash::add(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::MatrixXd values = matrix;
  impl_->sha.process_bytes(values.data(), std::size_t(values.size()) * sizeof(double));
}

void ContentHash::add_bytes(std::string_view bytes) {
  impl_->sha.process_bytes(bytes.data(), bytes.size());
}

std::string ContentHash::digits() const {
  boost::uuids::detail::sha1 copy = impl_->sha;
  unsigned int words[5];
  copy.get_digest(words);
  std::string out;
  for (const unsigned int word : words) out += fmt::format("{:08x}", word);
  return out;
}

}  // namespace surf
