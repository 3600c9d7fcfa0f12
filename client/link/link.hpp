#pragma once

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/link/address.hpp"
#include "client/link/conversation.hpp"
#include "client/link/events.hpp"
#include "client/link/link_core.hpp"
#include "core/result.hpp"

namespace hairnet::link {

struct LinkOptions {
  Address server;
  TlsOptions tls;
  TransportChoice transport = TransportChoice::automatic;
  // With `automatic`: after an attempt at WebTransport that was blocked, the link waits this long, tries again, and
  // moves the session to it.
  std::chrono::nanoseconds blocked_for = std::chrono::seconds(60);
  LinkCoreOptions core;
};

// A client's conversation with a server over a socket: a LinkCore, and a thread that drives it. Make all calls from one
// thread. Only connect() blocks.
class Link final : public Conversation {
 public:
  explicit Link(LinkOptions options);
  // Sends a goodbye, and waits up to 0.6 s until it is sent.
  ~Link() override;
  // Resolves the name, connects, and exchanges hello and welcome, within the time-out. Call it once: a link that has
  // ended cannot be used again.
  Result<wire::Welcome> connect();
  void send(wire::ClientMessage message) override;
  void report_importance(const std::vector<wire::MemberImportance>& members) override;
  void offer_groom(const wire::GroomHash& hash, RequestedState::Bytes bytes) override;
  void request_groom(const wire::GroomHash& hash) override;
  void push_poses(std::vector<wire::PoseSample> poses) override;
  void push_hands(std::vector<Hand> hands) override;
  std::vector<Event> poll() override;
  [[nodiscard]] std::int64_t now_ns() const override;
  [[nodiscard]] std::int64_t to_local_ns(std::int64_t server_time_ns) const override;
  [[nodiscard]] LinkCounters counters() const override;
  // How the open connection's packets travel: "webtransport", or the scheme of an address. Empty: none is open.
  [[nodiscard]] std::string transport() const;
  // One line that says why packets do not travel by WebTransport, which was tried before. Empty: they do, or
  // WebTransport was not tried.
  [[nodiscard]] std::string fallback_reason() const;
  [[nodiscard]] std::shared_ptr<const Skin> skin_of(const wire::GroomHash& groom) const override;
  void close() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet::link
