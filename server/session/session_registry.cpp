#include "server/session/session_registry.hpp"

#include <sodium.h>

#include <algorithm>
#include <utility>

namespace hairnet::server {

PacketSink* SessionRegistry::open(std::shared_ptr<Connection> connection, std::int64_t now_ns) {
  const auto awaiting_hello = std::ranges::count_if(
      sessions_, [](const auto& entry) { return entry.second->state() == Session::State::awaiting_hello; });
  if (draining_ || std::cmp_greater_equal(awaiting_hello, context_->limits.session_count_max)) {
    context_->counters.sessions_refused_full.add();
    const wire::Goodbye goodbye =
        draining_ ? wire::Goodbye{wire::GoodbyeReason::server_draining, "the server stops"}
                  : wire::Goodbye{wire::GoodbyeReason::server_full, "too many connections wait for their welcome"};
    connection->send(wire::encode_packet({now_ns, goodbye}));
    connection->close(to_string(goodbye.reason));
    return nullptr;
  }
  const SessionId id = ++last_id_;
  auto session = std::make_unique<Session>(id, std::move(connection), *context_, now_ns);
  return sessions_.emplace(id, std::move(session)).first->second.get();
}

std::optional<SessionIdentity> SessionRegistry::take_over(Session& successor, SessionId id,
                                                          const wire::SessionSecret& secret, std::int64_t now_ns) {
  const auto found = sessions_.find(id);
  if (found == sessions_.end() || !found->second->is_joined() || found->second.get() == &successor) return std::nullopt;
  const wire::SessionSecret& expected = found->second->secret();
  if (sodium_memcmp(expected.data(), secret.data(), expected.size()) != 0) return std::nullopt;
  auto node = sessions_.extract(successor.id());
  SessionIdentity identity = found->second->release_identity(now_ns);
  released_.push_back(std::exchange(found->second, std::move(node.mapped())));
  return identity;
}

Session* SessionRegistry::find(SessionId id) {
  const auto found = sessions_.find(id);
  return found == sessions_.end() ? nullptr : found->second.get();
}

void SessionRegistry::flush(std::int64_t now_ns) {
  for (auto& [id, session] : sessions_) session->flush(now_ns);
}

void SessionRegistry::poll(std::int64_t now_ns) {
  released_.clear();
  std::erase_if(sessions_, [](const auto& entry) { return entry.second->state() == Session::State::closed; });
  std::size_t detached = 0, packets_waiting = 0;
  for (auto& [id, session] : sessions_) {
    session->poll(now_ns);
    detached += session->state() == Session::State::detached ? 1 : 0;
    packets_waiting += session->outbox().packet_count();
  }
  SessionGauges& gauges = context_->counters.gauges;
  gauges.clients.set(static_cast<double>(sessions_.size()));
  gauges.clients_detached.set(static_cast<double>(detached));
  gauges.packets_waiting.set(static_cast<double>(packets_waiting));
}

void SessionRegistry::drain(std::int64_t now_ns) {
  draining_ = true;
  for (auto& [id, session] : sessions_) session->drain(wire::GoodbyeReason::server_draining, "", now_ns);
}

}  // namespace hairnet::server
