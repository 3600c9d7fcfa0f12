#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "client/link/events.hpp"
#include "client/link/link_core.hpp"
#include "core/skin/skin_distance_field.hpp"
#include "core/touch/hand.hpp"

namespace hairnet::link {

// A client's conversation with a server. A Link drives it with a thread and sockets of its own, or the caller of a
// LinkCore moves the bytes (CoreConversation). One thread.
class Conversation {
 public:
  Conversation() = default;
  Conversation(const Conversation&) = delete;
  Conversation& operator=(const Conversation&) = delete;
  virtual ~Conversation() = default;

  // The events since the last call. A caller that never polls loses the oldest frames; memory stays bounded.
  virtual std::vector<Event> poll() = 0;
  // Sends a request. Importance, grooms and poses have calls of their own.
  virtual void send(wire::ClientMessage message) = 0;
  // Poses captured at `capture_time_ns` of now_ns(); sent as one batch.
  virtual void push_poses(std::vector<wire::PoseSample> poses) = 0;
  // All hands of this client at now_ns(), which replace those before; they travel with the next poses. Empty: they are
  // gone. Asserts that they are valid (validate).
  virtual void push_hands(std::vector<Hand> hands) = 0;
  // How large members are on this screen. Sends at most four reports a second, of relevant changes only.
  virtual void report_importance(const std::vector<wire::MemberImportance>& members) = 0;
  // Offers a groom's file, and sends the bytes that the server lacks. `hash` is that of the bytes.
  virtual void offer_groom(const wire::GroomHash& hash, RequestedState::Bytes bytes) = 0;
  // Requests the groom of another client. GroomFetched follows, or an Error (groom_unavailable).
  virtual void request_groom(const wire::GroomHash& hash) = 0;
  // Says goodbye; Disconnected is the last event.
  virtual void close() = 0;
  // Returns the time of a monotonic clock.
  [[nodiscard]] virtual std::int64_t now_ns() const = 0;
  // Converts a time of the server's clock to that of now_ns(); unchanged while no server's clock is known.
  [[nodiscard]] virtual std::int64_t to_local_ns(std::int64_t server_time_ns) const = 0;
  [[nodiscard]] virtual LinkCounters counters() const = 0;
  // Returns the skin out of which drawn hair must be pushed (SkinPush). Null until the groom's basis has arrived, which
  // frames with coefficients make the link download.
  [[nodiscard]] virtual std::shared_ptr<const Skin> skin_of(const wire::GroomHash& groom) const = 0;
};

// The conversation of a LinkCore that the caller drives, which must outlive it.
class CoreConversation final : public Conversation {
 public:
  explicit CoreConversation(LinkCore& core) : core_(core) {}
  // The time must never go back.
  void set_now(std::int64_t now_ns) { now_ns_ = now_ns; }

  std::vector<Event> poll() override { return core_.take_events(); }
  void send(wire::ClientMessage message) override { core_.send(std::move(message)); }
  void push_poses(std::vector<wire::PoseSample> poses) override { core_.push_poses(std::move(poses)); }
  void push_hands(std::vector<Hand> hands) override { core_.push_hands(std::move(hands), now_ns_); }
  void report_importance(const std::vector<wire::MemberImportance>& members) override {
    core_.report_importance(members);
  }
  void offer_groom(const wire::GroomHash& hash, RequestedState::Bytes bytes) override {
    core_.offer_groom(hash, std::move(bytes));
  }
  void request_groom(const wire::GroomHash& hash) override { core_.request_groom(hash); }
  void close() override { core_.leave(now_ns_); }
  [[nodiscard]] std::int64_t now_ns() const override { return now_ns_; }
  [[nodiscard]] std::int64_t to_local_ns(std::int64_t server_time_ns) const override {
    return core_.to_local_ns(server_time_ns);
  }
  [[nodiscard]] LinkCounters counters() const override { return core_.counters(); }
  [[nodiscard]] std::shared_ptr<const Skin> skin_of(const wire::GroomHash& groom) const override {
    return core_.skin_of(groom);
  }

 private:
  LinkCore& core_;
  std::int64_t now_ns_ = 0;
};

}  // namespace hairnet::link
