#include "api/src/reader/unsupported.h"

#include <algorithm>
#include <array>

namespace api {
namespace {

struct Entry {
  std::string_view scope, name;
};

/// At present the format is built completely.
constexpr std::array<Entry, 0> table{};

}  // namespace

bool is_unsupported(std::string_view scope, std::string_view name) {
  return std::any_of(table.begin(), table.end(),
                     [&](const Entry& entry) { return entry.scope == scope && entry.name == name; });
}

}  // namespace api
