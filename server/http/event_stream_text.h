#pragma once
/// An event as it travels: server-sent events (HTML Living Standard, section 9.2).

#include <string>

#include "server/queue/events.h"

namespace http {

/// "id: n", "event: state", "data: {...}" and the empty line that ends it.
std::string event_text(const queue::JobEvent& event);

}  // namespace http
