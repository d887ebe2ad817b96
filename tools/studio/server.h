// The dialogue over HTTP on 127.0.0.1, and who may use it (docs/studio-protocol.md).
#pragma once

#include <memory>
#include <string>

#include "tools/studio/dialogue.h"

namespace surfseg::studio {

class Server {
 public:
  /// @param port  0 = any that is free
  /// @throws surf::UsageError  the port is taken
  Server(Dialogue& dialogue, int port, const std::string& version);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// With the token: for the person who started it alone.
  std::string address() const;
  int port() const;
  /// Serves until stop() is called.
  void run();
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surfseg::studio
