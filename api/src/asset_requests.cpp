#include "api/asset_requests.h"

#include <algorithm>
#include <new>
#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "api/src/json/parse_error.h"
#include "api/src/reader/fields.h"
#include "api/src/reader/issue_order.h"

namespace api {
namespace {

using Json = nlohmann::ordered_json;

struct Hashes {
  std::vector<std::string> in_order;
  std::set<std::string_view> seen;
};

void read_hash(Reading& reading, const Cursor& at, Hashes& hashes) {
  if (at.node->kind != json::Kind::string) return add_wrong_type(reading, at, "a sha256 as text");
  const std::string_view hash = at.node->string();
  if (!is_asset_hash(hash)) {
    return add_issue(reading, at, "malformed", "must be 64 lower-case hex digits, got " + quoted(hash));
  }
  if (hashes.seen.insert(hash).second) hashes.in_order.emplace_back(hash);
}

tracer::Result<std::vector<std::string>, Refusal> read(std::string_view bytes, const DocumentLimits& document_limits) {
  auto tape = parse_json(bytes, document_limits);
  if (!tape) return std::move(tape.error());
  Limits limits;
  limits.document = document_limits;
  Reading reading(*tape, limits);
  Cursor root;
  root.node = tape->root();
  Hashes hashes;
  Fields fields(reading, root, "the question");
  if (const auto list = fields.take("sha256")) {
    const bool is_list = list->node->kind == json::Kind::array;
    if (!is_list || within_limit(reading, *list, "asset_hashes_max", asset_hashes_max)) {
      for_each_element(reading, *list, [&](const Cursor& element) { read_hash(reading, element, hashes); });
    }
  } else if (fields) {
    fields.report_missing_field("sha256");
  }
  fields.finish();
  if (reading.issues.empty()) return std::move(hashes.in_order);
  sort_by_position(reading.issues, *tape);
  if (reading.omitted_issues > 0) {
    reading.issues.push_back({"", "too_many_issues", "and " + std::to_string(reading.omitted_issues) + " more"});
  }
  return invalid(std::move(reading.issues));
}

}  // namespace

bool is_asset_hash(std::string_view text) {
  return text.size() == 64 &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

tracer::Result<std::vector<std::string>, Refusal> parse_asset_hashes(std::string_view bytes,
                                                                     const DocumentLimits& limits) {
  try {
    return read(bytes, limits);
  } catch (const std::bad_alloc&) {
    return too_large("reading the question takes more memory than there is");
  }
}

std::string write_missing(const std::vector<std::string>& hashes) { return Json{{"missing", hashes}}.dump() + '\n'; }

std::string write_asset(const std::string& sha256, std::uint64_t bytes) {
  return Json{{"sha256", sha256}, {"bytes", bytes}}.dump() + '\n';
}

}  // namespace api
