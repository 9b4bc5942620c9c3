/// Reads and writes the file of keys, and creates keys.

#include <fcntl.h>
#include <sys/random.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <stdexcept>
#include <system_error>

#include "server/keys/key_ring.h"
#include "server/support/read_file.h"
#include "tracer/sha256.h"

namespace keys {
namespace {

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

std::string random_hex() {
  std::array<unsigned char, 32> bytes{};
  if (::getrandom(bytes.data(), bytes.size(), 0) != static_cast<ssize_t>(bytes.size())) fail("no random bits");
  std::string hex;
  for (const unsigned char byte : bytes) hex += {"0123456789abcdef"[byte >> 4], "0123456789abcdef"[byte & 15]};
  return hex;
}

}  // namespace

tracer::Result<std::vector<Key>, std::vector<std::string>> read(const std::string& path) {
  std::string text;
  try {
    text = support::read_file(path);
  } catch (const std::runtime_error& failure) {
    return std::vector<std::string>{failure.what()};
  }
  auto keys = parse(text);
  if (keys) return keys;
  for (std::string& error : keys.error()) error.insert(0, path + ":");
  return keys;
}

CreatedKey create(const std::string& name, const std::vector<Scope>& scopes) {
  CreatedKey created{"whittle_" + random_hex(), name + ' '};
  for (const Scope scope : scopes) {
    created.line.append(created.line.back() == ' ' ? "" : ",").append(name_of(scope));
  }
  created.line += ' ' + tracer::sha256_hex(created.token);
  return created;
}

void append(const std::string& path, const std::string& line) {
  const int fd = ::open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0600);
  if (fd < 0) fail("cannot open " + path);
  std::string text = line + '\n';
  char last = '\n';  // completes a last line without newline
  const off_t size = ::lseek(fd, 0, SEEK_END);
  if (size > 0 && ::pread(fd, &last, 1, size - 1) == 1 && last != '\n') text.insert(0, 1, '\n');
  const bool written = ::write(fd, text.data(), text.size()) == static_cast<ssize_t>(text.size()) && ::fsync(fd) == 0;
  const int error = errno;
  ::close(fd);
  errno = error;
  if (!written) fail("cannot write " + path);
}

}  // namespace keys
