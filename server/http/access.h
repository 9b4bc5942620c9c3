#pragma once
/// Authentication and authorisation: API keys if there are any, otherwise local clients only.

#include <optional>

#include "server/http/http_messages.h"
#include "server/keys/key_ring.h"

namespace http {

/// Checks a head before its body is read. With keys (`ring`): the key must be valid, except for "/", "/docs" and
/// "/openapi.json". Without keys (null): Host must be this machine, because a web page in a local browser could use a
/// name of its own that resolves to this machine (DNS rebinding).
std::optional<Problem> refusal(const RequestHead& head, const keys::KeyRing* ring);

/// Wraps a handler: the key must have the scope of the method, jobs:read for GET and HEAD, jobs:write for the others.
/// Every key with jobs:read can read all jobs, as a service belongs to one team. Sets Request::owner.
Handler with_access(const Handler& handler, const keys::KeyRing* ring);

}  // namespace http
