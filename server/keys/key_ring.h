#pragma once
/// The API keys and their scopes, stored as hashes.
///
/// The file has a line for each key, "NAME SCOPE[,SCOPE] SHA256 [WEIGHT]"; '#' begins a comment. A key has 256 random
/// bits, so a plain SHA-256 is safe against guessing. Two lines may share a name, for rotation; the name identifies the
/// owner of jobs and quotas.
///
/// A ticket stands for a key where a program cannot send a header, such as a browser that saves a file: it permits to
/// read one path for a short time. It is "NAME.EXPIRES.MAC": the name of the key, s since 1970 UTC, and the
/// HMAC-SHA-256 of path and time under the stored hash of the key, in hex. Nothing is stored, and a ticket ends with
/// its key.

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "tracer/result.h"

namespace keys {

enum class Scope { jobs_read, jobs_write, admin };
std::string_view name_of(Scope scope);  ///< "jobs:read"

constexpr int weight_max = 100;

struct Key {
  std::string name;           ///< 1..64 of A-Z a-z 0-9 . _ -
  std::vector<Scope> scopes;  ///< at least one
  std::string sha256;         ///< hash of the key, 64 hex digits
  int weight = 1;             ///< 1..weight_max: share of its jobs in the slots, see queue::Job

  /// `admin` allows everything.
  [[nodiscard]] bool allows(Scope scope) const;
};

/// The keys of a text, or all errors with their line: "3: ...". A text without keys is an error: it would reject every
/// client.
tracer::Result<std::vector<Key>, std::vector<std::string>> parse(const std::string& text);

/// Parses a file of at most 1 MiB.
tracer::Result<std::vector<Key>, std::vector<std::string>> read(const std::string& path);

/// The key whose hash is that of `token`, or null. The time does not depend on the digits of the hashes: all keys are
/// compared, each completely.
const Key* find(const std::vector<Key>& keys, std::string_view token);

/// A new key and its line. Throws std::system_error without random bits.
struct CreatedKey {
  std::string token;  ///< "whittle_" and 64 hex digits
  std::string line;   ///< for the file, without newline
};
CreatedKey create(const std::string& name, const std::vector<Scope>& scopes);

/// Parses "jobs:read,jobs:write"; none if a scope is unknown.
std::optional<std::vector<Scope>> parse_scopes(std::string_view text);
bool is_name(std::string_view text);

/// Appends the line to the file, durably; creates a missing file with mode 0600. Throws std::system_error.
void append(const std::string& path, const std::string& line);

constexpr std::int64_t ticket_lifetime_s = 60;

struct Ticket {
  std::string text;
  std::int64_t expires_s = 0;  ///< s since 1970 UTC
};

std::int64_t system_time_s();  ///< s since 1970 UTC

/// The current keys. Thread-safe.
class KeyRing {
 public:
  explicit KeyRing(std::vector<Key> keys, std::function<std::int64_t()> now_s = system_time_s)
      : now_s_(std::move(now_s)), keys_(std::make_shared<const std::vector<Key>>(std::move(keys))) {}
  void reload(std::vector<Key> keys);
  [[nodiscard]] std::optional<Key> find(std::string_view token) const;
  /// A ticket of a key for a path without query.
  [[nodiscard]] Ticket create_ticket(const Key& key, std::string_view path) const;
  /// The key of a ticket that is valid now for this path.
  [[nodiscard]] std::optional<Key> find_by_ticket(std::string_view ticket, std::string_view path) const;
  [[nodiscard]] std::size_t size() const { return current()->size(); }

 private:
  [[nodiscard]] std::shared_ptr<const std::vector<Key>> current() const;
  const std::function<std::int64_t()> now_s_;
  mutable std::mutex mutex_;
  std::shared_ptr<const std::vector<Key>> keys_;
};

}  // namespace keys
