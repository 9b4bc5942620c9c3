#include <arpa/inet.h>

#include <algorithm>
#include <array>

#include "server/daemon/config.h"
#include "server/support/text_values.h"

namespace whittled {
namespace {

using C = Config;
constexpr std::uint64_t mebi = 1u << 20, gibi = 1024 * mebi, tebi = 1024 * gibi;

constexpr Option number(std::string_view name, std::string_view default_text, std::uint64_t Config::*member,
                        std::uint64_t least, std::uint64_t most, std::string_view help) {
  return {name, default_text, member, {}, least, most, help};
}

/// A number that clients read as a limit.
constexpr Option limit(std::string_view name, std::string_view default_text, std::uint64_t Config::*member,
                       std::uint64_t least, std::uint64_t most, std::string_view help) {
  return {name, default_text, member, {}, least, most, help, true};
}

template <class Member>
constexpr Option text(std::string_view name, std::string_view default_text, Member member, std::string_view values,
                      std::string_view help) {
  return {name, default_text, member, values, 0, 0, help};
}

constexpr std::array table{
    text("listen", "127.0.0.1:8080", &C::listen, "ADDRESS:PORT",
         "client listener; loopback only, unless there are keys; port 0 takes a free one"),
    text("health_listen", "127.0.0.1:8081", &C::health_listen, "ADDRESS:PORT",
         "listener of /healthz, /readyz and /metrics, apart from clients so that load cannot block it"),
    text(
        "role", "all", &C::role, "all|api|worker",
        "part of this node, where several share a database: api serves clients and renders nothing, worker renders and "
        "serves only health_listen"),
    text("data", "./data", &C::data, "PATH", "directory of the database, images and uploads; created if missing"),
    text("database", "", &C::database, "URI",
         "PostgreSQL database of jobs, as postgres://user@host/name; its password belongs into PGPASSWORD or "
         "PGPASSFILE. Without it jobs are in a file of the data directory"),
    text("artifacts", "", &C::artifacts, "URI or PATH",
         "bucket of images and uploads that all nodes of --database share, as s3://bucket/prefix, or a directory that "
         "all of them mount. Without it they are in the data directory"),
    text("s3_endpoint", "", &C::s3_endpoint, "URL",
         "server of the bucket, as https://host:port; without it that of AWS in the region"),
    text("s3_region", "us-east-1", &C::s3_region, "NAME", "region of the bucket, which is part of the signatures"),
    text("s3_path_style", "off", &C::s3_path_style, "on|off",
         "the bucket is in the path of URLs, not in the name of the host; most stores other than AWS need it"),
    text("s3_credentials_file", "", &C::s3_credentials_file, "PATH",
         "file in the format of the AWS tools with the keys of the bucket, read again at each request; without it they "
         "are in AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_SESSION_TOKEN"),
    text("artifact_redirect", "off", &C::artifact_redirect, "on|off",
         "downloads of images of 1 MiB or more are redirected to the bucket, with a URL that is valid for an hour; "
         "clients must be able to reach it"),
    number("asset_cache_bytes", "17179869184", &C::asset_cache_bytes, 1, 1024 * tebi,
           "disk space for copies of the uploads of --artifacts that jobs of this node need; 16 GiB are 64 of the "
           "largest"),
    number("waiting_bytes", "4294967296", &C::waiting_bytes, 0, 1024 * tebi,
           "disk space for finished images that cannot be stored while the database or the bucket is away; when it is "
           "used up, no further jobs are started. 4 GiB are some hundred large images"),
    text("assets", "", &C::assets, "PATH",
         "directory of files that scenes may name; everyone who may submit scenes can read its content"),
    text("keys", "", &C::keys, "PATH",
         "file of API keys, written by --new-key and read again at SIGHUP; without it only this machine is served"),
    limit("asset_bytes", "256000000", &C::asset_bytes, 1, 256'000'000,
          "largest uploaded file; 256 MB is the largest image that is decoded, uncompressed"),
    number("asset_days", "30", &C::asset_days, 1, 36500,
           "days that an uploaded file is kept after its last use while no job names it; a month of work"),
    limit("uploads_bytes", "68719476736", &C::uploads_bytes, 1, 1024 * tebi,
          "size of all uploads together, then uploads get 503; 64 GiB is 256 of the largest"),
    number("spool_bytes", "2147483648", &C::spool_bytes, mebi, tebi,
           "disk space for large request bodies in transfer, then they get 503; 32 of the largest"),
    number("disk_free_bytes", "10737418240", &C::disk_free_bytes, 0, 1024 * tebi,
           "free disk space below which new jobs and uploads get 503, so that accepted jobs can end; a tenth of the "
           "disk if that is less"),
    text("webhook_secret_file", "", &C::webhook_secret_file, "PATH",
         "file of the secrets that sign webhooks (whsec_..., several during a rotation); without it none are sent"),
    text("webhook_networks", "", &C::webhook_networks, "NETWORK,...",
         "networks that webhooks may reach although they are not public, such as 10.0.0.0/8,fd00::/8; everyone who "
         "may submit scenes can send requests there"),
    number("jobs", "0", &C::jobs, 0, 64,
           "jobs that run at once; 0 is one more than threads, because small jobs are mostly sequential. If there are "
           "several, the last place is for small jobs, so that large ones do not delay them"),
    number("threads", "0", &C::threads, 0, 1024,
           "threads of a job that runs alone; several jobs share all but one each. 0 is the number of cores"),
    limit("scene_cache_bytes", "536870912", &C::scene_cache_bytes, 0, 1024 * tebi,
          "memory for geometry and textures that later jobs reuse, in addition to job_memory_bytes; 512 MiB are three "
          "million triangles or 33 Mpx, 0 keeps none. Released after a minute without jobs"),
    limit("body_bytes", "67108864", &C::body_bytes, 1024, gibi,
          "largest request body; 64 MiB is a million inline triangles"),
    limit("pixels", "67108864", &C::pixels, 1, 4 * gibi, "pixels of an image; 64 Mpx is twice 8K"),
    limit("samples_times_pixels", "17179869184", &C::samples_times_pixels, 1, 256 * tebi,
          "samples that a job may require; minutes to hours on two cores"),
    limit("objects", "4000000", &C::objects, 1, 2 * gibi, "objects of a scene; about 1 GiB when compiled"),
    limit("triangles", "40000000", &C::triangles, 1, 2 * gibi, "triangles of a scene; about 6 GiB when compiled"),
    limit("lights", "100000", &C::lights, 1, 2 * gibi, "lights of a scene; each costs a ray per hit"),
    limit("queued_jobs", "100000", &C::queued_jobs, 1, 10'000'000,
          "queued jobs, then submissions get 503; a night's batch of small scenes, about 100 MB"),
    limit("batch_jobs", "10000", &C::batch_jobs, 1, 100'000,
          "jobs of a batch, which are stored at once; ten minutes of film"),
    limit("batch_bytes", "268435456", &C::batch_bytes, 1024, 16 * gibi,
          "size of the scene and all patches of a batch, which are stored at once; 10,000 patches of 26 KiB"),
    limit("batch_values", "20000000", &C::batch_values, 1000, 1'000'000'000,
          "JSON values of all documents of a batch that are read completely, those that change materials, objects or "
          "what they name; a batch takes some seconds"),
    limit("key_queued_jobs", "100000", &C::key_queued_jobs, 1, 10'000'000,
          "queued jobs of an API key, then its submissions get 429; equal to queued_jobs for services with one key"),
    number("key_running_jobs", "0", &C::key_running_jobs, 0, 64,
           "jobs of an API key that run at once; 0 is one less than run at once in total, so that the next job of "
           "another key need not wait for the end of one"),
    limit("key_artifact_bytes", "1099511627776", &C::key_artifact_bytes, 1, 1024 * tebi,
          "size of all images of an API key, then its submissions get 429; 1 TiB is most disks"),
    limit("job_days", "90", &C::job_days, 1, 36500,
          "days after which a succeeded job loses its document and images, also if it expires later; a season of work"),
    limit("failed_job_days", "30", &C::failed_job_days, 1, 36500,
          "the same for failed and cancelled jobs; time enough to look into them"),
    number("artifact_bytes", "0", &C::artifact_bytes, 0, 1024 * tebi,
           "size of all images together, then the jobs that ended first lose theirs; 0 is half of the disk, so that "
           "images alone do not fill it"),
    limit("wall_time_s", "86400", &C::wall_time_s, 1, 31'536'000,
          "duration of one attempt of a job, then it is stopped; more than a day is a hang"),
    limit("job_memory_bytes", "17179869184", &C::job_memory_bytes, mebi, 1024 * tebi,
          "memory of a job: one with a higher estimate is refused, a running one that exceeds it is stopped; 16 GiB is "
          "twice the need of 64 Mpx"),
    limit("connections", "20000", &C::connections, 1, 1'000'000, "open connections; an idle one costs about 1 KiB"),
    limit("connections_per_address", "20000", &C::connections_per_address, 1, 1'000'000,
          "open connections of one client address; equal to connections, because all clients on loopback or behind a "
          "proxy have the same address"),
    limit("streams", "5000", &C::streams, 1, 1'000'000,
          "event streams and long polls at once; a slow reader costs up to 16 KiB"),
    number("handler_threads", "4", &C::handler_threads, 1, 64,
           "requests handled at once; waiting requests take no thread, so few suffice"),
    limit("render_wait_s", "60", &C::render_wait_s, 0, 3600,
          "seconds that POST /v1/render waits for the image before it replies 202, and requests for parts, previews or "
          "comparisons of images before 503; proxies cut at 60 s"),
    number("drain_s", "20", &C::drain_s, 0, 86'400,
           "seconds that running jobs may continue after SIGTERM before they return to the queue; with 10 s for "
           "pending requests it is within the 30 s of Kubernetes"),
    number(
        "lease_s", "30", &C::lease_s, 2, 3600,
        "seconds after which the jobs of a node that is gone run on another one; a disk or database stalls for less"),
    text("dashboard", "on", &C::dashboard, "on|off",
         "the page at / for browsers; it holds no data and reads what it shows from /v1 with the user's key"),
    text("log_level", "info", &C::log_level, "debug|info|warning|error",
         "lowest level that is logged; debug includes every read"),
};

std::string got(std::string_view text) { return ", got \"" + std::string(text) + "\""; }

bool is_ipv6(std::string_view host) { return host.find(':') != std::string_view::npos; }

bool is_address(const std::string& host) {
  in6_addr any{};
  return inet_pton(AF_INET, host.c_str(), &any) == 1 || inet_pton(AF_INET6, host.c_str(), &any) == 1;
}

// The value of `text` for the option, or the rule that it violates.

std::string parse(const Option& option, std::string_view text, std::uint64_t& value) {
  const auto parsed = support::parse_number<std::uint64_t>(text);
  if (!parsed || *parsed < option.least || *parsed > option.most) {
    return "must be a whole number " + option.range() + got(text);
  }
  value = *parsed;
  return {};
}

std::string parse(const Option& option, std::string_view text, std::string& value) {
  const std::string all = "|" + std::string(option.values) + "|", one = "|" + std::string(text) + "|";
  if (option.values.find('|') != std::string_view::npos && all.find(one) == std::string::npos) {
    return "must be one of " + option.range() + got(text);
  }
  if (text.empty() && !option.default_text.empty()) return "must not be empty";
  value = text;
  return {};
}

std::string parse(const Option& /*option*/, std::string_view text, Address& address) {
  const std::size_t colon = text.rfind(':');
  if (colon == std::string_view::npos) return "must be ADDRESS:PORT" + got(text);
  std::string host(text.substr(0, colon));
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') {
    host = host.substr(1, host.size() - 2);
  } else if (is_ipv6(host)) {
    return "an IPv6 address needs brackets: [" + host + "]";
  }
  if (host == "localhost") host = "127.0.0.1";
  const auto port = support::parse_number<std::uint64_t>(text.substr(colon + 1));
  if (!port || *port > 65535) return "the port must be 0..65535" + got(text.substr(colon + 1));
  if (!is_address(host)) return "must be a literal address such as 127.0.0.1 or [::1]" + got(host);
  address = {host, static_cast<std::uint16_t>(*port)};
  return {};
}

std::string to_text(std::uint64_t value) { return std::to_string(value); }
std::string to_text(const std::string& value) { return value; }

}  // namespace

std::string to_text(const Address& address) {
  return (is_ipv6(address.host) ? "[" + address.host + "]" : address.host) + ":" + std::to_string(address.port);
}

std::string Option::range() const {
  return values.empty() ? std::to_string(least) + ".." + std::to_string(most) : std::string(values);
}

std::string Option::text(const Config& config) const {
  return std::visit([&](auto value) { return to_text(config.*value); }, member);
}

std::string Option::assign(std::string_view text, Config& config) const {
  return std::visit([&](auto value) { return parse(*this, text, config.*value); }, member);
}

std::span<const Option> options() { return table; }

const Option* find_option(std::string_view name) {
  const auto found = std::ranges::find(table, name, &Option::name);
  return found == table.end() ? nullptr : &*found;
}

bool is_loopback(const std::string& host) {
  in_addr v4{};
  if (inet_pton(AF_INET, host.c_str(), &v4) == 1) return (ntohl(v4.s_addr) >> 24) == 127;
  in6_addr v6{};
  return inet_pton(AF_INET6, host.c_str(), &v6) == 1 && IN6_IS_ADDR_LOOPBACK(&v6);
}

}  // namespace whittled
