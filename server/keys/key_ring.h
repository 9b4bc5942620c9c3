#pragma once
/// Who may use the service, and what for: keys by name, kept as hashes only.
///
/// The file has a line for each key, "NAME SCOPE[,SCOPE] SHA256"; '#' begins a comment. A key is 256 random bits, so
/// that SHA-256 alone hides it: there is nothing to guess faster. Two lines may share a name while one key replaces
/// another: the name is whose quota and whose jobs they are.

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

struct Key {
  std::string name;           ///< 1..64 of A-Z a-z 0-9 . _ -
  std::vector<Scope> scopes;  ///< at least one
  std::string sha256;         ///< of the key, 64 hex digits

  /// `admin` allows everything.
  [[nodiscard]] bool allows(Scope scope) const;
};

/// The keys of a text, or every mistake with its line: "3: ...". None at all is a mistake, too: it would lock all out.
tracer::Result<std::vector<Key>, std::vector<std::string>> parse(std::string_view text);

/// As parse, of a file of at most 1 MiB.
tracer::Result<std::vector<Key>, std::vector<std::string>> read(const std::string& path);

/// The key whose hash is that of `token`. Takes as long for any token of the same length, and tells no one by its time
/// how near they came.
const Key* find(const std::vector<Key>& keys, std::string_view token);

/// A key that nobody had before, and its line. Throws std::system_error when the kernel has no random bits.
struct Made {
  std::string token;  ///< "whittle_" and 64 hex digits: to be shown once
  std::string line;   ///< for the file, without its end
};
Made make(const std::string& name, const std::vector<Scope>& scopes);

/// "jobs:read,jobs:write"; nothing where one is no scope.
std::optional<std::vector<Scope>> parse_scopes(std::string_view text);
bool is_name(std::string_view text);

/// Adds the line to the file, which is made, readable by its owner alone, where there is none. Durable when it returns.
/// Throws std::system_error.
void append(const std::string& path, const std::string& line);

/// The keys in force; any thread.
class KeyRing {
 public:
  explicit KeyRing(std::vector<Key> keys) : keys_(std::make_shared<const std::vector<Key>>(std::move(keys))) {}
  void replace(std::vector<Key> keys);
  [[nodiscard]] std::optional<Key> find(std::string_view token) const;
  [[nodiscard]] std::size_t size() const { return now()->size(); }

 private:
  [[nodiscard]] std::shared_ptr<const std::vector<Key>> now() const;
  mutable std::mutex mutex_;
  std::shared_ptr<const std::vector<Key>> keys_;
};

}  // namespace keys
