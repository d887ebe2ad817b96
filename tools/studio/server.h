// The dialogue over HTTP on 127.0.0.1, and who may use it (docs/studio-protocol.md).
#pragma once

#include <memory>
#include <string>

#include "tools/studio/dialogue.h"

namespace surfseg::studio {

class Server {
 public:
  /// @param port         0 = any that is free
  /// @param has_itksnap  answers ITK-SNAP's client too, which knows no token
  /// @throws surf::UsageError  the port is taken
  Server(Dialogue& dialogue, int port, const std::string& version, bool has_itksnap = false);
  ~Server();
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// With the token: for the person who started it alone.
  std::string address() const;
  /// For the browser that is started: without the token, opens once and soon (LaunchCode).
  std::string launch_address() const;
  int port() const;
  /// Serves until stop() is called.
  void run();
  void stop();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace surfseg::studio
