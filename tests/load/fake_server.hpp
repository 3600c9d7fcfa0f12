#pragma once

#include <algorithm>
#include <array>
#include <memory>
#include <utility>
#include <vector>

#include "tests/load/client_connection.hpp"
#include "tests/load/protocol_client.hpp"
#include "tests/load/virtual_client.hpp"

namespace hairnet::load {

// A server in simulated time. At each tick it sends each client one packet, which stands for a frame of every character
// of that client, sampled kPoseDelay_ns before the tick. The first packet on a connection stands for the welcome. A
// stalled server sends nothing, and skips the ticks that it has missed.
class FakeServer final : public Connector {
 public:
  // The tick is that of 30 Hz. The delay is the default of the server's pose_delay_ms.
  static constexpr std::int64_t kTick_ns = 33'333'333, kPoseDelay_ns = 25'000'000;

  std::unique_ptr<ClientConnection> connect(ConnectionEvents& events, std::uint32_t host) override {
    auto line = std::make_unique<FakeClientConnection>(*this, events);
    lines_.push_back(line.get());
    ++connect_count;
    hosts.push_back(host);
    return line;
  }
  std::unique_ptr<ProtocolClient> make_protocol_client() { return std::make_unique<FakeProtocolClient>(*this); }

  // Does what is due by now: opens connections and sends the frames of ticks.
  void pump(std::int64_t now_ns) {
    now_ns_ = now_ns;
    const std::vector<FakeClientConnection*> lines = lines_;
    for (FakeClientConnection* line : lines)
      if (is_alive(line) && !line->open) {
        line->open = true;
        line->events->on_open(now_ns);
      }
    if (stalled) return;
    while (next_tick_ns_ <= now_ns) {
      // A stalled server skips the ticks that it missed.
      if (next_tick_ns_ + kTick_ns <= now_ns) {
        next_tick_ns_ += kTick_ns;
        ++tick_;
        continue;
      }
      announced_ = std::exchange(pending_, {});
      // The bytes mean nothing: FakeProtocolClient makes the events of a tick itself.
      const std::uint8_t tick_packet[16] = {};
      for (FakeClientConnection* line : lines)
        if (is_alive(line) && line->open) line->events->on_packet(tick_packet, now_ns);
      next_tick_ns_ += kTick_ns;
      ++tick_;
    }
  }
  void drop_all(std::int64_t now_ns) {
    const std::vector<FakeClientConnection*> lines = lines_;
    for (FakeClientConnection* line : lines)
      if (is_alive(line)) line->events->on_closed("reset", now_ns);
  }

  bool stalled = false;
  std::size_t connect_count = 0;
  // The hosts that clients connected from, in the order of their connections.
  std::vector<std::uint32_t> hosts;
  // The sessions that have pushed hands, and the kinds of requests about holds: take, drop, pin, unpin.
  std::vector<std::uint64_t> with_hands;
  std::vector<std::string> holds;
  // Whether clients may set props, and the changes that they have asked for.
  bool may_set_props = true;
  std::vector<wire::SetProps> props_set;
  // For each pose: when it was captured, and when it was pushed.
  std::vector<std::pair<std::int64_t, std::int64_t>> poses;

 private:
  struct FakeClientConnection final : ClientConnection {
    FakeClientConnection(FakeServer& s, ConnectionEvents& e) : server(&s), events(&e) {}
    ~FakeClientConnection() override { std::erase(server->lines_, this); }
    void send(std::span<const std::uint8_t>) override {}
    void close_sending() override {}
    void limit_reading(std::size_t) override {}
    [[nodiscard]] std::size_t unsent_bytes() const override { return 0; }
    FakeServer* server;
    ConnectionEvents* events;
    bool open = false;
  };

  // Stands for the protocol of a client. It connects again 600 ms after it lost its connection.
  struct FakeProtocolClient final : ProtocolClient {
    explicit FakeProtocolClient(FakeServer& s) : server(&s), session(++s.session_count_) {}
    void offer(const EncodedGroom&) override {}
    void add_character(std::uint32_t character, const wire::GroomHash&, LevelIndex) override {
      characters.push_back(character);
    }
    void remove_character(std::uint32_t character) override { std::erase(characters, character); }
    void push_poses(std::vector<wire::PoseSample> samples) override {
      for (const wire::PoseSample& sample : samples)
        server->poses.emplace_back(sample.capture_time_ns, server->now_ns_);
    }
    void push_hands(std::vector<Hand> hands, std::int64_t) override {
      if (validate(hands).empty() && std::ranges::count(server->with_hands, session) == 0)
        server->with_hands.push_back(session);
    }
    void allow_touch(std::uint32_t) override {}
    void take_hold(const wire::TakeHold& hold) override {
      if (wire::validate(hold).empty()) server->holds.emplace_back("take");
      held = 20;
    }
    void let_go(const wire::LetGo& hold) override {
      server->holds.emplace_back(std::array{"drop", "pin", "unpin"}[static_cast<std::size_t>(hold.release)]);
    }
    void set_props(wire::SetProps change) override { server->change_props(std::move(change)); }
    void leave(std::int64_t) override { state = State::ended; }
    void poll(std::int64_t) override {}
    [[nodiscard]] std::int64_t next_deadline_ns() const override { return connected ? kNever_ns : retry_ns; }
    void tell(ProtocolEvents& events, std::int64_t now_ns) override {
      if (std::exchange(announced, state) == state) return;
      wire::Welcome welcome;
      welcome.session = session;
      welcome.tick_rate_hz = 30;
      welcome.resumed = true;
      welcome.may_set_props = server->may_set_props;
      if (state == State::welcomed) events.on_welcome(welcome, now_ns);
      if (state == State::lost) events.on_lost("", now_ns);
      if (state == State::ended) events.on_end("", now_ns);
    }
    [[nodiscard]] bool wants_connection() const override {
      return !connected && state != State::ended && server->now_ns_ >= retry_ns;
    }
    [[nodiscard]] bool wants_half_close() const override { return false; }
    [[nodiscard]] bool wants_close() const override { return connected && state == State::ended; }
    void on_opening(std::int64_t) override { connected = true; }
    void on_open(std::int64_t, bool) override {}
    void on_packet(std::span<const std::uint8_t>, std::int64_t now_ns, ProtocolEvents& events) override {
      if (state != State::welcomed) {
        state = State::welcomed;
        return;
      }
      FrameSeen frame;
      frame.tick = server->tick_;
      frame.sample_time_local_ns = server->next_tick_ns_ - kPoseDelay_ns;
      frame.level = LevelIndex::low;
      frame.content_bytes = 600;
      for (const std::uint32_t character : characters) {
        frame.character = character;
        events.on_frame(frame, now_ns);
      }
      if (!server->announced_.props.empty() || !server->announced_.removed.empty())
        events.on_props(server->announced_, now_ns);
      if (held > 0) events.on_held(std::exchange(held, 0), now_ns);
      for (const std::uint64_t other : server->with_hands) {
        if (other == session) continue;
        events.on_hands({other, frame.sample_time_local_ns}, now_ns);
        // Members have the numbers of their sessions here.
        static const Pose kUpright;
        frame.member = static_cast<std::uint32_t>(other);
        frame.character = 0;
        frame.pose = &kUpright;
        events.on_frame(frame, now_ns);
      }
    }
    void on_closed(std::int64_t now_ns) override {
      connected = false;
      retry_ns = now_ns + 600'000'000;
      if (state != State::ended) state = State::lost;
    }
    std::vector<std::uint8_t> take_packet(std::int64_t) override { return {}; }

    enum class State : std::uint8_t { away, welcomed, lost, ended };
    FakeServer* server;
    std::uint64_t session;
    std::uint32_t held = 0;
    State state = State::away, announced = State::away;
    bool connected = false;
    std::int64_t retry_ns = 0;
    std::vector<std::uint32_t> characters;
  };

  [[nodiscard]] bool is_alive(const FakeClientConnection* line) const {
    return std::find(lines_.begin(), lines_.end(), line) != lines_.end();
  }

  // Everyone is in one room. The newest change of each prop is announced at the next tick, to the sender too.
  void change_props(wire::SetProps change) {
    const auto replace = [this](std::uint8_t number) {
      std::erase_if(pending_.props, [&](const wire::Prop& prop) { return prop.number == number; });
      std::erase(pending_.removed, number);
    };
    for (const std::uint8_t number : change.removed) {
      replace(number);
      pending_.removed.push_back(number);
    }
    for (const wire::Prop& prop : change.props) {
      replace(prop.number);
      pending_.props.push_back(prop);
    }
    props_set.push_back(std::move(change));
  }

  std::vector<FakeClientConnection*> lines_;
  // The changes of props since the last tick, and those that this tick announces.
  wire::RoomProps pending_, announced_;
  std::uint64_t session_count_ = 0;
  std::int64_t next_tick_ns_ = 0;
  std::uint64_t tick_ = 100;
  std::int64_t now_ns_ = 0;
};

}  // namespace hairnet::load
