#include "server/http/router.h"

#include <httplib.h>

#include <algorithm>
#include <cstring>
#include <map>
#include <set>
#include <utility>

namespace http {
namespace {

// The limits below are those of the installed version of cpp-httplib; review them when it changes.
static_assert(std::string_view(CPPHTTPLIB_VERSION) == "0.11.4");

/// Gives the library its request from memory and drops what it writes.
class MemoryStream final : public httplib::Stream {
 public:
  explicit MemoryStream(std::string input) : input_(std::move(input)) {}
  bool is_readable() const override { return true; }
  bool is_writable() const override { return true; }
  ssize_t read(char* into, std::size_t size) override {
    size = std::min(size, input_.size() - at_);
    std::memcpy(into, input_.data() + at_, size);
    at_ += size;
    return static_cast<ssize_t>(size);
  }
  ssize_t write(const char*, std::size_t size) override { return static_cast<ssize_t>(size); }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return -1; }

 private:
  std::string input_;
  std::size_t at_ = 0;
};

/// "/v1/jobs/{id}/cancel" as the regular expression the library wants. The library decodes percent escapes first.
std::string regex_of(const std::string& pattern) {
  std::string regex;
  for (std::size_t i = 0; i < pattern.size(); ++i) {
    if (pattern[i] == '{') {
      regex += "([^/]+)";
      i = pattern.find('}', i);
    } else {
      if (pattern[i] == '.') regex += '\\';
      regex += pattern[i];
    }
  }
  return regex;
}

/// Unknown query parameters are refused, as unknown fields of a document are: a typo must not be passed over.
Handler with_checked_query(const Route& route) {
  return [route](Request& request) -> Answer {
    std::string unknown;
    for (const auto& [name, value] : request.head.query) {
      const bool known = std::find(route.query.begin(), route.query.end(), name) != route.query.end();
      if (!known) unknown += (unknown.empty() ? "\"" : ", \"") + name + '"';
    }
    if (unknown.empty()) return route.handler(request);
    std::string known;
    for (const std::string& name : route.query) known += (known.empty() ? "" : ", ") + name;
    const std::string detail = "not known here: " + unknown + "; known: " + (known.empty() ? "none" : known);
    return problem_reply({Failure::bad_query, detail, {}}, request.id);
  };
}

template <class Call>
Answer guarded(const Call& call, const Request& request, const telemetry::Log& log) {
  try {
    return call();
  } catch (const queue::StoreFailure& failure) {
    log.write(telemetry::Level::error, "store_failure",
              {{"request_id", request.id}, {"detail", std::string_view(failure.what())}});
    return problem_reply(problem_of(failure), request.id);
  } catch (const std::exception& exception) {
    log.write(telemetry::Level::error, "handler_failure",
              {{"request_id", request.id}, {"detail", std::string_view(exception.what())}});
  } catch (...) {
    log.write(telemetry::Level::error, "handler_failure", {{"request_id", request.id}});
  }
  return problem_reply({Failure::internal, "the log has more under this request_id", {}}, request.id);
}

}  // namespace

class Router::Library final : public httplib::Server {
 public:
  explicit Library(const std::vector<Route>& routes) {
    std::map<std::string, std::set<std::string>> methods;  // by pattern
    for (const Route& route : routes) {
      methods[route.pattern].insert(route.method);
      add(route.method, route.pattern, with_checked_query(route), route.pattern);
    }
    for (const auto& [pattern, allowed] : methods) refuse_others(pattern, allowed);
  }

  Answer answer(Request& request) {
    request_ = &request;
    answer_ = problem_reply({Failure::not_found, "there is nothing at " + request.head.path, {}}, request.id);
    MemoryStream stream(request.head.method + ' ' + request.head.path + " HTTP/1.1\r\nContent-Length: 0\r\n\r\n");
    bool closed = false;
    process_request(stream, false, closed, nullptr);
    request_ = nullptr;
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
    return std::move(answer_);
  }

 private:
  void add(const std::string& method, const std::string& pattern, const http::Handler& handler,
           const std::string& route) {
    // No exception passes through the library.
    const auto call = [this, handler, route](const httplib::Request& matched, httplib::Response&) noexcept {
      try {
        request_->path.assign(std::next(matched.matches.begin()), matched.matches.end());
        request_->route = route;
        answer_ = handler(*request_);
      } catch (...) {
        failure_ = std::current_exception();
      }
    };
    const std::string regex = regex_of(pattern);
    if (method == "GET") Get(regex, call);
    if (method == "POST") Post(regex, call);
    if (method == "PUT") Put(regex, call);
    if (method == "PATCH") Patch(regex, call);
    if (method == "DELETE") Delete(regex, call);
    if (method == "OPTIONS") Options(regex, call);
  }

  void refuse_others(const std::string& pattern, const std::set<std::string>& allowed) {
    std::string list;
    for (const std::string& method : allowed) {
      list += (list.empty() ? "" : ", ") + method + (method == "GET" ? ", HEAD" : "");
    }
    const http::Handler refuse = [list](Request& request) -> Answer {
      const std::string detail =
          request.head.method + " is not allowed here; " + list + (list.size() > 6 ? " are" : " is");
      Reply reply = problem_reply({Failure::method_not_allowed, detail, {}}, request.id);
      reply.headers.emplace_back("Allow", list);
      return reply;
    };
    for (const char* method : {"GET", "POST", "PUT", "PATCH", "DELETE", "OPTIONS"}) {
      if (!allowed.contains(method)) add(method, pattern, refuse, pattern);
    }
  }

  Request* request_ = nullptr;
  Answer answer_;
  std::exception_ptr failure_;
};

Router::Router(const std::vector<Route>& routes, const telemetry::Log& log)
    : library_(std::make_unique<Library>(routes)), log_(log) {}
Router::~Router() = default;

Answer Router::answer(Request& request) {
  return guarded([&] { return library_->answer(request); }, request, log_);
}

std::optional<Reply> Router::start_watch(const DeferredReply& parked, const std::function<void()>& wake,
                                         std::function<void()>& stop_watching, const Request& request) {
  Answer started = guarded(
      [&]() -> Answer {
        stop_watching = parked.watch(wake);
        return DeferredReply{};
      },
      request, log_);
  if (std::holds_alternative<DeferredReply>(started)) return std::nullopt;
  return std::get<Reply>(std::move(started));
}

Answer Router::resume(const DeferredReply& parked, bool timed_out, const Request& request) {
  return guarded([&] { return parked.resume(timed_out); }, request, log_);
}

}  // namespace http
