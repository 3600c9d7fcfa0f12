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
#include "core/groom/groom.hpp"
#include "core/result.hpp"

namespace hairnet::link {

struct LinkOptions {
  Address server;
  TlsOptions tls;
  TransportChoice transport = TransportChoice::automatic;
  // `automatic`: so long after a try that was blocked, WebTransport is tried again, and a session moves up to it.
  std::chrono::nanoseconds blocked_for = std::chrono::seconds(60);
  LinkCoreOptions core;
};

// A client's conversation with a server over a socket: a LinkCore, and a thread that drives it. Make all calls from one
// thread. Only connect() blocks.
class Link final : public Conversation {
 public:
  explicit Link(LinkOptions options);
  ~Link() override;  // sends a goodbye, and waits a moment until it is sent
  // Resolves the name, connects, and exchanges hello and welcome, within the time-out. Call it once: a link that has
  // ended cannot be used again.
  Result<wire::Welcome> connect();
  // Offers the groom, and sends the bytes that the server lacks. The same groom twice is one upload. `learnt`: hair
  // that was learnt of it, which spares the server that; null: none.
  wire::GroomHash upload(const Groom& groom, const LearntHair* learnt = nullptr);
  // The calls from add_character to moderate are shorthands for it.
  void send(wire::ClientMessage message) override;
  // `tag`: any bytes, at most wire::kTagBytesMax, by convention the person's name in UTF-8. Everyone in the room gets
  // tag and appearance (MemberJoined), so that an application knows whose character a member is and how to draw it.
  void add_character(std::uint32_t character, const wire::GroomHash& groom, LevelIndex level, std::string tag = {},
                     std::optional<wire::Appearance> appearance = {}) {
    send(wire::AddCharacter{character, groom, level, {}, std::move(tag), appearance});
  }
  // Replaces both; its hair continues. Others learn of it at most four times a second (MemberChanged).
  void set_appearance(std::uint32_t character, std::string tag, std::optional<wire::Appearance> appearance) {
    send(wire::SetAppearance{character, std::move(tag), appearance});
  }
  void remove_character(std::uint32_t character) { send(wire::RemoveCharacter{character}); }
  void set_level(std::uint32_t character, LevelIndex level) { send(wire::SetLevel{character, level}); }
  // Refused with an Error when out of range.
  void set_material(std::uint32_t character, const MaterialScale& scale) { send(wire::SetMaterial{character, scale}); }
  void set_wind(const Wind& wind) { send(wire::SetWind{wind}); }  // of the whole room; the last client to set it wins
  void observe(const wire::Observe& wanted) { send(wanted); }     // of others; every frame of all at first
  // Refused with an Error unless the link's token says `moderate`. Sent once, and not again over a new connection.
  void moderate(const wire::Moderate& action) { send(action); }
  void report_importance(const std::vector<wire::MemberImportance>& members) override;
  void offer_groom(const wire::GroomHash& hash, RequestedState::Bytes bytes) override;
  void request_groom(const wire::GroomHash& hash) override;
  void push_poses(std::vector<wire::PoseSample> poses) override;
  std::vector<Event> poll() override;
  [[nodiscard]] std::int64_t now_ns() const override;
  [[nodiscard]] std::int64_t to_local_ns(std::int64_t server_time_ns) const override;
  [[nodiscard]] LinkCounters counters() const override;
  // How the open connection's packets travel: "webtransport", or the scheme of an address. Empty: none is open.
  [[nodiscard]] std::string transport() const;
  // Why these packets do not travel by WebTransport, which was tried before, in one line. Empty: they do, or it was not
  // tried.
  [[nodiscard]] std::string fallback_reason() const;
  [[nodiscard]] std::shared_ptr<const Skin> skin_of(const wire::GroomHash& groom) const override;
  void close() override;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace hairnet::link
