#pragma once
/// Lets the queue, its stores and the worker's supervisor write into the daemon's log.

#include "server/queue/event_log.h"
#include "server/telemetry/json_log.h"

namespace telemetry {

/// The function shares `log`'s sink; values are written as text.
queue::Log queue_log(const Log& log);

}  // namespace telemetry
