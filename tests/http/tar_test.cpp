/// Tar archives that are produced while they are read.

#include <gtest/gtest.h>

#include <cstdlib>
#include <memory>
#include <string>

#include "server/http/handlers/handlers.h"
#include "tracer/sha256.h"

namespace {

/// The content is the media type in this test.
std::unique_ptr<queue::ArtifactReader> open(const queue::Artifact& artifact) {
  if (artifact.sha256 == "gone") return nullptr;
  return std::make_unique<queue::MemoryReader>(artifact.media_type);
}

http::handlers::TarEntry entry(const std::string& name, const std::string& content) {
  return {name, content.size(), 1'700'000'000'000, {name, content, tracer::sha256_hex(content), content.size()}};
}

std::string read_in_pieces(const http::BodySource& source, std::size_t piece) {
  std::string all;
  std::string buffer(piece, '?');
  while (const std::size_t got = source.read(all.size(), buffer.data(), piece)) all.append(buffer, 0, got);
  return all;
}

}  // namespace

TEST(Tar, IsTheSameInPiecesOfAnySize) {
  const http::BodySource source = http::handlers::tar_of(
      {entry("a.png", std::string(512, 'a')), entry("b.png", ""), entry("c.png", std::string(700, 'c'))}, open);
  const std::string whole = read_in_pieces(source, 1 << 20);
  EXPECT_EQ(whole.size(), source.size_bytes);
  EXPECT_EQ(whole.size(), 1024u + 512u + 512u + 1024u + 1024u);
  for (const std::size_t piece : {1u, 7u, 511u, 512u, 513u, 4096u}) EXPECT_EQ(read_in_pieces(source, piece), whole);
  EXPECT_EQ(whole.substr(512, 512), std::string(512, 'a'));
  EXPECT_EQ(whole.substr(whole.size() - 1024), std::string(1024, '\0'));
}

TEST(Tar, HeadersHaveValidChecksums) {
  const std::string whole = read_in_pieces(http::handlers::tar_of({entry("a.png", "abc")}, open), 4096);
  std::string header = whole.substr(0, 512);
  EXPECT_EQ(header.substr(257, 8), std::string("ustar\0", 6) + "00");
  EXPECT_EQ(std::strtoull(header.c_str() + 124, nullptr, 8), 3u);
  EXPECT_EQ(std::strtoull(header.c_str() + 136, nullptr, 8), 1'700'000'000u);
  const unsigned long long checksum = std::strtoull(header.c_str() + 148, nullptr, 8);
  header.replace(148, 8, 8, ' ');
  unsigned long long sum = 0;
  for (const char c : header) sum += static_cast<unsigned char>(c);
  EXPECT_EQ(checksum, sum);
}

TEST(Tar, ThrowsAtTheEndOfADamagedArtifact) {
  http::handlers::TarEntry damaged = entry("a.png", "abc");
  damaged.artifact.media_type = "abd";
  const http::BodySource source = http::handlers::tar_of({damaged}, open);
  std::string buffer(4096, '?');
  EXPECT_EQ(source.read(512, buffer.data(), 2), 2u);
  EXPECT_EQ(source.read(513, buffer.data(), 1), 1u) << "again, as after a short write";
  EXPECT_THROW(source.read(514, buffer.data(), 1), std::runtime_error);
}

TEST(Tar, ThrowsIfAnArtifactIsMissingOrShorter) {
  const http::BodySource missing = http::handlers::tar_of({{"a.png", 3, 0, {"a.png", "image/png", "gone", 3}}}, open);
  std::string buffer(4096, '?');
  EXPECT_THROW(missing.read(512, buffer.data(), 512), std::runtime_error);
  const http::BodySource shorter = http::handlers::tar_of({{"a.png", 30, 0, {"a.png", "abc", "", 30}}}, open);
  EXPECT_THROW(shorter.read(512, buffer.data(), 512), std::runtime_error);
}
