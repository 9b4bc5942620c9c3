#include "tracer/sha256.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <utility>

namespace {

using tracer::Sha256;

/// Digests of hashlib.sha256 (Python 3.11) over the bytes 0, 1, ... 250, 0, 1 ..., for lengths around one block.
TEST(Sha256, EqualsTheReferenceDigestForAnySplit) {
  const std::pair<std::size_t, const char*> expected[] = {
      {0, "e3b0c44298fc1c149afbf4c8996fb92427ae41e4649b934ca495991b7852b855"},
      {3, "ae4b3280e56e2faf83f414a6e3dabe9d5fbe18976544c05fed121accb85b53fc"},
      {127, "92ca0fa6651ee2f97b884b7246a562fa71250fedefe5ebf270d31c546bfea976"},
      {128, "471fb943aa23c511f6f72f8d1652d9c880cfa392ad80503120547703e56a2be5"},
      {129, "5099c6a56203f9687f7d33f4bfdf576d31dc91f6b695ecea38b2770c87631135"},
      {256, "5bc31b283cef0072274e97d74916552954c935794536cab632641e5ea071379d"},
      {257, "a2c6cad2ffa699b14538231fef914f45d30440389e6f8d79091efba836165a2b"},
      {1000, "4e4c294b331f7a2099a379bec34b9f9fc03dc46ab465d998f4d683da53487e6d"},
  };
  for (const auto& [count, digest] : expected) {
    std::string bytes(count, '\0');
    for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<char>(i % 251);
    Sha256 parts;
    for (std::size_t at = 0; at < count; at += 7) parts.add(bytes.data() + at, std::min<std::size_t>(7, count - at));
    EXPECT_EQ(parts.size_bytes(), count);
    EXPECT_EQ(tracer::sha256_hex(bytes), digest) << count << " bytes";
    EXPECT_EQ(parts.hex(), digest) << count << " bytes, 7 at a time";
  }
}

TEST(Sha256, WritesTheDigestAsBytesToo) {
  Sha256 hash;
  EXPECT_EQ(hash.digest().substr(0, 4), "\xe3\xb0\xc4\x42");
}

TEST(HmacSha256, IsThatOfRfc4231) {
  EXPECT_EQ(tracer::hex_of(tracer::hmac_sha256("Jefe", "what do ya want for nothing?")),
            "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
  EXPECT_EQ(tracer::hex_of(tracer::hmac_sha256(std::string(131, '\xaa'),
                                               "Test Using Larger Than Block-Size Key - Hash Key First")),
            "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54");
}

TEST(IsSha256, AcceptsOnlyLowerCaseHexOfFullLength) {
  const std::string digest = tracer::sha256_hex("");
  EXPECT_TRUE(tracer::is_sha256(digest));
  for (const std::string& name : {std::string(), digest + '0', digest.substr(1), 'A' + digest.substr(1),
                                  'g' + digest.substr(1), 'z' + digest.substr(1), "../" + digest.substr(3)})
    EXPECT_FALSE(tracer::is_sha256(name)) << name;
}

}  // namespace
