#include "server/http/client.h"

#include <sys/epoll.h>

#include <algorithm>
#include <utility>

namespace http {

Time Client::deadline() const {
  if (stream) return std::min(connection.deadline(), heartbeat_due);
  return is_deferred() ? std::min(connection.deadline(), pending->deferred.deadline) : connection.deadline();
}

std::uint32_t Client::events() const {
  std::uint32_t events = 0;
  if (is_waiting()) events |= EPOLLRDHUP;
  if (connection.wants_to_read()) events |= EPOLLIN;
  if (connection.wants_to_write()) events |= EPOLLOUT;
  return events;
}

void Client::start_stream(std::string text, std::shared_ptr<BodyStream> body, Time now) {
  connection.start_stream(std::move(text), now);
  stream = std::move(body);
  heartbeat_due = now + stream->heartbeat_interval;
  pending->request = {};  // a stream may last for days
}

void Client::feed_stream(Time now) {
  while (stream && connection.state() == Connection::State::streaming && !connection.wants_to_write()) {
    BodyStream::Chunk chunk = stream->take();
    if (chunk.text.empty() && !chunk.last) return;
    heartbeat_due = now + stream->heartbeat_interval;
    if (!chunk.text.empty()) connection.append(std::move(chunk.text), now);
    if (chunk.last) end_stream(now);
  }
}

void Client::send_heartbeat(Time now) {
  heartbeat_due = now + stream->heartbeat_interval;
  if (!connection.wants_to_write()) connection.append(stream->heartbeat, now);
}

void Client::end_stream(Time now) {
  stream.reset();
  if (connection.state() == Connection::State::streaming) connection.end_stream(now);
}

bool ClientTable::has_capacity(const std::string& remote) const {
  const auto same_address = per_address_.find(remote);
  const std::size_t count = same_address == per_address_.end() ? 0 : same_address->second;
  return clients_.size() < settings_.connections_max && count < settings_.connections_per_address_max;
}

Client& ClientTable::add(std::unique_ptr<Client> client) {
  ++per_address_[client->connection.remote()];
  return *(clients_[client->number] = std::move(client));
}

void ClientTable::remove(const Client& client) {
  const auto same_address = per_address_.find(client.connection.remote());
  if (--same_address->second == 0) per_address_.erase(same_address);
  clients_.erase(client.number);
}

Client* ClientTable::find(std::uint64_t number) const {
  const auto found = clients_.find(number);
  return found == clients_.end() ? nullptr : found->second.get();
}

std::vector<std::uint64_t> ClientTable::numbers() const {
  std::vector<std::uint64_t> numbers;
  numbers.reserve(clients_.size());
  for (const auto& [number, client] : clients_) numbers.push_back(number);
  return numbers;
}

}  // namespace http
