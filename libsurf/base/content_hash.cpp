#include "libsurf/base/content_hash.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <new>

namespace surf {
namespace {

struct Free {
  void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
};
using Context = std::unique_ptr<EVP_MD_CTX, Free>;

Context make_context() {
  Context out(EVP_MD_CTX_new());
  if (!out) throw std::bad_alloc();
  return out;
}

}  // namespace

struct ContentHash::Impl {
  Context sha = make_context();
};

ContentHash::ContentHash() : impl_(std::make_unique<Impl>()) {
  EVP_DigestInit_ex(impl_->sha.get(), EVP_sha1(), nullptr);
}
ContentHash::~ContentHash() = default;

void ContentHash::add(std::span<const float> values) {
  EVP_DigestUpdate(impl_->sha.get(), values.data(), values.size_bytes());
}

void ContentHash::add(std::span<const int> values) {
  EVP_DigestUpdate(impl_->sha.get(), values.data(), values.size_bytes());
}

void ContentHash::add(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::MatrixXd values = matrix;
  EVP_DigestUpdate(impl_->sha.get(), values.data(), std::size_t(values.size()) * sizeof(double));
}

void ContentHash::add_bytes(std::string_view bytes) {
  EVP_DigestUpdate(impl_->sha.get(), bytes.data(), bytes.size());
}

std::string ContentHash::digits() const {
  const Context copy = make_context();
  EVP_MD_CTX_copy_ex(copy.get(), impl_->sha.get());
  std::array<unsigned char, EVP_MAX_MD_SIZE> bytes;
  unsigned int n_bytes = 0;
  EVP_DigestFinal_ex(copy.get(), bytes.data(), &n_bytes);
  std::string out;
  for (unsigned int n = 0; n < n_bytes; ++n) out += fmt::format("{:02x}", bytes[n]);
  return out;
}

}  // namespace surf
