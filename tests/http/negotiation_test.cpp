#include <gtest/gtest.h>

#include "server/http/header_text.h"

namespace {

const std::vector<std::string_view> png_or_exr{"image/png", "image/x-exr"};

std::string best(std::optional<std::string_view> accept) {
  const auto index = http::best_offer(accept, png_or_exr);
  return index ? std::string(png_or_exr[*index]) : "none";
}

TEST(Accept, SelectsTheFirstOfferOfEqualWeight) {
  EXPECT_EQ(best(std::nullopt), "image/png");
  for (const char* accept : {"", "*/*", "image/*", "image/x-exr, image/png", "image/avif,image/webp,*/*;q=0.8"})
    EXPECT_EQ(best(accept), "image/png") << accept;
}

TEST(Accept, FollowsWeightsAndTheMostSpecificRange) {
  for (const char* accept :
       {"image/x-exr", "IMAGE/X-EXR ; q=0.3, text/html", "image/png;q=0.5, image/x-exr;q=0.501",
        "image/*, image/png;q=0.1", "*/*;q=0.9, image/*;q=0.1, image/x-exr;q=0.2", "image/png;q=0, */*"})
    EXPECT_EQ(best(accept), "image/x-exr") << accept;
}

TEST(Accept, RefusesUnlistedOffersAndWeightZero) {
  for (const char* accept : {"text/html", "image/jpeg, image/webp", "image/png;q=0, image/x-exr;q=0.000", ",,;,"})
    EXPECT_EQ(best(accept), "none") << accept;
}

TEST(Accept, IgnoresInvalidMembers) {
  for (const char* accept : {"png, image/x-exr", "image/png;q=2, image/x-exr", "image/png;q=, image/x-exr;q=0.1"})
    EXPECT_EQ(best(accept), "image/x-exr") << accept;
}

TEST(AcceptEncoding, AcceptsGzipIfItIsNamedWithAWeight) {
  for (const char* accepted : {"gzip", "br, GZIP;q=0.5", "*", "deflate, gzip;q=1.0, *;q=0", "x-gzip"}) {
    EXPECT_TRUE(http::accepts_gzip(accepted)) << accepted;
  }
  for (const char* refused : {"", "br", "gzip;q=0", "*;q=0", "gzip;q=0, *", "gzip;q=2", "gzipped"}) {
    EXPECT_FALSE(http::accepts_gzip(refused)) << refused;
  }
  EXPECT_FALSE(http::accepts_gzip(std::nullopt));
}

using Kind = http::RangeAnswer::Kind;

void expect_part(std::string_view range, std::uint64_t size, http::ByteRange part) {
  const auto answer = http::read_range(range, size);
  EXPECT_EQ(answer.kind, Kind::part) << range;
  EXPECT_EQ(answer.range, part) << range << " gave " << answer.range.begin << ".." << answer.range.end;
}

TEST(Range, ReturnsAHalfOpenRangeWithinTheBytes) {
  expect_part("bytes=0-0", 10, {0, 1});
  expect_part("bytes=2-5", 10, {2, 6});
  expect_part("bytes=5-", 10, {5, 10});
  expect_part("bytes=5-99", 10, {5, 10});
  expect_part("bytes=-3", 10, {7, 10});
  expect_part("bytes=-99", 10, {0, 10});
  expect_part("bytes=9-18446744073709551615", 10, {9, 10});
}

TEST(Range, IsUnsatisfiableBeyondTheEnd) {
  for (const char* range : {"bytes=10-", "bytes=10-12", "bytes=-0", "bytes=18446744073709551615-"}) {
    EXPECT_EQ(http::read_range(range, 10).kind, Kind::unsatisfiable) << range;
  }
  EXPECT_EQ(http::read_range("bytes=0-", 0).kind, Kind::unsatisfiable);
}

TEST(Range, ReturnsTheWholeUnlessThereIsOneValidRange) {
  for (const char* range : {"bytes=0-1,4-5", "bytes=5-2", "bytes=", "bytes=-", "bytes=a-b", "bytes=+1-2", "lines=0-1",
                            "bytes=1--2", "bytes=99999999999999999999-", "bytes 0-1", ""}) {
    EXPECT_EQ(http::read_range(range, 10).kind, Kind::whole) << range;
  }
  EXPECT_EQ(http::read_range(std::nullopt, 10).kind, Kind::whole);
}

TEST(IfNoneMatch, MatchesSingleListedWeakAndStarEtags) {
  EXPECT_TRUE(http::none_match_names("\"a\"", "\"a\""));
  EXPECT_TRUE(http::none_match_names("\"x\" , W/\"a\"", "\"a\""));
  EXPECT_TRUE(http::none_match_names(" * ", "\"a\""));
  EXPECT_FALSE(http::none_match_names("\"b\", \"ab\"", "\"a\""));
  EXPECT_FALSE(http::none_match_names("a", "\"a\""));
  EXPECT_FALSE(http::none_match_names("", "\"a\""));
}

TEST(IfNoneMatch, ComparesAWeakEtagWeakly) {
  EXPECT_TRUE(http::none_match_names("W/\"a\"", "W/\"a\""));
  EXPECT_TRUE(http::none_match_names("\"a\"", "W/\"a\""));
  EXPECT_FALSE(http::none_match_names("W/\"b\"", "W/\"a\""));
}

TEST(Prefer, ReturnsTheFirstWaitInWholeSeconds) {
  using std::chrono::seconds;
  EXPECT_EQ(http::preferred_wait("wait=10"), seconds(10));
  EXPECT_EQ(http::preferred_wait(" respond-async , Wait = \"7\" ; x=y, wait=3"), seconds(7));
  EXPECT_EQ(http::preferred_wait("wait=0"), seconds(0));
  EXPECT_EQ(http::preferred_wait("wait=18446744073709551615"), seconds(31'536'000));
  for (const char* prefer : {"", "wait", "wait=", "wait=-1", "wait=1.5", "wait=x", "waits=1", "foo=wait", ";;", ",,",
                             "wait=99999999999999999999"}) {
    EXPECT_FALSE(http::preferred_wait(prefer)) << prefer;
  }
}

TEST(ContentType, AcceptsJsonUnlessTheCharsetIsNotUtf8) {
  EXPECT_TRUE(http::is_json("application/json"));
  EXPECT_TRUE(http::is_json("Application/JSON; charset=UTF-8"));
  EXPECT_TRUE(http::is_json("application/json;charset=\"utf-8\""));
  EXPECT_TRUE(http::is_json("application/json; profile=x"));
  EXPECT_FALSE(http::is_json("application/json; charset=latin1"));
  EXPECT_FALSE(http::is_json("text/plain"));
  EXPECT_TRUE(http::is_json("Application/merge-patch+json; charset=utf-8", "application/merge-patch+json"));
  EXPECT_FALSE(http::is_json("application/json", "application/merge-patch+json"));
  EXPECT_FALSE(http::is_json("application/jsonx"));
  EXPECT_FALSE(http::is_json(""));
}

}  // namespace
