#pragma once
/// The configuration in the words of each part of the daemon.

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "api/document.h"
#include "server/daemon/config.h"
#include "server/http/http_server.h"
#include "server/keys/key_ring.h"
#include "server/webhooks/webhooks.h"

api::Limits document_limits(const whittled::Config& config);

/// `ring`: null where there are no keys.
http::HttpServerSettings gate_settings(const whittled::Config& config, const std::string& spool_directory,
                                       const keys::KeyRing* ring);
/// One thread suffices for three short routes, and a probe needs no body.
http::HttpServerSettings health_gate_settings(const whittled::Config& config, const std::string& spool_directory);

/// Both throw with the reason when the options do not make sense together with what is in the file.
webhooks::WebhookSettings webhook_settings(const whittled::Config& config);
webhooks::SenderSettings sender_settings(const whittled::Config& config);
/// What either of them would throw, by option.
std::vector<whittled::ConfigError> validate_webhooks(const whittled::Config& config);

/// Everything that GET /v1/version tells as a limit.
std::vector<std::pair<std::string, std::uint64_t>> effective_limits(const whittled::Config& config,
                                                                    const api::Limits& limits,
                                                                    const http::HeadLimits& head);
