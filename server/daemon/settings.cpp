#include "server/daemon/settings.h"

#include <fstream>
#include <stdexcept>

#include "api/asset_requests.h"
#include "server/http/access.h"
#include "server/http/handlers/routes.h"

api::Limits document_limits(const whittled::Config& config) {
  api::Limits limits;
  limits.document.bytes = config.body_bytes;
  limits.scene.pixels = config.pixels;
  limits.scene.samples_times_pixels = config.samples_times_pixels;
  limits.scene.objects = config.objects;
  limits.scene.triangles = config.triangles;
  limits.scene.lights = static_cast<std::uint32_t>(config.lights);
  if (!config.assets.empty()) limits.files = api::Files::below_a_directory;
  limits.uploads = true;
  limits.webhooks = !config.webhook_secret_file.empty();
  return limits;
}

http::HttpServerSettings gate_settings(const whittled::Config& config, const std::string& spool_directory,
                                       const keys::KeyRing* ring) {
  http::HttpServerSettings settings;
  settings.host = config.listen.host;
  settings.port = config.listen.port;
  settings.connections_max = config.connections;
  settings.connections_per_address_max = config.connections_per_address;
  settings.handler_threads = config.handler_threads;
  settings.head.body_bytes = config.body_bytes;
  settings.head_filter = [ring](const http::RequestHead& head) { return http::refusal(head, ring); };
  settings.head.asset_bytes = config.asset_bytes;
  settings.spool_directory = spool_directory;
  settings.spool_bytes = config.spool_bytes;
  return settings;
}

webhooks::WebhookSettings webhook_settings(const whittled::Config& config) {
  std::ifstream file(config.webhook_secret_file, std::ios::binary);
  std::string text(4096, '\0');  // of more secrets than anyone exchanges at once
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  text.resize(static_cast<std::size_t>(file.gcount()));
  if (!file.is_open() || file.bad()) throw std::runtime_error("cannot read " + config.webhook_secret_file);
  auto secrets = webhooks::read_secrets(text);
  if (!secrets) throw std::runtime_error(config.webhook_secret_file + ": " + secrets.error());
  webhooks::WebhookSettings settings;
  settings.secrets = *std::move(secrets);
  return settings;
}

webhooks::SenderSettings sender_settings(const whittled::Config& config) {
  auto networks = webhooks::Networks::parse(config.webhook_networks);
  if (!networks) throw std::runtime_error(networks.error());
  webhooks::SenderSettings settings;
  settings.networks = *std::move(networks);
  return settings;
}

std::vector<whittled::ConfigError> validate_webhooks(const whittled::Config& config) {
  std::vector<whittled::ConfigError> errors;
  try {
    if (!config.webhook_secret_file.empty()) (void)webhook_settings(config);
  } catch (const std::runtime_error& failure) {
    errors.push_back({"--webhook-secret-file", failure.what()});
  }
  try {
    (void)sender_settings(config);
  } catch (const std::runtime_error& failure) {
    errors.push_back({"--webhook-networks", failure.what()});
  }
  return errors;
}

http::HttpServerSettings health_gate_settings(const whittled::Config& config, const std::string& spool_directory) {
  http::HttpServerSettings settings;
  settings.host = config.health_listen.host;
  settings.port = config.health_listen.port;
  settings.connections_max = settings.connections_per_address_max = 256;
  settings.handler_threads = 1;
  settings.waiting_max = 64;
  if (config.keys.empty())
    settings.head_filter = [](const http::RequestHead& head) { return http::refusal(head, nullptr); };
  settings.head.body_bytes = settings.head.asset_bytes = 0;
  settings.spool_directory = spool_directory;
  return settings;
}

std::vector<std::pair<std::string, std::uint64_t>> effective_limits(const whittled::Config& config,
                                                                    const api::Limits& limits,
                                                                    const http::HeadLimits& head) {
  return {{"body_bytes", config.body_bytes},
          {"asset_bytes", config.asset_bytes},
          {"uploads_bytes", config.uploads_bytes},
          {"asset_hashes", api::asset_hashes_max},
          {"json_depth", limits.document.depth},
          {"json_values", limits.document.values},
          {"json_string_bytes", limits.document.string_bytes},
          {"json_key_bytes", limits.document.key_bytes},
          {"json_number_chars", limits.document.number_chars},
          {"name_bytes", limits.document.name_bytes},
          {"labels", limits.document.labels},
          {"pixels", limits.scene.pixels},
          {"image_side", limits.scene.image_side},
          {"samples_times_pixels", limits.scene.samples_times_pixels},
          {"max_depth", limits.scene.max_depth},
          {"objects", limits.scene.objects},
          {"triangles", limits.scene.triangles},
          {"lights", limits.scene.lights},
          {"materials", limits.scene.materials},
          {"textures", limits.scene.textures},
          {"queued_jobs", config.queued_jobs},
          {"batch_jobs", config.batch_jobs},
          {"batch_bytes", config.batch_bytes},
          {"key_queued_jobs", config.key_queued_jobs},
          {"key_artifact_bytes", config.key_artifact_bytes},
          {"wall_time_s", config.wall_time_s},
          {"job_memory_bytes", config.job_memory_bytes},
          {"scene_cache_bytes", config.scene_cache_bytes},
          {"connections", config.connections},
          {"connections_per_address", config.connections_per_address},
          {"streams", config.streams},
          {"wait_s", static_cast<std::uint64_t>(http::wait_max.count())},
          {"render_wait_s", config.render_wait_s},
          {"request_line_bytes", head.request_line_bytes},
          {"target_bytes", head.target_bytes},
          {"header_count", head.header_count},
          {"header_bytes", head.header_bytes}};
}
