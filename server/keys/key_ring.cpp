#include "server/keys/key_ring.h"

#include <fcntl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <sstream>
#include <stdexcept>
#include <system_error>
#include <utility>

#include "server/support/descriptor.h"
#include "server/support/read_file.h"
#include "server/support/text_values.h"
#include "tracer/sha256.h"

namespace keys {
namespace {

constexpr std::array<std::pair<Scope, std::string_view>, 3> scope_names{
    {{Scope::jobs_read, "jobs:read"}, {Scope::jobs_write, "jobs:write"}, {Scope::admin, "admin"}}};

/// Compares hashes in a time that depends on their lengths only.
bool is_equal(std::string_view a, std::string_view b) {
  if (a.size() != b.size()) return false;
  int difference = 0;
  for (std::size_t i = 0; i < a.size(); ++i) difference |= a[i] ^ b[i];
  return difference == 0;
}

/// Compares every key, wherever the match is.
const Key* find_hash(const std::vector<Key>& keys, std::string_view sha256) {
  const Key* found = nullptr;
  for (const Key& key : keys)
    if (is_equal(key.sha256, sha256)) found = &key;
  return found;
}

/// The error of the line, or empty.
std::string read_line(const std::string& line, Key& key) {
  std::istringstream words(line);
  std::string name, scopes, sha256, weight = "1", rest;
  words >> name >> scopes >> sha256 >> weight;
  if (sha256.empty() || words >> rest) return "must be NAME SCOPE[,SCOPE] SHA256 [WEIGHT]";
  if (!is_name(name)) return "the name must be 1 to 64 of A-Z a-z 0-9 . _ -";
  const auto read = parse_scopes(scopes);
  if (!read) return "scopes are jobs:read, jobs:write and admin, got \"" + scopes + "\"";
  if (!tracer::is_sha256(sha256)) return "the hash must be 64 lower-case hex digits";
  key = {name, *read, sha256, support::parse_number<int>(weight).value_or(0)};
  if (key.weight < 1 || key.weight > weight_max)
    return "the weight must be 1.." + std::to_string(weight_max) + ", got \"" + weight + "\"";
  return {};
}

std::string ticket_text(const Key& key, std::string_view path, std::int64_t expires_s) {
  const std::string expires = std::to_string(expires_s);
  return key.name + '.' + expires + '.' +
         tracer::hex_of(tracer::hmac_sha256(key.sha256, expires + ' ' + std::string(path)));
}

[[noreturn]] void fail(const std::string& what) { throw std::system_error(errno, std::generic_category(), what); }

std::string random_hex() {
  std::string bytes(32, '\0');
  if (::getentropy(bytes.data(), bytes.size()) != 0) fail("no random bits");
  return tracer::hex_of(bytes);
}

}  // namespace

std::string_view name_of(Scope scope) {
  return std::ranges::find_if(scope_names, [&](const auto& entry) { return entry.first == scope; })->second;
}

bool Key::allows(Scope scope) const {
  return std::ranges::any_of(scopes, [&](Scope own) { return own == scope || own == Scope::admin; });
}

bool is_name(std::string_view text) {
  return !text.empty() && text.size() <= 64 && std::ranges::all_of(text, [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '.' || c == '_' ||
           c == '-';
  });
}

std::optional<std::vector<Scope>> parse_scopes(std::string_view text) {
  std::vector<Scope> scopes;
  for (;;) {
    const std::string_view name = text.substr(0, text.find(','));
    const auto found = std::ranges::find_if(scope_names, [&](const auto& entry) { return entry.second == name; });
    if (found == scope_names.end()) return std::nullopt;
    scopes.push_back(found->first);
    if (name.size() == text.size()) return scopes;
    text.remove_prefix(name.size() + 1);
  }
}

tracer::Result<std::vector<Key>, std::vector<std::string>> parse(const std::string& text) {
  std::vector<Key> keys;
  std::vector<std::string> errors;
  std::istringstream lines(text);
  std::string line;
  for (int number = 1; std::getline(lines, line); ++number) {
    line.resize(std::min(line.find('#'), line.size()));
    if (line.find_first_not_of(" \t\r") == std::string::npos) continue;
    Key key;
    std::string error = read_line(line, key);
    if (error.empty() && find_hash(keys, key.sha256) != nullptr) error = "this key exists already";
    if (!error.empty()) errors.push_back(std::to_string(number) + ": " + error);
    keys.push_back(std::move(key));
  }
  if (keys.empty()) errors.emplace_back("1: the file has no keys");
  if (!errors.empty()) return errors;
  return keys;
}

tracer::Result<std::vector<Key>, std::vector<std::string>> read(const std::string& path) {
  try {
    auto keys = parse(support::read_file(path));
    if (keys) return keys;
    for (std::string& error : keys.error()) error.insert(0, path + ":");
    return keys;
  } catch (const std::runtime_error& failure) {
    return std::vector<std::string>{failure.what()};
  }
}

const Key* find(const std::vector<Key>& keys, std::string_view token) {
  return find_hash(keys, tracer::sha256_hex(token));
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
  const support::Descriptor file(::open(path.c_str(), O_RDWR | O_APPEND | O_CREAT | O_CLOEXEC, 0600));
  if (!file) fail("cannot open " + path);
  std::string text = line + '\n';
  char last = '\n';  // completes a last line without newline
  const off_t size = ::lseek(file.get(), 0, SEEK_END);
  if (size > 0 && ::pread(file.get(), &last, 1, size - 1) == 1 && last != '\n') text.insert(0, 1, '\n');
  const bool written = ::write(file.get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
  if (!written || ::fsync(file.get()) != 0) fail("cannot write " + path);
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

std::int64_t system_time_s() {
  const auto since_1970 = std::chrono::system_clock::now().time_since_epoch();
  return std::chrono::duration_cast<std::chrono::seconds>(since_1970).count();
}

Ticket KeyRing::create_ticket(const Key& key, std::string_view path) const {
  const std::int64_t expires_s = now_s_() + ticket_lifetime_s;
  return {ticket_text(key, path, expires_s), expires_s};
}

std::optional<Key> KeyRing::find_by_ticket(std::string_view ticket, std::string_view path) const {
  const std::size_t mac = ticket.rfind('.');
  if (mac == std::string_view::npos || mac == 0) return std::nullopt;
  const std::size_t expires = ticket.rfind('.', mac - 1);  // a name may have dots
  if (expires == std::string_view::npos) return std::nullopt;
  const std::string_view name = ticket.substr(0, expires), digits = ticket.substr(expires + 1, mac - expires - 1);
  const auto expires_s = support::parse_number<std::int64_t>(digits);
  if (!expires_s || *expires_s < now_s_()) return std::nullopt;
  const auto keys = current();
  for (const Key& key : *keys)  // a name may have several keys
    if (key.name == name && is_equal(ticket_text(key, path, *expires_s), ticket)) return key;
  return std::nullopt;
}

}  // namespace keys
