#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "client/link/link_core.hpp"
#include "schema/channel/packet_splitter.hpp"
#include "tests/whole/assets.hpp"
#include "tests/whole/server_host.hpp"

namespace hairnet::whole {

// The properties of a well-behaved client.
struct PlayerPlan {
  int number = 0;
  std::string room, token;
  NetworkQuality quality;
  double pose_hz = 60;
  std::int64_t clock_offset_ns = 0;
  // Its clock drifts so fast.
  int clock_ppm = 0;
  // It has a good network and behaves simply, and must get every tick.
  bool steady = false;
  // Garbage comes among its poses, until calm_down().
  bool sends_garbage = false;
  // Counts all that a client may ask for.
  double actions_per_s = 1;
  // Its characters have one of the first so many grooms.
  std::size_t groom_count = assets().grooms.size();
  // Limits how long a steady client waits for its first groom, whoever else offers grooms.
  std::int64_t groom_wait_ns_max = 0;

  // In a fleet. The server at an address; none: the one that the client knows.
  std::function<ServerHost&(const std::optional<wire::ServerAt>&)> find_server = {};
  // Hears of each packet with frames, from a server's life and with that server's time.
  std::function<void(const ServerHost& host, int life, std::int64_t stamp_ns)> on_frames = {};
  // A moderator may remove it, or a lock keep it out.
  bool may_be_removed = false;
};

// A well-behaved client: a LinkCore over simulated connections, with random requests. Checks what the server sends.
class Player final : public ClientEvents {
 public:
  Player(Timeline& timeline, Journal& journal, ServerHost& host, PlayerPlan plan, std::uint64_t seed);

  void join();
  void leave(bool says_goodbye);
  void add_character();
  // Makes random requests, again and again, until `until_ns`.
  void act_at_random(std::int64_t until_ns);
  void break_connection(const ConnectionLoss& how, std::optional<std::uint64_t> after_bytes, bool of_server);
  void pause_reading(bool paused);
  // Requests everything, and sends no more garbage. The connection does not break any more.
  void calm_down();
  [[nodiscard]] std::int64_t calm_since_ns() const { return calm_since_ns_; }
  // Returns when it was last welcomed with a new session; 0 means never.
  [[nodiscard]] std::int64_t welcomed_ns() const { return welcomed_ns_; }
  // When anything from it last reached a server; its line may stall. 0: never over this connection.
  [[nodiscard]] std::int64_t heard_ns() const { return connection_ ? connection_->heard_ns() : 0; }
  // Returns whether everything that it sent over earlier connections has arrived or is lost.
  [[nodiscard]] bool has_all_arrived() const;
  void set_moving(bool moving);
  void send(wire::ClientMessage message);

  [[nodiscard]] const PlayerPlan& plan() const { return plan_; }
  [[nodiscard]] bool has_datagrams() const { return plan_.quality.lossy && plan_.quality.lossy->has_datagrams; }
  [[nodiscard]] bool is_active() const { return core_ && core_->active(); }
  // Is the one that it asked last.
  [[nodiscard]] const ServerHost& host() const { return *host_; }
  [[nodiscard]] bool may_set_wind() const { return core_ && core_->welcome() && core_->welcome()->may_set_wind; }
  [[nodiscard]] std::string name() const { return "client " + std::to_string(plan_.number); }

  // The characters that it knows: its own confirmed ones by number, and those of its room by owner.
  struct Member {
    server::CharacterKey key = 0;
    wire::GroomHash groom{};
    bool own = false;
    // Counts frames since the connection began.
    std::uint64_t frames = 0;
    std::optional<std::uint64_t> last_tick;
    std::int64_t last_ns = 0;
    bool asleep = false, discontinuous = false;
    // The last frame had hair.
    bool hair = false;
    LevelIndex level = LevelIndex::rigid;
    // Is the sample time of the last frame of level `learnt`.
    std::optional<std::int64_t> learnt_ns;
    // Is when the hair last equalled that of the server's World, or could not be compared.
    std::int64_t like_ns = 0;
    Pose pose;
    std::string tag;
    std::optional<wire::Appearance> appearance;
  };
  [[nodiscard]] const std::map<std::uint32_t, Member>& members() const { return members_; }
  struct Character {
    std::size_t groom = 0;
    LevelIndex level = LevelIndex::low;
    std::uint32_t sequence = 0;
    bool moving = true;
    double phase = 0, reach = 0.1, turn = 0.5;
    // It rides on a circle.
    double ride_m_per_s = 0;
    Vec3 place = Vec3::Zero();
    // Is when the motion stopped, while it does not move.
    std::int64_t still_since_ns = 0;
    // The next pose teleports.
    bool teleports = false;
    // This and the next are as last sent.
    std::string tag;
    std::optional<wire::Appearance> appearance;
  };
  [[nodiscard]] const std::map<std::uint32_t, Character>& characters() const { return characters_; }
  // The keys of its characters, once the server knows them.
  [[nodiscard]] std::set<server::CharacterKey> keys() const;
  [[nodiscard]] std::uint64_t session() const { return core_ && core_->welcome() ? core_->welcome()->session : 0; }
  // The wind that the server says its room has.
  [[nodiscard]] const std::optional<Wind>& room_wind() const { return room_wind_; }
  // Adds what the last core has counted to the journal.
  void finish();

  void on_open() override;
  void on_bytes(std::span<const std::uint8_t> bytes) override;
  void on_datagram(std::span<const std::uint8_t> bytes) override;
  void on_download_packet(std::span<const std::uint8_t> packet) override;
  void on_room() override { turn(); }
  void on_closed(const std::string& error) override;

 private:
  struct EventHandler;

  [[nodiscard]] std::int64_t clock_ns() const;
  void make_core();
  // Notes that a connection with a session broke.
  void note_break();
  // Does the core's current work: connect, send, close.
  void turn();
  void connect();
  void wake_at(std::int64_t local_ns);
  void hear();
  void act();
  void send_poses();
  void add_pose(std::uint32_t number, Character& character, std::vector<wire::PoseSample>& poses);
  void corrupt(wire::PoseSample& pose);
  Pose pose_of(const Character& character) const;
  void change_appearance(Character& character);
  void note_frames(const wire::DecodedPacket& decoded);
  // Its session broke a moment ago and this server has it still.
  [[nodiscard]] bool must_be_resumed() const;
  void check(const link::FrameBatch& batch);
  void check(const link::FrameBatch& batch, const link::Frame& frame, Member& member);
  void check_hair(const link::FrameBatch& batch, const link::Frame& frame, const GroundTruth& truth, Member& member);
  void check_interval(const link::FrameBatch& batch, const link::Frame& frame, const Member& member);
  void check_counters();
  // Answers for an own character.
  [[nodiscard]] bool wants_hair(std::uint32_t character) const {
    const auto found = characters_.find(character);
    return found != characters_.end() && found->second.level != LevelIndex::rigid;
  }
  [[nodiscard]] wire::GroomHash first_groom() const {
    return characters_.empty() ? wire::GroomHash{} : assets().grooms[characters_.begin()->second.groom].hash;
  }
  void fault(const std::string& what) { journal_->fault(name(), what); }

  Timeline* timeline_;
  Journal* journal_;
  ServerHost* host_;
  PlayerPlan plan_;
  Random random_;
  std::unique_ptr<link::LinkCore> core_;
  std::shared_ptr<SimulatedConnection> connection_;
  // Holds the connection and all earlier ones.
  std::vector<std::weak_ptr<SimulatedConnection>> connections_;
  std::int64_t wake_ns_ = -1;
  bool half_closed_ = false, leaving_ = false, joined_ = false, acting_ = false, posing_ = false, turning_ = false;
  bool turn_again_ = false, calm_ = false;
  std::int64_t act_until_ns_ = 0, gap_until_ns_ = 0, calm_since_ns_ = 0, opening_ns_ = 0, welcomed_ns_ = 0;
  std::uint64_t dials_ = 0;
  std::map<std::uint32_t, Character> characters_;
  std::set<std::uint32_t> removing_;
  std::uint32_t last_number_ = 0;
  std::map<std::uint32_t, Member> members_;
  std::optional<Wind> room_wind_;
  // Counts changes of appearances.
  std::uint32_t change_count_ = 0;
  wire::Observe observe_;
  // Is the coarsest that it has asked for.
  float coarsest_m_ = wire::Observe{}.error_m;
  bool sees_all_ = true;
  // Is when the connection broke without a goodbye; negative when it did not.
  std::int64_t broken_ns_ = -1;
  // It had one then; a session without one gives way when the server is full.
  bool had_character_ = false;
  int broken_life_ = -1;
  // Is that connection, until the next welcome.
  std::shared_ptr<SimulatedConnection> broken_connection_;
  const ServerHost* broken_host_ = nullptr;
  // Is true between a welcome and the loss of its connection.
  bool has_session_ = false;
  // Are own characters that had hair when the session before this one ended.
  std::set<std::uint32_t> haired_;
  // Serves on_frames.
  channel::PacketSplitter splitter_{wire::kPacketBytesMax};
  // Since then the groom of its first character is not ready; negative means that it is.
  std::int64_t groom_wanted_ns_ = -1;
  std::uint64_t counted_undecodable_ = 0, counted_unknown_ = 0, counted_evaluated_ = 0;
};

}  // namespace hairnet::whole
