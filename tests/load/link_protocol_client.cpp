#include "tests/load/link_protocol_client.hpp"

#include <cstdlib>
#include <utility>
#include <variant>

namespace hairnet::load {
namespace {

link::LinkCoreOptions core_options(ProtocolOptions& options) {
  link::LinkCoreOptions core;
  core.client_name = std::move(options.name);
  core.room = std::move(options.room);
  core.token = std::move(options.token);
  core.trace = options.seed;
  core.decode_share = options.decode_share;
  core.evaluate_learnt = options.evaluate_learnt;
  core.catalog = std::move(options.catalog);
  return core;
}

// A plan's `observe` is "all", or a number of nearest characters; 0 is an empty list, so that the client sees only its
// own.
wire::Observe observe_of(const ProtocolOptions& options) {
  const std::string& text = options.observe;
  wire::Observe observe;
  observe.error_m = static_cast<float>(1e-3 * options.hair_error_mm);
  observe.bytes_per_s = static_cast<std::uint32_t>(options.frame_bytes_per_s);
  if (text == "all") return observe;
  observe.count = static_cast<std::uint32_t>(std::strtoul(text.c_str(), nullptr, 10));
  observe.mode = observe.count == 0 ? wire::ObserveMode::list : wire::ObserveMode::nearest;
  return observe;
}

std::string_view reason_text(wire::GoodbyeReason reason) {
  return reason == wire::GoodbyeReason::none ? std::string_view() : wire::to_string(reason);
}

class LinkProtocolClient final : public ProtocolClient, private link::FrameSink {
 public:
  explicit LinkProtocolClient(ProtocolOptions options) : core_(core_options(options)) {
    core_.set_frame_sink(this);
    core_.send(observe_of(options));
    core_.start();
  }

  void offer(const EncodedGroom& groom) override { core_.offer_groom(groom.hash, groom.bytes); }
  void add_character(std::uint32_t character, const wire::GroomHash& groom, LevelIndex level) override {
    core_.send(wire::AddCharacter{character, groom, level});
  }
  void remove_character(std::uint32_t character) override { core_.send(wire::RemoveCharacter{character}); }
  void push_poses(std::vector<wire::PoseSample> poses) override { core_.push_poses(std::move(poses)); }
  void push_hands(std::vector<Hand> hands, std::int64_t captured_ns) override {
    core_.push_hands(std::move(hands), captured_ns);
  }
  void allow_touch(std::uint32_t character) override {
    core_.send(wire::SetTouch{character, TouchAudience::everyone, {}});
  }
  void take_hold(const wire::TakeHold& hold) override { core_.send(hold); }
  void let_go(const wire::LetGo& hold) override { core_.send(hold); }
  void set_props(wire::SetProps change) override { core_.send(std::move(change)); }
  void leave(std::int64_t now_ns) override { core_.leave(now_ns); }

  void poll(std::int64_t now_ns) override { core_.poll(now_ns); }
  [[nodiscard]] std::int64_t next_deadline_ns() const override { return core_.next_deadline_ns(); }
  void tell(ProtocolEvents& events, std::int64_t now_ns) override {
    for (link::Event& event : core_.take_events()) {
      if (const auto* connected = std::get_if<link::Connected>(&event))
        events.on_welcome(connected->welcome, now_ns);
      else if (const auto* reconnecting = std::get_if<link::Reconnecting>(&event))
        events.on_lost(reason_text(reconnecting->reason), now_ns);
      else if (const auto* disconnected = std::get_if<link::Disconnected>(&event))
        events.on_end(reason_text(disconnected->reason), now_ns);
      else if (const auto* status = std::get_if<wire::GroomStatus>(&event))
        events.on_groom_state(status->hash, status->state);
      else if (const auto* error = std::get_if<wire::Error>(&event))
        events.on_refusal(wire::to_string(error->reason), now_ns);
      else if (const auto* held = std::get_if<wire::Held>(&event))
        events.on_held(held->point_count, now_ns);
      else if (const auto* props = std::get_if<wire::RoomProps>(&event))
        events.on_props(*props, now_ns);
      else if (const auto* room = std::get_if<wire::RoomHands>(&event)) {
        for (const wire::RoomHands::Person& person : room->people)
          events.on_hands({person.session, core_.to_local_ns(room->sample_time_ns)}, now_ns);
      }
    }
  }

  [[nodiscard]] bool wants_connection() const override { return core_.wants_connection(); }
  [[nodiscard]] bool wants_half_close() const override { return core_.wants_half_close(); }
  [[nodiscard]] bool wants_close() const override { return core_.wants_close(); }
  void on_opening(std::int64_t now_ns) override { core_.on_opening(now_ns); }
  void on_open(std::int64_t now_ns, bool has_datagrams) override { core_.on_open(now_ns, has_datagrams); }
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t now_ns, ProtocolEvents& events) override {
    events_ = &events;
    now_ns_ = now_ns;
    core_.on_packet(packet, now_ns);
    events_ = nullptr;
  }
  void on_closed(std::int64_t now_ns) override { core_.on_closed("the connection ended", now_ns); }
  [[nodiscard]] std::vector<std::uint8_t> take_packet(std::int64_t now_ns) override {
    return core_.take_packet(now_ns);
  }
  [[nodiscard]] bool taken_may_be_lost() const override { return core_.taken_may_be_lost(); }

 private:
  void on_frame(const link::ReceivedFrame& received) override {
    const auto& [tick, sample_time_ns, frame, decoded] = received;
    FrameSeen seen;
    seen.member = frame.member;
    seen.character = decoded.character;
    seen.tick = tick;
    seen.stride = frame.step_stride;
    seen.sample_time_local_ns = core_.to_local_ns(sample_time_ns);
    seen.level = frame.level;
    seen.discontinuous = decoded.discontinuous;
    seen.asleep = frame.asleep;
    seen.undecodable = decoded.outcome == link::Members::Outcome::undecodable;
    seen.content_bytes = frame.content.size();
    seen.pose = decoded.pose;
    seen.coefficients = decoded.coefficients;
    events_->on_frame(seen, now_ns_);
  }

  link::LinkCore core_;
  // It is set only during on_packet(), for the frames of the packet.
  ProtocolEvents* events_ = nullptr;
  std::int64_t now_ns_ = 0;
};

}  // namespace

std::unique_ptr<ProtocolClient> make_link_protocol_client(ProtocolOptions options) {
  return std::make_unique<LinkProtocolClient>(std::move(options));
}

}  // namespace hairnet::load
