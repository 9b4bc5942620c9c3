#include "api/src/reader/unsupported.h"

namespace api {
namespace {

struct Entry {
  std::string_view scope, name;
};

constexpr Entry table[] = {
    {"job", "run_after"},
    {"job", "deadline"},
    {"job", "expires_in"},
    {"job", "cache"},
};

}  // namespace

bool is_unsupported(std::string_view scope, std::string_view name) {
  for (const Entry& entry : table) {
    if (entry.scope == scope && entry.name == name) return true;
  }
  return false;
}

}  // namespace api
