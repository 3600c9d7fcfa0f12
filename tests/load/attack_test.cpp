#include <gmock/gmock.h>

#include <algorithm>
#include <set>

#include "schema/channel/packet_splitter.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/load/attack_grooms.hpp"
#include "tests/load/attack_hands.hpp"
#include "tests/load/attack_session.hpp"
#include "tests/load/attack_socket.hpp"
#include "tests/load/attack_upload.hpp"
#include "tests/load/attacks.hpp"

namespace hairnet::load {
namespace {

using testing::Each;
using testing::SizeIs;

// Connections whose other end is the test.
class Wire final : public Connector {
 public:
  std::unique_ptr<ClientConnection> connect(ConnectionEvents& to, std::uint32_t host) override {
    events = &to;
    hosts.push_back(host);
    sent.clear();
    auto line = std::make_unique<Line>(*this);
    return line;
  }
  // All messages that were sent on the newest connection.
  [[nodiscard]] std::vector<wire::Message> messages() const {
    std::vector<wire::Message> found;
    channel::PacketSplitter splitter(wire::kPacketBytesMax);
    splitter.feed(sent, [&](std::span<const std::uint8_t> packet) {
      found.push_back(wire::decode_packet(packet).envelope.message);
    });
    return found;
  }
  template <class T>
  [[nodiscard]] std::vector<T> all() const {
    std::vector<T> found;
    for (const wire::Message& message : messages())
      if (const auto* one = std::get_if<T>(&message)) found.push_back(*one);
    return found;
  }
  void answer(wire::Message message, std::int64_t now_ns = 0) {
    events->on_packet(wire::encode_packet({now_ns, std::move(message)}), now_ns);
  }

  ConnectionEvents* events = nullptr;
  std::vector<std::uint32_t> hosts;
  std::vector<std::uint8_t> sent;  // on the newest connection
  std::size_t open_count = 0, readable = ~std::size_t{0};

 private:
  struct Line final : ClientConnection {
    explicit Line(Wire& w) : wire(&w) { ++wire->open_count; }
    ~Line() override { --wire->open_count; }
    void send(std::span<const std::uint8_t> bytes) override {
      wire->sent.insert(wire->sent.end(), bytes.begin(), bytes.end());
    }
    void close_sending() override {}
    void limit_reading(std::size_t bytes) override { wire->readable = bytes; }
    [[nodiscard]] std::size_t unsent_bytes() const override { return 0; }
    Wire* wire;
  };
};

class AttackTest : public testing::Test {
 protected:
  AttackTest() {
    context_.connector = &wire_;
    context_.events = &events_;
    context_.late_joiner_groom.fill(7);
    context_.late_joiner_groom_bytes = 500;
  }
  // Connects, and is welcomed.
  void welcome(Attacker& attacker, const wire::Welcome& welcome = {}) {
    attacker.act(kSecond_ns);
    wire_.events->on_open(kSecond_ns);
    attacker.act(kSecond_ns);
    wire_.answer(welcome, kSecond_ns);
  }

  static constexpr std::int64_t kSecond_ns = 1'000'000'000;
  Wire wire_;
  std::map<std::string, std::uint64_t, std::less<>> events_;
  AttackContext context_;
};

TEST_F(AttackTest, rate_is_that_of_events_whatever_the_calls) {
  Rate rate(100), never(0);
  int count = 0;
  for (std::int64_t now_ns = kSecond_ns; now_ns < 3 * kSecond_ns; now_ns += 37'000'000)
    while (rate.take(now_ns)) ++count;
  // Two seconds have 200 events. The calls come every 37 ms, so up to four events are due after the last one.
  EXPECT_NEAR(count, 200, 5);
  EXPECT_FALSE(never.take(kSecond_ns));
  count = 0;
  // Who has not called for more than a second gets one event, not all of the 97 seconds at once: a generator that
  // stalled must not flood the server afterwards.
  while (rate.take(100 * kSecond_ns)) ++count;
  EXPECT_EQ(count, 1);
}

TEST_F(AttackTest, session_adds_its_characters_and_sends_all_their_poses) {
  SessionAttack attack;
  attack.room = "attack";
  // A packet has at most 1024 poses (kPosesPerPacket), so 1500 need two.
  attack.characters = 1500;
  attack.pose_hz = 30;
  AttackSession session(context_, 9, attack);
  welcome(session);
  EXPECT_EQ(wire_.hosts, std::vector<std::uint32_t>{9});
  EXPECT_EQ(wire_.all<wire::Hello>().at(0).room, "attack");
  EXPECT_THAT(wire_.all<wire::AddCharacter>(), SizeIs(1500));
  session.act(2 * kSecond_ns);
  std::size_t poses = 0;
  for (const wire::PoseBatch& batch : wire_.all<wire::PoseBatch>()) {
    for (const wire::PoseSample& sample : batch.poses)
      EXPECT_EQ(wire::validate_pose(sample.pose), wire::PoseRefusal::none);
    poses += batch.poses.size();
  }
  EXPECT_EQ(poses, 1500u);
  EXPECT_EQ(events_["poses"], 1500u);
}

TEST_F(AttackTest, resuming_session_closes_when_it_has_its_characters_and_at_each_resume) {
  SessionAttack attack;
  attack.characters = 3;
  attack.stay = SessionAttack::Stay::resumes;
  AttackSession session(context_, 9, attack);
  wire::Welcome first;
  first.session = 77;
  first.secret.fill(5);
  welcome(session, first);
  // The session waits for its last character, number 3, before it closes the connection.
  wire_.answer(wire::CharacterAdded{2, {}, LevelIndex::rigid, 1}, kSecond_ns);
  EXPECT_EQ(wire_.open_count, 1u);
  wire_.answer(wire::CharacterAdded{3, {}, LevelIndex::rigid, 2}, kSecond_ns);
  EXPECT_EQ(wire_.open_count, 0u);
  wire::Welcome resumed = first;
  resumed.resumed = true;
  welcome(session, resumed);
  const wire::Hello hello = wire_.all<wire::Hello>().at(0);
  EXPECT_EQ(hello.session, 77u);
  EXPECT_EQ(hello.secret, first.secret);
  EXPECT_THAT(wire_.all<wire::AddCharacter>(), SizeIs(0));
  EXPECT_EQ(wire_.open_count, 0u);
}

TEST_F(AttackTest, observer_reads_little_and_churn_adds_and_removes) {
  SessionAttack attack;
  attack.read_bytes_per_s = 1000;
  attack.churn_hz = 10;
  attack.characters = 2;
  AttackSession session(context_, 9, attack);
  welcome(session);
  for (int i = 0; i < 9; ++i) session.act(2 * kSecond_ns + i * kSecond_ns / 10);
  // It reads ten times a second (kReads_hz), and so 100 of 1000 bytes at a time.
  EXPECT_EQ(wire_.readable, 100u);
  // Nine calls at 10 Hz are nine events, additions and removals in turn, beside the first two characters.
  EXPECT_THAT(wire_.all<wire::AddCharacter>(), SizeIs(2 + 5));
  EXPECT_THAT(wire_.all<wire::RemoveCharacter>(), SizeIs(4));
}

TEST_F(AttackTest, appearances_change_in_turn_within_the_protocol) {
  SessionAttack attack;
  attack.characters = 3;
  attack.appearance_hz = 30;
  AttackSession session(context_, 9, attack);
  welcome(session);
  for (int i = 0; i < 10; ++i) session.act(2 * kSecond_ns + i * kSecond_ns / 10);
  const auto set = wire_.all<wire::SetAppearance>();
  // The ten calls span 0.9 s, which have some 28 changes at 30 Hz.
  EXPECT_NEAR(static_cast<double>(set.size()), 30, 3);
  std::set<std::uint32_t> characters;
  std::set<std::string> tags;
  for (const wire::SetAppearance& one : set) {
    characters.insert(one.character);
    tags.insert(one.tag);
  }
  EXPECT_EQ(characters, (std::set<std::uint32_t>{1, 2, 3}));
  EXPECT_EQ(tags.size(), set.size());
  EXPECT_EQ(events_["appearances"], set.size());
}

TEST_F(AttackTest, bad_appearances_are_what_a_server_must_refuse) {
  SessionAttack attack;
  attack.characters = 1;
  // The ten calls below span 0.9 s, which make some 900 packets.
  attack.bad_appearance_hz = 1000;
  AttackSession session(context_, 9, attack);
  welcome(session);
  const std::size_t good_bytes = wire_.sent.size();
  for (int i = 0; i < 10; ++i) session.act(2 * kSecond_ns + i * kSecond_ns / 10);
  std::map<wire::DecodeError, int> errors;
  channel::PacketSplitter splitter(wire::kPacketBytesMax);
  splitter.feed(std::span(wire_.sent).subspan(good_bytes), [&](std::span<const std::uint8_t> packet) {
    const wire::DecodedPacket decoded = wire::decode_packet(packet);
    ++errors[decoded.error];
    const auto* set = std::get_if<wire::SetAppearance>(&decoded.envelope.message);
    if (set && decoded.error == wire::DecodeError::none) {
      EXPECT_GT(set->character, 1u);
    }
  });
  // A third of the packets name characters that the session does not have.
  EXPECT_GT(errors[wire::DecodeError::none], 200);
  // Two thirds have tags of too many bytes.
  EXPECT_GT(errors[wire::DecodeError::invalid], 400);
  errors.erase(wire::DecodeError::none);
  errors.erase(wire::DecodeError::invalid);
  // Every 256th packet has random bytes, which fail to decode in other ways.
  EXPECT_FALSE(errors.empty());
}

TEST_F(AttackTest, upload_sends_from_the_wanted_offset_and_then_another_groom) {
  // The server says that it has the first 100 000 of 300 000 bytes, as after an interrupted upload.
  AttackUpload upload(context_, 9, make_rubbish(300'000), 1);
  welcome(upload);
  ASSERT_THAT(wire_.messages(), SizeIs(2));  // Hello and GroomOffer
  const wire::GroomOffer offer = wire_.all<wire::GroomOffer>().at(0);
  EXPECT_EQ(offer.byte_count, 300'000u);
  upload.act(kSecond_ns);
  EXPECT_THAT(wire_.all<wire::GroomChunk>(), SizeIs(0));
  wire_.answer(wire::GroomNeed{offer.hash, 100'000}, kSecond_ns);
  upload.act(kSecond_ns);
  std::uint64_t offset = 100'000;
  for (const wire::GroomChunk& chunk : wire_.all<wire::GroomChunk>()) {
    EXPECT_EQ(chunk.hash, offer.hash);
    EXPECT_EQ(chunk.offset, offset);
    offset += chunk.bytes.size();
  }
  EXPECT_EQ(offset, 300'000u);
  wire_.answer(wire::GroomStatus{offer.hash, wire::GroomState::refused}, kSecond_ns);
  upload.act(kSecond_ns);
  EXPECT_THAT(wire_.all<wire::GroomOffer>(), SizeIs(2));
  EXPECT_NE(wire_.all<wire::GroomOffer>().at(1).hash, offer.hash);
}

TEST_F(AttackTest, offers_stay_without_their_bytes) {
  // The attacker offers the late joiner's groom once, as soon as it can (at 1000 Hz), and sends none of its bytes.
  AttackOffers late_joiners(context_, 9, SlowOffers{0, 1000, 1, 0, true});
  welcome(late_joiners);
  late_joiners.act(2 * kSecond_ns);
  late_joiners.act(3 * kSecond_ns);
  ASSERT_THAT(wire_.all<wire::GroomOffer>(), SizeIs(1));
  EXPECT_EQ(wire_.all<wire::GroomOffer>().at(0).hash, context_.late_joiner_groom);
  EXPECT_EQ(wire_.all<wire::GroomOffer>().at(0).byte_count, 500u);
  EXPECT_THAT(wire_.all<wire::GroomChunk>(), SizeIs(0));
}

TEST_F(AttackTest, socket_sends_its_bytes_once_and_comes_again) {
  // The bytes are more than one piece of 64 KiB. The socket stays open for 5 s, then connects again a second later.
  const auto bytes = std::make_shared<const std::vector<std::uint8_t>>(100'000, std::uint8_t{3});
  // `false`: it reads nothing of what the server answers.
  AttackSocket socket(context_, 9, SocketAttack{bytes, false, 5});
  socket.act(kSecond_ns);
  wire_.events->on_open(kSecond_ns);
  for (int i = 0; i < 5; ++i) socket.act(kSecond_ns);
  EXPECT_EQ(wire_.sent, *bytes);
  EXPECT_EQ(wire_.readable, 0u);
  socket.act(6 * kSecond_ns);
  EXPECT_EQ(wire_.open_count, 0u);
  socket.act(7 * kSecond_ns);
  EXPECT_EQ(wire_.open_count, 1u);
}

// A groom that the decoder refuses would attack nothing but the decoder.
TEST_F(AttackTest, grooms_are_valid_within_the_default_limits) {
  // This is the default of GroomStoreLimits::groom_bytes_max.
  constexpr std::size_t kServerGroomBytesMax = 64u << 20;
  for (const auto& bytes : {make_zigzag_groom(), make_body_groom(), make_big_groom()}) {
    EXPECT_LE(bytes.size(), kServerGroomBytesMax);
    EXPECT_FALSE(std::ranges::search(bytes, kAttackGroomName).empty());
    const auto groom = wire::decode_groom(bytes);
    EXPECT_TRUE(groom) << groom.error();
  }
  EXPECT_TRUE(wire::decode_groom(*make_late_joiner_groom(1).bytes));
  EXPECT_NE(make_late_joiner_groom(1).hash, make_late_joiner_groom(2).hash);
  EXPECT_FALSE(wire::decode_groom(make_rubbish(1000)));
}

TEST_F(AttackTest, hands_are_valid_unless_they_are_meant_to_be_bad) {
  AttackHands attack(context_, 9, {.room = "attack", .characters = 2, .hands_hz = 90, .holds_hz = 60, .props_hz = 10});
  welcome(attack);
  wire_.answer(wire::MemberJoined{7, 3, 1}, kSecond_ns);
  for (int i = 0; i < 60; ++i) attack.act(2 * kSecond_ns + i * kSecond_ns / 60);
  std::size_t shapes = 0;
  for (const wire::PoseBatch& batch : wire_.all<wire::PoseBatch>()) {
    if (!batch.hands) continue;
    EXPECT_EQ(validate(batch.hands->hands), "");
    for (const Hand& hand : batch.hands->hands) shapes += hand.shapes.size();
  }
  // Each message has the most shapes that the protocol allows.
  EXPECT_GE(shapes, kHandShapesMax);
  ASSERT_THAT(wire_.all<wire::TakeHold>(), SizeIs(testing::Ge(1u)));
  EXPECT_EQ(wire_.all<wire::TakeHold>()[0].member, 7u);
  EXPECT_EQ(wire::validate(wire_.all<wire::TakeHold>()[0]), "");
  EXPECT_EQ(wire_.all<wire::SetTouch>()[0].audience, TouchAudience::everyone);
  EXPECT_THAT(wire_.all<wire::SetProps>(), SizeIs(testing::Ge(1u)));

  // The attack has eight holds at once (kHeldAtOnce) and then releases and takes in turn. A release must name a hold
  // that exists, and must not come in the tick of its own hold.
  std::set<std::pair<std::uint32_t, std::uint8_t>> taken;
  std::size_t releases = 0;
  for (const wire::Message& message : wire_.messages()) {
    if (const auto* take = std::get_if<wire::TakeHold>(&message)) taken.emplace(take->member, take->hand);
    if (const auto* release = std::get_if<wire::LetGo>(&message)) {
      ++releases;
      EXPECT_EQ(taken.erase({release->member, release->hand}), 1u) << "it holds nothing there";
      EXPECT_THAT(taken, testing::Not(testing::IsEmpty())) << "in the same tick it would hold nothing";
    }
  }
  // The second has 60 events: eight holds, then some 26 releases.
  EXPECT_GT(releases, 10u);
  wire_.answer(wire::Held{7, 3, 12}, 3 * kSecond_ns);
  wire_.answer(wire::Held{7, 3, 0}, 3 * kSecond_ns);
  EXPECT_EQ(events_["holds"], 1u);
  EXPECT_EQ(events_["holds_ended"], 1u);
}

TEST_F(AttackTest, bad_touches_are_refused_and_none_ends_its_session) {
  AttackHands attack(context_, 9, {.room = "attack", .bad_hz = 400});
  welcome(attack);
  const std::size_t good_bytes = wire_.sent.size();
  for (int i = 0; i < 10; ++i) attack.act(2 * kSecond_ns + i * kSecond_ns / 10);
  int bad_hands = 0;
  channel::PacketSplitter splitter(wire::kPacketBytesMax);
  splitter.feed(std::span(wire_.sent).subspan(good_bytes), [&](std::span<const std::uint8_t> packet) {
    const wire::DecodedPacket decoded = wire::decode_packet(packet);
    EXPECT_THAT(decoded.error, testing::AnyOf(wire::DecodeError::none, wire::DecodeError::invalid)) << decoded.detail;
    if (decoded.error != wire::DecodeError::none) bad_hands += decoded.detail.starts_with("hand");
    if (const auto* hold = std::get_if<wire::TakeHold>(&decoded.envelope.message)) {
      EXPECT_NE(wire::validate(*hold), "");
    }
  });
  // The 0.9 s have some 360 bad messages at 400 Hz, a quarter of them with damaged hands. A few of those are valid by
  // chance.
  EXPECT_GT(bad_hands, 70);
}

TEST_F(AttackTest, each_attack_has_a_meaning_and_attackers) {
  EXPECT_THAT(attack_meanings(), Each(testing::Ne("")));
  for (const Attack attack :
       {Attack::resume, Attack::silent, Attack::hellos, Attack::prologue, Attack::churn, Attack::rooms, Attack::observe,
        Attack::wind, Attack::poses, Attack::appearances, Attack::rides, Attack::offers, Attack::hands})
    EXPECT_FALSE(make_attackers(attack, context_).empty());
}

}  // namespace
}  // namespace hairnet::load
