#pragma once
/// Messages between nodes by NOTIFY. Private to this directory.

#include <memory>
#include <string>

#include "server/queue/wakeups.h"

namespace storage::postgres {

/// One connection that listens and sends. It must not pass a proxy that pools transactions. A NOTIFY makes transactions
/// commit one after the other, so messages are never part of the transactions of the stores: they are sent after these,
/// those of some milliseconds together, in one that writes nothing.
std::unique_ptr<queue::Wakeups> make_wakeups(const std::string& dsn);

}  // namespace storage::postgres
