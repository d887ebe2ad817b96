#include "tools/studio/access.h"

#include <fmt/format.h>

#include <random>
#include <sstream>

namespace surfseg::studio {
namespace {

constexpr std::chrono::minutes kLaunch(1);

}  // namespace

std::string random_token() {
  std::random_device random;  // of the system, not a sequence
  std::string out;
  for (int word = 0; word < 4; ++word) out += fmt::format("{:08x}", std::uint32_t(random()));
  return out;
}

bool is_same_secret(const std::string& a, const std::string& b) {
  if (a.size() != b.size()) return false;
  unsigned char difference = 0;
  for (std::size_t n = 0; n < a.size(); ++n) difference |= (unsigned char)(a[n] ^ b[n]);
  return difference == 0;
}

bool LaunchCode::opens(const std::string& code, Clock::time_point now) {
  return is_same_secret(code, text_) && now - made_ < kLaunch && !is_used_.exchange(true);
}

std::string cookie(const std::string& header, const std::string& name) {
  std::stringstream parts(header);
  std::string part;
  while (std::getline(parts, part, ';')) {
    part.erase(0, part.find_first_not_of(' '));
    if (part.starts_with(name + "=")) return part.substr(name.size() + 1);
  }
  return {};
}

int status_of(const Credentials& c, int port, const std::string& token) {
  if (c.host != fmt::format("127.0.0.1:{}", port) && c.host != fmt::format("localhost:{}", port))
    return 421;
  if (!c.origin.empty() && c.origin != "http://" + c.host) return 403;
  if (!c.fetch_site.empty() && c.fetch_site != "same-origin" && c.fetch_site != "none") return 403;
  const bool knows = is_same_secret(cookie(c.cookies, fmt::format("surfseg-{}", port)), token) ||
                     is_same_secret(c.authorization, "Bearer " + token);
  return knows ? 200 : 401;
}

}  // namespace surfseg::studio
