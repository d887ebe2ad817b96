#include "libsurf/base/detail/child_process.h"

#include <fcntl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <system_error>

namespace surf {
namespace {

[[noreturn]] void fail() { throw std::system_error(errno, std::generic_category()); }

std::array<int, 2> connected() {
  std::array<int, 2> ends;
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0) fail();
  return ends;
}

/// The channel is all that is left of what the parent has open: its sockets and other children's
/// channels must end with the parent's.
int keep_alone(int descriptor) {
  constexpr int kOwn = STDERR_FILENO + 1;
  ::dup2(descriptor, kOwn);
  ::close_range(kOwn + 1, ~0U, 0);
  return kOwn;
}

/// No words on the terminal, no core file, and no handlers of the program's own.
void be_quiet() {
  for (const int signal : {SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL}) std::signal(signal, SIG_DFL);
  for (const int signal : {SIGINT, SIGTERM})  // the parent hears them, too, and ends the child
    std::signal(signal, SIG_IGN);
  const rlimit none = {0, 0};
  ::setrlimit(RLIMIT_CORE, &none);
  const int nowhere = ::open("/dev/null", O_WRONLY);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
}

/// Calls a function of the system until all bytes are through.
template <class Bytes, class Transfer>
bool transfer_all(Bytes* bytes, std::size_t n, const Transfer& transfer) {
  while (n > 0) {
    const ssize_t done = transfer(bytes, n);
    if (done < 0 && errno == EINTR) continue;
    if (done <= 0) return false;
    bytes += done;
    n -= std::size_t(done);
  }
  return true;
}

}  // namespace

Channel::~Channel() { ::close(descriptor_); }

bool Channel::send(const void* bytes, std::size_t n) {
  return transfer_all(static_cast<const char*>(bytes), n, [&](const char* at, std::size_t left) {
    return ::send(descriptor_, at, left, MSG_NOSIGNAL);
  });
}

bool Channel::receive(void* bytes, std::size_t n) {
  return transfer_all(static_cast<char*>(bytes), n,
                      [&](char* at, std::size_t left) { return ::recv(descriptor_, at, left, 0); });
}

ChildProcess::ChildProcess(const std::function<void(Channel&)>& work)
    : ChildProcess(work, connected()) {}

ChildProcess::ChildProcess(const std::function<void(Channel&)>& work,
                           const std::array<int, 2>& ends)
    : channel_(ends[0]), process_(::fork()) {
  if (process_ == 0) {
    const int own = keep_alone(ends[1]);
    be_quiet();
    try {
      Channel channel(own);
      work(channel);
    } catch (...) {  // the parent sees that the connection ends
    }
    ::_exit(0);
  }
  const int error = errno;
  ::close(ends[1]);
  errno = error;
  if (process_ < 0) fail();
}

bool ChildProcess::was_killed() {
  siginfo_t how = {};  // left to be waited for
  while (::waitid(P_PID, id_t(process_), &how, WEXITED | WNOWAIT) < 0)
    if (errno != EINTR) return false;
  return how.si_code == CLD_KILLED && how.si_status == SIGKILL;
}

ChildProcess::~ChildProcess() {
  if (::waitpid(process_, nullptr, WNOHANG) != 0) return;  // it has ended
  ::kill(process_, SIGKILL);
  while (::waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
  }
}

void limit_cpu_seconds(unsigned seconds) {
  rusage used = {};
  ::getrusage(RUSAGE_SELF, &used);
  const auto done = rlim_t(used.ru_utime.tv_sec + used.ru_stime.tv_sec) + 1;
  rlimit limit = {};
  ::getrlimit(RLIMIT_CPU, &limit);
  limit.rlim_cur = std::min(limit.rlim_max, done + seconds);
  std::signal(SIGXCPU, SIG_DFL);  // whatever the program that this is a child of does at it
  ::setrlimit(RLIMIT_CPU, &limit);
}

}  // namespace surf
