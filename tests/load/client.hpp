#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/random.hpp"
#include "tests/load/toucher.hpp"
#include "tests/load/virtual_client.hpp"

namespace hairnet::load {

// A user with some characters: connects, adds them, and sends all their poses at its own fixed times; returns when it
// loses its connection. A slow one behaves likewise but hardly reads, and does not count.
class Client final : public VirtualClient, private ConnectionEvents, private ProtocolEvents {
 public:
  Client(const ClientContext& context, std::uint32_t number, std::uint32_t place, bool slow);

  void join(std::uint32_t characters, const std::vector<LevelIndex>& levels, std::int64_t intended_ns,
            std::int64_t now_ns);
  std::int64_t act(std::int64_t now_ns) override;
  void set_characters(std::uint32_t characters, const std::vector<LevelIndex>& levels, std::int64_t now_ns) override;
  void lose_connection(std::int64_t intended_ns, std::int64_t now_ns) override;
  void leave(bool politely, std::int64_t now_ns) override;
  [[nodiscard]] bool gone() const override { return state_ == State::gone; }
  [[nodiscard]] std::size_t character_count() const override { return slow_ ? 0 : characters_.size(); }
  [[nodiscard]] bool counts() const override { return !slow_; }

 private:
  enum class State : std::uint8_t { away, active, leaving, gone };
  struct Character {
    std::uint32_t number = 0;
    std::size_t groom = 0, motion = 0;
    // Is the motion's step at pose 0.
    std::uint64_t motion_step = 0;
    LevelIndex level = LevelIndex::high;
    Vec3 place = Vec3::Zero();  // m, world
    // Is the intended time; never means that no first frame is waited for.
    std::int64_t join_ns = kNever_ns;
    bool asleep = false;
    // Poses up to this one are settled.
    std::int64_t answered = -1;
    // Is the tick of its last frame; zero means that there was none in this session.
    std::uint64_t tick = 0;
    std::uint32_t stride = 1;
    const Pose* last_pose = nullptr;
  };

  void on_open(std::int64_t now_ns) override;
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) override;
  void on_closed(std::string_view reason, std::int64_t now_ns) override;
  void on_welcome(const wire::Welcome& welcome, std::int64_t now_ns) override;
  void on_lost(std::string_view reason, std::int64_t now_ns) override;
  void on_end(std::string_view reason, std::int64_t now_ns) override;
  void on_groom_state(const wire::GroomHash&, wire::GroomState) override {}
  void on_refusal(std::string_view reason, std::int64_t now_ns) override;
  void on_frame(const FrameSeen& frame, std::int64_t now_ns) override;
  void on_hands(const HandsSeen& hands, std::int64_t now_ns) override;
  void on_held(std::uint32_t points, std::int64_t now_ns) override;

  void begin(std::int64_t now_ns);
  void drive(std::int64_t now_ns);
  void lose(std::string_view reason, std::int64_t now_ns);
  void settle(std::int64_t now_ns);
  void close_connection();
  void add_to_server(const Character& character);
  Character make_character(std::uint32_t number, const std::vector<LevelIndex>& levels) const;
  void pass_poses(std::int64_t now_ns);
  void pass_hands(std::int64_t pose);
  [[nodiscard]] std::vector<wire::PoseSample> make_poses(std::int64_t pose);
  void answer(Character& character, const FrameSeen& frame, std::int64_t now_ns);
  void watch_other(const FrameSeen& frame, std::int64_t now_ns);
  void give_up_poses(std::int64_t until_ns, std::int64_t now_ns, bool count);
  const ClientContext* context_;
  std::uint32_t number_, place_;
  bool slow_;
  Random random_;
  State state_ = State::away;
  std::unique_ptr<ClientConnection> connection_;
  std::unique_ptr<ProtocolClient> protocol_;
  // Says how the last connection ended.
  std::string closed_;
  // Is true when the plan loses the connection, which is no error.
  bool meant_to_lose_ = false;
  // The index is number - 1.
  std::vector<Character> characters_;
  PoseClock clock_;
  std::int64_t next_pose_ = 0;
  std::optional<Toucher> toucher_;
  // Is true once it has been welcomed.
  bool started_ = false;
  std::int64_t begin_ns_ = kNever_ns, read_ns_ = kNever_ns;
  // Is the last frame's.
  std::uint64_t tick_ = 0;
  std::int64_t tick_arrival_ns_ = 0, tick_ns_ = 0;
  struct Other {
    std::uint64_t tick = 0;
    std::int64_t arrival_ns = 0;  // 0: asleep
  };
  std::unordered_map<std::uint32_t, Other> others_;  // by member
  // The time of the last hands that were seen of a session.
  std::unordered_map<std::uint64_t, std::int64_t> hands_ns_;
};

}  // namespace hairnet::load
