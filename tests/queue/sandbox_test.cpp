/// The restrictions of a compromised worker. Each attempt is made by a child process.

#include "server/worker/process/sandbox.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <linux/capability.h>
#include <linux/landlock.h>
#include <linux/openat2.h>
#include <pthread.h>
#include <sched.h>
#include <sys/ioctl.h>
#include <sys/mman.h>
#include <sys/ptrace.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <future>
#include <thread>

#include "tests/conformance/temporary_directory.h"

#ifndef WHITTLE_SANITIZED

namespace {

/// The result of an attempt: 0 or errno.
using Attempt = std::function<int()>;

int error_of(long result) { return result < 0 ? errno : 0; }

constexpr int could_not_enter = 255;

/// The end of a child that enters the sandbox and makes the attempt; its exit status is the result.
int status_of(const std::vector<std::string>& directories, const Attempt& attempt) {
  const pid_t child = fork();
  if (child == 0) {
    try {
      worker::restrict_files(directories);
      worker::restrict_calls();
    } catch (...) {
      _exit(could_not_enter);
    }
    _exit(attempt());
  }
  int status = 0;
  waitpid(child, &status, 0);
  return status;
}

int result_of(const std::vector<std::string>& directories, const Attempt& attempt) {
  const int status = status_of(directories, attempt);
  return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
}

long landlock_version() { return syscall(SYS_landlock_create_ruleset, nullptr, 0, LANDLOCK_CREATE_RULESET_VERSION); }

int open_beneath_nothing(const std::string& path) {
  open_how how{};
  how.flags = O_RDONLY;
  return error_of(syscall(SYS_openat2, AT_FDCWD, path.c_str(), &how, sizeof how));
}

class SandboxTest : public testing::Test {
 protected:
  SandboxTest() {
    std::ofstream(inside) << "inside";
    std::ofstream(outside) << "outside";
  }
  TemporaryDirectory directory, other;
  std::string inside = directory.path() + "/file", outside = other.path() + "/file";
  std::vector<std::string> directories{directory.path()};
};

}  // namespace

TEST_F(SandboxTest, PreventsSockets) {
  for (const int family : {AF_INET, AF_INET6, AF_UNIX, AF_NETLINK}) {
    EXPECT_EQ(result_of(directories, [&] { return error_of(socket(family, SOCK_STREAM, 0)); }), EPERM) << family;
  }
  EXPECT_EQ(result_of(directories, [] { return error_of(connect(0, nullptr, 0)); }), EPERM);
  int pair[2];
  EXPECT_EQ(result_of(directories, [&] { return error_of(socketpair(AF_UNIX, SOCK_STREAM, 0, pair)); }), EPERM);
}

TEST_F(SandboxTest, PreventsProgramsAndProcesses) {
  EXPECT_EQ(result_of(directories, [] { return error_of(execl("/bin/true", "true", nullptr)); }), EPERM);
  EXPECT_EQ(result_of(directories, [] { return error_of(syscall(SYS_execveat, AT_FDCWD, "/bin/true", 0, 0, 0)); }),
            EPERM);
  EXPECT_EQ(result_of(directories, [] { return error_of(fork()); }), EPERM);
#ifdef SYS_fork
  EXPECT_EQ(result_of(directories, [] { return error_of(syscall(SYS_fork)); }), EPERM);
  EXPECT_EQ(result_of(directories, [] { return error_of(syscall(SYS_vfork)); }), EPERM);
#endif
  EXPECT_EQ(result_of(directories, [] { return error_of(syscall(SYS_clone, SIGCHLD, 0, 0, 0, 0)); }), EPERM);
  EXPECT_EQ(result_of(directories, [] { return error_of(syscall(SYS_clone3, nullptr, 0)); }), ENOSYS);
}

TEST_F(SandboxTest, PreventsAccessToOtherProcesses) {
  const pid_t parent = getpid();
  EXPECT_EQ(result_of(directories, [&] { return error_of(kill(parent, 0)); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(syscall(SYS_tgkill, parent, parent, 0)); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(ptrace(PTRACE_ATTACH, parent, 0, 0)); }), EPERM);
  EXPECT_EQ(result_of(directories,
                      [&] {
                        const rlimit limit{1, 1};
                        return error_of(prlimit(parent, RLIMIT_NOFILE, &limit, nullptr));
                      }),
            EPERM);
}

TEST_F(SandboxTest, PreventsSignalsThroughDescriptors) {
  int pair[2];
  ASSERT_EQ(socketpair(AF_UNIX, SOCK_SEQPACKET, 0, pair), 0);
  const pid_t parent = getpid();
  EXPECT_EQ(result_of(directories, [&] { return error_of(fcntl(pair[0], F_SETOWN, parent)); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(fcntl(pair[0], F_SETSIG, SIGKILL)); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(fcntl(pair[0], F_SETFL, O_ASYNC)); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(ioctl(pair[0], FIOASYNC, pair)); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(fcntl(pair[0], F_SETLEASE, F_RDLCK)); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(fcntl(pair[0], F_GETFL)); }), 0);
  EXPECT_EQ(result_of(directories, [&] { return error_of(fcntl(pair[0], F_DUPFD_CLOEXEC, 3)); }), 0);
  close(pair[0]);
  close(pair[1]);
}

TEST_F(SandboxTest, PreventsSchedulingOfOtherProcesses) {
  const pid_t parent = getpid();
  cpu_set_t processors;
  ASSERT_EQ(sched_getaffinity(0, sizeof processors, &processors), 0);
  const auto set = [&](pid_t which) { return error_of(sched_setaffinity(which, sizeof processors, &processors)); };
  EXPECT_EQ(result_of(directories, [&] { return set(parent); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return set(0); }), 0);
  EXPECT_EQ(result_of(directories, [&] { return error_of(setpriority(PRIO_PROCESS, parent, 19)); }), EPERM);
  EXPECT_EQ(result_of(directories, [] { return std::thread::hardware_concurrency() > 0 ? 0 : 1; }), 0);
  EXPECT_EQ(result_of(directories,
                      [] {  // the stack of a thread, which its scheduler wants
                        pthread_attr_t attributes;
                        return std::async(std::launch::async,
                                          [&] { return pthread_getattr_np(pthread_self(), &attributes); })
                            .get();
                      }),
            0);
}

TEST_F(SandboxTest, LandlockPreventsSignalsToOtherProcesses) {
  if (landlock_version() < 6) GTEST_SKIP() << "this kernel has no Landlock scopes";
  const pid_t parent = getpid(), child = fork();
  if (child == 0) {
    worker::restrict_files({});
    _exit(error_of(kill(parent, 0)));
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), EPERM);
}

TEST_F(SandboxTest, HasNoCapabilities) {
  const pid_t child = fork();
  if (child == 0) {
    worker::restrict_files({});
    __user_cap_header_struct header{_LINUX_CAPABILITY_VERSION_3, 0};
    __user_cap_data_struct held[_LINUX_CAPABILITY_U32S_3]{};
    const bool read = syscall(SYS_capget, &header, held) == 0;
    _exit(read && (held[0].effective | held[0].permitted | held[1].effective | held[1].permitted) == 0 ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(SandboxTest, BoundsFilesInMemory) {
  const pid_t child = fork();
  if (child == 0) {
    std::signal(SIGXFSZ, SIG_IGN);
    worker::limit_resources(1, 1 << 20);
    worker::restrict_calls();
    const int memory = memfd_create("image", MFD_ALLOW_SEALING);
    const bool most = ftruncate(memory, 1 << 20) == 0;
    const bool more = ftruncate(memory, (1 << 20) + 1) == 0 || fallocate(memory, 0, 0, 2 << 20) == 0 ||
                      pwrite(memory, "x", 1, 1 << 20) == 1;
    _exit(most && !more ? 0 : 1);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), 0);
}

TEST_F(SandboxTest, PreventsExecutableMemory) {
  const auto map = [](int protection) {
    return mmap(nullptr, 4096, protection, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0) == MAP_FAILED ? errno : 0;
  };
  EXPECT_EQ(result_of(directories, [&] { return map(PROT_READ | PROT_WRITE); }), 0);
  EXPECT_EQ(result_of(directories, [&] { return map(PROT_READ | PROT_EXEC); }), EPERM);
}

TEST_F(SandboxTest, OpensAndFindsNoFiles) {
  for (const std::string& path : {inside, outside, std::string("/proc/self/mem")}) {
    EXPECT_EQ(result_of(directories, [&] { return error_of(open(path.c_str(), O_RDONLY)); }), EPERM) << path;
    EXPECT_EQ(result_of(directories, [&] { return error_of(open(path.c_str(), O_PATH)); }), EPERM) << path;
    EXPECT_EQ(result_of(directories, [&] { return open_beneath_nothing(path); }), EPERM) << path;
    struct stat status {};
    EXPECT_EQ(result_of(directories, [&] { return error_of(stat(path.c_str(), &status)); }), EPERM) << path;
    EXPECT_EQ(result_of(directories, [&] { return error_of(access(path.c_str(), F_OK)); }), EPERM) << path;
  }
  EXPECT_EQ(result_of(directories, [&] { return error_of(unlink(inside.c_str())); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(rename(inside.c_str(), outside.c_str())); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(chmod(inside.c_str(), 0777)); }), EPERM);
  EXPECT_EQ(result_of(directories, [&] { return error_of(mkdir((directory.path() + "/new").c_str(), 0700)); }), EPERM);
}

TEST_F(SandboxTest, LandlockAllowsReadingInItsDirectoriesOnly) {
  if (landlock_version() < 1) GTEST_SKIP() << "this kernel has no Landlock";
  const std::string link = directory.path() + "/link";
  ASSERT_EQ(symlink(outside.c_str(), link.c_str()), 0);
  const auto result = [&](const std::string& path, int flags) {
    const pid_t child = fork();
    if (child == 0) {
      worker::restrict_files({directory.path(), directory.path() + "/absent"});
      _exit(error_of(open(path.c_str(), flags, 0600)));
    }
    int status = 0;
    waitpid(child, &status, 0);
    return WEXITSTATUS(status);
  };
  EXPECT_EQ(result(inside, O_RDONLY), 0);
  EXPECT_EQ(result(inside, O_RDWR), EACCES);
  for (const std::string& path : {outside, link, std::string("/etc/passwd"), std::string("/proc/self/environ")})
    EXPECT_EQ(result(path, O_RDONLY), EACCES) << path;
}

TEST_F(SandboxTest, AllowsThreadsAndSharedMemory) {
  EXPECT_EQ(result_of({},
                      [] {
                        int seen = 1;
                        std::thread([&] { seen = 0; }).join();
                        return seen;
                      }),
            0);
  EXPECT_EQ(result_of({},
                      [] {
                        const int memory = memfd_create("image", MFD_ALLOW_SEALING);
                        return memory >= 0 && write(memory, "x", 1) == 1
                                   ? error_of(fcntl(memory, F_ADD_SEALS, F_SEAL_WRITE))
                                   : 1;
                      }),
            0);
}

TEST_F(SandboxTest, AllowsAbort) {
  const int status = status_of({}, []() -> int { abort(); });
  EXPECT_TRUE(WIFSIGNALED(status) && WTERMSIG(status) == SIGABRT && !WCOREDUMP(status)) << status;
}

TEST_F(SandboxTest, RestrictsExistingThreads) {
  const pid_t child = fork();
  if (child == 0) {
    worker::restrict_files({});
    int result = 0;
    std::atomic<bool> held = false;
    std::thread earlier([&] {
      while (!held) std::this_thread::yield();
      result = error_of(socket(AF_INET, SOCK_STREAM, 0));
    });
    worker::restrict_calls();
    held = true;
    earlier.join();
    _exit(result);
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(WEXITSTATUS(status), EPERM);
}

#endif
