/// The client of S3-compatible stores, against a server that checks each signature with botocore.

#include "server/storage/s3/s3_client.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <string>
#include <vector>

#include "tests/conformance/test_store.h"
#include "tests/support/s3_server.h"
#include "tests/support/threads.h"
#include "tracer/sha256.h"

using namespace storage::s3;

namespace {

std::string pattern(std::size_t size) {
  std::string bytes(size, '\0');
  for (std::size_t i = 0; i < size; ++i) bytes[i] = static_cast<char>(i * 2654435761u >> 13);
  return bytes;
}

class S3ClientTest : public testing::Test {
 protected:
  void put(const std::string& key, const std::string& bytes) { client.put(key, bytes.size(), reading(bytes)); }
  std::string get(const std::string& key, std::uint64_t offset = 0, std::size_t size = 64u << 20) {
    const auto piece = client.get(key, offset, size);
    return piece ? piece->bytes : "(none)";
  }
  /// That of a store which is unavailable; "(none)" without one.
  template <class Call>
  std::string failure(const Call& call) {
    const Failure found = failure_of(call);
    if (!found.kind) return "(none)";
    EXPECT_EQ(found.kind, queue::StoreFailure::Kind::unavailable);
    return found.what;
  }

  S3Server& server = S3Server::shared();
  S3Settings settings = server.settings();
  S3Client client{settings};
};

}  // namespace

TEST_F(S3ClientTest, ReturnsTheBytesThatWerePut) {
  for (const std::size_t size : {0u, 1u, 1000u, 2'000'000u, 16u << 20, (16u << 20) + 1, 40'000'000u}) {
    const std::string key = "size/" + std::to_string(size), bytes = pattern(size);
    EXPECT_EQ(client.bytes_of(key), std::nullopt);
    put(key, bytes);
    EXPECT_EQ(client.bytes_of(key), size);
    EXPECT_TRUE(get(key) == bytes) << size;
    EXPECT_EQ(client.get(key, 0, 10)->object_bytes, size);
  }
  EXPECT_EQ(server.command("uploads"), "0");
}

TEST_F(S3ClientTest, ReadsRanges) {
  const std::string bytes = pattern(1000);
  put("ranges", bytes);
  EXPECT_EQ(get("ranges", 0, 1), bytes.substr(0, 1));
  EXPECT_EQ(get("ranges", 990, 100), bytes.substr(990));
  EXPECT_EQ(get("ranges", 1000, 1), "");
  EXPECT_EQ(get("ranges", 9'000'000'000, 1), "");
  EXPECT_EQ(get("ranges", 5, 0), "");
  EXPECT_EQ(client.get("ranges", 1000, 1)->object_bytes, 1000u);
  EXPECT_EQ(client.get("missing", 0, 1), std::nullopt);
}

TEST_F(S3ClientTest, ReplacesTheBytesOfAKey) {
  const std::string large = pattern(17'000'000), other(17'000'000, 'x');
  for (const std::string& bytes : {std::string("abc"), std::string("abd"), large, other}) {
    put("key", bytes);
    EXPECT_TRUE(get("key") == bytes);
  }
  client.remove("key");
  client.remove("key");
  EXPECT_EQ(client.bytes_of("key"), std::nullopt);
}

TEST_F(S3ClientTest, RepeatsRequestsThatFailForAWhile) {
  const std::string large = pattern(17'000'000);
  for (const char* fault : {"status 503 3", "status 500 3", "status 429 3", "drop 3", "lose 3"}) {
    const std::string key = tracer::sha256_hex(fault);
    server.command(fault);
    EXPECT_NO_THROW(put(key, "abc")) << fault;
    server.command(fault);
    EXPECT_EQ(get(key), "abc") << fault;
    server.command(fault);
    EXPECT_EQ(client.bytes_of(key), 3u) << fault;
    server.command(fault);
    put(key + "/large", large);
    EXPECT_TRUE(get(key + "/large") == large) << fault;
  }
  EXPECT_EQ(client.abort_uploads("", "2999-01-01T00:00:00"), 3) << "begun, but the answers were lost";
}

TEST_F(S3ClientTest, ReportsFailuresThatStay) {
  server.command("status 503 6");
  EXPECT_NE(failure([&] { put("key", "abc"); }).find("/key: status 503, Fault"), std::string::npos);
  EXPECT_EQ(client.get("key", 0, 1), std::nullopt) << "nothing is left of the fault";
  const std::string large = pattern(17'000'000);
  server.command("broken 9");
  EXPECT_NE(failure([&] { put("large", large); }).find("InternalError: parts"), std::string::npos);
  server.command("broken 0");
  EXPECT_EQ(server.command("uploads"), "0") << "aborted";
  EXPECT_EQ(client.bytes_of("large"), std::nullopt);
}

TEST_F(S3ClientTest, ReportsAStoreThatIsDownAndFindsItAgain) {
  put("key", "abc");
  server.command("down");
  EXPECT_NE(failure([&] { get("key"); }).find("S3: GET http://127.0.0.1:"), std::string::npos);
  server.command("up");
  EXPECT_TRUE(eventually([&] { return failure([&] { get("key"); }) == "(none)"; })) << "once a probe is due";
  EXPECT_EQ(get("key"), "abc");
}

TEST_F(S3ClientTest, SendsNothingWhileTheStoreIsAwayUntilAProbeIsDue) {
  settings.probe_pause = std::chrono::hours(1);
  S3Client other(settings);
  put("key", "abc");
  server.command("down");
  const std::string first = failure([&] { (void)other.get("key", 0, 3); });
  server.command("up");
  const std::string requests = server.command("requests");
  EXPECT_EQ(failure([&] { (void)other.get("key", 0, 3); }), first);
  EXPECT_EQ(failure([&] { other.remove("key"); }), first);
  EXPECT_EQ(server.command("requests"), requests);
}

TEST_F(S3ClientTest, DeletesOldUploadsThatWereNotEnded) {
  const std::string key = settings.location.prefix + "kind/a";
  server.command("begin " + key);
  EXPECT_EQ(client.abort_uploads("kind/", "2020-01-01T00:00:00"), 0) << "a young one";
  server.command("age");
  server.command("begin " + key);
  const std::time_t hour_ago = std::time(nullptr) - 3600;
  std::array<char, 32> then{};
  std::strftime(then.data(), then.size(), "%Y-%m-%dT%H:%M:%S", std::gmtime(&hour_ago));
  EXPECT_EQ(client.abort_uploads("other/", then.data()), 0);
  EXPECT_EQ(client.abort_uploads("kind/", then.data()), 1);
  EXPECT_EQ(server.command("uploads"), "1");
  EXPECT_EQ(client.abort_uploads("kind/", "2999-01-01T00:00:00"), 1);
}

TEST_F(S3ClientTest, ReportsAQuotaThatIsUsedUpAsFull) {
  server.command("status 507 1");
  EXPECT_EQ(failure_of([&] { put("key", "abc"); }).kind, queue::StoreFailure::Kind::full);
}

TEST_F(S3ClientTest, ReportsWhatTheStoreRefuses) {
  settings.location.bucket = "other";
  EXPECT_NE(failure([&] { S3Client(settings).check(); }).find("status 404, NoSuchBucket"), std::string::npos);
  EXPECT_NE(failure([&] { S3Client(settings).get("key", 0, 1); }).find("NoSuchBucket"), std::string::npos);
  settings.location.bucket = "whittle";
  settings.region = "eu-central-1";
  EXPECT_NE(failure([&] { S3Client(settings).check(); }).find("expecting 'us-east-1'"), std::string::npos);
  settings.region = "us-east-1";
  EXPECT_EQ(failure([&] { S3Client(settings).check(); }), "(none)");
}

TEST_F(S3ClientTest, ReadsCredentialsFromAFileAtEachRequest) {
  const TemporaryDirectory directory;
  settings.credentials_file = directory.path() + "/credentials";
  S3Client other(settings);
  EXPECT_NE(failure([&] { other.check(); }).find("cannot read the credentials in"), std::string::npos);
  const auto write = [&](const std::string& secret) {
    std::ofstream(settings.credentials_file) << "# rotated daily\n[other]\naws_access_key_id = x\n[default]\n"
                                             << "aws_access_key_id = whittle-key\r\naws_secret_access_key=" << secret
                                             << "\naws_session_token = a token/+=\n";
  };
  write("wrong");
  EXPECT_NE(failure([&] { other.check(); }).find("status 403, SignatureDoesNotMatch"), std::string::npos);
  write("whittle/secret+");
  EXPECT_EQ(failure([&] { other.check(); }), "(none)");
  EXPECT_NO_THROW(other.put("key", 3, reading("abc")));
  std::ofstream(settings.credentials_file) << "[default]\naws_access_key_id = whittle-key\n";
  EXPECT_NE(failure([&] { other.check(); }).find("has no aws_access_key_id or no aws_secret"), std::string::npos);
}

TEST_F(S3ClientTest, ListsKeysInOrderAndInPages) {
  std::vector<std::string> keys;
  for (int i = 0; i < 1'203; ++i) keys.push_back("list/" + tracer::sha256_hex(std::to_string(i)));
  std::sort(keys.begin(), keys.end());
  for (const std::string& key : keys) put(key, key.substr(0, 7));
  put("other", "abc");
  std::vector<std::string> found;
  for (std::string after;;) {
    const auto page = client.list("list/", after);
    for (const S3Client::Listed& each : page) {
      EXPECT_EQ(each.bytes, 7u);
      found.push_back(each.key);
    }
    if (page.size() < 1000) break;
    after = page.back().key;
  }
  EXPECT_EQ(found, keys);
}

TEST_F(S3ClientTest, SignsUrlsForOthers) {
  put("image", "abc");
  const auto hour = std::chrono::seconds(3600);
  const std::time_t now = std::time(nullptr);
  const std::string hash = tracer::sha256_hex("abc");
  EXPECT_EQ(
      server.command("fetch " + client.presigned_url("image", hour, now, {{"response-content-type", "image/png"}})),
      "200 " + hash + " image/png");
  setenv("AWS_SESSION_TOKEN", "a token/+=", 1);
  const std::string with_token = client.presigned_url("image", hour, now, {{"response-content-type", "image/webp"}});
  unsetenv("AWS_SESSION_TOKEN");
  EXPECT_EQ(server.command("fetch " + with_token), "200 " + hash + " image/webp");
  EXPECT_EQ(server.command("fetch " + client.presigned_url("image", hour, now - 4000)), "403 AccessDenied");
  std::string changed = client.presigned_url("image", hour, now);
  changed.replace(changed.find("Expires=3600"), 12, "Expires=9600");
  EXPECT_EQ(server.command("fetch " + changed), "403 SignatureDoesNotMatch");
  EXPECT_EQ(server.command("fetch " + client.presigned_url("missing", hour, now)), "404 NoSuchKey");
}

TEST_F(S3ClientTest, NamesTheBucketInTheHostOrThePath) {
  const auto url = [&](const std::string& endpoint, bool path_style) {
    settings.endpoint = endpoint;
    settings.path_style = path_style;
    settings.location = {"images", "frames/"};
    const std::string whole = S3Client(settings).presigned_url("key", std::chrono::seconds(1), 0);
    return whole.substr(0, whole.find('?'));
  };
  EXPECT_EQ(url("", false), "https://images.s3.us-east-1.amazonaws.com/frames/key");
  EXPECT_EQ(url("https://store:9000", false), "https://images.store:9000/frames/key");
  EXPECT_EQ(url("https://store:9000", true), "https://store:9000/images/frames/key");
}

TEST_F(S3ClientTest, ServesManyThreads) {
  in_threads(8, [&](int thread) {
    for (int i = 0; i < 20; ++i) {
      const std::string key = std::to_string(thread) + "/" + std::to_string(i), bytes = pattern(1000 + i);
      put(key, bytes);
      EXPECT_TRUE(get(key) == bytes) << key;
    }
  });
}

TEST(S3Location, ReadsTheUriOfABucket) {
  const auto text = [](const std::string& uri) {
    const auto location = Location::parse(uri);
    return location ? location->bucket + " " + location->prefix : "error: " + location.error();
  };
  EXPECT_EQ(text("s3://images"), "images ");
  EXPECT_EQ(text("s3://images/"), "images ");
  EXPECT_EQ(text("s3://my.images-2/frames/a"), "my.images-2 frames/a/");
  for (const char* uri : {"s3://", "s3://ab", "s3:/images", "images", "s3://Images", "s3://images//a",
                          "s3://images/../a", "s3://images/a b", "s3://images/a?b", "s3://images/%41", "s3://im:9000/a",
                          "s3://images/a/.", "s3://user@images"})
    EXPECT_TRUE(text(uri).starts_with("error: must be s3://BUCKET")) << uri;
}
