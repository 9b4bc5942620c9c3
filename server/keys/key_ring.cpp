#include "server/keys/key_ring.h"

#include <algorithm>
#include <array>
#include <utility>

#include "tracer/sha256.h"

namespace keys {
namespace {

constexpr std::array<std::pair<Scope, std::string_view>, 3> scope_names{
    {{Scope::jobs_read, "jobs:read"}, {Scope::jobs_write, "jobs:write"}, {Scope::admin, "admin"}}};

/// Removes the next word from `line`.
std::string_view take_word(std::string_view& line) {
  const std::size_t begin = std::min(line.find_first_not_of(" \t\r"), line.size());
  line.remove_prefix(begin);
  const std::string_view word = line.substr(0, line.find_first_of(" \t\r"));
  line.remove_prefix(word.size());
  return word;
}

/// The error of the line, or empty.
std::string read_line(std::string_view line, Key& key) {
  const std::string_view name = take_word(line), scopes = take_word(line), sha256 = take_word(line);
  if (sha256.empty() || !take_word(line).empty()) return "must be NAME SCOPE[,SCOPE] SHA256";
  if (!is_name(name)) return "the name must be 1 to 64 of A-Z a-z 0-9 . _ -";
  const auto read = parse_scopes(scopes);
  if (!read) return "scopes are jobs:read, jobs:write and admin, got \"" + std::string(scopes) + "\"";
  if (!tracer::is_sha256(sha256)) return "the hash must be 64 lower-case hex digits";
  key = {std::string(name), *read, std::string(sha256)};
  return {};
}

/// Precondition: equal sizes.
bool equal_in_constant_time(std::string_view a, std::string_view b) {
  volatile unsigned char difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    difference =
        static_cast<unsigned char>(difference | (static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i])));
  }
  return difference == 0;
}

}  // namespace

std::string_view name_of(Scope scope) {
  return std::find_if(scope_names.begin(), scope_names.end(), [&](const auto& entry) { return entry.first == scope; })
      ->second;
}

bool Key::allows(Scope scope) const {
  return std::any_of(scopes.begin(), scopes.end(), [&](Scope own) { return own == scope || own == Scope::admin; });
}

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= 64 && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  });
}

std::optional<std::vector<Scope>> parse_scopes(std::string_view text) {
  std::vector<Scope> scopes;
  for (;;) {
    const std::string_view name = text.substr(0, text.find(','));
    const auto found =
        std::find_if(scope_names.begin(), scope_names.end(), [&](const auto& entry) { return entry.second == name; });
    if (found == scope_names.end()) return std::nullopt;
    scopes.push_back(found->first);
    if (name.size() == text.size()) return scopes;
    text.remove_prefix(name.size() + 1);
  }
}

tracer::Result<std::vector<Key>, std::vector<std::string>> parse(std::string_view text) {
  std::vector<Key> keys;
  std::vector<std::string> errors;
  for (int number = 1; !text.empty(); ++number) {
    std::string_view line = text.substr(0, text.find('\n'));
    text.remove_prefix(std::min(text.size(), line.size() + 1));
    line = line.substr(0, line.find('#'));
    std::string_view rest = line;
    if (take_word(rest).empty()) continue;
    Key key;
    std::string error = read_line(line, key);
    const bool duplicate =
        std::any_of(keys.begin(), keys.end(), [&](const Key& other) { return other.sha256 == key.sha256; });
    if (error.empty() && duplicate) error = "this key exists already";
    if (error.empty()) {
      keys.push_back(std::move(key));
    } else {
      errors.push_back(std::to_string(number) + ": " + error);
    }
  }
  if (keys.empty() && errors.empty()) errors.emplace_back("1: the file has no keys");
  if (!errors.empty()) return errors;
  return keys;
}

const Key* find(const std::vector<Key>& keys, std::string_view token) {
  const std::string hash = tracer::sha256_hex(token);
  const Key* found = nullptr;
  for (const Key& key : keys) {  // all keys, for constant time
    if (equal_in_constant_time(key.sha256, hash)) found = &key;
  }
  return found;
}

void KeyRing::reload(std::vector<Key> keys) {
  auto next = std::make_shared<const std::vector<Key>>(std::move(keys));
  const std::lock_guard lock(mutex_);
  keys_ = std::move(next);
}

std::shared_ptr<const std::vector<Key>> KeyRing::current() const {
  const std::lock_guard lock(mutex_);
  return keys_;
}

std::optional<Key> KeyRing::find(std::string_view token) const {
  const auto keys = current();
  const Key* const key = keys::find(*keys, token);
  return key == nullptr ? std::nullopt : std::optional(*key);
}

}  // namespace keys
