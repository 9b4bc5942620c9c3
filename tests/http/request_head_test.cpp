#include "server/http/request_head.h"

#include <gtest/gtest.h>

#include <string>

namespace {

http::HeadResult read(const std::string& bytes, const http::HeadLimits& limits = {}) {
  return http::read_head(bytes, limits);
}

/// Parses a head that must be complete.
http::RequestHead complete(const std::string& bytes) {
  auto result = read(bytes);
  if (const auto* refused = std::get_if<http::Problem>(&result)) ADD_FAILURE() << refused->detail;
  if (std::holds_alternative<http::Incomplete>(result)) ADD_FAILURE() << "incomplete: " << bytes;
  if (auto* head = std::get_if<http::RequestHead>(&result)) return *head;
  return {};
}

/// The name of the problem or "complete" or "incomplete", readable in a failed comparison.
std::string refusal(const std::string& bytes, const http::HeadLimits& limits = {}) {
  const auto result = read(bytes, limits);
  if (const auto* refused = std::get_if<http::Problem>(&result)) {
    return std::string(refused->failure.name);
  }
  return std::holds_alternative<http::Incomplete>(result) ? "incomplete" : "complete";
}

std::string get(const std::string& target) { return "GET " + target + " HTTP/1.1\r\nHost: x\r\n\r\n"; }
std::string with_headers(const std::string& headers) { return "POST /a HTTP/1.1\r\nHost: x\r\n" + headers + "\r\n"; }

TEST(RequestHead, SplitsTargetIntoPathAndDecodedQuery) {
  const auto head = complete(get("/v1/jobs?label=a%3Ab&q=two%20words&flag"));
  EXPECT_EQ(head.method, "GET");
  EXPECT_EQ(head.path, "/v1/jobs");
  EXPECT_EQ(head.query, (http::Pairs{{"label", "a:b"}, {"q", "two words"}, {"flag", ""}}));
}

TEST(RequestHead, LowersHeaderNamesAndTrimsValues) {
  const auto head = complete(with_headers("X-Thing: \t a b \t\r\nContent-Length: 12\r\n"));
  EXPECT_EQ(head.header("x-thing"), "a b");
  EXPECT_EQ(head.content_length, 12U);
  EXPECT_FALSE(head.header("X-Thing"));
}

TEST(RequestHead, EndsWhereTheBodyBegins) {
  const std::string bytes = with_headers("Content-Length: 3\r\n");
  EXPECT_EQ(complete(bytes + "abc").size_bytes, bytes.size());
}

TEST(RequestHead, DerivesPersistenceFromVersionAndConnectionHeaders) {
  EXPECT_TRUE(complete("GET / HTTP/1.1\r\nHost: x\r\n\r\n").keep_alive);
  EXPECT_FALSE(complete("GET / HTTP/1.1\r\nHost: x\r\nConnection: upgrade, Close\r\n\r\n").keep_alive);
  EXPECT_FALSE(complete("GET / HTTP/1.1\r\nHost: x\r\nConnection: keep-alive\r\nConnection: close\r\n\r\n").keep_alive);
  EXPECT_FALSE(complete("GET / HTTP/1.0\r\n\r\n").keep_alive);
  EXPECT_TRUE(complete("GET / HTTP/1.0\r\nConnection: Keep-Alive\r\n\r\n").keep_alive);
}

TEST(RequestHead, ExpectsContinueOnlyBeforeABody) {
  EXPECT_TRUE(complete(with_headers("Expect: 100-Continue\r\nContent-Length: 1\r\n")).expects_continue);
  EXPECT_FALSE(complete(with_headers("Expect: 100-continue\r\nContent-Length: 0\r\n")).expects_continue);
  EXPECT_FALSE(complete(with_headers("Expect: 100-continue\r\n")).expects_continue);
}

TEST(RequestHead, IsIncompleteForEveryPrefix) {
  const std::string bytes = with_headers("Content-Length: 3\r\nX: y\r\n");
  for (std::size_t size = 0; size < bytes.size(); ++size) {
    EXPECT_EQ(refusal(bytes.substr(0, size)), "incomplete") << size;
  }
  EXPECT_EQ(refusal(bytes), "complete");
}

struct Refused {
  const char* what;
  std::string bytes;
  const char* verdict;
};

/// Refused heads with the name of their problem.
std::vector<Refused> refused_heads() {
  using namespace std::string_literals;
  const std::string many_headers = [] {
    std::string lines;
    for (int i = 0; i < 64; ++i) lines += "X" + std::to_string(i) + ": y\r\n";
    return lines;
  }();
  return {
      {"bare LF", "GET / HTTP/1.1\nHost: x\n\n", "bad_request"},
      {"bare LF in headers", "GET / HTTP/1.1\r\nHost: x\n\r\n", "bad_request"},
      {"bare CR in a header", with_headers("A: b\rContent-Length: 5\r\n"), "bad_request"},
      {"bare LF before another header", with_headers("A: b\nTransfer-Encoding: chunked\r\n"), "bad_request"},
      {"bare CR before CR LF", with_headers("A: b\r\r\n"), "bad_request"},
      {"bare CR in the request line", "GET /\r HTTP/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"empty line first", "\r\nGET / HTTP/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"NUL in a header", with_headers("A: b\0c\r\n"s), "bad_request"},
      {"ESC in a header", with_headers("A: \x1b[31m\r\n"), "bad_request"},
      {"DEL in a header", with_headers("A: \x7f\r\n"), "bad_request"},
      {"NUL in the target", get("/a\0b"s), "bad_request"},
      {"tab in the target", get("/a\tb"), "bad_request"},
      {"space in the target", get("/a b"), "bad_request"},
      {"byte over 127 in the target", get("/\xc3\xa9"), "bad_request"},
      {"fragment", get("/a#b"), "bad_request"},
      {"backslash", get("/a\\b"), "bad_request"},
      {"escaped NUL", get("/a%00"), "bad_request"},
      {"escaped CR LF in the path", get("/a%0d%0aX:%20y"), "bad_request"},
      {"escaped CR LF in the query", get("/a?b=%0D%0A"), "bad_request"},
      {"escaped DEL", get("/%7f"), "bad_request"},
      {"escaped slash", get("/a%2Fb"), "bad_request"},
      {"half an escape", get("/a%4"), "bad_request"},
      {"no escape at all", get("/a%zz"), "bad_request"},
      {"bad escape in a query name", get("/a?%g0=1"), "bad_request"},
      {"absolute form", get("http://x/a"), "bad_request"},
      {"asterisk form", "OPTIONS * HTTP/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"authority form", "GET x:80 HTTP/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"control in the target", get("/a\x01"), "bad_request"},
      {"no slash", get("v1/version"), "bad_request"},
      {"two spaces", "GET  / HTTP/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"tab for a space", "GET\t/ HTTP/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"space first", " GET / HTTP/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"space last", "GET / HTTP/1.1 \r\nHost: x\r\n\r\n", "bad_request"},
      {"HTTP/0.9", "GET /\r\n\r\n", "bad_request"},
      {"lower-case version", "GET / http/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"version with more digits", "GET / HTTP/1.10\r\nHost: x\r\n\r\n", "bad_request"},
      {"HTTP/1.2", "GET / HTTP/1.2\r\nHost: x\r\n\r\n", "version_not_supported"},
      {"HTTP/2 preface", "PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n", "version_not_supported"},
      {"unknown method", "BREW / HTTP/1.1\r\nHost: x\r\n\r\n", "not_implemented"},
      {"lower-case method", "get / HTTP/1.1\r\nHost: x\r\n\r\n", "not_implemented"},
      {"CONNECT", "CONNECT /a HTTP/1.1\r\nHost: x\r\n\r\n", "not_implemented"},
      {"TRACE", "TRACE / HTTP/1.1\r\nHost: x\r\n\r\n", "not_implemented"},
      {"method that is no token", "GE(T / HTTP/1.1\r\nHost: x\r\n\r\n", "bad_request"},
      {"no Host", "GET / HTTP/1.1\r\n\r\n", "bad_request"},
      {"empty Host", "GET / HTTP/1.1\r\nHost: \r\n\r\n", "bad_request"},
      {"two Hosts", "GET / HTTP/1.1\r\nHost: x\r\nhost: x\r\n\r\n", "bad_request"},
      {"two Hosts in 1.0", "GET / HTTP/1.0\r\nHost: x\r\nHost: y\r\n\r\n", "bad_request"},
      {"Host with user info", "GET / HTTP/1.1\r\nHost: a@b\r\n\r\n", "bad_request"},
      {"Host with a path", "GET / HTTP/1.1\r\nHost: a/b\r\n\r\n", "bad_request"},
      {"header without colon", with_headers("Content-Length\r\n"), "bad_request"},
      {"header without name", with_headers(": a\r\n"), "bad_request"},
      {"space before the colon", with_headers("Content-Length : 5\r\n"), "bad_request"},
      {"obs-fold", with_headers("A: b\r\n c\r\n"), "bad_request"},
      {"obs-fold of the first header", "GET / HTTP/1.1\r\n Host: x\r\n\r\n", "bad_request"},
      {"tab folds too", with_headers("A: b\r\n\tc\r\n"), "bad_request"},
      {"header name with a control", with_headers("A\x01: b\r\n"), "bad_request"},
      {"two Content-Lengths", with_headers("Content-Length: 5\r\nContent-Length: 6\r\n"), "bad_request"},
      {"equal Content-Lengths", with_headers("Content-Length: 5\r\nContent-Length: 5\r\n"), "bad_request"},
      {"list of Content-Lengths", with_headers("Content-Length: 5, 5\r\n"), "bad_request"},
      {"signed Content-Length", with_headers("Content-Length: +5\r\n"), "bad_request"},
      {"negative Content-Length", with_headers("Content-Length: -1\r\n"), "bad_request"},
      {"hexadecimal Content-Length", with_headers("Content-Length: 0x5\r\n"), "bad_request"},
      {"Content-Length with a point", with_headers("Content-Length: 5.0\r\n"), "bad_request"},
      {"folded Content-Length", with_headers("Content-Length:\r\n 0\r\n"), "bad_request"},
      {"Content-Length with a NUL", with_headers("Content-Length: 0\0\r\n"s), "bad_request"},
      {"empty Content-Length", with_headers("Content-Length:\r\n"), "bad_request"},
      {"Content-Length over 64 bits", with_headers("Content-Length: 99999999999999999999\r\n"), "body_too_large"},
      {"Content-Length over the limit", with_headers("Content-Length: 67108865\r\n"), "body_too_large"},
      {"chunked", with_headers("Transfer-Encoding: chunked\r\n"), "length_required"},
      {"chunked after Content-Length", with_headers("Content-Length: 5\r\nTransfer-Encoding: chunked\r\n"),
       "bad_request"},
      {"chunked before Content-Length", with_headers("Transfer-Encoding: chunked\r\nContent-Length: 5\r\n"),
       "bad_request"},
      {"hidden chunked", with_headers("Transfer-Encoding: \tchunked\r\n"), "length_required"},
      {"chunked twice", with_headers("Transfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n"),
       "length_required"},
      {"chunked in upper case", with_headers("TRANSFER-ENCODING: CHUNKED\r\n"), "length_required"},
      {"folded coding", with_headers("Transfer-Encoding:\r\n chunked\r\n"), "bad_request"},
      {"coding before its colon", with_headers("Transfer-Encoding : chunked\r\n"), "bad_request"},
      {"unknown coding", with_headers("Transfer-Encoding: xchunked\r\n"), "length_required"},
      {"chunked in 1.0", "POST / HTTP/1.0\r\nTransfer-Encoding: chunked\r\n\r\n", "bad_request"},
      {"gzip", with_headers("Content-Encoding: gzip\r\nContent-Length: 5\r\n"), "unsupported_encoding"},
      {"body of a GET", "GET / HTTP/1.1\r\nHost: x\r\nContent-Length: 1\r\n\r\n", "bad_request"},
      {"unknown expectation", with_headers("Expect: 200-ok\r\n"), "expectation_failed"},
      {"two ranges", "GET / HTTP/1.1\r\nHost: x\r\nRange: bytes=0-1\r\nRange: bytes=0-2\r\n\r\n", "bad_request"},
      {"two content types", with_headers("Content-Type: a/b\r\nContent-Type: application/json\r\n"), "bad_request"},
      {"65 headers", with_headers(many_headers), "headers_too_large"},
      {"long header", with_headers("A: " + std::string(17'000, 'b') + "\r\n"), "headers_too_large"},
      {"header without end", "GET / HTTP/1.1\r\nA: " + std::string(17'000, 'b'), "headers_too_large"},
      {"long target", get("/" + std::string(2048, 'a')), "target_too_long"},
      {"long request line", get("/" + std::string(9000, 'a')), "target_too_long"},
      {"request line without end", std::string(9000, 'a'), "target_too_long"},
  };
}

TEST(RequestHead, RefusesMalformedHeadsWithTheirProblem) {
  for (const Refused& row : refused_heads()) EXPECT_EQ(refusal(row.bytes), row.verdict) << row.what;
}

TEST(RequestHead, DecidesIndependentlyOfThePackets) {
  for (const Refused& row : refused_heads()) {
    std::string verdict = "incomplete";
    for (std::size_t size = 1; size <= row.bytes.size() && verdict == "incomplete"; ++size) {
      verdict = refusal(row.bytes.substr(0, size));
    }
    EXPECT_EQ(verdict, row.verdict) << row.what;
  }
}

TEST(RequestHead, AcceptsHeadsExactlyAtTheLimits) {
  http::HeadLimits limits;
  limits.body_bytes = 7;
  EXPECT_EQ(refusal(with_headers("Content-Length: 7\r\n"), limits), "complete");
  EXPECT_EQ(refusal(with_headers("Content-Length: 8\r\n"), limits), "body_too_large");
  EXPECT_EQ(refusal(get("/" + std::string(2047, 'a'))), "complete");
  limits.header_count = 2;
  EXPECT_EQ(refusal(with_headers("A: b\r\n"), limits), "complete");
  EXPECT_EQ(refusal(with_headers("A: b\r\nC: d\r\n"), limits), "headers_too_large");
  limits.header_bytes = 15;  // "Host: x\r\n" and "A: b\r\n"
  EXPECT_EQ(refusal(with_headers("A: b\r\n"), limits), "complete");
  limits.header_bytes = 14;
  EXPECT_EQ(refusal(with_headers("A: b\r\n"), limits), "headers_too_large");
}

TEST(RequestHead, HasASeparateLimitForUploads) {
  http::HeadLimits limits;
  limits.body_bytes = 7;
  limits.asset_bytes = 9;
  const auto put = [](int length) {
    return "PUT / HTTP/1.1\r\nHost: x\r\nContent-Length: " + std::to_string(length) + "\r\n\r\n";
  };
  EXPECT_EQ(refusal(put(9), limits), "complete");
  const auto result = http::read_head(put(10), limits);
  ASSERT_TRUE(std::holds_alternative<http::Problem>(result));
  EXPECT_NE(std::get<http::Problem>(result).detail.find("asset_bytes is 9"), std::string::npos);
}

TEST(RequestHead, ReportsLimitAndSizeOfABodyThatIsTooLarge) {
  const auto result = read(with_headers("Content-Length: 67108865\r\n"));
  const std::string detail = std::get<http::Problem>(result).detail;
  EXPECT_NE(detail.find("body_bytes"), std::string::npos) << detail;
  EXPECT_NE(detail.find("67108864"), std::string::npos) << detail;
  EXPECT_NE(detail.find("67108865"), std::string::npos) << detail;
}

TEST(PercentDecoding, DecodesBothCasesAndKeepsPlus) {
  EXPECT_EQ(http::percent_decoded("%41%4a%4A+b"), "AJJ+b");
  EXPECT_EQ(http::percent_decoded("100%25"), "100%");
  EXPECT_FALSE(http::percent_decoded("%"));
  EXPECT_FALSE(http::percent_decoded("%1f"));
}

}  // namespace
