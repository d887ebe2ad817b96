#include "libsurf/base/content_hash.h"

#include <fmt/format.h>
#include <openssl/evp.h>

#include <array>
#include <stdexcept>

namespace surf {
namespace {

struct Free {
  void operator()(EVP_MD_CTX* context) const { EVP_MD_CTX_free(context); }
};
/// @throws std::runtime_error  OpenSSL has no SHA-1 here, or no memory
void check(bool is_done) {
  if (!is_done) throw std::runtime_error("SHA-1: OpenSSL cannot compute it here");
}

using Context = std::unique_ptr<EVP_MD_CTX, Free>;

Context make_context() {
  Context out(EVP_MD_CTX_new());
  check(out != nullptr);
  return out;
}

}  // namespace

struct ContentHash::Impl {
  Context sha = make_context();
};

ContentHash::ContentHash() : impl_(std::make_unique<Impl>()) {
  check(EVP_DigestInit_ex(impl_->sha.get(), EVP_sha1(), nullptr) == 1);
}
ContentHash::~ContentHash() = default;

void ContentHash::add(std::span<const float> values) {
  add_bytes({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
}

void ContentHash::add(std::span<const int> values) {
  add_bytes({reinterpret_cast<const char*>(values.data()), values.size_bytes()});
}

void ContentHash::add(const Eigen::Ref<const Eigen::MatrixXd>& matrix) {
  const Eigen::MatrixXd values = matrix;
  add_bytes(
      {reinterpret_cast<const char*>(values.data()), std::size_t(values.size()) * sizeof(double)});
}

void ContentHash::add_bytes(std::string_view bytes) {
  check(EVP_DigestUpdate(impl_->sha.get(), bytes.data(), bytes.size()) == 1);
}

std::string ContentHash::digits() const {
  const Context copy = make_context();
  check(EVP_MD_CTX_copy_ex(copy.get(), impl_->sha.get()) == 1);
  std::array<unsigned char, EVP_MAX_MD_SIZE> bytes;
  unsigned int n_bytes = 0;
  check(EVP_DigestFinal_ex(copy.get(), bytes.data(), &n_bytes) == 1);
  std::string out;
  for (unsigned int n = 0; n < n_bytes; ++n) out += fmt::format("{:02x}", bytes[n]);
  return out;
}

}  // namespace surf
