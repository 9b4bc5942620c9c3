/// Uploaded files, named by the sha256 of their bytes.

#include <set>

#include "api/json.h"
#include "api/reader/fields.h"
#include "api/reader/issue_text.h"
#include "server/http/handlers/handlers.h"
#include "tracer/sha256.h"

namespace http::handlers {
namespace {

/// Rule for a name in the path; the number of characters that were received follows.
constexpr const char* asset_name_rule =
    "an asset is named by the sha256 of its bytes, 64 lower-case hex digits; characters in the path: ";

/// {"sha256": ["64 lower-case hex digits", ...]}, in their order and without duplicates.
void read_hashes(api::Reading& reading, std::vector<std::string>& hashes) {
  api::Fields fields(reading, reading.root, "the request");
  const auto list = fields.take_required("sha256");
  fields.finish();
  if (!list || !within_limit(reading, *list, "asset_hashes_max", asset_hashes_max)) return;
  std::set<std::string_view> known;
  for_each_element(reading, *list, [&](const api::Cursor& element) {
    if (!expect_string(reading, element, "a sha256 as text")) return;
    const std::string_view hash = element.node->string();
    if (!tracer::is_sha256(hash)) {
      add_issue(reading, element, "malformed", "must be 64 lower-case hex digits, got " + api::quoted(hash));
    } else if (known.insert(hash).second) {
      hashes.emplace_back(hash);
    }
  });
}

/// Existing assets are marked as used, so that they are kept until the client submits its job.
Answer find_missing_assets(Request& request, const ApiContext& context) {
  const auto hashes = take_request(request, "the hashes", read_hashes, context.limits);
  if (!hashes) return hashes.error();
  std::vector<std::string> missing;
  for (const std::string& sha256 : *hashes) {
    if (!context.assets.use(sha256)) missing.push_back(sha256);
  }
  return json_reply(200, api::json_line({{"missing", missing}}));
}

Answer put_asset(Request& request, const ApiContext& context) {
  if (!request.head.content_length) {
    return Problem{failures::length_required, "send the file with its Content-Length"};
  }
  const queue::DiskSpace space = context.queue.queries.disk_space();
  if (space.state != queue::DiskSpace::State::enough) return disk_full(space);
  const std::string& sha256 = request.parameters.front();
  const std::string size = std::to_string(request.body.size_bytes());
  const auto read = [&](std::uint64_t offset, char* into, std::size_t count) {
    return request.body.read(offset, into, count);
  };
  const queue::AssetStore::Put put = context.assets.put(sha256, read);
  if (put == queue::AssetStore::Put::other_bytes) {
    return Problem{failures::asset_mismatch,
                   (tracer::is_sha256(sha256) ? "the " + size + " bytes have another sha256 than the path"
                                              : asset_name_rule + std::to_string(sha256.size())) +
                       "; nothing was stored"};
  }
  if (put == queue::AssetStore::Put::quota_exceeded) return uploads_full(request.body.size_bytes(), context);
  const bool is_new = put == queue::AssetStore::Put::stored;
  Reply reply =
      json_reply(is_new ? 201 : 200, api::json_line({{"sha256", sha256}, {"bytes", request.body.size_bytes()}}));
  if (is_new) reply.headers.emplace_back("Location", "/v1/assets/" + sha256);
  return reply;
}

Answer get_asset(Request& request, const ApiContext& context) {
  const std::string& sha256 = request.parameters.front();
  auto reader = context.assets.open(sha256);
  if (!reader) {
    return Problem{failures::asset_not_found, tracer::is_sha256(sha256)
                                                  ? "there is no asset " + sha256 + "; upload it with PUT"
                                                  : asset_name_rule + std::to_string(sha256.size())};
  }
  return Reply{.content_type = "application/octet-stream",
               .headers = {{"ETag", '"' + sha256 + '"'}, {"Cache-Control", "max-age=31536000, immutable"}},
               .source = source_of(std::move(reader))};
}

}  // namespace

Problem uploads_full(std::uint64_t bytes, const ApiContext& context) {
  return {failures::uploads_full, "uploads have " + std::to_string(context.assets.bytes()) + " bytes, and with these " +
                                      std::to_string(bytes) + " they would exceed the limit uploads_bytes of " +
                                      std::to_string(context.uploads_bytes) + "; nothing was stored"};
}

Endpoints asset_endpoints() {
  return {{"POST", "/v1/assets/missing", find_missing_assets},
          {"PUT", "/v1/assets/{sha256}", put_asset},
          {"GET", "/v1/assets/{sha256}", get_asset}};
}

}  // namespace http::handlers
