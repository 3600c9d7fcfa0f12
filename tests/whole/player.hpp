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
#include "tests/whole/touching.hpp"

namespace hairnet::whole {

// The properties of a well-behaved client.
struct PlayerPlan {
  int number = 0;
  std::string room, token;
  NetworkQuality quality;
  double pose_hz = 60;
  std::int64_t clock_offset_ns = 0;
  // The player's clock runs too fast by so many parts per million; a negative number means too slow.
  int clock_ppm = 0;
  // A steady player has a good network and makes no requests that cost it frames. It must get every tick's frame.
  bool steady = false;
  // Some of its poses are not valid, until calm_down().
  bool sends_garbage = false;
  // The mean rate of random requests (Player::act).
  double actions_per_s = 1;
  // The player chooses among the first so many grooms of assets().
  std::size_t groom_count = assets().grooms.size();
  // A steady player must have its first groom ready within this time, although other clients offer grooms too.
  std::int64_t groom_wait_ns_max = 0;

  // In a fleet, finds the server at the address to which a client was sent. Without an address it returns the server
  // that the client asks first.
  std::function<ServerHost&(const std::optional<wire::ServerAt>&)> find_server = {};
  // This is called for each packet with frames. `life` is the run of the server that sent the packet
  // (ServerHost::life), and `stamp_ns` is the time that this server has stamped on it.
  std::function<void(const ServerHost& host, int life, std::int64_t stamp_ns)> on_frames = {};
  // A moderator may remove it, or a lock keep it out.
  bool may_be_removed = false;
  // It has hands, and lets others touch its hair (Touching).
  bool touches = false;
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
  // The time of the last calm_down(); 0 means that none has come yet.
  [[nodiscard]] std::int64_t calm_since_ns() const { return calm_since_ns_; }
  // Returns when it was last welcomed with a new session; 0 means never.
  [[nodiscard]] std::int64_t welcomed_ns() const { return welcomed_ns_; }
  // Returns when anything from this player last arrived at a server over the present connection, which may be long ago
  // on a line that stalls. 0 means never.
  [[nodiscard]] std::int64_t heard_ns() const { return connection_ ? connection_->heard_ns() : 0; }
  // Returns whether everything that it sent over earlier connections has arrived or is lost.
  [[nodiscard]] bool has_all_arrived() const;
  void set_moving(bool moving);
  void send(wire::ClientMessage message);

  [[nodiscard]] const PlayerPlan& plan() const { return plan_; }
  [[nodiscard]] bool has_datagrams() const { return plan_.quality.lossy && plan_.quality.lossy->has_datagrams; }
  [[nodiscard]] bool is_active() const { return core_ && core_->active(); }
  // The server to which the player last connected.
  [[nodiscard]] const ServerHost& host() const { return *host_; }
  [[nodiscard]] bool may_set_wind() const { return core_ && core_->welcome() && core_->welcome()->may_set_wind; }
  [[nodiscard]] bool may_set_props() const { return core_ && core_->welcome() && core_->welcome()->may_set_props; }
  [[nodiscard]] std::string name() const { return "client " + std::to_string(plan_.number); }

  // What the player knows of a character in its room: an own one that the server has confirmed, or another client's.
  struct Member {
    // Session and number of the character, by which the server's World knows it.
    server::CharacterKey key = 0;
    wire::GroomHash groom{};
    bool own = false;
    // The number of frames since the connection began.
    std::uint64_t frames = 0;
    std::optional<std::uint64_t> last_tick;
    std::int64_t last_ns = 0;
    bool asleep = false, discontinuous = false;
    // The last frame had hair, and was of a character that is to have hair.
    bool hair = false;
    LevelIndex level = LevelIndex::rigid;
    // The sample time of the last frame of level `learnt`.
    std::optional<std::int64_t> learnt_ns;
    // The arrival of the first frame since which the hair has not equalled that of the server's World, within the
    // error.
    std::optional<std::int64_t> off_since_ns;
    Pose pose;
    std::string tag;
    std::optional<wire::Appearance> appearance;
    // Its owner has set who may touch it, other than by default.
    bool has_touch_rule = false;
  };
  // All known characters of the room, by the number of the member.
  [[nodiscard]] const std::map<std::uint32_t, Member>& members() const { return members_; }
  // An own character, as the player wants it to be.
  struct Character {
    std::size_t groom = 0;
    LevelIndex level = LevelIndex::low;
    std::uint32_t sequence = 0;
    bool moving = true;
    // The motion (pose_of): its phase in seconds, how far the head goes in metres, and how far it turns in radians.
    double phase = 0, reach = 0.1, turn = 0.5;
    // The speed on a circle of 50 m radius; 0 means that the character stays at its place.
    double ride_m_per_s = 0;
    Vec3 place = Vec3::Zero();
    // The time at which the motion stopped, while `moving` is false.
    std::int64_t still_since_ns = 0;
    // The next pose is marked as a teleport.
    bool teleports = false;
    // The tag and appearance that the player sent last.
    std::string tag;
    std::optional<wire::Appearance> appearance;
  };
  [[nodiscard]] const std::map<std::uint32_t, Character>& characters() const { return characters_; }
  // The keys of its characters, once the server knows them.
  [[nodiscard]] std::set<server::CharacterKey> keys() const;
  [[nodiscard]] std::uint64_t session() const { return core_ && core_->welcome() ? core_->welcome()->session : 0; }
  // Says which hands of others and which rules of touch the player still knows; empty: none but the default rule. A
  // room is to come to that when all have ended their touching.
  [[nodiscard]] std::string known_touch() const;
  // The numbers of the room's props, as the server tells them.
  [[nodiscard]] const std::set<std::uint8_t>& room_props() const { return room_props_; }
  // The wind that the server says its room has.
  [[nodiscard]] const std::optional<Wind>& room_wind() const { return room_wind_; }
  // Adds what the last core has counted to the journal.
  void finish();

  // ClientEvents (network.hpp).
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
  // Makes a random request about touch, and sends what it takes.
  void touch();
  // Undoes all that touch() has done.
  void end_touch();
  [[nodiscard]] std::vector<Touching::Head> heads() const;
  [[nodiscard]] std::vector<std::uint32_t> character_numbers() const;
  void note_frames(const wire::DecodedPacket& decoded);
  // Returns whether the connection broke so short a time ago that the server must still have the session.
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
  // The connection and all earlier ones.
  std::vector<std::weak_ptr<SimulatedConnection>> connections_;
  // The time for which the next call of turn() is planned on the timeline.
  std::int64_t wake_ns_ = -1;
  // `acting_` and `posing_` say that a next act() or send_poses() is planned, `turning_` that turn() is running.
  bool half_closed_ = false, leaving_ = false, joined_ = false, acting_ = false, posing_ = false, turning_ = false;
  // turn_again_ asks the running turn() for another round. calm_ stays true from calm_down() on.
  bool turn_again_ = false, calm_ = false;
  // No poses are sent until `gap_until_ns_`. The last connection was opened at `opening_ns_`.
  std::int64_t act_until_ns_ = 0, gap_until_ns_ = 0, calm_since_ns_ = 0, opening_ns_ = 0, welcomed_ns_ = 0;
  // The number of connections, so that each has a seed of its own.
  std::uint64_t dials_ = 0;
  // The own characters, by number.
  std::map<std::uint32_t, Character> characters_;
  // The number of the newest own character. Numbers are not used again.
  std::uint32_t last_number_ = 0;
  std::map<std::uint32_t, Member> members_;
  std::optional<Wind> room_wind_;
  // Draws from a stream of its own, so that players without hands act as they would without it.
  Touching touching_;
  std::set<std::uint8_t> room_props_;
  // By session: the tick of the newest word about its hands, and whether it had any.
  std::map<std::uint64_t, std::pair<std::uint64_t, bool>> hands_of_others_;
  // The number of changes of appearances.
  std::uint32_t change_count_ = 0;
  wire::Observe observe_;
  // The coarsest error of hair that the player has ever asked for. Frames that were sent earlier may still have it.
  float coarsest_m_ = wire::Observe{}.error_m;
  // It is true while the player has not limited which members it observes.
  bool sees_all_ = true;
  // The time at which the connection broke without a goodbye; it is negative when it did not.
  std::int64_t broken_ns_ = -1;
  // The session had a character when it broke. The server need not keep one without, which gives way when it is full.
  bool had_character_ = false;
  // The run of the server, the connection and the server that broke. The connection is kept until the next welcome.
  int broken_life_ = -1;
  std::shared_ptr<SimulatedConnection> broken_connection_;
  const ServerHost* broken_host_ = nullptr;
  // It is true between a welcome and the loss of its connection.
  bool has_session_ = false;
  // The own characters that had hair when the last session ended. They must have hair in the first frame of the next
  // one.
  std::set<std::uint32_t> haired_;
  // Splits the bytes of the connection a second time, for PlayerPlan::on_frames.
  channel::PacketSplitter splitter_{wire::kPacketBytesMax};
  // The time since which the groom of the first character is not ready; it is negative once the groom is.
  std::int64_t groom_wanted_ns_ = -1;
  // The counters of the core that the journal has already.
  std::uint64_t counted_undecodable_ = 0, counted_unknown_ = 0, counted_evaluated_ = 0;
};

}  // namespace hairnet::whole
