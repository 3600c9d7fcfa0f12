#include "server/session/session_registry.hpp"

#include <utility>

namespace hairnet::server {

PacketSink* SessionRegistry::open(std::shared_ptr<Connection> connection, std::int64_t now_ns) {
  if (draining_ || sessions_.size() >= context_->limits.session_count_max) {
    context_->counters.sessions_refused_full.add();
    const auto reason = draining_ ? wire::GoodbyeReason::server_draining : wire::GoodbyeReason::server_full;
    connection->send(wire::encode_packet({now_ns, wire::Goodbye{reason, ""}}));
    connection->close(to_string(reason));
    return nullptr;
  }
  const SessionId id = ++last_id_;
  auto session = std::make_unique<Session>(id, std::move(connection), *context_, now_ns);
  return sessions_.emplace(id, std::move(session)).first->second.get();
}

Session* SessionRegistry::find(SessionId id) {
  const auto found = sessions_.find(id);
  return found == sessions_.end() ? nullptr : found->second.get();
}

void SessionRegistry::flush(std::int64_t now_ns) {
  for (auto& [id, session] : sessions_) session->flush(now_ns);
}

void SessionRegistry::poll(std::int64_t now_ns) {
  std::erase_if(sessions_, [](const auto& entry) { return entry.second->state() == Session::State::closed; });
  context_->counters.gauges.clients.set(static_cast<double>(sessions_.size()));
  for (auto& [id, session] : sessions_) session->poll(now_ns);
}

void SessionRegistry::drain(std::int64_t now_ns) {
  draining_ = true;
  for (auto& [id, session] : sessions_) session->drain(wire::GoodbyeReason::server_draining, "", now_ns);
}

}  // namespace hairnet::server
