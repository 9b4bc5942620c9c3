/// Arbitrary bytes through the reader: must neither crash nor hang, and the result must satisfy its postconditions.

#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

#include "api/document.h"
#include "tests/fuzz/require.h"
#include "tracer/requirements.h"
#include "tracer/warnings.h"

namespace {

/// Small limits, so that a fuzzer reaches them with small documents.
api::Limits narrow_limits() {
  api::Limits limits;
  limits.document.depth = 10;
  limits.document.values = 2'000;
  limits.document.string_bytes = 500;
  limits.document.key_bytes = 40;
  limits.document.name_bytes = 20;
  limits.document.labels = 3;
  limits.scene.objects = 20;
  limits.scene.triangles = 100;
  limits.scene.lights = 5;
  limits.scene.materials = 8;
  limits.scene.textures = 4;
  return limits;
}

void check(const api::Document& document, const api::Limits& limits) {
  require(tracer::validate(document.scene, limits.scene).empty(), "an accepted scene passes validate");
  tracer::requirements(document.scene);
  tracer::warnings(document.scene);
}

void check(const api::Refusal& refusal) {
  using Kind = api::Refusal::Kind;
  require(!refusal.detail.empty(), "a refusal has a sentence");
  require(refusal.kind != Kind::not_json || (refusal.line > 0 && refusal.column > 0), "what is not JSON has a place");
  require((refusal.kind == Kind::invalid) == !refusal.issues.empty(), "issues are what an invalid document has");
  for (const tracer::Issue& issue : refusal.issues) {
    require(issue.pointer.empty() || issue.pointer.front() == '/', "a pointer is one of RFC 6901");
    require(!issue.code.empty() && !issue.detail.empty(), "an issue has a code and a sentence");
  }
}

void read(std::string_view bytes, const api::Limits& limits) {
  const auto document = api::parse_scene(bytes, limits);
  if (document) {
    check(*document, limits);
  } else {
    check(document.error());
  }
}

}  // namespace

// NOLINTNEXTLINE(readability-identifier-naming): libFuzzer's name for it
extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<char> copy(data, data + size);  // of exactly this size: reading beyond its end is seen
  const std::string_view bytes(copy.data(), copy.size());
  read(bytes, {});
  read(bytes, narrow_limits());
  return 0;
}
