// Who may use the studio's server: the page that it gave out, and who knows the token.
#pragma once

#include <string>

namespace surfseg::studio {

/// 128 random bits as 32 hexadecimal digits.
std::string random_token();

/// In a time that does not depend on where they differ.
bool is_same_secret(const std::string& a, const std::string& b);

/// Value of a cookie in a Cookie header; "" if there is none.
std::string cookie(const std::string& header, const std::string& name);

/// What of a request decides; empty = not sent.
struct Credentials {
  std::string host, origin, fetch_site, cookies, authorization;
};

/// 200, 421 (another Host, as under DNS rebinding), 403 (another page asks), 401 (no token).
int status_of(const Credentials& credentials, int port, const std::string& token);

}  // namespace surfseg::studio
