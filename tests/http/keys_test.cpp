#include <gtest/gtest.h>

#include "server/http/handlers/routes.h"

namespace {

using keys::Scope;

const std::string zeros(64, '0');

TEST(Keys, FindsAKeyByItsHash) {
  const keys::CreatedKey ann = keys::create("ann", {Scope::jobs_read}), bob = keys::create("bob", {Scope::admin});
  EXPECT_NE(ann.token, bob.token);
  const auto read = keys::parse(ann.line + "\n# a comment\n\n  " + bob.line + " # another");
  ASSERT_TRUE(read);
  ASSERT_EQ(read->size(), 2U);
  EXPECT_EQ(keys::find(*read, ann.token)->name, "ann");
  EXPECT_EQ(keys::find(*read, bob.token)->name, "bob");
  EXPECT_EQ(keys::find(*read, ann.token + "0"), nullptr);
  EXPECT_EQ(keys::find(*read, ""), nullptr);
  EXPECT_EQ(keys::find(*read, read->front().sha256), nullptr) << "the hash is not the key";
}

/// The example "abc" of FIPS 180-4.
TEST(Keys, HashesWithSha256) {
  const auto read = keys::parse("ann admin ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  ASSERT_TRUE(read);
  EXPECT_NE(keys::find(*read, "abc"), nullptr);
}

TEST(Keys, HaveAWeight) {
  const auto read = keys::parse("a admin " + zeros + "\nb admin " + std::string(64, '1') + " 100 # a hundred turns");
  ASSERT_TRUE(read);
  EXPECT_EQ(read->front().weight, 1);
  EXPECT_EQ(read->back().weight, 100);
  for (const char* weight : {"0", "-1", "101", "1.5", "x", "99999999999", "2 2"}) {
    EXPECT_FALSE(keys::parse("a admin " + zeros + " " + weight)) << weight;
  }
}

TEST(Keys, AllowsItsScopesAndAdminAll) {
  const keys::Key reader{"r", {Scope::jobs_read}, zeros}, admin{"a", {Scope::admin}, zeros};
  EXPECT_TRUE(reader.allows(Scope::jobs_read));
  EXPECT_FALSE(reader.allows(Scope::jobs_write));
  EXPECT_FALSE(reader.allows(Scope::admin));
  for (const Scope scope : {Scope::jobs_read, Scope::jobs_write, Scope::admin}) EXPECT_TRUE(admin.allows(scope));
}

TEST(Keys, ParsesTheNamesOfScopes) {
  EXPECT_EQ(keys::parse_scopes("jobs:read,admin"), (std::vector{Scope::jobs_read, Scope::admin}));
  for (const char* text : {"", "jobs", "jobs:read,", ",admin", "admin admin", "Admin"}) {
    EXPECT_FALSE(keys::parse_scopes(text)) << text;
  }
}

TEST(KeyRing, ReloadsAllKeys) {
  const keys::CreatedKey old = keys::create("old", {Scope::admin}), fresh = keys::create("new", {Scope::admin});
  keys::KeyRing ring(*keys::parse(old.line));
  EXPECT_TRUE(ring.find(old.token));
  ring.reload(*keys::parse(fresh.line));
  EXPECT_FALSE(ring.find(old.token));
  EXPECT_EQ(ring.find(fresh.token)->name, "new");
}

std::optional<http::Problem> refusal_without_keys(const http::RequestHead& head) {
  const auto access = http::access_of(head, nullptr);
  return access ? std::nullopt : std::optional(access.error());
}

TEST(Access, AcceptsOnlyNamesOfThisMachineWithoutKeys) {
  http::RequestHead head;
  head.path = "/";
  EXPECT_FALSE(refusal_without_keys(head)) << "HTTP/1.0 has no Host";
  for (const char* host : {"localhost", "LOCALHOST:1", "127.0.0.1", "127.9.9.9:1", "[::1]", "[::1]:1"}) {
    head.headers = {{"host", host}};
    EXPECT_FALSE(refusal_without_keys(head)) << host;
  }
  for (const char* host : {"localhos", "localhost.evil", "127.evil", "128.0.0.1", "[::2]", "[::1", "evil:127"}) {
    head.headers = {{"host", host}};
    const auto refusal = refusal_without_keys(head);
    ASSERT_TRUE(refusal) << host;
    EXPECT_EQ(refusal->failure, http::failures::misdirected_request);
  }
}

http::RequestHead head_of(const std::string& method, const std::string& name, const std::string& value) {
  http::RequestHead head;
  head.method = method;
  head.path = "/v1/jobs/1/cancel";
  head.headers = {{"host", "localhost:8080"}, {name, value}};
  return head;
}

TEST(Access, RefusesChangesByPagesOfOtherSitesWithoutKeys) {
  const std::vector<std::pair<std::string, std::string>> foreign{
      {"sec-fetch-site", "cross-site"},
      {"sec-fetch-site", "same-site"},
      {"sec-fetch-site", "new"},
      {"origin", "http://evil.example"},
      {"origin", "http://localhost:3000"},
      {"origin", "http://localhost"},
      {"origin", "null"},
      {"origin", "localhost:8080"},
      {"origin", "http://127.0.0.1:8080"},
      {"origin", "http://localhost:8080.evil"},
  };
  for (const auto& [name, value] : foreign) {
    for (const char* method : {"POST", "PUT", "PATCH", "DELETE"}) {
      const auto refusal = refusal_without_keys(head_of(method, name, value));
      ASSERT_TRUE(refusal) << method << ' ' << name << ": " << value;
      EXPECT_EQ(refusal->failure, http::failures::cross_site_request);
    }
    for (const char* method : {"GET", "HEAD", "OPTIONS"}) {
      EXPECT_FALSE(refusal_without_keys(head_of(method, name, value))) << method << ' ' << name << ": " << value;
    }
  }
}

TEST(Access, AcceptsChangesByItsOwnPagesAndPrograms) {
  const std::vector<std::pair<std::string, std::string>> own{{"sec-fetch-site", "same-origin"},
                                                             {"sec-fetch-site", "none"},
                                                             {"origin", "http://localhost:8080"},
                                                             {"origin", "https://LOCALHOST:8080"},
                                                             {"user-agent", "curl"}};
  for (const auto& [name, value] : own) {
    EXPECT_FALSE(refusal_without_keys(head_of("POST", name, value))) << name << ": " << value;
  }
}

TEST(KeyRing, FindsAKeyByATicketForItsPathAndTime) {
  const keys::CreatedKey made = keys::create("a.n-n", {Scope::jobs_read});
  std::int64_t now_s = 1000;
  keys::KeyRing ring(*keys::parse(made.line + "\n" + keys::create("a.n-n", {Scope::admin}).line),
                     [&] { return now_s; });
  const keys::Ticket ticket = ring.create_ticket(*ring.find(made.token), "/v1/jobs");
  EXPECT_EQ(ticket.expires_s, 1000 + keys::ticket_lifetime_s);
  const auto found = ring.find_by_ticket(ticket.text, "/v1/jobs");
  ASSERT_TRUE(found);
  EXPECT_EQ(found->sha256, ring.find(made.token)->sha256);
  EXPECT_FALSE(ring.find_by_ticket(ticket.text, "/v1/job"));
  now_s = ticket.expires_s;
  EXPECT_TRUE(ring.find_by_ticket(ticket.text, "/v1/jobs"));
  now_s = ticket.expires_s + 1;
  EXPECT_FALSE(ring.find_by_ticket(ticket.text, "/v1/jobs"));
  now_s = 1000;
  std::string later = ticket.text;
  later.replace(later.find("1060"), 4, "9999");
  for (const std::string& wrong : {later, std::string(), std::string("."), std::string(".."), std::string("a.n-n"),
                                   "a.n-n.x" + ticket.text.substr(10), ticket.text + "0"}) {
    EXPECT_FALSE(ring.find_by_ticket(wrong, "/v1/jobs")) << wrong;
  }
  ring.reload(*keys::parse(keys::create("a.n-n", {Scope::jobs_read}).line));
  EXPECT_FALSE(ring.find_by_ticket(ticket.text, "/v1/jobs"));
}

TEST(Access, HasTheKeyOrRefuses) {
  const keys::CreatedKey made = keys::create("ann", {Scope::jobs_read});
  const keys::KeyRing ring(*keys::parse(made.line));
  http::RequestHead head;
  head.path = "/v1/jobs";
  head.headers = {{"host", "render.example.com"}, {"authorization", "Bearer  " + made.token}};  // any host is served
  const auto key = http::access_of(head, &ring);
  ASSERT_TRUE(key);
  EXPECT_EQ((*key)->name, "ann");
  head.headers.clear();
  EXPECT_EQ(http::access_of(head, &ring).error().failure, http::failures::unauthenticated);
}

TEST(Access, IsOpenToEveryoneOnPathsOfOpenRoutesOnly) {
  const keys::KeyRing ring(*keys::parse(keys::create("ann", {Scope::admin}).line));
  const auto is_open = [&](const char* path) {
    http::RequestHead head;
    head.path = path;
    return static_cast<bool>(http::access_of(head, &ring));
  };
  for (const char* path : {"/", "/docs", "/docs/scene", "/openapi.json", "/schemas/scene.schema.json", "/ui/0/main.js"})
    EXPECT_TRUE(is_open(path)) << path;
  for (const char* path : {"/v1/jobs", "/v1/me", "/docs/", "/doc", "/docs/scene/x", "/ui", "/ui/0/a/b", "//", ""})
    EXPECT_FALSE(is_open(path)) << path;
}

TEST(Access, NeedsTheScopeOfTheRoute) {
  using enum http::RequiredKey;
  const keys::Key reader{"r", {Scope::jobs_read}, zeros}, writer{"w", {Scope::jobs_write}, zeros};
  const keys::Key admin{"a", {Scope::admin}, zeros};
  const auto allowed = [&](const char* method, http::RequiredKey required) {
    const http::Route route{method, "/", {}, {.key = required}};
    EXPECT_FALSE(http::scope_problem(admin, route) || http::scope_problem(std::nullopt, route)) << method;
    return std::pair(!http::scope_problem(reader, route), !http::scope_problem(writer, route));
  };
  EXPECT_EQ(allowed("GET", of_method), std::pair(true, false));
  for (const char* method : {"POST", "DELETE"}) EXPECT_EQ(allowed(method, of_method), std::pair(false, true));
  EXPECT_EQ(allowed("POST", reading), std::pair(true, false));
  for (const auto open : {any, none}) EXPECT_EQ(allowed("GET", open), std::pair(true, true));
  EXPECT_EQ(http::scope_problem(writer, {"GET", "/", {}})->failure, http::failures::forbidden);
}

}  // namespace
