#include "tests/load/attacks.hpp"

#include <array>
#include <string>
#include <utility>

#include "tests/load/attack_grooms.hpp"
#include "tests/load/attack_hands.hpp"
#include "tests/load/attack_session.hpp"
#include "tests/load/attack_socket.hpp"
#include "tests/load/attack_upload.hpp"

namespace hairnet::load {
namespace {

constexpr std::uint32_t kFirstAttackHost = 0x020001;  // 127.2.0.1

using Stay = SessionAttack::Stay;
using Bytes = std::vector<std::uint8_t>;

// Makes the attackers of one attack. A *person* is a loopback address: attackers of one person share its limits at the
// server. Each attack has 256 addresses of its own.
class Cast {
 public:
  Cast(Attack attack, const AttackContext& context)
      : context_(&context), host_(kFirstAttackHost + 256 * static_cast<std::uint32_t>(attack)) {}

  // Adds `count` attackers of one kind, all of the current person.
  template <class AttackerType, class... Arguments>
  void add(int count, const Arguments&... arguments) {
    for (int i = 0; i < count; ++i)
      attackers_.push_back(std::make_unique<AttackerType>(*context_, host_, arguments...));
  }
  void next_person() { ++host_; }
  // The numbers of uploads (AttackUpload) begin with the address and the attacker, so no two attackers share any.
  void add_uploads(int persons, int of_each, const Bytes& bytes) {
    for (int i = 0; i < persons; ++i, next_person())
      for (int k = 0; k < of_each; ++k) add<AttackUpload>(1, bytes, (host_ << 20) + (static_cast<unsigned>(k) << 14));
  }
  void add_persons(int persons, const SessionAttack& session) {
    for (int i = 0; i < persons; ++i, next_person()) add<AttackSession>(1, session);
  }
  void add_hands(int persons, const HandsAttack& attack) {
    for (int i = 0; i < persons; ++i, next_person()) add<AttackHands>(1, attack);
  }
  void add_rooms(int count, SessionAttack session) {
    for (int i = 0; i < count; ++i) {
      session.room = "attack-" + std::to_string(i);
      add<AttackSession>(1, session);
    }
  }
  std::vector<std::unique_ptr<Attacker>> take() { return std::move(attackers_); }

 private:
  const AttackContext* context_;
  std::uint32_t host_;
  std::vector<std::unique_ptr<Attacker>> attackers_;
};

std::shared_ptr<const Bytes> repeated(std::string_view text, int count) {
  Bytes bytes;
  for (int i = 0; i < count; ++i) bytes.insert(bytes.end(), text.begin(), text.end());
  return std::make_shared<const Bytes>(std::move(bytes));
}

// Returns a packet that announces `byte_count` bytes in all, its size prefix included, and lacks the last one. The
// server must keep the others and wait.
std::shared_ptr<const Bytes> unfinished_packet(std::uint32_t byte_count) {
  Bytes bytes(byte_count - 1);
  for (std::size_t i = 0; i < 4; ++i) bytes[i] = static_cast<std::uint8_t>((byte_count - 4) >> (8 * i));
  return std::make_shared<const Bytes>(std::move(bytes));
}

// The members of SlowOffers are the size of a groom, offers a second, the most offers, bytes a second of each groom,
// and whether the groom is the late joiner's. attack_meanings() says in words what the five kinds do.
void add_offers(Cast& cast) {
  cast.add<AttackOffers>(1, SlowOffers{64u << 20, 1, 16, 1 / 4.5, false});
  cast.next_person();
  cast.add<AttackOffers>(1, SlowOffers{1, 400, 1'000'000, 0, false});
  cast.next_person();
  cast.add<AttackOffers>(1, SlowOffers{0, 1000, 1, 0, true});
  cast.next_person();
  cast.add_uploads(1, 1, make_big_groom());
  cast.add_uploads(1, 8, make_rubbish(256u << 10));
}

void add_appearances(Cast& cast, SessionAttack session) {
  session.characters = 64;
  // This is a little less than the server takes: a session may send 1000 messages a second
  // (SessionLimits::messages_per_s), and a change of appearance costs a little more than one (price_of).
  session.appearance_hz = 900;
  for (int room = 0; room < 4; ++room) {
    session.room = "load-" + std::to_string(room);
    cast.add_persons(1, session);
  }
  session.appearance_hz = 30'000;
  cast.add_persons(1, session);
  session.characters = 1;
  session.appearance_hz = 0;
  session.bad_appearance_hz = 500;
  cast.add_persons(2, session);
}

}  // namespace

const std::array<std::string_view, kAttackNames.size()>& attack_meanings() {
  static const std::array<std::string_view, kAttackNames.size()> meanings{
      "4 persons upload grooms of one strand that fills its box with a zigzag",
      "2 persons upload grooms over a body of 2 million triangles through each other",
      "2 persons upload the largest hairstyles that can be built: 90 000 strands of 20 points",
      "4 sessions of 512 characters resume as fast as they can",
      "offers of 64 MiB and a byte every 4.5 s, 400 tiny offers a second, the late joiner's groom offered and never "
      "sent, "
      "rubbish behind long builds",
      "2000 silent sockets, 600 pages whose answers nobody reads, and 64 sessions of 16 characters that promise signs "
      "of "
      "life and give none",
      "24 persons connect, say hello and leave, as often as the server accepts them",
      "256 connections send a packet without its last byte before their hello: of 4 MiB, and of 16 KiB",
      "40 observers read 1 kB/s while characters come and go 420 times a second",
      "40 clients in 40 rooms with 51 moving characters each",
      "3 clients with 1024 characters each ask for the nearest members 93 times a second",
      "2 clients set the wind 30 times a second in rooms of 128 characters: the same one, and others",
      "one client sends 184 000 poses a second",
      "in the witnesses' rooms: 4 clients change tags and appearances of 64 characters 900 times a second, one "
      "30 000 times, and 2 send tags of too many bytes, changes of characters that are not theirs, and damaged "
      "packets",
      "in the witnesses' rooms: 4 clients whose 64 characters ride at 30 to 300 m/s on circles, and stop at once",
      "in a room of their own and in the witnesses': 20 people with 32 shapes each, anywhere and of any size, 90 times "
      "a second, who "
      "take hold of everyone's hair, pin it, set props and send bad hands"};
  return meanings;
}

std::vector<std::unique_ptr<Attacker>> make_attackers(Attack attack, const AttackContext& context) {
  Cast cast(attack, context);
  SessionAttack session;
  session.room = "attack";
  // The numbers of each attack are those that attack_meanings() tells a user. They are such that a server without its
  // defence would be short of time or memory.
  switch (attack) {
    case Attack::zigzag:
      cast.add_uploads(4, 1, make_zigzag_groom());
      break;
    case Attack::body:
      cast.add_uploads(2, 1, make_body_groom());
      break;
    case Attack::big:
      cast.add_uploads(2, 1, make_big_groom());
      break;
    case Attack::resume:
      session.characters = 512;
      session.stay = Stay::resumes;
      cast.add<AttackSession>(4, session);
      break;
    case Attack::offers:
      add_offers(cast);
      break;
    case Attack::silent:
      cast.add<AttackSocket>(2000, SocketAttack{repeated("", 0)});
      cast.next_person();
      cast.add<AttackSocket>(600, SocketAttack{repeated("GET /metrics HTTP/1.1\r\nHost: x\r\n\r\n", 64), false, 5});
      cast.next_person();
      session.characters = 16;
      session.promises_signs_of_life = true;
      cast.add<AttackSession>(64, session);
      break;
    case Attack::hellos:
      session.stay = Stay::leaves;
      cast.add_persons(24, session);
      break;
    case Attack::prologue:
      for (int person = 0; person < 4; ++person, cast.next_person()) {
        cast.add<AttackSocket>(32, SocketAttack{unfinished_packet(wire::kPacketBytesMax)});
        cast.add<AttackSocket>(32, SocketAttack{unfinished_packet(16u << 10)});
      }
      break;
    case Attack::churn:
      session.role = wire::Role::observer;
      session.read_bytes_per_s = 1000;
      cast.add<AttackSession>(40, session);
      cast.next_person();
      session = {};
      session.room = "attack";
      session.churn_hz = 420;
      session.characters = 64;
      cast.add<AttackSession>(1, session);
      break;
    case Attack::rooms:
      session.characters = 51;
      session.pose_hz = 30;
      cast.add_rooms(40, session);
      break;
    case Attack::observe:
      session.characters = 1024;
      session.pose_hz = 10;
      session.observe_hz = 93;
      cast.add_persons(3, session);
      break;
    case Attack::wind:
      session.characters = 128;
      session.pose_hz = 10;
      session.moves = false;
      session.wind_hz = 30;
      session.wind_varies = false;
      cast.add_persons(1, session);
      session.room = "attack-2";
      session.wind_varies = true;
      cast.add_persons(1, session);
      break;
    case Attack::poses:
      session.characters = 1024;
      session.pose_hz = 180;
      cast.add<AttackSession>(1, session);
      break;
    case Attack::appearances:
      add_appearances(cast, session);
      break;
    case Attack::rides:
      session.characters = 64;
      session.pose_hz = 60;
      for (int room = 0; room < 4; ++room) {
        session.room = "load-" + std::to_string(room);
        session.ride_m_per_s = std::array{30.0, 60.0, 100.0, 300.0}[static_cast<std::size_t>(room)];
        cast.add_persons(1, session);
      }
      break;
    case Attack::hands:
      for (int room = 0; room < 5; ++room) {
        const bool is_own = room == 4;
        const std::string name = is_own ? "attack" : "load-" + std::to_string(room);
        cast.add_hands(4,
                       {.room = name, .characters = is_own ? 8u : 1u, .hands_hz = 90, .holds_hz = 60, .props_hz = 10});
        cast.add_hands(1, {.room = name, .bad_hz = 200});
      }
      break;
  }
  return cast.take();
}

}  // namespace hairnet::load
