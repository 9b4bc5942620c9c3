/// The page at / and its files below /ui. None of them holds data: the page reads that from /v1 with the user's key.

#include <algorithm>

#include "server/http/handlers/handlers.h"
#include "server/http/header_text.h"
#include "server/web/page.h"

namespace http::handlers {
namespace {

/// No inline script or style and no nonce, so that the page is constant.
constexpr const char* content_security_policy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; worker-src "
    "'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'; require-trusted-types-for 'script'";

const web::File* find_file(std::string_view name) {
  const auto files = web::files();
  const auto found = std::ranges::find(files, name, &web::File::name);
  return found == files.end() ? nullptr : &*found;
}

/// The file, compressed if the client accepts that.
Reply file_reply(const Request& request, const web::File& file, const char* cache_control) {
  const bool compressed = accepts_gzip(request.head.header("accept-encoding"));
  Reply reply;
  reply.headers = {{"ETag", '"' + std::string(file.sha256) + (compressed ? "-gzip\"" : "\"")},
                   {"Cache-Control", cache_control}};
  if (compressed) reply.headers.emplace_back("Content-Encoding", "gzip");
  reply.content_type = file.type;
  const std::string_view bytes = compressed ? file.gzip : file.raw;
  reply.source = BodySource{bytes.size(), [bytes](std::uint64_t at, char* into, std::size_t count) {
                              return bytes.copy(into, count, static_cast<std::size_t>(at));
                            }};
  return reply;
}

/// The page if the client prefers HTML, as browsers do; otherwise the overview as text.
Answer get_root(Request& request, const ApiContext& context) {
  const auto best = best_offer(request.head.header("accept"), {"text/plain", "text/html"});
  if (!context.dashboard || best != 1) return get_overview(request);
  Reply reply = file_reply(request, *find_file("index.html"), "no-cache");
  reply.headers.emplace_back("Vary", "Accept, Accept-Encoding");
  reply.headers.emplace_back("Content-Security-Policy", content_security_policy);
  reply.headers.emplace_back("Referrer-Policy", "no-referrer");
  reply.headers.emplace_back("Cross-Origin-Opener-Policy", "same-origin");
  return reply;
}

Answer get_page_file(Request& request, const ApiContext& context) {
  const std::string& tree = request.parameters[0];
  const web::File* const file = find_file(request.parameters[1]);
  if (!context.dashboard || tree != web::tree() || file == nullptr || file->name == "index.html") {
    return Problem{failures::not_found, "the page of this build has no file " + request.head.path};
  }
  Reply reply = file_reply(request, *file, "max-age=31536000, immutable");  // another file has another tree
  reply.headers.emplace_back("Vary", "Accept-Encoding");
  return reply;
}

}  // namespace

Endpoints page_endpoints() {
  return {{"GET", "/", get_root, {.key = RequiredKey::none}},
          {"GET", "/ui/{tree}/{file}", get_page_file, {.key = RequiredKey::none}}};
}

}  // namespace http::handlers
