// Replaces file functions of libc. The environment variable FAILING_FILES selects the one that fails:
//   no_nameless    the file system does not support O_TMPFILE
//   full           the disk is full when the file is flushed
//   kill_at_flush  SIGKILL after the data is written, before the file has a name
//   kill_at_name   SIGKILL after the file has its temporary name, before it replaces the old file
#include <dlfcn.h>
#include <fcntl.h>
#include <sys/types.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdarg>
#include <cstdlib>
#include <cstring>

namespace {

bool is_selected(const char* failure) {
  const char* selected = std::getenv("FAILING_FILES");
  return selected != nullptr && std::strcmp(selected, failure) == 0;
}

template <class Call>
Call next(const char* name) {
  return reinterpret_cast<Call>(dlsym(RTLD_NEXT, name));
}

}  // namespace

extern "C" {

int open(const char* path, int flags, ...) {
  va_list rest;
  va_start(rest, flags);
  const mode_t mode = (flags & (O_CREAT | O_TMPFILE)) != 0 ? va_arg(rest, mode_t) : 0;
  va_end(rest);
  if ((flags & O_TMPFILE) == O_TMPFILE && is_selected("no_nameless")) {
    errno = EOPNOTSUPP;
    return -1;
  }
  return next<int (*)(const char*, int, ...)>("open")(path, flags, mode);
}

int fsync(int descriptor) {
  if (is_selected("kill_at_flush")) kill(getpid(), SIGKILL);
  if (is_selected("full")) {
    errno = ENOSPC;
    return -1;
  }
  return next<int (*)(int)>("fsync")(descriptor);
}

int rename(const char* from, const char* to) {
  if (is_selected("kill_at_name")) kill(getpid(), SIGKILL);
  return next<int (*)(const char*, const char*)>("rename")(from, to);
}
}
