#pragma once
/// An HTTP server with handlers of the test, and a client of it.

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <sys/time.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <memory>
#include <mutex>
#include <thread>

#include "server/http/http_server.h"

namespace http_server_test {

using namespace std::chrono_literals;
using http::Answer;
using http::Reply;
using http::Request;

constexpr auto patience = 600s;

/// A blocking client on loopback.
class Client {
 public:
  explicit Client(std::uint16_t port) : fd_(::socket(AF_INET, SOCK_STREAM, 0)) {
    const timeval limit{std::chrono::seconds(patience).count(), 0};
    ::setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &limit, sizeof limit);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = ::connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  Client(const Client&) = delete;
  ~Client() { ::close(fd_); }

  [[nodiscard]] bool connected() const { return connected_; }

  void send_get(const std::string& path) {
    const std::string text = "GET " + path + " HTTP/1.1\r\nHost: x\r\n\r\n";
    ASSERT_EQ(::send(fd_, text.data(), text.size(), MSG_NOSIGNAL), static_cast<ssize_t>(text.size()));
  }

  /// Reads `size` bytes, or fewer if the connection ends before.
  std::string read(std::size_t size) {
    std::string text(size, '\0');
    std::size_t got = 0;
    for (ssize_t count = 1; got < size && count > 0; got += static_cast<std::size_t>(std::max<ssize_t>(count, 0))) {
      count = ::recv(fd_, text.data() + got, size - got, 0);
    }
    text.resize(got);
    return text;
  }

  /// Reads the head of a reply; it is empty if the connection ends before.
  std::string read_head() {
    std::string head;
    while (!head.ends_with("\r\n\r\n")) {
      const std::string byte = read(1);
      if (byte.empty()) return {};
      head += byte;
    }
    return head;
  }

  struct Response {
    int status = 0;
    std::string body;
  };
  Response read_reply() {
    const std::string head = read_head();
    if (head.empty()) return {};
    const std::size_t length = head.find("Content-Length: ");
    const std::size_t size = length == std::string::npos ? 0 : std::stoul(head.substr(length + 16));
    return {std::stoi(head.substr(9, 3)), read(size)};
  }

  Response get(const std::string& path) {
    send_get(path);
    return read_reply();
  }

 private:
  int fd_;
  bool connected_ = false;
};

/// Blocks handlers until it is opened, and counts them.
class Barrier {
 public:
  void wait() {
    std::unique_lock lock(mutex_);
    ++waiters_;
    changed_.notify_all();
    changed_.wait(lock, [&] { return open_; });
  }
  void open() {
    const std::lock_guard lock(mutex_);
    open_ = true;
    changed_.notify_all();
  }
  bool wait_for_waiters(int count) {
    std::unique_lock lock(mutex_);
    return changed_.wait_for(lock, patience, [&] { return waiters_ >= count; });
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  bool open_ = false;
  int waiters_ = 0;
};

inline Reply text(const std::string& body) {
  Reply reply;
  reply.content_type = "text/plain";
  reply.body = body;
  return reply;
}

class HttpServerTest : public testing::Test {
 protected:
  void serve(const std::vector<std::pair<std::string, http::Handler>>& handlers) {
    const auto size = [](Request& request) -> Answer { return text(std::to_string(request.body.size_bytes())); };
    std::vector<http::Route> routes{{"GET", "/", [](Request&) -> Answer { return text("root"); }, {}},
                                    {"POST", "/size", size, {}}};
    for (const auto& [path, handler] : handlers) {
      const bool one_at_a_time = std::find(slow_paths.begin(), slow_paths.end(), path) != slow_paths.end();
      routes.push_back({"GET", path, handler, {.one_at_a_time = one_at_a_time}});
    }
    settings.spool_directory = testing::TempDir();
    server = std::make_unique<http::HttpServer>(
        settings, routes, [this] { return std::to_string(++request_count); }, telemetry::Log(telemetry::Level::error));
  }
  Client client() const { return Client(server->port()); }
  /// A handler that waits until `barrier` is open.
  http::Handler slow() {
    return [this](Request&) -> Answer {
      barrier.wait();
      return text("slow");
    };
  }

  /// Polls until `condition` holds, so that no test depends on the speed of the machine.
  static bool eventually(const std::function<bool()>& condition) {
    const auto end = std::chrono::steady_clock::now() + patience;
    while (!condition() && std::chrono::steady_clock::now() < end) std::this_thread::sleep_for(1ms);
    return condition();
  }

  Barrier barrier;
  std::vector<std::string> slow_paths;  ///< routes whose requests are handled one at a time
  http::HttpServerSettings settings;
  std::atomic<int> request_count = 0;
  std::unique_ptr<http::HttpServer> server;
};

}  // namespace http_server_test
