#include "api/asset_requests.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "api/src/reader/fields.h"
#include "api/src/reader/issue_text.h"
#include "api/src/reader/request.h"

namespace api {
namespace {

using Json = nlohmann::ordered_json;

std::vector<std::string> read_hashes(Reading& reading, const Cursor& at) {
  std::vector<std::string> hashes;
  std::set<std::string_view> known;
  if (!within_limit(reading, at, "asset_hashes_max", asset_hashes_max)) return hashes;
  for_each_element(reading, at, [&](const Cursor& element) {
    if (element.node->kind != json::Kind::string) return add_wrong_type(reading, element, "a sha256 as text");
    const std::string_view hash = element.node->string();
    if (!is_asset_hash(hash))
      return add_issue(reading, element, "malformed", "must be 64 lower-case hex digits, got " + quoted(hash));
    if (known.insert(hash).second) hashes.emplace_back(hash);
    return true;
  });
  return hashes;
}

}  // namespace

bool is_asset_hash(std::string_view text) {
  return text.size() == 64 &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

tracer::Result<std::vector<std::string>, Refusal> parse_asset_hashes(std::string_view bytes,
                                                                     const DocumentLimits& document_limits) {
  using Hashes = std::vector<std::string>;
  return read_request<Hashes>(bytes, document_limits, [&](json::Tape& tape, Hashes& hashes) {
    Limits limits;
    limits.document = document_limits;
    Reading reading(tape, limits);
    Fields fields(reading, reading.root, "the request");
    if (const auto list = fields.take_required("sha256")) hashes = read_hashes(reading, *list);
    fields.finish();
    return reading.take_issues();
  });
}

std::string write_missing(const std::vector<std::string>& hashes) { return Json{{"missing", hashes}}.dump() + '\n'; }

std::string write_asset(const std::string& sha256, std::uint64_t bytes) {
  return Json{{"sha256", sha256}, {"bytes", bytes}}.dump() + '\n';
}

}  // namespace api
