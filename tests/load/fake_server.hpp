#pragma once

#include <deque>
#include <memory>
#include <utility>
#include <vector>

#include "tests/load/line.hpp"
#include "tests/load/peer.hpp"

namespace hairnet::load {

// A server in the test's own time: welcomes at once, and answers every tick with a frame of each character, sampled
// `pose_delay_ns` before; unless it stalls, when nothing comes of it.
class FakeServer final : public Dialler {
 public:
  static constexpr std::int64_t kTick_ns = 33'333'333, kPoseDelay_ns = 25'000'000;

  std::unique_ptr<Line> dial(LineEvents& events) override {
    auto line = std::make_unique<FakeLine>(*this, events);
    lines_.push_back(line.get());
    ++dialled;
    return line;
  }
  std::unique_ptr<Peer> make_peer() { return std::make_unique<FakePeer>(*this); }

  // What has become due by now: connections open, ticks are answered.
  void pump(std::int64_t now_ns) {
    const std::vector<FakeLine*> lines = lines_;
    for (FakeLine* line : lines)
      if (is_alive(line) && !line->open) {
        line->open = true;
        line->events->on_open(now_ns);
      }
    if (stalled) return;
    while (next_tick_ns_ <= now_ns) {
      // A server that was stalled skips what it missed.
      if (next_tick_ns_ + kTick_ns <= now_ns) {
        next_tick_ns_ += kTick_ns;
        ++tick_;
        continue;
      }
      const std::uint8_t tick_packet[16] = {};
      for (FakeLine* line : lines)
        if (is_alive(line) && line->open) line->events->on_packet(tick_packet, now_ns);
      next_tick_ns_ += kTick_ns;
      ++tick_;
    }
  }
  void drop_all(std::int64_t now_ns) {
    const std::vector<FakeLine*> lines = lines_;
    for (FakeLine* line : lines)
      if (is_alive(line)) line->events->on_closed("reset", now_ns);
  }

  bool stalled = false;
  std::size_t dialled = 0;
  std::vector<std::pair<std::int64_t, std::int64_t>> poses;  // captured, pushed

 private:
  struct FakeLine final : Line {
    FakeLine(FakeServer& s, LineEvents& e) : server(&s), events(&e) {}
    ~FakeLine() override { std::erase(server->lines_, this); }
    void send(std::span<const std::uint8_t>) override {}
    void close_sending() override {}
    void limit_reading(std::size_t) override {}
    [[nodiscard]] std::size_t unsent_bytes() const override { return 0; }
    FakeServer* server;
    LineEvents* events;
    bool open = false;
  };

  struct FakePeer final : Peer {
    explicit FakePeer(FakeServer& s) : server(&s) {}
    void open(std::int64_t) override {}
    bool on_packet(std::span<const std::uint8_t>, std::int64_t now_ns, PeerEvents& events) override {
      if (!std::exchange(welcomed, true)) {
        wire::Welcome welcome;
        welcome.tick_rate_hz = 30;
        events.on_welcome(welcome, now_ns);
        return true;
      }
      FrameSeen frame;
      frame.tick = server->tick_;
      frame.sample_time_local_ns = server->next_tick_ns_ - kPoseDelay_ns;
      frame.level = LevelIndex::low;
      frame.node_bytes = 600;
      const std::vector<std::uint32_t> all = characters;
      for (const std::uint32_t character : all) {
        frame.character = character;
        events.on_frame(frame, kPoseDelay_ns, now_ns);
      }
      return true;
    }
    void offer(const EncodedGroom&, std::int64_t) override {}
    void add_character(std::uint32_t character, const wire::GroomHash&, LevelIndex, std::int64_t) override {
      characters.push_back(character);
    }
    void remove_character(std::uint32_t character, std::int64_t) override { std::erase(characters, character); }
    void push_poses(std::vector<wire::PoseSample> samples, std::int64_t now_ns) override {
      for (const wire::PoseSample& sample : samples) server->poses.emplace_back(sample.capture_time_ns, now_ns);
    }
    void say_goodbye(std::int64_t) override {}
    std::vector<std::uint8_t> take_packet() override { return {}; }

    FakeServer* server;
    bool welcomed = false;
    std::vector<std::uint32_t> characters;
  };

  [[nodiscard]] bool is_alive(const FakeLine* line) const {
    return std::find(lines_.begin(), lines_.end(), line) != lines_.end();
  }

  std::vector<FakeLine*> lines_;
  std::int64_t next_tick_ns_ = 0;
  std::uint64_t tick_ = 100;
};

}  // namespace hairnet::load
