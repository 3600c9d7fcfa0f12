#include "tests/whole/bad_client.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <utility>

namespace hairnet::whole {
namespace {

// scenario.cpp limits the characters of a session to 16: kManyCharacters is below this limit, kTooManyCharacters above.
constexpr std::uint32_t kManyCharacters = 12, kTooManyCharacters = 20;

}  // namespace

bool sends_bad_datagrams(Misbehaviour kind) {
  return kind == Misbehaviour::datagram_corrupter || kind == Misbehaviour::noise || kind == Misbehaviour::mutant ||
         kind == Misbehaviour::stranger;
}

BadClient::BadClient(Timeline& timeline, Journal& journal, ServerHost& host, BadClientPlan plan, std::uint64_t seed)
    : timeline_(&timeline),
      journal_(&journal),
      host_(&host),
      plan_(std::move(plan)),
      random_(seed, 1000 + static_cast<std::uint64_t>(plan_.number)),
      messages_(random_.next()),
      splitter_(wire::kPacketBytesMax) {}

void BadClient::start(std::int64_t until_ns) {
  until_ns_ = until_ns;
  connect();
}

void BadClient::stop() {
  until_ns_ = 0;
  if (connection_) {
    const std::shared_ptr<SimulatedConnection> wire = std::exchange(connection_, nullptr);
    left_.push_back(wire);
    wire->forget_client();
    if (random_.unit() < 0.3)
      wire->break_now({-1, random_.unit() < 0.5 ? 0 : -1});
    else
      wire->drop();
  }
  // Connections that were left with unsent bytes break now. Otherwise these bytes would arrive long after the
  // disturbances.
  for (const std::weak_ptr<SimulatedConnection>& left : left_) {
    if (const auto wire = left.lock(); wire && !wire->all_sent()) wire->break_now({-1, random_.unit() < 0.5 ? 0 : -1});
  }
}

bool BadClient::has_all_arrived() const {
  return std::ranges::all_of(left_, [](const std::weak_ptr<SimulatedConnection>& left) {
    const auto wire = left.lock();
    return !wire || wire->all_arrived();
  });
}

void BadClient::connect() {
  if (timeline_->now_ns() >= until_ns_ || connection_) return;
  ++turn_;
  is_welcome_ = false;
  splitter_ = channel::PacketSplitter(wire::kPacketBytesMax);
  journal_->count(kind_name() + " bad client dials");
  connection_ =
      std::make_shared<SimulatedConnection>(*timeline_, *host_, *this, plan_.quality, plan_.address, random_.next());
  connection_->connect(false);
}

// Leaves the connection, which breaks or ends, and makes another one.
void BadClient::redial(double wait_ns_max) {
  const std::shared_ptr<SimulatedConnection> wire = std::exchange(connection_, nullptr);
  ++turn_;
  left_.push_back(wire);
  wire->forget_client();
  if (random_.unit() < 0.5)
    wire->drop();
  else
    wire->break_now({-1, static_cast<std::int64_t>(random_.between(0, 2e8))});
  timeline_->after(static_cast<std::int64_t>(random_.between(1e6, wait_ns_max)), [this] { connect(); });
}

void BadClient::send(const wire::Message& message) {
  if (connection_ && connection_->is_open()) connection_->write(wire::encode_packet({clock_ns(), message}));
}

void BadClient::hello() {
  wire::Hello hello;
  hello.client_name = name();
  hello.room = plan_.room;
  hello.token = plan_.token;
  if (plan_.kind == Misbehaviour::drip_reader) hello.role = wire::Role::observer;
  // The probability that the client resumes its last session instead of beginning a new one.
  const double resumes = plan_.kind == Misbehaviour::resumer ? 1 : plan_.kind == Misbehaviour::rejoiner ? 0 : 0.5;
  if (welcome_ && random_.unit() < resumes) {
    hello.session = welcome_->session;
    hello.secret = welcome_->secret;
  }
  if (plan_.kind == Misbehaviour::wrong_hello) {
    // The wrong part is the version, the room, the token's time (expired), the token's room, the session or the token
    // itself.
    switch (random_.next() % 6) {
      case 0:
        hello.protocol_version = static_cast<std::uint16_t>(random_.next());
        break;
      case 1:
        hello.room = "no such/room";
        break;
      case 2:
        hello.token = assets().token(true, plan_.room, "");
        break;
      case 3:
        hello.token = assets().token(false, "another", "");
        break;
      case 4:
        // This may be the session of another client, whose secret the hello lacks.
        hello.session = 1 + random_.next() % 12;
        break;
      default:
        hello.token = "x.y.z";
        break;
    }
  }
  send(hello);
}

// The first action comes 20 ms after the hello. `turn` tells whether the connection is still the same then.
void BadClient::on_open() {
  const std::uint64_t turn = turn_;
  // Half of these clients send datagrams before any hello.
  if (sends_bad_datagrams(plan_.kind) && random_.unit() < 0.5) send_bad_datagrams();
  switch (plan_.kind) {
    case Misbehaviour::silent:
      return say_part_of_hello();
    case Misbehaviour::noise:
      break;
    case Misbehaviour::slow_reader:
      hello();
      if (random_.unit() < 0.5) connection_->pause_reading(true);
      break;
    default:
      hello();
      break;
  }
  timeline_->after(20 * kMs, [this, turn] {
    if (turn == turn_) act();
  });
}

void BadClient::say_part_of_hello() {
  const double pick = random_.unit();
  if (pick < 0.4) return;
  if (pick < 0.6) {
    // These bytes announce the largest packet that a server takes before a hello, and lack its last byte. The server
    // must wait for that byte, and time out.
    std::vector<std::uint8_t> bytes(server::kHelloPacketBytesMax - 1);
    const auto size = static_cast<std::uint32_t>(server::kHelloPacketBytesMax - sizeof(std::uint32_t));
    std::memcpy(bytes.data(), &size, sizeof size);
    return connection_->write(bytes);
  }
  wire::Hello hello;
  hello.client_name = name();
  const std::vector<std::uint8_t> packet = wire::encode_packet({clock_ns(), hello});
  connection_->write(std::span(packet).first(static_cast<std::size_t>(random_.next() % packet.size())));
  if (random_.unit() < 0.5) connection_->half_close();
}

void BadClient::on_bytes(std::span<const std::uint8_t> bytes) {
  const bool valid = splitter_.feed(bytes, [this](std::span<const std::uint8_t> packet) { on_packet(packet); });
  if (!valid) journal_->fault(name(), "is sent a stream that cannot be split");
}

void BadClient::on_packet(std::span<const std::uint8_t> packet) {
  const wire::DecodedPacket decoded = wire::decode_packet(packet);
  if (decoded.error != wire::DecodeError::none)
    return journal_->fault(name(), "is sent a bad packet: " + decoded.detail);
  const wire::Message& message = decoded.envelope.message;
  journal_->mix(message.index());
  if (const auto* welcome = std::get_if<wire::Welcome>(&message)) {
    welcome_ = *welcome;
    is_welcome_ = true;
    members_.clear();
    if (!welcome->resumed) characters_.clear();
  } else if (const auto* joined = std::get_if<wire::MemberJoined>(&message)) {
    members_.push_back(joined->member);
  } else if (const auto* error = std::get_if<wire::Error>(&message)) {
    journal_->count(kind_name() + " got " + std::string(wire::to_string(error->reason)));
    if (error->reason == wire::ErrorReason::none || error->detail.empty())
      journal_->fault(name(), "is refused without a reason");
  } else if (const auto* goodbye = std::get_if<wire::Goodbye>(&message)) {
    is_welcome_ = false;
    journal_->count(kind_name() + " sent away, " + std::string(wire::to_string(goodbye->reason)));
    if (goodbye->reason == wire::GoodbyeReason::none) journal_->fault(name(), "is sent away without a reason");
  }
}

// Rejoiners and resumers come back within 50 ms, the others within 0.8 s.
void BadClient::on_closed(const std::string& error) {
  if (is_welcome_) journal_->count(kind_name() + " cut off, " + error);
  connection_.reset();
  ++turn_;
  const bool is_eager = plan_.kind == Misbehaviour::rejoiner || plan_.kind == Misbehaviour::resumer;
  timeline_->after(static_cast<std::int64_t>(is_eager ? random_.between(1e6, 5e7) : random_.between(2e7, 8e8)),
                   [this] { connect(); });
}

void BadClient::act() {
  if (timeline_->now_ns() >= until_ns_ || !connection_ || !connection_->is_open()) return;
  if (sends_bad_datagrams(plan_.kind)) send_bad_datagrams();
  misbehave();
  const std::uint64_t turn = turn_;
  timeline_->after(static_cast<std::int64_t>(random_.between(5e6, 1e8)), [this, turn] {
    if (turn == turn_) act();
  });
}

void BadClient::misbehave() {
  switch (plan_.kind) {
    case Misbehaviour::silent:
    case Misbehaviour::wrong_hello:
      return;
    case Misbehaviour::noise: {
      std::vector<std::uint8_t> bytes(random_.next() % 300);
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_.next());
      return connection_->write(bytes);
    }
    case Misbehaviour::mutant:
      return mutate();
    case Misbehaviour::stranger:
      return send(random_valid_message());
    case Misbehaviour::flood:
      // 60 empty messages every 5 to 100 ms are more than the 300 messages a second of scenario.cpp.
      for (int i = 0; i < 60 && connection_->takes_more(); ++i) send(wire::PoseBatch{});
      return;
    case Misbehaviour::pose_flood:
      return flood_poses();
    case Misbehaviour::slow_reader:
      connection_->pause_reading(random_.unit() < 0.8);
      if (random_.unit() < 0.2) send(wire::Observe{});
      if (random_.unit() < 0.3 && !members_.empty()) send(wire::GroomRequest{assets().grooms.back().hash, 0});
      return send(wire::PoseBatch{});
    case Misbehaviour::groom_corrupter:
      return corrupt_groom();
    case Misbehaviour::crowd:
      return add_crowd();
    case Misbehaviour::churner:
      add_crowd();
      if (random_.unit() < 0.3) redial(1e8);
      return;
    case Misbehaviour::rejoiner:
      if (random_.unit() < 0.2) redial(2e7);
      return;
    case Misbehaviour::resumer:
      add_characters(kManyCharacters, LevelIndex::ether);
      if (welcome_) redial(2e7);
      return;
    case Misbehaviour::groom_trickler:
      return trickle_groom();
    case Misbehaviour::groom_heaper:
      return heap_groom();
    case Misbehaviour::drip_reader:
      if (random_.unit() < 0.1) send(wire::Observe{});
      return send(wire::PoseBatch{});
    case Misbehaviour::shuffler:
      return shuffle();
    case Misbehaviour::hoarder:
      return hoard();
    case Misbehaviour::chooser:
      return choose();
    case Misbehaviour::windmaker:
      return make_wind();
    case Misbehaviour::datagram_corrupter:
      add_characters(2, LevelIndex::ether);
      return pose_characters();
  }
}

// Sends random bytes, and packets of a client as datagrams: whole, cut off, with bytes behind them, or with changed
// bits.
void BadClient::send_bad_datagrams() {
  if (!connection_->has_datagrams()) return;
  for (std::uint64_t n = up_to(4); n > 0; --n) {
    std::vector<std::uint8_t> bytes(random_.next() % quic::kDatagramBytesMax);
    const double pick = random_.unit();
    if (pick < 0.3) {
      for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_.next());
    } else {
      bytes = wire::encode_packet({clock_ns(), random_valid_message()});
      // A frame datagram begins with these bytes. Only servers send such datagrams.
      if (pick > 0.95) bytes = {'F', 'B'};
      if (pick < 0.4) bytes.resize(random_.next() % bytes.size());
      if (pick >= 0.4 && pick < 0.5) bytes.resize(bytes.size() + up_to(8));
      for (std::uint64_t flips = pick < 0.7 && !bytes.empty() ? random_.next() % 4 : 0; flips > 0; --flips)
        bytes[random_.next() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random_.next() % 8);
    }
    if (bytes.size() > quic::kDatagramBytesMax) continue;
    journal_->count("bad datagrams");
    connection_->write_datagram(std::move(bytes));
  }
}

// Up to three bits behind the size prefix are changed, so the packet's length stays valid.
void BadClient::mutate() {
  std::vector<std::uint8_t> packet =
      wire::encode_packet({clock_ns(), messages_.message(random_.next() % wire::kMessageKinds)});
  const std::uint64_t flips = random_.next() % 4;
  for (std::uint64_t i = 0; i < flips; ++i)
    packet[4 + random_.next() % (packet.size() - 4)] ^= static_cast<std::uint8_t>(1u << random_.next() % 8);
  connection_->write(packet);
}

// Makes a message that a client may send. It is about characters and grooms that exist, and about some that do not.
wire::Message BadClient::random_valid_message() {
  const auto number = [&] { return static_cast<std::uint32_t>(random_.next() % 6); };
  const auto level = [&] {
    return std::array{LevelIndex::low, LevelIndex::ether, LevelIndex::rigid}[random_.next() % 3];
  };
  const Assets::GroomFile& groom = assets().grooms[random_.next() % assets().grooms.size()];
  switch (random_.next() % 15) {
    case 0:
      return wire::GroomOffer{groom.hash, groom.bytes->size() + random_.next() % 2};
    case 1: {
      wire::AddCharacter add{number(), groom.hash, level(), {}};
      if (random_.unit() < 0.5) add.state = messages_.hair_state();
      return add;
    }
    case 2:
      return wire::SetLevel{number(), level()};
    case 3:
      return wire::RemoveCharacter{number()};
    case 4: {
      wire::SetMaterial set{number(), messages_.material_scale()};
      if (random_.unit() < 0.5) set.scale.stiffness = -1;
      return set;
    }
    case 5: {
      wire::Observe observe = messages_.observe();
      if (random_.unit() < 0.3) observe.stride = 3;
      return observe;
    }
    case 6:
    case 7:
    case 8:
      return wire::PoseBatch{{{number(), ++sequence_, clock_ns(), random_.unit() < 0.1, messages_.pose()}}};
    case 9:
    case 10: {
      wire::ReportImportance report;
      for (int i = 0; i < 4; ++i) report.members.push_back({number(), 0.5f, random_.unit() < 0.5});
      return report;
    }
    case 11:
      return wire::GroomRequest{groom.hash, random_.next() % (groom.bytes->size() + 2)};
    case 12:
      return wire::GroomChunk{groom.hash, random_.next() % 2, {1, 2, 3}};
    case 13:
      return wire::SetAppearance{number(), std::string(random_.next() % 400, '\xfe'), wire::Appearance{}};
    default:
      return messages_.message(random_.next() % wire::kMessageKinds);
  }
}

// Half of the uploads have one wrong bit, and half stop in the middle. Chunks are a third of the file, or at least 400
// bytes.
void BadClient::corrupt_groom() {
  if (!welcome_) return;
  const Assets::GroomFile& groom = assets().grooms[random_.next() % assets().grooms.size()];
  std::vector<std::uint8_t> bytes = *groom.bytes;
  const bool wrong = random_.unit() < 0.5;
  if (wrong) bytes[bytes.size() / 2] ^= 1;
  send(wire::GroomOffer{groom.hash, bytes.size()});
  const std::size_t end = random_.unit() < 0.5 ? bytes.size() : bytes.size() / 2;
  for (std::size_t at = 0; at < end;) {
    const std::size_t count = std::min(end - at, std::max<std::size_t>(400, bytes.size() / 3));
    const auto begin = bytes.begin() + static_cast<std::ptrdiff_t>(at);
    send(wire::GroomChunk{groom.hash, at, {begin, begin + static_cast<std::ptrdiff_t>(count)}});
    at += count;
  }
}

// The store must not keep the memory, or the turn, of an upload that hardly goes on.
void BadClient::trickle_groom() {
  if (!welcome_) return;
  if (trickled_.empty() || random_.unit() < 0.2) {
    const Assets::GroomFile& known = assets().grooms[random_.next() % assets().grooms.size()];
    wire::GroomOffer offer{known.hash, known.bytes->size()};
    // A groom that it has offered before is replaced by one that nobody has.
    if (trickled_.contains(known.hash)) {
      for (std::uint8_t& byte : offer.hash) byte = static_cast<std::uint8_t>(random_.next());
      offer.byte_count = random_.unit() < 0.5 ? up_to(100) : host_->config().grooms.groom_bytes_max;
    }
    trickled_.emplace(offer.hash, 0);
    return send(offer);
  }
  auto& [hash, at] = *std::next(trickled_.begin(), static_cast<std::ptrdiff_t>(random_.next() % trickled_.size()));
  wire::GroomChunk chunk{hash, at, std::vector<std::uint8_t>(up_to(20))};
  at += chunk.bytes.size();
  send(chunk);
}

// Nine of ten uploads are rubbish that no build can read, and the others cost much to build (Assets::costly).
void BadClient::heap_groom() {
  if (!welcome_) return;
  for (std::uint64_t n = up_to(8); n > 0; --n) {
    Assets::GroomFile groom = assets().costly[random_.next() % assets().costly.size()];
    if (random_.unit() < 0.9) {
      std::vector<std::uint8_t> rubbish(up_to(500));
      for (std::uint8_t& byte : rubbish) byte = static_cast<std::uint8_t>(random_.next());
      groom = groom_file(std::move(rubbish));
    }
    send(wire::GroomOffer{groom.hash, groom.bytes->size()});
    send(wire::GroomChunk{groom.hash, 0, *groom.bytes});
  }
}

void BadClient::flood_poses() {
  // Poses 1 ns apart are too close to each other; poses 5 ms apart are not.
  constexpr std::int64_t kSpacings_ns[] = {1, 5 * kMs};
  add_crowd();
  for (std::uint64_t n = up_to(6); n > 0; --n) {
    wire::PoseBatch batch;
    const std::int64_t spacing_ns = kSpacings_ns[random_.next() % 2];
    for (int i = 0; i < 60; ++i)
      batch.poses.push_back({1, ++sequence_, clock_ns() + i * spacing_ns, false, rigid_pose({})});
    send(batch);
  }
}

void BadClient::shuffle() {
  add_characters(1, LevelIndex::ether);
  if (!welcome_) return;
  for (std::uint64_t n = up_to(30); n > 0 && connection_->takes_more(); --n) {
    send(wire::RemoveCharacter{1});
    send(wire::AddCharacter{1, groom_, LevelIndex::ether, {}});
  }
}

// Fills a room together with others of its kind, and reports their characters as large on its screen.
void BadClient::hoard() {
  add_characters(kTooManyCharacters, LevelIndex::low);
  pose_characters();
  wire::ReportImportance report;
  for (const std::uint32_t member : members_) report.members.push_back({member, 1, true});
  if (random_.unit() < 0.2) send(report);
}

void BadClient::choose() {
  add_characters(kManyCharacters, LevelIndex::ether);
  pose_characters();
  wire::Observe observe;
  observe.mode = wire::ObserveMode::nearest;
  for (std::uint64_t n = up_to(60); n > 0 && connection_->takes_more(); --n) {
    observe.count = static_cast<std::uint32_t>(up_to(8));
    observe.members = members_;
    send(observe);
  }
}

void BadClient::make_wind() {
  wire::SetWind set;
  const bool is_same = random_.unit() < 0.3;
  for (std::uint64_t n = up_to(20); n > 0 && connection_->takes_more(); --n) {
    if (!is_same) set.wind.mean_m_per_s.x() = random_.between(-5, 5);
    send(set);
  }
}

void BadClient::add_crowd() {
  if (!welcome_) return;
  // The client sometimes forgets its characters, and then adds the same numbers again.
  if (random_.unit() < 0.2) characters_.clear();
  add_characters(4, LevelIndex::ether);
  pose_characters();
  if (random_.unit() >= 0.2) return;
  send(wire::RemoveCharacter{*characters_.begin()});
  const Assets::GroomFile& groom = assets().grooms[random_.next() % assets().grooms.size()];
  if (random_.unit() < 0.5) send(wire::AddCharacter{*characters_.begin(), groom.hash, LevelIndex::rigid, {}});
}

// Adds characters with a groom, if it has none yet.
void BadClient::add_characters(std::uint32_t count, LevelIndex level) {
  if (!welcome_ || !characters_.empty()) return;
  const Assets::GroomFile& groom = assets().grooms[random_.next() % assets().grooms.size()];
  send(wire::GroomOffer{groom.hash, groom.bytes->size()});
  send(wire::GroomChunk{groom.hash, 0, *groom.bytes});
  groom_ = groom.hash;
  for (std::uint32_t number = 1; number <= count; ++number) {
    send(wire::AddCharacter{number, groom_, level, {}});
    characters_.insert(number);
  }
}

void BadClient::pose_characters() {
  wire::PoseBatch batch;
  ++sequence_;
  for (const std::uint32_t number : characters_)
    batch.poses.push_back(
        {number, sequence_, clock_ns(), false, rigid_pose({Quat::Identity(), {random_.between(-1, 1), 1.6, 0}})});
  if (!batch.poses.empty()) send(batch);
}

}  // namespace hairnet::whole
