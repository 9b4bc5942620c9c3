#pragma once
/// The API keys and their scopes, stored as hashes.
///
/// The file has a line for each key, "NAME SCOPE[,SCOPE] SHA256 [WEIGHT]"; '#' begins a comment. A key has 256 random
/// bits, so a plain SHA-256 is safe against guessing. Two lines may share a name, for rotation; the name identifies the
/// owner of jobs and quotas.

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

/// The current keys. Thread-safe.
class KeyRing {
 public:
  explicit KeyRing(std::vector<Key> keys) : keys_(std::make_shared<const std::vector<Key>>(std::move(keys))) {}
  void reload(std::vector<Key> keys);
  [[nodiscard]] std::optional<Key> find(std::string_view token) const;
  [[nodiscard]] std::size_t size() const { return current()->size(); }

 private:
  [[nodiscard]] std::shared_ptr<const std::vector<Key>> current() const;
  mutable std::mutex mutex_;
  std::shared_ptr<const std::vector<Key>> keys_;
};

}  // namespace keys
