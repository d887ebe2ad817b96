// What may crash, in a copy of this process.
#pragma once

#include <sys/types.h>

#include <array>
#include <cstddef>
#include <functional>
#include <type_traits>

namespace surf {

/// One end of a connection between two processes; bytes as they lie in memory.
class Channel {
 public:
  explicit Channel(int descriptor) : descriptor_(descriptor) {}
  ~Channel();
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  /// False if the other end is gone.
  bool send(const void* bytes, std::size_t n);
  bool receive(void* bytes, std::size_t n);
  template <class T>
  requires std::is_trivially_copyable_v<T>
  bool send(const T& value) { return send(&value, sizeof value); }
  template <class T>
  requires std::is_trivially_copyable_v<T>
  bool receive(T& value) { return receive(&value, sizeof value); }

 private:
  int descriptor_;
};

/// A fork of this process that works for libraries that abort on damaged files: when it ends, the
/// channel's send() and receive() return false. Nothing of it is heard (stdout, stderr, core
/// files); it ends when `work` returns, and is ended with this object. `work` must start no threads
/// and wait for none: the child has only the one that made it.
class ChildProcess {
 public:
  /// @throws std::system_error  the system gives no process
  explicit ChildProcess(const std::function<void(Channel&)>& work);
  ~ChildProcess();
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  Channel& channel() { return channel_; }
  /// After the channel has ended: whether the system ended the child, as it does where memory is
  /// short.
  bool was_killed();

 private:
  ChildProcess(const std::function<void(Channel&)>& work, const std::array<int, 2>& ends);

  Channel channel_;
  pid_t process_;
};

/// Ends this process, as damaged data would, when it has worked for so many seconds from now on.
void limit_cpu_seconds(unsigned seconds);

}  // namespace surf
