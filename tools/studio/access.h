// Who may use the studio's server: the page that it gave out, and who knows the token.
#pragma once

#include <atomic>
#include <chrono>
#include <string>

namespace surfseg::studio {

/// 128 random bits as 32 hexadecimal digits.
std::string random_token();

/// In a time that does not depend on where they differ.
bool is_same_secret(const std::string& a, const std::string& b);

/// In the token's place in the address that the browser is started with: every user of the machine
/// can read the arguments of a program. Opens once, within a minute.
class LaunchCode {
 public:
  using Clock = std::chrono::steady_clock;

  const std::string& text() const { return text_; }
  bool opens(const std::string& code, Clock::time_point now = Clock::now());

 private:
  const std::string text_ = random_token();
  const Clock::time_point made_ = Clock::now();
  std::atomic<bool> is_used_ = false;
};

/// Value of a cookie in a Cookie header; "" if there is none.
std::string cookie(const std::string& header, const std::string& name);

/// What of a request decides; empty = not sent.
struct Credentials {
  std::string host, origin, fetch_site, cookies, authorization;
};

/// 200, 421 (another Host, as under DNS rebinding), 403 (another page asks), 401 (no token).
int status_of(const Credentials& credentials, int port, const std::string& token);

}  // namespace surfseg::studio
