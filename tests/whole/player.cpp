#include "tests/whole/player.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "schema/wire/frame_datagram.hpp"

namespace hairnet::whole {
namespace {

constexpr std::int64_t kNever_ns = std::numeric_limits<std::int64_t>::max();
// A few characters make every case: none, one, and some of which one can go.
constexpr std::size_t kCharactersMax = 3;

template <class T>
const T& one_of(const std::vector<T>& all, Random& random) {
  return all[static_cast<std::size_t>(random.next() % all.size())];
}

}  // namespace

Player::Player(Timeline& timeline, Journal& journal, ServerHost& host, PlayerPlan plan, std::uint64_t seed)
    : timeline_(&timeline),
      journal_(&journal),
      host_(&host),
      plan_(std::move(plan)),
      random_(seed, 100 + static_cast<std::uint64_t>(plan_.number)),
      touching_(Random(seed, 200 + static_cast<std::uint64_t>(plan_.number))) {}

// A clock that is 1 ppm too fast gains a nanosecond in each millisecond.
std::int64_t Player::clock_ns() const {
  const std::int64_t now_ns = timeline_->now_ns();
  return plan_.clock_offset_ns + now_ns + now_ns / 1'000'000 * plan_.clock_ppm;
}

void Player::join() {
  // The player is in its room already.
  if (core_ && !core_->ended() && !leaving_) return;
  joined_ = true;
  leaving_ = false;
  broken_ns_ = -1;
  if (connection_) std::exchange(connection_, nullptr)->drop();
  make_core();
  turn();
  if (!std::exchange(posing_, true)) send_poses();
}

void Player::make_core() {
  finish();
  link::LinkCoreOptions options;
  options.client_name = name();
  options.room = plan_.room;
  options.token = plan_.token;
  // A connection over a line that loses packets, or to a server that has just died, needs more tries.
  options.connect_timeout_s = plan_.quality.lossy || plan_.find_server ? 5 : 1;
  options.trace = random_.next();
  core_ = std::make_unique<link::LinkCore>(options);
  members_.clear();
  has_session_ = false;
  haired_.clear();
  counted_undecodable_ = counted_unknown_ = counted_evaluated_ = 0;
  core_->start();
  for (const auto& [number, character] : characters_) {
    const Assets::GroomFile& groom = assets().grooms[character.groom];
    core_->offer_groom(groom.hash, groom.bytes);
    core_->send(wire::AddCharacter{number, groom.hash, character.level, {}, character.tag, character.appearance});
  }
  if (!sees_all_) core_->send(observe_);
  // The room may still have a wind that this player set before it left.
  if (calm_) core_->send(wire::SetWind{});
}

void Player::add_character() {
  if (characters_.size() >= kCharactersMax) return;
  const std::uint32_t number = ++last_number_;
  Character& character = characters_[number];
  character.groom = static_cast<std::size_t>(random_.next() % plan_.groom_count);
  // Of 16 characters, 6 have ether, 3 learnt hair, 4 the low level, 1 the medium level and 2 rigid hair: fine levels
  // take most of a trial's time.
  const std::uint64_t pick = random_.next() % 16;
  character.level = pick < 6    ? LevelIndex::ether
                    : pick < 9  ? LevelIndex::learnt
                    : pick < 13 ? LevelIndex::low
                    : pick < 14 ? LevelIndex::medium
                                : LevelIndex::rigid;
  // The motion differs from character to character: see Character in player.hpp. Heads stand 1.6 m high, within 5 m of
  // the room's middle.
  character.phase = random_.between(0, 6);
  character.reach = random_.between(0.02, 0.3);
  character.turn = random_.between(0.1, 0.9);
  character.place = {random_.between(-5, 5), 1.6, random_.between(-5, 5)};
  change_appearance(character);
  journal_->count("character added");
  if (!core_) return;
  const Assets::GroomFile& groom = assets().grooms[character.groom];
  core_->offer_groom(groom.hash, groom.bytes);
  core_->send(wire::AddCharacter{number, groom.hash, character.level, {}, character.tag, character.appearance});
}

// Chooses tags of every size up to the limit, some of which are not text. Each tag differs from the one before.
void Player::change_appearance(Character& character) {
  const std::uint32_t n = ++change_count_;
  character.tag = name() + '\xff' + std::to_string(n);
  // The numbers are arbitrary primes: they make tags from a few bytes to the limit, and colours that differ from each
  // other.
  character.tag.resize(std::min(character.tag.size() + 37 * (n % 7), wire::kTagBytesMax), '\0');
  const auto byte = [n](std::uint32_t factor) { return static_cast<std::uint8_t>(n * factor); };
  character.appearance.reset();
  if (n % 4 != 0)
    character.appearance = {{byte(3), byte(5), byte(7)}, {byte(11), byte(13), byte(17)}, {byte(19), 1, 2}, byte(23)};
}

void Player::leave(bool says_goodbye) {
  leaving_ = true;
  if (!core_) return;
  if (says_goodbye) {
    journal_->count("left with goodbye");
    core_->leave(clock_ns());
    turn();
    return;
  }
  journal_->count("left without a word");
  if (connection_) {
    const std::shared_ptr<SimulatedConnection> wire = std::exchange(connection_, nullptr);
    wire->forget_client();
    // The client's machine is gone. In three of ten cases the server never hears of it, and must notice by the silence.
    const bool server_announced = random_.unit() < 0.7;
    if (!server_announced) journal_->count("half-open, left");
    wire->break_now({-1, server_announced ? static_cast<std::int64_t>(random_.between(0, 1e8)) : -1});
  }
  finish();
  core_.reset();
  members_.clear();
}

void Player::finish() {
  if (!core_) return;
  hear();
  const link::LinkCounters counters = core_->counters();
  journal_->count("frames received", counters.frames_received);
  journal_->count("reconnected", counters.reconnects);
  journal_->count("resumed", counters.resumes);
}

void Player::set_moving(bool moving) {
  for (auto& [number, character] : characters_) {
    if (character.moving && !moving) character.still_since_ns = timeline_->now_ns();
    character.moving = moving;
  }
}

void Player::send(wire::ClientMessage message) {
  if (!core_) return;
  core_->send(std::move(message));
  turn();
}

// From here on the player is one to whom everything must be right again: it sees all, its materials and wind are the
// defaults, and nothing breaks its connection.
void Player::calm_down() {
  act_until_ns_ = gap_until_ns_ = 0;
  calm_since_ns_ = timeline_->now_ns();
  calm_ = true;
  pause_reading(false);
  if (connection_) connection_->break_no_more();
  set_moving(true);
  observe_ = {};
  sees_all_ = true;
  if (!core_) return;
  core_->send(observe_);
  core_->send(wire::SetWind{});
  std::vector<wire::MemberImportance> all;
  for (const auto& [member, m] : members_) all.push_back({member, 0.5f, true});
  core_->report_importance(all);
  for (const auto& [number, character] : characters_) core_->send(wire::SetMaterial{number, {}});
  end_touch();
  if (connection_ && !is_active()) journal_->count("calm while connecting");
  turn();
}

bool Player::has_all_arrived() const {
  return std::ranges::all_of(connections_, [this](const std::weak_ptr<SimulatedConnection>& weak) {
    const auto wire = weak.lock();
    return !wire || wire == connection_ || wire->all_arrived();
  });
}

void Player::break_connection(const ConnectionLoss& how, std::optional<std::uint64_t> after_bytes, bool of_server) {
  if (!connection_ || !connection_->is_open()) return;
  if (!after_bytes) {
    connection_->break_now(how);
  } else {
    connection_->break_after(*after_bytes, of_server, how);
  }
  journal_->count(after_bytes ? "broken at a byte" : "broken");
  if (how.server_announced_ns < 0) journal_->count("half-open");
}

void Player::pause_reading(bool paused) {
  if (connection_) connection_->pause_reading(paused);
}

void Player::connect() {
  opening_ns_ = timeline_->now_ns();
  core_->on_opening(clock_ns());
  half_closed_ = false;
  if (plan_.find_server) host_ = &plan_.find_server(core_->redirected_to());
  splitter_ = channel::PacketSplitter(wire::kPacketBytesMax);
  connection_ = std::make_shared<SimulatedConnection>(
      *timeline_, *host_, *this, plan_.quality, static_cast<std::uint64_t>(plan_.number), random_.next() ^ ++dials_);
  connections_.push_back(connection_);
  // One connection in twenty gets no answer while the player is disturbed, so the core's time-out must work.
  const bool into_nothing = !plan_.steady && act_until_ns_ > timeline_->now_ns() && random_.unit() < 0.05;
  if (into_nothing) journal_->count("dialled into nothing");
  connection_->connect(into_nothing);
}

// A call of the core may bring another call of turn(), by an event or a connection that breaks. The inner call only
// asks the outer one for another round, as a driver with one thread does.
void Player::turn() {
  if (!core_) return;
  if (std::exchange(turning_, true)) {
    turn_again_ = true;
    return;
  }
  do {
    turn_again_ = false;
    core_->poll(clock_ns());
    // The events are read before another connection takes the place of the one that they come from.
    hear();
    if (core_->wants_close()) {
      if (connection_) {
        connection_->drop();
        connection_.reset();
      }
      core_->on_closed("", clock_ns());
    }
    if (core_->wants_connection()) connect();
    while (connection_ && connection_->takes_more()) {
      const std::vector<std::uint8_t> packet = core_->take_packet(clock_ns());
      if (packet.empty()) break;
      // A packet that is too large for a datagram goes by the stream.
      const bool may_be_lost = core_->taken_may_be_lost() && packet.size() <= quic::kDatagramBytesMax;
      if (connection_->has_datagrams() && may_be_lost)
        connection_->write_datagram(packet);
      else
        connection_->write(packet);
    }
    if (connection_ && core_->wants_half_close() && !std::exchange(half_closed_, true)) connection_->half_close();
    hear();
  } while (turn_again_);
  turning_ = false;
  if (core_->ended()) {
    if (connection_) {
      connection_->drop();
      connection_.reset();
    }
    if (leaving_ || !joined_) return;
    // A first attempt that fails is a core's last: a person would try again.
    journal_->count("began again");
    // People try again after 50 to 500 ms.
    const std::int64_t wait_ns = static_cast<std::int64_t>(random_.between(5e7, 5e8));
    finish();
    core_.reset();
    members_.clear();
    timeline_->after(wait_ns, [this] {
      if (core_ || leaving_) return;
      make_core();
      turn();
    });
    return;
  }
  wake_at(core_->next_deadline_ns());
}

// `local_ns` is a time of the player's own clock, which is converted to the timeline. The microsecond more makes sure
// that the player's clock has reached the time, in spite of rounding.
void Player::wake_at(std::int64_t local_ns) {
  if (local_ns == kNever_ns) return;
  const auto wait_ns =
      static_cast<std::int64_t>(static_cast<double>(local_ns - clock_ns()) / (1 + 1e-6 * plan_.clock_ppm));
  const std::int64_t at_ns = timeline_->now_ns() + std::max<std::int64_t>(wait_ns, 0) + 1000;
  if (wake_ns_ > timeline_->now_ns() && wake_ns_ <= at_ns) return;
  wake_ns_ = at_ns;
  timeline_->at(at_ns, [this, at_ns] {
    if (wake_ns_ == at_ns) turn();
  });
}

void Player::on_open() {
  if (!core_) return;
  core_->on_open(clock_ns(), connection_->has_datagrams());
  turn();
}

void Player::on_bytes(std::span<const std::uint8_t> bytes) {
  if (!core_) return;
  if (plan_.on_frames)
    splitter_.feed(bytes, [this](std::span<const std::uint8_t> packet) { note_frames(wire::decode_packet(packet)); });
  core_->on_bytes(bytes, clock_ns());
  turn();
}

void Player::note_frames(const wire::DecodedPacket& decoded) {
  const auto* const batch = std::get_if<wire::FrameBatch>(&decoded.envelope.message);
  // A batch without frames is a sign of life of a server, whoever owns the room.
  if (plan_.on_frames && core_->active() && batch && !batch->frames.empty())
    plan_.on_frames(*host_, connection_->life(), decoded.envelope.clock_ns);
}

void Player::on_datagram(std::span<const std::uint8_t> bytes) {
  if (!core_) return;
  journal_->count("datagrams received");
  if (plan_.on_frames && wire::is_frame_datagram(bytes)) note_frames(wire::decode_frame_datagram(bytes));
  core_->on_packet(bytes, clock_ns());
  turn();
}

void Player::on_download_packet(std::span<const std::uint8_t> packet) {
  if (!core_) return;
  journal_->count("download packets received");
  core_->on_packet(packet, clock_ns());
  turn();
}

void Player::on_closed(const std::string& error) {
  if (!core_) return;
  note_break();
  connection_.reset();
  core_->on_closed(error, clock_ns());
  turn();
}

void Player::note_break() {
  if (core_->active() && broken_ns_ < 0) {
    broken_ns_ = connection_ && connection_->broken_ns() >= 0 ? connection_->broken_ns() : timeline_->now_ns();
    broken_life_ = connection_ ? connection_->life() : -1;
    broken_host_ = host_;
    broken_connection_ = connection_;
    had_character_ = std::ranges::any_of(members_, [](const auto& m) { return m.second.own; });
  }
}

std::set<server::CharacterKey> Player::keys() const {
  std::set<server::CharacterKey> keys;
  for (const auto& [number, character] : characters_)
    keys.insert(server::character_key(static_cast<server::SessionId>(session()), number));
  return keys;
}

// The head sways on an ellipse of `reach`, looks left and right with the body, and nods by `turn`. The frequencies have
// no common multiple, so no pose comes twice.
Pose Player::pose_of(const Character& character) const {
  const std::int64_t at_ns = character.moving ? timeline_->now_ns() : character.still_since_ns;
  const double t = 1e-9 * static_cast<double>(at_ns) + character.phase;
  // A character that rides goes round a circle of this radius, at up to 300 m/s: such a head moves fast, but does not
  // teleport.
  constexpr double kRideRadius_m = 50;
  const double ridden = character.ride_m_per_s * t / kRideRadius_m;
  const Vec3 ride = kRideRadius_m * Vec3(std::cos(ridden) - 1, 0, std::sin(ridden));
  const Vec3 place =
      character.place + Vec3(character.reach * std::sin(2.1 * t), 0, character.reach * std::cos(1.7 * t)) + ride;
  Pose pose = rigid_pose({Quat(Eigen::AngleAxisd(0.3 * std::sin(t), Vec3::UnitY())), place});
  RigidTransform& head = pose[Bone::head];
  head.rotation = head.rotation * Quat(Eigen::AngleAxisd(character.turn * std::sin(3 * t), Vec3::UnitX()));
  return pose;
}

void Player::send_poses() {
  if (leaving_ || !joined_) {
    posing_ = false;
    return;
  }
  timeline_->after(static_cast<std::int64_t>(1e9 / plan_.pose_hz), [this] { send_poses(); });
  if (!core_ || timeline_->now_ns() < gap_until_ns_) return;
  std::vector<wire::PoseSample> poses;
  for (auto& [number, character] : characters_) add_pose(number, character, poses);
  if (poses.empty()) return;
  core_->push_poses(std::move(poses));
  if (plan_.touches) core_->push_hands(touching_.hands(heads(), 1e-9 * static_cast<double>(clock_ns())), clock_ns());
  turn();
}

void Player::add_pose(std::uint32_t number, Character& character, std::vector<wire::PoseSample>& poses) {
  wire::PoseSample pose{number, ++character.sequence, clock_ns(), std::exchange(character.teleports, false),
                        pose_of(character)};
  poses.push_back(pose);
  // One pose in ten is followed by a damaged one, in plans with garbage.
  if (!plan_.sends_garbage || calm_ || random_.unit() > 0.1) return;
  pose.sequence = ++character.sequence;
  corrupt(pose);
  poses.push_back(pose);
  journal_->count("garbage pose");
}

std::vector<Touching::Head> Player::heads() const {
  std::vector<Touching::Head> heads;
  for (const auto& [number, member] : members_) {
    if (member.frames > 0) heads.push_back({number, member.pose.head()});
  }
  return heads;
}

std::vector<std::uint32_t> Player::character_numbers() const {
  std::vector<std::uint32_t> numbers;
  for (const auto& [number, character] : characters_) numbers.push_back(number);
  return numbers;
}

void Player::touch() {
  if (!core_ || !core_->active()) return;
  for (wire::ClientMessage& message : touching_.act({heads(), character_numbers(), may_set_props()})) {
    journal_->count("touch requested");
    core_->send(std::move(message));
  }
}

void Player::end_touch() {
  if (!plan_.touches) return;
  for (wire::ClientMessage& message : touching_.end(character_numbers(), may_set_props()))
    core_->send(std::move(message));
}

std::string Player::known_touch() const {
  const auto has_hands = [](const auto& person) { return person.second.second; };
  if (std::ranges::any_of(hands_of_others_, has_hands)) return "knows hands";
  const auto has_rule = [](const auto& member) { return member.second.has_touch_rule; };
  if (std::ranges::any_of(members_, has_rule)) return "knows a rule of touch";
  return {};
}

void Player::corrupt(wire::PoseSample& sample) {
  RigidTransform& bone = sample.pose.bones[static_cast<std::size_t>(random_.next() % kBoneCount)];
  switch (random_.next() % 8) {
    case 0:
      bone.position.y() = std::numeric_limits<double>::quiet_NaN();
      break;
    case 1:
      // This rotation does not have unit length.
      bone.rotation.coeffs() *= 1.1;
      break;
    case 2:
      // This place is beyond the 10 km of a pose (kPositionMax_m).
      bone.position.x() = 2e4;
      break;
    case 3:
      bone.rotation.coeffs().setZero();
      break;
    case 4:
      sample.capture_time_ns += static_cast<std::int64_t>(random_.between(-9e10, 9e10));
      break;
    case 5:
      sample.capture_time_ns += static_cast<std::int64_t>(random_.between(-2e9, 2e9));
      break;
    case 6:
      // This place is valid, because it is within 10 km (kPositionMax_m), but absurd.
      bone.position.z() = 9999;
      break;
    default:
      // Such a pose is out of order, or comes twice.
      sample.sequence -= static_cast<std::uint32_t>(random_.next() % 1000);
      break;
  }
}

void Player::act_at_random(std::int64_t until_ns) {
  act_until_ns_ = until_ns;
  if (acting_) return;
  acting_ = true;
  act();
}

void Player::act() {
  if (timeline_->now_ns() >= act_until_ns_ || leaving_) {
    acting_ = false;
    return;
  }
  timeline_->after(static_cast<std::int64_t>(1e9 * random_.between(0.2, 1.8) / plan_.actions_per_s), [this] { act(); });
  if (!core_) return;
  if (plan_.touches) touch();
  const std::vector<std::uint32_t> numbers = character_numbers();
  std::vector<std::uint32_t> seen;
  for (const auto& [member, m] : members_) seen.push_back(member);
  // The 17 actions, by number: 0 adds a character, 1 removes one, 2 and 3 set a level, 4 a material, 5 the wind, 6 and
  // 7 what is observed, 8 and 9 the importance, 10 asks for a groom, 11 teleports or rides, 12 stops the poses for a
  // while, 13 rests or moves, 14 stops reading, 15 sets an appearance, 16 replaces the connection.
  const std::uint64_t pick = random_.next() % 17;
  // The first character of a steady player must live on, seen and moving: its steps are checked.
  const bool plain = plan_.steady;
  if (pick == 0) {
    add_character();
  } else if (pick == 1 && numbers.size() > 1) {
    const std::uint32_t number = numbers.back();
    characters_.erase(number);
    core_->send(wire::RemoveCharacter{number});
    journal_->count("character removed");
  } else if (pick <= 3 && !numbers.empty() && !plain) {
    const std::uint32_t number = one_of(numbers, random_);
    characters_[number].level =
        std::array{LevelIndex::low, LevelIndex::ether, LevelIndex::rigid, LevelIndex::learnt}[random_.next() % 4];
    // The character may have been rigid for a moment, and so may have no hair to keep.
    haired_.erase(number);
    // A rigid character has no hair to keep, even if the connection breaks before its next frame.
    for (auto& [member, m] : members_) {
      const bool is_changed = m.own && server::number_of(m.key) == number;
      if (is_changed && characters_[number].level == LevelIndex::rigid) m.hair = false;
    }
    core_->send(wire::SetLevel{number, characters_[number].level});
    journal_->count("level set");
  } else if (pick == 4 && !numbers.empty()) {
    MaterialScale scale;
    scale.stiffness = static_cast<float>(random_.between(0.05, 20));
    scale.density = static_cast<float>(random_.between(0.2, 5));
    scale.gel_per_s2 = static_cast<float>(random_.between(0, 100));
    core_->send(wire::SetMaterial{one_of(numbers, random_), scale});
    journal_->count("material set");
  } else if (pick == 5) {
    Wind wind;
    if (random_.unit() < 0.5) wind.mean_m_per_s = {random_.between(-8, 8), 0, random_.between(-8, 8)};
    if (random_.unit() < 0.3) wind.turbulence_rms_m_per_s = 1;
    core_->send(wire::SetWind{wind});
    journal_->count("wind set");
  } else if (pick <= 7) {
    observe_ = {};
    observe_.mode = static_cast<wire::ObserveMode>(random_.next() % 4);
    observe_.count = static_cast<std::uint32_t>(random_.next() % 3);
    observe_.radius_m = static_cast<float>(random_.between(0, 8));
    if (random_.unit() < 0.3) observe_.from = Vec3f(1, 1, 1);
    if (!seen.empty()) observe_.members = {one_of(seen, random_)};
    observe_.stride = plain ? 1 : 1u << random_.next() % 3;
    observe_.error_m = static_cast<float>(random_.unit() < 0.3 ? 0 : random_.between(0, 0.01));
    coarsest_m_ = std::max(coarsest_m_, observe_.error_m);
    sees_all_ = false;
    core_->send(observe_);
    journal_->count("observe");
  } else if (pick <= 9 && !seen.empty()) {
    std::vector<wire::MemberImportance> report;
    for (const std::uint32_t member : seen)
      report.push_back({member, static_cast<float>(random_.unit()), members_[member].own || random_.unit() < 0.6});
    core_->report_importance(report);
    journal_->count("importance");
  } else if (pick == 10 && !seen.empty()) {
    core_->request_groom(members_[one_of(seen, random_)].groom);
    journal_->count("groom requested");
  } else if (pick == 11 && !numbers.empty()) {
    Character& character = characters_[one_of(numbers, random_)];
    character.place += Vec3(random_.between(-4, 4), 0, 0);
    character.ride_m_per_s = random_.unit() < 0.7 ? 0 : random_.between(20, 300);
    character.teleports = true;
    journal_->count(character.ride_m_per_s > 0 ? "ride" : "teleport");
  } else if (pick == 12 && !plain) {
    gap_until_ns_ = timeline_->now_ns() + static_cast<std::int64_t>(random_.between(1e8, 1.5e9));
    journal_->count("gap of poses");
  } else if (pick == 13 && !numbers.empty() && !plain) {
    Character& character = characters_[one_of(numbers, random_)];
    if (character.moving) character.still_since_ns = timeline_->now_ns();
    character.moving = !character.moving;
    journal_->count("rest or move");
  } else if (pick == 14 && !plain) {
    pause_reading(true);
    timeline_->after(static_cast<std::int64_t>(random_.between(5e7, 1.2e9)), [this] { pause_reading(false); });
    journal_->count("reads nothing for a while");
  } else if (pick == 15 && !numbers.empty()) {
    const std::uint32_t number = numbers[change_count_ % numbers.size()];
    Character& character = characters_[number];
    change_appearance(character);
    core_->send(wire::SetAppearance{number, character.tag, character.appearance});
    journal_->count("appearance set");
  } else if (pick == 16 && !plain) {
    note_break();
    if (core_->replace_connection("a better one", clock_ns())) journal_->count("connection replaced");
  }
  turn();
}

}  // namespace hairnet::whole
