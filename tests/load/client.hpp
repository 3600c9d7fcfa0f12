#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

#include "core/random.hpp"
#include "tests/load/prop_setter.hpp"
#include "tests/load/toucher.hpp"
#include "tests/load/virtual_client.hpp"

namespace hairnet::load {

// A user with some characters. The client connects, adds its characters, and sends all their poses at its own fixed
// times. It connects again when it loses its connection. A slow client does the same but reads only 1 kB a second; it
// is one of the misbehaving clients, so its poses and frames are not in the figures.
class Client final : public VirtualClient, private ConnectionEvents, private ProtocolEvents {
 public:
  // `context` must outlive the client. `place` is the client's index among those that are there (Action::place).
  Client(const ClientContext& context, std::uint32_t number, std::uint32_t place, bool slow);

  // Call it once, first. `levels` are given to the characters in turn. `intended_ns` is when the plan wants the client
  // to come, which may be earlier than `now_ns`.
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
  // `away` has no session, `active` has one, `leaving` waits for the server after a goodbye, `gone` has ended.
  enum class State : std::uint8_t { away, active, leaving, gone };
  struct Character {
    std::uint32_t number = 0;
    // They index ClientContext::grooms and motions.
    std::size_t groom = 0, motion = 0;
    // The step of the motion that pose 0 shows.
    std::uint64_t motion_step = 0;
    LevelIndex level = LevelIndex::high;
    // The place in the world, m.
    Vec3 place = Vec3::Zero();
    // The time from which the character waits for its first frame, or for its first one after a loss of the connection.
    // kNever_ns means that it waits for none.
    std::int64_t join_ns = kNever_ns;
    // The last frame said that the hair is at rest. The server sends no frames until the pose changes.
    bool asleep = false;
    // The number of the newest pose that no answer is expected for: a frame has answered it, or it was given up.
    std::int64_t answered = -1;
    // The tick of the last frame, and the ticks from it to the next one. A tick of zero means that no frame has come in
    // this session, or since the hair was at rest.
    std::uint64_t tick = 0;
    std::uint32_t stride = 1;
    // The pose that was sent last. ClientContext::motions owns it.
    const Pose* last_pose = nullptr;
  };

  // ConnectionEvents (client_connection.hpp).
  void on_open(std::int64_t now_ns) override;
  void on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) override;
  void on_closed(std::string_view reason, std::int64_t now_ns) override;
  // ProtocolEvents (protocol_client.hpp).
  void on_welcome(const wire::Welcome& welcome, std::int64_t now_ns) override;
  void on_lost(std::string_view reason, std::int64_t now_ns) override;
  void on_end(std::string_view reason, std::int64_t now_ns) override;
  void on_groom_state(const wire::GroomHash&, wire::GroomState) override {}
  void on_refusal(std::string_view reason, std::int64_t now_ns) override;
  void on_frame(const FrameSeen& frame, std::int64_t now_ns) override;
  void on_hands(const HandsSeen& hands, std::int64_t now_ns) override;
  void on_props(const wire::RoomProps& props, std::int64_t now_ns) override;
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
  void pass_props(std::int64_t pose);
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
  // The reason with which the last connection ended (ConnectionEvents::on_closed).
  std::string closed_;
  // It is true while the plan itself breaks the connection, which then counts as no error.
  bool meant_to_lose_ = false;
  // Character `number` has the index number - 1.
  std::vector<Character> characters_;
  PoseClock clock_;
  // The number of the first pose that was not due yet.
  std::int64_t next_pose_ = 0;
  // It is there for a client with hands (ClientContext::touch_share).
  std::optional<Toucher> toucher_;
  // It is there for a client that sets props (ClientContext::props_share), which also has hands.
  std::optional<PropSetter> prop_setter_;
  // The server permits this session to set props.
  bool may_set_props_ = false;
  // It stays true after the first welcome. Poses count from then on.
  bool started_ = false;
  // The time at which a client whose session has ended begins another one, and at which a slow client reads again.
  std::int64_t begin_ns_ = kNever_ns, read_ns_ = kNever_ns;
  // The newest tick of which a frame has come, when the first one came, and the length of a tick. A tick of zero means
  // that none has come in this session.
  std::uint64_t tick_ = 0;
  std::int64_t tick_arrival_ns_ = 0, tick_ns_ = 0;
  struct Other {
    // The arrival of the last frame; zero when there was none in this session or its hair was at rest.
    std::int64_t arrival_ns = 0;
  };
  // The characters of other clients, by the number of the member.
  std::unordered_map<std::uint32_t, Other> others_;
  // The sample time of the newest hands that were seen of each other session.
  std::unordered_map<std::uint64_t, std::int64_t> hands_ns_;
  // The changes of the room's props that this client has seen, or that were sent before its session began.
  SentProps::Seen seen_props_;
};

}  // namespace hairnet::load
