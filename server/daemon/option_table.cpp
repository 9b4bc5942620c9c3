#include "server/daemon/option_table.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>
#include <charconv>

namespace whittled {
namespace {

constexpr std::array table{
    Option{"listen", "127.0.0.1:8080", Endpoint{&Config::listen},
           "where clients connect; loopback only, unless there are keys; port 0 takes a free one"},
    Option{"health_listen", "127.0.0.1:8081", Endpoint{&Config::health_listen},
           "where /healthz, /readyz and /metrics answer, apart from clients so that load cannot hide them"},
    Option{"data", "./data", Text{&Config::data},
           "the directory of the queue's database and the images; made if missing"},
    Option{
        "assets", "", Text{&Config::assets, true},
        "the directory whose files scenes may name; none unless given, for whoever may send scenes sees what is in it"},
    Option{"keys", "", Text{&Config::keys, true},
           "the file of those who may use the service, made by --new-key; none unless given, and then only this "
           "machine's users may. SIGHUP has it read again"},
    Option{"asset_bytes", "256000000", Count{&Config::asset_bytes, 1, 256'000'000},
           "largest uploaded file; 256 MB is the largest image that is taken, uncompressed, and more is not read"},
    Option{"asset_days", "30", Count{&Config::asset_days, 1, 36500},
           "how long an uploaded file stays after its last use while no job names it; a month's work comes back to it"},
    Option{"uploads_bytes", "68719476736", Count{&Config::uploads_bytes, 1, 1ull << 50},
           "most bytes of all uploaded files together, then uploads answer 503; 64 GiB is 256 of the largest"},
    Option{"spool_bytes", "2147483648", Count{&Config::spool_bytes, 1ull << 20, 1ull << 40},
           "most bytes on the disk of large bodies that are on their way in, then they answer 503; 32 of the largest"},
    Option{
        "disk_free_bytes", "10737418240", Count{&Config::disk_free_bytes, 0, 1ull << 50},
        "with less room on the disk of the data new jobs and uploads answer 503, so that what was accepted can end; a "
        "tenth of the disk where that is less"},
    Option{"webhook_secret_file", "", Text{&Config::webhook_secret_file, true},
           "holds the secret that webhooks are signed with (whsec_..., several while one is exchanged); none are sent "
           "without"},
    Option{"webhook_networks", "", Text{&Config::webhook_networks, true, "NETWORK,..."},
           "networks that webhooks may reach although they are not public, as 10.0.0.0/8,fd00::/8; none unless given, "
           "for whoever may send scenes could knock there"},
    Option{"jobs", "0", Count{&Config::jobs, 0, 64},
           "jobs traced at once; 0 is one more than threads, so that small ones, mostly not parallel, fill them too. "
           "Where "
           "there are several the last place is for small jobs, that large ones do not keep them waiting"},
    Option{"threads", "0", Count{&Config::threads, 0, 1024},
           "threads that trace a job that runs by itself; several share all but one each. 0 is as many as there are "
           "cores"},
    Option{"scene_cache_bytes", "536870912", Count{&Config::scene_cache_bytes, 0, 1ull << 50},
           "memory for the shapes and images of recent jobs together, so that frames of one scene read their meshes, "
           "build their BVH and decode their textures once; 512 MiB are three million triangles or 33 Mpx, 0 keeps "
           "none. Goes after a minute without jobs"},
    Option{"body_bytes", "67108864", Count{&Config::body_bytes, 1024, 1ull << 30},
           "largest request body; 64 MiB is a million inline triangles"},
    Option{"pixels", "67108864", Count{&Config::pixels, 1, 1ull << 32}, "largest image; 64 Mpx is 8K twice over"},
    Option{"samples_times_pixels", "17179869184", Count{&Config::samples_times_pixels, 1, 1ull << 48},
           "most samples a job may insist on; minutes to hours on two cores, more is a mistake"},
    Option{"objects", "4000000", Count{&Config::objects, 1, 1ull << 31}, "most objects; about 1 GiB while compiled"},
    Option{"triangles", "40000000", Count{&Config::triangles, 1, 1ull << 31},
           "most triangles; about 6 GiB while compiled"},
    Option{"lights", "100000", Count{&Config::lights, 1, 1ull << 31}, "most lights; each costs a ray per hit"},
    Option{"queued_jobs", "100000", Count{&Config::queued_jobs, 1, 10'000'000},
           "most jobs waiting, then submissions answer 503; small scenes of a night's batch, about 100 MB"},
    Option{"batch_jobs", "10000", Count{&Config::batch_jobs, 1, 100'000},
           "most jobs of one batch, which are stored at once; ten minutes of film"},
    Option{"batch_bytes", "268435456", Count{&Config::batch_bytes, 1024, 1ull << 34},
           "most bytes of all documents of a batch, each whole; 10,000 scenes of 26 KiB"},
    Option{"key_queued_jobs", "100000", Count{&Config::key_queued_jobs, 1, 10'000'000},
           "most jobs of one API key waiting, then its submissions answer 429; as many as all, for most have one"},
    Option{"key_artifact_bytes", "1099511627776", Count{&Config::key_artifact_bytes, 1, 1ull << 50},
           "most bytes of one API key's images, then its submissions answer 429; 1 TiB is most disks"},
    Option{"wall_time_s", "86400", Count{&Config::wall_time_s, 1, 31'536'000},
           "longest attempt of a job, then it is stopped; whatever takes more than a day hangs"},
    Option{"job_memory_bytes", "17179869184", Count{&Config::job_memory_bytes, 1ull << 20, 1ull << 50},
           "most memory of a job: one estimated to take more is refused, a running one that does is stopped; 16 GiB is "
           "twice "
           "what 64 Mpx take"},
    Option{"connections", "20000", Count{&Config::connections, 1, 1'000'000},
           "open connections; each idle one costs about 1 KiB"},
    Option{"connections_per_address", "20000", Count{&Config::connections_per_address, 1, 1'000'000},
           "of one client address; as many as all, for on loopback everyone, a proxy too, has the same"},
    Option{"streams", "5000", Count{&Config::streams, 1, 1'000'000},
           "event streams and long polls at once; one that is not read holds up to 16 KiB"},
    Option{"handler_threads", "4", Count{&Config::handler_threads, 1, 64},
           "requests handled at once; waiting ones need none, so few suffice"},
    Option{"render_wait_s", "60", Count{&Config::render_wait_s, 0, 3600},
           "how long POST /v1/render waits for its image before it answers 202; proxies cut at 60 s"},
    Option{"drain_s", "20", Count{&Config::drain_s, 0, 86400},
           "how long running jobs may take to finish after SIGTERM; then they go back to the queue. With 10 s for "
           "replies it stays within the 30 s that Kubernetes grants"},
    Option{"log_level", "info", Choice{&Config::log_level, "debug|info|warning|error"},
           "the least level written; debug tells every read too"},
};

/// Decimal digits only.
std::optional<std::uint64_t> whole_number(std::string_view text) {
  std::uint64_t value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) return std::nullopt;
  return value;
}

bool is_ipv6(std::string_view host) { return host.find(':') != std::string_view::npos; }

bool is_address(const std::string& host) {
  in6_addr any{};
  return inet_pton(AF_INET, host.c_str(), &any) == 1 || inet_pton(AF_INET6, host.c_str(), &any) == 1;
}

std::string assign_endpoint(std::string_view text, Address& address) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return "must be ADDRESS:PORT, got \"" + std::string(text) + "\"";
  std::string host(text.substr(0, colon));
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  } else if (is_ipv6(host)) {
    return "an IPv6 address needs brackets: [" + host + "]";
  }
  if (host == "localhost") host = "127.0.0.1";
  const auto port = whole_number(text.substr(colon + 1));
  if (!port || *port > 65535) return "the port must be 0..65535, got \"" + std::string(text.substr(colon + 1)) + "\"";
  if (!is_address(host)) return "must be a literal address such as 127.0.0.1 or [::1], got \"" + host + "\"";
  address = {host, static_cast<std::uint16_t>(*port)};
  return {};
}

std::string assign_count(const Count& count, std::string_view text, Config& config) {
  const auto value = whole_number(text);
  if (!value || *value < count.least || *value > count.most) {
    return "must be a whole number " + std::to_string(count.least) + ".." + std::to_string(count.most) + ", got \"" +
           std::string(text) + "\"";
  }
  config.*count.member = *value;
  return {};
}

bool is_choice(std::string_view choices, std::string_view text) {
  while (!choices.empty()) {
    const std::string_view choice = choices.substr(0, choices.find('|'));
    if (choice == text) return true;
    choices.remove_prefix(std::min(choices.size(), choice.size() + 1));
  }
  return false;
}

std::string write_address(const Address& address) {
  const std::string host = is_ipv6(address.host) ? "[" + address.host + "]" : address.host;
  return host + ":" + std::to_string(address.port);
}

}  // namespace

bool is_loopback(const std::string& host) {
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

std::span<const Option> options() { return table; }

const Option* find_option(std::string_view name) {
  const auto found =
      std::find_if(table.begin(), table.end(), [&](const Option& option) { return option.name == name; });
  return found == table.end() ? nullptr : &*found;
}

std::string assign(const Option& option, std::string_view text, Config& config) {
  if (const auto* count = std::get_if<Count>(&option.kind)) return assign_count(*count, text, config);
  if (const auto* endpoint = std::get_if<Endpoint>(&option.kind)) {
    return assign_endpoint(text, config.*endpoint->member);
  }
  if (const auto* choice = std::get_if<Choice>(&option.kind)) {
    if (!is_choice(choice->choices, text)) {
      return "must be one of " + std::string(choice->choices) + ", got \"" + std::string(text) + "\"";
    }
    config.*choice->member = text;
    return {};
  }
  const Text& path = std::get<Text>(option.kind);
  if (text.empty() && !path.may_be_empty) return "must not be empty";
  config.*path.member = text;
  return {};
}

std::string text_of(const Option& option, const Config& config) {
  if (const auto* count = std::get_if<Count>(&option.kind)) return std::to_string(config.*count->member);
  if (const auto* endpoint = std::get_if<Endpoint>(&option.kind)) return write_address(config.*endpoint->member);
  if (const auto* choice = std::get_if<Choice>(&option.kind)) return config.*choice->member;
  return config.*std::get<Text>(option.kind).member;
}

std::string range_of(const Option& option) {
  if (const auto* count = std::get_if<Count>(&option.kind)) {
    return std::to_string(count->least) + ".." + std::to_string(count->most);
  }
  if (std::holds_alternative<Endpoint>(option.kind)) return "ADDRESS:PORT";
  if (const auto* choice = std::get_if<Choice>(&option.kind)) return std::string(choice->choices);
  return std::string(std::get<Text>(option.kind).range);
}

}  // namespace whittled
