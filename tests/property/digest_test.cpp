// The digest that kept geometry is known by.
#include "tracer/src/cache/digest.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <string_view>
#include <utility>

namespace {

using tracer::Digest;

std::string hex(std::string_view bytes) {
  std::string text;
  for (const unsigned char byte : bytes) {
    text += "0123456789abcdef"[byte >> 4];
    text += "0123456789abcdef"[byte & 15];
  }
  return text;
}

/// hashlib.blake2b(bytes, digest_size=32) of Python 3.11, of the bytes 0, 1, ... 250, 0, 1 ... around a block's length.
TEST(Digest, IsBlake2b) {
  const std::pair<std::size_t, const char*> expected[] = {
      {0, "0e5751c026e543b2e8ab2eb06099daa1d1e5df47778f7787faab45cdf12fe3a8"},
      {3, "3d8c3d594928271f44aad7a04b177154806867bcf918e1549c0bc16f9da2b09b"},
      {127, "f2fe67ff342e21b8f45e8f2e0bcd1d9243245d50ee6c78042e9c491388791c72"},
      {128, "c3582f71ebb2be66fa5dd750f80baae97554f3b015663c8be377cfcb2488c1d1"},
      {129, "f7f3c46ba2564ff4c4c162da1f5b605f9f1c4aa6a20652a9f9a337c1a2f5b9c9"},
      {256, "582f782226018ec33076bd8d1c42413530ac7e1126260ffc0f306ba3befc3f24"},
      {257, "227e15ed64ee8e93eb7bc53828f76eed974f2c4ab1408c3d08f212b7f8d69904"},
      {1000, "b372d0608f720c8c3dd41e9c8eecb10143b41abe520b616607e754bf79c08331"},
  };
  for (const auto& [count, digest] : expected) {
    std::string bytes(count, '\0');
    for (std::size_t i = 0; i < count; ++i) bytes[i] = static_cast<char>(i % 251);
    Digest whole, parts;
    whole.add(bytes.data(), count);
    for (std::size_t at = 0; at < count; at += 7) parts.add(bytes.data() + at, std::min<std::size_t>(7, count - at));
    EXPECT_EQ(whole.bytes(), count);
    EXPECT_EQ(hex(whole.end()), digest) << count << " bytes";
    EXPECT_EQ(hex(parts.end()), digest) << count << " bytes, 7 at a time";
  }
}

}  // namespace
