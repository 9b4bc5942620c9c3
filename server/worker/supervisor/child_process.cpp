#include "server/worker/supervisor/child_process.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <csignal>
#include <cstring>
#include <system_error>
#include <utility>
#include <vector>

namespace worker {
namespace {

void check(int error, const std::string& what) {
  if (error != 0) throw std::system_error(error, std::generic_category(), what);
}

/// What the child gets of ours: descriptor 3, 1 and 2 to be heard by, and SIGINT and SIGTERM blocked until it ignores
/// them. It has a session of its own, for where the scheduler groups by session (autogroup, sched(7)) renders would use
/// up the daemon's share of the processors, however they step back: beside 8 large jobs on a busy machine small ones
/// took 150 ms at p99, and half of that since.
class SpawnRules {
 public:
  SpawnRules(int socket, int output) {
    posix_spawn_file_actions_init(&actions_);
    posix_spawnattr_init(&attributes_);
    check(posix_spawn_file_actions_addopen(&actions_, STDIN_FILENO, "/dev/null", O_RDONLY, 0), "spawn rules");
    for (const int theirs : {STDOUT_FILENO, STDERR_FILENO}) {
      check(posix_spawn_file_actions_adddup2(&actions_, output, theirs), "spawn rules");
    }
    check(posix_spawn_file_actions_adddup2(&actions_, socket, worker_socket), "spawn rules");
    check(posix_spawn_file_actions_addclosefrom_np(&actions_, worker_socket + 1), "spawn rules");
    sigset_t blocked, reset;
    sigemptyset(&blocked);
    sigaddset(&blocked, SIGINT);
    sigaddset(&blocked, SIGTERM);
    sigfillset(&reset);
    check(posix_spawnattr_setsigmask(&attributes_, &blocked), "spawn rules");
    check(posix_spawnattr_setsigdefault(&attributes_, &reset), "spawn rules");
    check(posix_spawnattr_setflags(&attributes_, POSIX_SPAWN_SETSIGMASK | POSIX_SPAWN_SETSIGDEF | POSIX_SPAWN_SETSID),
          "spawn rules");
  }
  ~SpawnRules() {
    posix_spawn_file_actions_destroy(&actions_);
    posix_spawnattr_destroy(&attributes_);
  }
  SpawnRules(const SpawnRules&) = delete;
  SpawnRules& operator=(const SpawnRules&) = delete;

  [[nodiscard]] const posix_spawn_file_actions_t* actions() const { return &actions_; }
  [[nodiscard]] const posix_spawnattr_t* attributes() const { return &attributes_; }

 private:
  posix_spawn_file_actions_t actions_{};
  posix_spawnattr_t attributes_{};
};

std::vector<char*> environment_without_our_settings() {
  std::vector<char*> kept;
  for (char** variable = environ; *variable != nullptr; ++variable) {
    if (std::strncmp(*variable, "WHITTLE_", 8) != 0) kept.push_back(*variable);
  }
  kept.push_back(nullptr);
  return kept;
}

/// As posix_spawn wants them; good as long as `texts` are.
std::vector<char*> pointers_to(std::vector<std::string>& texts) {
  std::vector<char*> pointers;
  for (std::string& text : texts) pointers.push_back(text.data());
  pointers.push_back(nullptr);
  return pointers;
}

}  // namespace

Process::Process(const std::string& executable, std::vector<std::string> arguments) {
  std::array<int, 2> ends{};
  if (socketpair(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0, ends.data()) != 0) check(errno, "socketpair");
  socket_ = Descriptor(ends[0]);
  const Descriptor theirs(ends[1]);
  if (fcntl(socket_.get(), F_SETFL, O_NONBLOCK) != 0) check(errno, "fcntl");

  std::array<int, 2> pipe{};
  if (pipe2(pipe.data(), O_CLOEXEC) != 0) check(errno, "pipe");
  spoken_ = OutputReader(Descriptor(pipe[0]));
  const Descriptor output(pipe[1]);
  if (fcntl(pipe[0], F_SETFL, O_NONBLOCK) != 0) check(errno, "fcntl");

  const SpawnRules rules(theirs.get(), output.get());
  arguments.insert(arguments.begin(), executable);
  const std::vector<char*> argument_pointers = pointers_to(arguments);
  const std::vector<char*> environment = environment_without_our_settings();
  check(posix_spawn(&pid_, executable.c_str(), rules.actions(), rules.attributes(), argument_pointers.data(),
                    environment.data()),
        "cannot start " + executable);
  pid_descriptor_ = Descriptor(static_cast<int>(syscall(SYS_pidfd_open, pid_, 0)));
  if (!pid_descriptor_) {
    const int error = errno;
    kill();
    reap();
    check(error, "pidfd_open");
  }
}

Process::~Process() {
  if (reaped_) return;
  kill();
  reap();
}

void Process::send(Packet packet) {
  unsent_.push_back(std::move(packet));
  flush();
}

void Process::flush() {
  while (!unsent_.empty()) {
    const Sent sent = worker::send(socket_.get(), unsent_.front());
    if (sent == Sent::later) return;
    unsent_.pop_front();  // closed: the process's end is told by its descriptor
  }
}

void Process::kill() { ::kill(pid_, SIGKILL); }  // ours until reaped, so the number is not another's

std::string Process::reap() {
  siginfo_t end{};
  reaped_ = true;
  while (waitid(P_PID, static_cast<id_t>(pid_), &end, WEXITED) != 0) {
    if (errno != EINTR) return "ended, and another reaped it";  // SIGCHLD is ignored, say
  }
  if (end.si_code == CLD_EXITED) return "exited with status " + std::to_string(end.si_status);
  const char* name = sigabbrev_np(end.si_status);
  return "was killed by signal " + std::to_string(end.si_status) + (name ? " (SIG" + std::string(name) + ")" : "");
}

}  // namespace worker
