/// The HTTP server as cpp-httplib sees it: a client that shares no code and no author with it.
#include <httplib.h>

#include "tests/http/http_server_fixture.h"

namespace http_server_test {
namespace {

class IndependentClientTest : public HttpServerTest {
 protected:
  /// GET / answers "root"; POST /size answers with the size of the body.
  void start() {
    settings.spool_directory = testing::TempDir();
    const auto size_of_body = [](Request& request) -> Answer {
      return text(std::to_string(request.body.size_bytes()));
    };
    server = std::make_unique<http::HttpServer>(
        settings,
        std::vector<http::Route>{{"GET", "/", [](Request&) -> Answer { return text("root"); }, {}},
                                 {"POST", "/size", size_of_body, {}}},
        [this] { return std::to_string(++request_count); }, telemetry::Log(telemetry::Level::error));
    client = std::make_unique<httplib::Client>("127.0.0.1", server->port());
    client->set_read_timeout(patience);
  }

  std::unique_ptr<httplib::Client> client;
};

TEST_F(IndependentClientTest, GetsManyRepliesOverOneConnection) {
  start();
  client->set_keep_alive(true);
  for (int i = 0; i < 100; ++i) {
    const httplib::Result reply = client->Get("/");
    ASSERT_TRUE(reply) << httplib::to_string(reply.error());
    EXPECT_EQ(reply->status, 200);
    EXPECT_EQ(reply->body, "root");
  }
  EXPECT_EQ(server->connections(), 1u);
}

TEST_F(IndependentClientTest, GetsTheHeadersOfAReplyWithoutItsBody) {
  start();
  const httplib::Result reply = client->Head("/");
  ASSERT_TRUE(reply) << httplib::to_string(reply.error());
  EXPECT_EQ(reply->get_header_value("Content-Length"), "4");
  EXPECT_EQ(reply->get_header_value("Content-Type"), "text/plain");
  EXPECT_EQ(reply->body, "");
  EXPECT_EQ(client->Get("/")->body, "root") << "the next reply begins where the headers ended";
}

TEST_F(IndependentClientTest, SendsBodiesOfEverySize) {
  start();
  client->set_keep_alive(true);
  for (const std::size_t size : {std::size_t{0}, std::size_t{1}, std::size_t{65'536}, std::size_t{5} << 20}) {
    const httplib::Result reply = client->Post("/size", std::string(size, 'x'), "application/octet-stream");
    ASSERT_TRUE(reply) << httplib::to_string(reply.error());
    EXPECT_EQ(reply->body, std::to_string(size));
  }
}

TEST_F(IndependentClientTest, ReadsProblemsAsReplies) {
  start();
  const auto expect_problem = [](const httplib::Result& reply, int status) {
    ASSERT_TRUE(reply) << httplib::to_string(reply.error());
    EXPECT_EQ(reply->status, status);
    EXPECT_EQ(reply->get_header_value("Content-Type"), "application/problem+json");
  };
  expect_problem(client->Get("/nowhere"), 404);
  expect_problem(client->Post("/", "text", "text/plain"), 405);
  const auto chunks = [](std::size_t offset, httplib::DataSink& sink) {
    sink.write("text", 4);
    if (offset > 0) sink.done();
    return true;
  };
  expect_problem(client->Post("/size", chunks, "text/plain"), 411);  // sent in chunks, which the server does not take
  EXPECT_EQ(client->Get("/")->body, "root") << "over another connection";
}

}  // namespace
}  // namespace http_server_test
