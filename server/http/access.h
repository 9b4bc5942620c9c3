#pragma once
/// Who may do what: bearer keys where there are some, this machine's users where there are none.

#include <optional>

#include "server/http/pending_request.h"
#include "server/keys/key_ring.h"

namespace http {

/// What a head alone tells against a request, before its body is read: a key that is missing or not known, or, where
/// there are no keys (`ring` null), a Host that is not this machine: a page of another name in a browser here, whose
/// name was made to lead here (DNS rebinding), may not speak with a daemon that trusts whoever reaches it.
/// Nobody needs a key for "/" and "/openapi.json".
std::optional<Problem> refusal(const RequestHead& head, const keys::KeyRing* ring);

/// The handler, for requests whose key has the scope of their method: jobs:read for GET and HEAD, jobs:write for the
/// others. Every key with jobs:read sees all jobs: a service belongs to one team. Sets Request::owner.
Handler with_access(const Handler& handler, const keys::KeyRing* ring);

}  // namespace http
