#pragma once
/// Short messages between the nodes that share a database. They are hints: one may be lost, so what counts is in the
/// tables, and every receiver also looks there from time to time.
///
///   const auto subscription = wakeups.subscribe("task_available", [&](const std::string& id) { ... });
///   wakeups.publish("task_available", id);   // after the commit that made the task available

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace queue {

/// Thread-safe.
class Wakeups {
 public:
  virtual ~Wakeups() = default;

  /// Sends to all other nodes, within some milliseconds; returns at once. Equal messages that are sent together arrive
  /// once. `topic`: a word. `id`: without line breaks; both have at most 1000 bytes together.
  virtual void publish(std::string_view topic, std::string_view id) noexcept = 0;

  /// Called with the id of each message of another node, and with an empty id when messages may have been lost, such as
  /// after the connection to the database was replaced. One call at a time, from a thread of this object; must be
  /// quick, must not throw, and must neither subscribe nor end a subscription.
  using Receive = std::function<void(const std::string& id)>;
  /// The destruction of the result ends the subscription; no call is in progress then. It must end before this object.
  [[nodiscard]] virtual std::shared_ptr<void> subscribe(std::string topic, Receive receive) = 0;
};

}  // namespace queue
