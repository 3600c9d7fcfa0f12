#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "schema/channel/packet_splitter.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/whole/assets.hpp"
#include "tests/whole/server_host.hpp"

namespace hairnet::whole {

enum class Misbehaviour : std::uint8_t {
  // Connects, and sends nothing, half a hello, or a packet just too small to be refused before a hello.
  silent,
  // Sends random bytes.
  noise,
  // Sends a hello, then valid packets with changed bits.
  mutant,
  // Sends a hello, then valid messages that make no sense.
  stranger,
  // Sends more messages than a session may.
  flood,
  // Sends more poses than a session may.
  pose_flood,
  // Reads slowly, or not at all.
  slow_reader,
  // Sends a hello with a wrong version, room, token or session.
  wrong_hello,
  // Uploads bytes other than those of the announced hash, or stops halfway.
  groom_corrupter,
  // Adds and removes as many characters as allowed, and more.
  crowd,
  // Connects and disconnects all the time.
  churner,
  // Joins as a new session again and again, also when the server is full.
  rejoiner,
  // Has many characters, and resumes its session again and again.
  resumer,
  // Offers large grooms and those of players, and uploads a few bytes of each.
  groom_trickler,
  // Uploads grooms that cannot be built.
  groom_heaper,
  // Observes a room, and reads a few bytes a second.
  drip_reader,
  // Adds and removes characters as fast as it can.
  shuffler,
  // Has as many characters as it may, in a room of its own.
  hoarder,
  // Has many characters, and asks for the nearest ones again and again.
  chooser,
  // Sets the wind again and again.
  windmaker,
  // Sends datagrams that are not poses, or that are empty.
  datagram_corrupter,
};
inline constexpr std::array<std::string_view, 21> kMisbehaviourNames{
    "silent",       "noise",           "mutant",       "stranger", "flood",    "pose_flood", "slow",
    "wrong_hello",  "groom_corrupter", "crowd_of_one", "churner",  "rejoiner", "resumer",    "groom_trickler",
    "groom_heaper", "drip_reader",     "shuffler",     "hoarder",  "chooser",  "windmaker",  "datagram_corrupter"};

// Returns whether this kind of client sends bad datagrams on a line that has datagrams. The server would disconnect the
// other kinds for such datagrams before they do their own harm.
[[nodiscard]] bool sends_bad_datagrams(Misbehaviour kind);

struct BadClientPlan {
  int number = 0;
  std::uint64_t address = 0;
  Misbehaviour kind = Misbehaviour::silent;
  std::string room, token;
  NetworkQuality quality;
};

// A client that breaks the rules until stop() is called. It still checks that the server's packets are valid.
class BadClient final : public ClientEvents {
 public:
  BadClient(Timeline& timeline, Journal& journal, ServerHost& host, BadClientPlan plan, std::uint64_t seed);
  void start(std::int64_t until_ns);
  void stop();
  // Returns whether everything that it has sent has arrived.
  [[nodiscard]] bool has_all_arrived() const;

  void on_open() override;
  void on_bytes(std::span<const std::uint8_t> bytes) override;
  void on_room() override {}
  void on_closed(const std::string& error) override;

 private:
  // The client's clock is 77 s ahead of the timeline, and differs from the server's clock.
  [[nodiscard]] std::int64_t clock_ns() const { return timeline_->now_ns() + 77 * kSecond_ns; }
  [[nodiscard]] std::string kind_name() const {
    return std::string(kMisbehaviourNames[static_cast<std::size_t>(plan_.kind)]);
  }
  [[nodiscard]] std::string name() const {
    return "bad client " + std::to_string(plan_.number) + " (" + kind_name() + ")";
  }
  // Returns a random number from 1 to `max`.
  [[nodiscard]] std::uint64_t up_to(std::uint64_t max) { return 1 + random_.next() % max; }
  void connect();
  void send_bad_datagrams();
  void redial(double wait_ns_max);
  void on_packet(std::span<const std::uint8_t> packet);
  void send(const wire::Message& message);
  void hello();
  void act();
  void misbehave();
  void mutate();
  void say_part_of_hello();
  void flood_poses();
  void corrupt_groom();
  void trickle_groom();
  void heap_groom();
  void add_crowd();
  void add_characters(std::uint32_t count, LevelIndex level);
  void pose_characters();
  void shuffle();
  void hoard();
  void choose();
  void make_wind();
  wire::Message random_valid_message();

  Timeline* timeline_;
  Journal* journal_;
  ServerHost* host_;
  BadClientPlan plan_;
  Random random_;
  wire::RandomMessages messages_;
  channel::PacketSplitter splitter_;
  std::shared_ptr<SimulatedConnection> connection_;
  // Earlier connections, over which bytes may still arrive at the server.
  std::vector<std::weak_ptr<SimulatedConnection>> left_;
  // The last welcome. A later connection may resume its session.
  std::optional<wire::Welcome> welcome_;
  // The client breaks no rule after this time.
  std::int64_t until_ns_ = 0;
  // A number that changes whenever a connection begins or ends, so that actions that were planned for an earlier one do
  // nothing.
  std::uint64_t turn_ = 0;
  // It is true from the welcome on this connection until the server sends a goodbye.
  bool is_welcome_ = false;
  // The sequence number of the newest pose.
  std::uint32_t sequence_ = 0;
  // The numbers of the characters that the client has asked for, whatever the server has answered.
  std::set<std::uint32_t> characters_;
  // The groom of all these characters.
  wire::GroomHash groom_{};
  // The members of the room that have joined since the welcome.
  std::vector<std::uint32_t> members_;
  // The number of bytes that were sent of each groom that a groom_trickler has offered.
  std::map<wire::GroomHash, std::size_t> trickled_;
};

}  // namespace hairnet::whole
