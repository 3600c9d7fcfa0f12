#include "client/viewer/sources/live_room.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <utility>

#include "client/viewer/characters/hair_colour.hpp"
#include "core/shown_text.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/text.hpp"

namespace hairnet::viewer {
namespace {

constexpr const char* kWaiting = "waiting for the lattices";
// Heads are upright for at least this long, so that hair has settled before motions begin.
constexpr std::int64_t kUprightMin_ns = 1'000'000'000;
// Without a window the program waits ten minutes at most for the lattices: a server may have to build the levels of
// many new grooms first.
constexpr std::int64_t kGroomsReady_ns_max = 600'000'000'000;
// A character at a coarser level for this time stays at it: the server gives no finer one now.
constexpr std::int64_t kCoarser_ns = 3'000'000'000;
// An error within this time has the reason why a groom was refused; waiting for it makes a better message.
constexpr std::int64_t kRefusalDetail_ns = 500'000'000;
// Poses that are late by more than this many periods of the pose rate are skipped. After a stall only the newest pose
// matters; all missed ones would be a burst of old poses.
constexpr double kLateMax = 4;
// The id of another client's character is this plus its member number. Ids of own characters count from 1 and member
// numbers have 32 bits, so all ids differ.
constexpr std::uint64_t kOther = std::uint64_t{1} << 32;

std::int64_t to_ns(double seconds) {
  return static_cast<std::int64_t>(std::llround(seconds * 1e9));
}

// A member's tag as a name; empty if that is no text: a tag holds any bytes, and another client chose them.
std::string name_of(const room::Member& member) {
  return wire::is_text(member.tag) ? member.tag : std::string();
}

// Observes only this client's own characters: a list that names no others.
wire::Observe nobody() {
  wire::Observe observe;
  observe.mode = wire::ObserveMode::list;
  return observe;
}

}  // namespace

link::LinkOptions LiveRoom::link_options(const ViewOptions& options) {
  link::LinkOptions link;
  link.server = options.server;
  link.tls = options.tls;
  link.transport = options.transport;
  link.core.client_name = "hairnet-view";
  link.core.room = options.room;
  link.core.token = options.token;
  // An observer may not set the wind, so a client that wants to is a participant without characters.
  if (options.characters.empty() && !options.wind) link.core.role = wire::Role::observer;
  link.core.reconnect = options.reconnect_s > 0;
  // Infinity in the options means forever, for which the link takes 0. No reconnecting at all is set above.
  link.core.give_up_after_s = std::isfinite(options.reconnect_s) ? options.reconnect_s : 0;
  return link;
}

LiveRoom::LiveRoom(const ViewOptions& options, const std::vector<CharacterSetup>& characters, bool tolerant)
    : options_(options), characters_(characters), tolerant_(tolerant), wind_(options.wind.value_or(Wind{})) {
  auto link = std::make_unique<link::Link>(link_options(options));
  link_ = link.get();
  room_ = std::make_unique<room::Room>(std::move(link), options.observe.value_or(nobody()));
  // The room calls back for each frame while it advances; the trace and statistics need frames before play-out mixes
  // them.
  room_->set_frame_observer(this);
  // A stream without an end must not jump at each round of its clip.
  const Loop loop = std::isfinite(options.duration_s) ? Loop::plain : Loop::smooth;
  for (const CharacterSetup& setup : characters) {
    OwnCharacter& own = own_characters_.emplace_back(setup.motion, options.duration_s, loop);
    own.level_wanted = setup.level;
    if (setup.material) own.material = scale_between(setup.groom->materials.base, *setup.material);
  }
}

Result<void> LiveRoom::open() {
  if (const Result<wire::Welcome> welcome = link_->connect(); !welcome) return Refusal(welcome.error());
  // Characters with one groom share one file: it is encoded and uploaded once.
  std::map<const Groom*, link::RequestedState::Bytes> files;
  for (std::size_t i = 0; i < characters_.size(); ++i) {
    const CharacterSetup& setup = characters_[i];
    link::RequestedState::Bytes& file = files[setup.groom.get()];
    if (!file)
      file = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(*setup.groom, setup.learnt.get()));
    const Result<std::uint32_t> number =
        room_->add_character(file, {setup.level, setup.name, appearance_of(setup.hair_colour)});
    if (!number) return Refusal(number.error());
    own_characters_[i].number = *number;
    if (setup.material) {
      if (Result<void> set = room_->set_material(*number, own_characters_[i].material); !set) return set;
    }
  }
  if (options_.wind) {
    if (Result<void> set = room_->set_wind(*options_.wind); !set) return set;
  }
  opened_ns_ = poses_begun_ns_ = next_pose_ns_ = now_ns();
  status_ = characters_.empty() ? "" : kWaiting;
  return {};
}

Result<void> LiveRoom::play() {
  room_->advance();
  if (Result<void> taken = take_events(); !taken) return taken;
  const std::int64_t now = now_ns();
  if (!zero_ns_) begin_when_ready(now);
  if (refused_ns_ && now - *refused_ns_ > kRefusalDetail_ns) return Refusal("the server refused a groom");
  // A window waits without end, and shows why; a program without one must end.
  if (!tolerant_ && !zero_ns_ && now - opened_ns_ > kGroomsReady_ns_max) return Refusal("the lattices never arrived");
  return {};
}

Result<void> LiveRoom::take_events() {
  for (const room::Event& event : room_->take_events()) {
    const Result<void> taken = std::visit([this](const auto& e) { return take(e); }, event);
    if (!taken) return taken;
  }
  return {};
}

Result<void> LiveRoom::take(const room::StateChanged& changed) {
  if (changed.state == room::State::closed) return Refusal(changed.detail);
  if (changed.state == room::State::reconnecting) {
    const std::string line = changed.detail + "; reconnecting";
    // Print the same line once only: each attempt to reconnect reports again.
    if (line != status_) std::fprintf(stderr, "hairnet-view: %s\n", line.c_str());
    status_ = line;
    return {};
  }
  std::string transport = link_->transport();
  if (const std::string error = link_->fallback_reason(); !error.empty()) transport += " (" + error + ")";
  if (!transport.empty() && transport != std::exchange(transport_, transport))
    std::fprintf(stderr, "hairnet-view: connected over %s\n", transport_.c_str());
  status_ = zero_ns_ || characters_.empty() ? "" : kWaiting;
  return {};
}

// A window keeps going after a refusal, and shows it; without one the program ends with the line.
Result<void> LiveRoom::refuse_or_note(const std::string& line) {
  if (!tolerant_) return Refusal(line);
  status_ = line;
  return {};
}

Result<void> LiveRoom::take(const room::Error& error) {
  // A later wait for lattices must not count characters that never get one.
  note_refused(error);
  if (error.reason != wire::ErrorReason::none) return refuse_or_note(error.detail);
  // The reason follows in another error, which ends the stream with a better line.
  if (!tolerant_) refused_ns_ = now_ns();
  return {};
}

// Notes the refusal for the character that it names, or for all characters with the groom that it names.
void LiveRoom::note_refused(const room::Error& error) {
  for (std::size_t i = 0; i < own_characters_.size(); ++i) {
    // A refused groom names its hash alone; other refusals name a character.
    OwnCharacter& own = own_characters_[i];
    const bool by_groom = error.groom != wire::GroomHash{} && room_->groom_of(own.number) == error.groom;
    own.refused = own.refused || by_groom || error.character == own.number;
  }
}

Result<void> LiveRoom::take(const room::Joined& joined) {
  // An own character joins again with another number after a move to another server; its hair stays shown until then.
  const auto own = std::ranges::find(own_characters_, joined.member->own, &OwnCharacter::number);
  if (joined.member->own != 0 && own != own_characters_.end()) own->member = joined.member;
  return {};
}

Result<void> LiveRoom::take(const room::Left& left) {
  statistics_.forget(left.number);
  return {};
}

Result<void> LiveRoom::take(const room::WindChanged& changed) {
  wind_ = changed.wind;
  return {};
}

void LiveRoom::on_batch(const link::FrameBatch& batch, std::int64_t sampled_ns, std::int64_t now_ns) {
  // A repeated frame came already, before its basis, and has been measured then.
  if (batch.frames.empty() || batch.frames[0].repeated) return;
  latency_ms_ = 1e-6 * static_cast<double>(now_ns - sampled_ns);
  statistics_.count_frames(batch, now_ns - sampled_ns);
}

void LiveRoom::on_frame(const link::FrameBatch& batch, const link::Frame& frame, const room::Member& member) {
  // Only own characters have statistics of displacement, so others' lattices are not computed without a trace.
  if (member.own != 0 || on_frame_) link::displacements_of(frame, displacement_);
  if (on_frame_ && !frame.repeated) on_frame_(frame, batch.tick, displacement_, member);
  const auto own = std::ranges::find(own_characters_, member.own, &OwnCharacter::number);
  if (own == own_characters_.end()) return;
  own->at_level = own->at_level || frame.level == own->level_wanted;
  // A frame without a basis brings no lattice: its hair rests, or the basis has not arrived.
  if (!own->first_lattice_ns && frame.basis) own->first_lattice_ns = now_ns();
  statistics_.count_displacement(member.own, displacement_);
}

// All clips begin together, once every character that is not refused is simulated at its level, or has been at a
// coarser one for a while.
void LiveRoom::begin_when_ready(std::int64_t now_ns) {
  const bool ready = std::all_of(own_characters_.begin(), own_characters_.end(), [&](const OwnCharacter& own) {
    return own.refused || own.at_level || (own.first_lattice_ns && now_ns - *own.first_lattice_ns > kCoarser_ns);
  });
  if (!ready || now_ns < opened_ns_ + kUprightMin_ns) return;
  zero_ns_ = now_ns + to_ns(MotionTimeline::kLeadIn_s);
  paused_s_ = 0;
  if (status_ == kWaiting) status_.clear();
}

// The result is none before the begin is known, and negative during the lead-in.
std::optional<double> LiveRoom::clip_time_s(std::int64_t now_ns) const {
  if (!zero_ns_) return {};
  return 1e-9 * static_cast<double>(now_ns - *zero_ns_) - paused_s_;
}

// Before the clips begin, heads rest at the start of the lead-in.
double LiveRoom::motion_time_s(std::int64_t now_ns) const {
  return clip_time_s(now_ns).value_or(-MotionTimeline::kLeadIn_s);
}

Pose LiveRoom::pose_of(std::size_t own, double time_s) const {
  Pose pose = own_characters_[own].grab.apply(own_characters_[own].timeline.at(time_s), characters_[own].groom->body);
  if (own_characters_[own].aside) {
    for (RigidTransform& bone : pose.bones) bone.position.x() += kAside_m;
  }
  return pose;
}

void LiveRoom::send_poses(std::int64_t now_ns) {
  // The caller's loop is faster than the rate of poses.
  if (now_ns < next_pose_ns_) return;
  const double to_s = motion_time_s(now_ns);
  std::vector<room::OwnPose> poses;
  for (std::size_t i = 0; i < own_characters_.size(); ++i) {
    OwnCharacter& own = own_characters_[i];
    // A jump must be marked as a teleport: the hair would swing after a head that is suddenly elsewhere.
    const bool is_jump = own.timeline.teleports(last_pose_s_, to_s) || std::exchange(own.teleport_pending, false);
    poses.push_back({own.number, pose_of(i, to_s), is_jump});
  }
  last_pose_s_ = to_s;
  statistics_.count_poses(poses.size());
  if (const Result<void> pushed = room_->push(poses); !pushed) status_ = pushed.error();

  // The times are those of the rate from the first pose on, not the last pose's plus a period: so they do not drift
  // with the loop's delays.
  ++pose_count_;
  const double jitter_s = 1e-3 * options_.jitter_ms * std::uniform_real_distribution<>(-1, 1)(random_);
  const auto after_s = [&] { return static_cast<double>(pose_count_) / options_.pose_rate_hz; };
  const double late_s = kLateMax / options_.pose_rate_hz + 1e-3 * options_.jitter_ms;
  if (now_ns > poses_begun_ns_ + to_ns(after_s() + late_s)) {
    poses_begun_ns_ = now_ns;
    pose_count_ = 1;
  }
  next_pose_ns_ = poses_begun_ns_ + to_ns(after_s() + jitter_s);
}

void LiveRoom::keep(std::size_t moment) {
  for (const auto& [number, member] : room_->members()) {
    // Own characters are stored by moments(); others without hair or pose cannot be drawn.
    if (member->own != 0 || !member->groom || !member->sample.valid) continue;
    Moment shown(member->sample);
    shown.skin = member->skin;
    kept_[member].insert_or_assign(moment, std::move(shown));
  }
}

std::vector<Moment> LiveRoom::moments() const {
  std::vector<Moment> moments;
  for (std::size_t i = 0; i < own_characters_.size(); ++i) {
    const std::shared_ptr<const room::Member> member = member_of(i);
    if (!member || !member->sample.valid) continue;
    // Nothing is shown of a character before its first pose has come back.
    moments.emplace_back(member->sample);
    moments.back().skin = member->skin;
  }
  return moments;
}

std::vector<SeenCharacter> LiveRoom::others(std::size_t moment_count) const {
  std::vector<SeenCharacter> seen;
  for (const auto& [member, moments] : kept_) {
    SeenCharacter& one = seen.emplace_back(SeenCharacter{member, member->groom, {}});
    one.moments.resize(moment_count);
    // Moments at which this character was not there stay empty.
    for (const auto& [moment, shown] : moments) one.moments[moment] = shown;
  }
  // The map is sorted by address, which differs between runs.
  std::ranges::stable_sort(seen, {}, [](const SeenCharacter& each) { return each.member->number; });
  return seen;
}

std::string LiveRoom::members_summary() const {
  std::string lines;
  for (const auto& [number, member] : room_->members()) {
    if (member->own != 0 || !options_.observe) continue;
    lines += "member " + std::to_string(number) + ": '" + shown_text(name_of(*member), wire::kTagBytesMax, '\'') +
             "', character " + std::to_string(member->owners_character) + " of session " +
             std::to_string(member->session);
    if (member->appearance) {
      const auto& [root, tip, skin, roughness] = *member->appearance;
      std::array<char, 96> text{};
      std::snprintf(text.data(), text.size(),
                    ", hair #%02x%02x%02x to #%02x%02x%02x, skin #%02x%02x%02x, roughness %.2f", root.red, root.green,
                    root.blue, tip.red, tip.green, tip.blue, skin.red, skin.green, skin.blue, roughness / 255.0);
      lines += text.data();
    }
    lines += '\n';
  }
  return lines;
}

Result<void> LiveRoom::advance(std::int64_t now_ns) {
  const double elapsed_s = 1e-9 * static_cast<double>(now_ns - advanced_ns_.value_or(now_ns));
  advanced_ns_ = now_ns;
  // A pause stops the time only once the clips run: before, poses must go on so that hair settles.
  if (paused_ && clip_time_s(now_ns).value_or(-1) > 0) paused_s_ += elapsed_s;
  for (OwnCharacter& own : own_characters_) own.grab.advance(elapsed_s);
  // Poses first: what they cause arrives a little later anyway, and the heads to draw are the newest.
  send_poses(now_ns);
  if (Result<void> played = play(); !played) return played;
  show(now_ns);
  return {};
}

// Servers send neither springs nor attachments, contact points or drag, so the model is built here when an overlay
// first asks for it. Frames have the nodes of the finest level.
std::shared_ptr<const Level> LiveRoom::model_of(const std::shared_ptr<const Groom>& groom,
                                                const LevelGeometry* geometry) const {
  if (builder_ == nullptr || geometry == nullptr) return nullptr;
  const std::shared_ptr<const LevelSet> levels = builder_->levels_of(groom);
  if (!levels) return nullptr;
  const std::shared_ptr<const Level> model(levels, &(*levels)[LevelIndex::high]);
  // A server of another version could have other nodes; the model would then not fit.
  return model->geometry.active_nodes == geometry->active_nodes ? model : nullptr;
}

void LiveRoom::show(std::int64_t now_ns) {
  viewed_.clear();
  const auto add = [&](const std::shared_ptr<const Groom>& groom, const room::Member* member) -> ViewedCharacter& {
    ViewedCharacter& character = viewed_.emplace_back();
    character.groom = groom;
    if (member == nullptr) return character;
    character.skin = member->skin;
    character.lattice = member->sample.lattice();
    character.level = member->sample.level;
    character.geometry = member->sample.geometry();
    character.model = model_of(groom, character.geometry.get());
    return character;
  };
  for (std::size_t i = 0; i < own_characters_.size(); ++i) {
    const OwnCharacter& own = own_characters_[i];
    ViewedCharacter& character = add(characters_[i].groom, member_of(i).get());
    character.id = i + 1;
    character.name =
        characters_[i].name.empty() ? characters_[i].groom->name + " " + std::to_string(i + 1) : characters_[i].name;
    character.hair_colour = characters_[i].hair_colour;
    // The pose of now, not that of the lattice's time: an own head must follow the mouse at once (late latching).
    character.pose = pose_of(i, motion_time_s(now_ns));
    character.material = own.material;
    character.level_wanted = own.level_wanted;
    character.own = true;
  }
  for (const auto& [number, member] : room_->members()) {
    // A member without a groom is still on its way.
    if (member->own != 0 || !member->groom || !member->sample.valid) continue;
    ViewedCharacter& character = add(member->groom, member.get());
    character.pose = member->sample.pose;
    character.id = kOther + number;
    const std::string person = name_of(*member);
    character.name = (person.empty() ? member->groom->name : person) + ", member " + std::to_string(number);
    // All clients derive the default colour from the member's number.
    character.hair_colour = default_hair_colour(number - 1);
    character.appearance = member->appearance;
  }
}

// Members behind the camera count, too: their size is 0, so the server lowers their detail.
void LiveRoom::report_importance(const Seen& seen) {
  std::vector<wire::MemberImportance> members;
  const auto add = [&](std::uint32_t member, const Pose& pose) {
    wire::MemberImportance importance = seen(pose);
    importance.member = member;
    members.push_back(importance);
  };
  for (const auto& [number, member] : room_->members()) {
    if (member->pose) add(number, *member->pose);
  }
  room_->report_importance(std::move(members));
}

LiveRoom::OwnCharacter* LiveRoom::own_character(std::uint64_t id) {
  return id >= 1 && id <= own_characters_.size() ? &own_characters_[id - 1] : nullptr;
}

HeadGrab* LiveRoom::grab(std::uint64_t id) {
  OwnCharacter* own = own_character(id);
  return own != nullptr ? &own->grab : nullptr;
}

void LiveRoom::set_material(std::uint64_t id, const MaterialScale& scale) {
  OwnCharacter* own = own_character(id);
  if (own == nullptr) return;
  // The server's answer may be a refusal, for example of a scale out of range: then the sliders stay where they are.
  if (room_->set_material(own->number, scale)) own->material = scale;
}

void LiveRoom::set_level(std::uint64_t id, LevelIndex level) {
  OwnCharacter* own = own_character(id);
  if (own == nullptr) return;
  own->level_wanted = level;
  room_->set_level(own->number, level);
}

void LiveRoom::teleport(std::uint64_t id) {
  OwnCharacter* own = own_character(id);
  if (own == nullptr) return;
  own->aside = !own->aside;
  // The next pose carries the jump.
  own->teleport_pending = true;
}

void LiveRoom::set_wind(const Wind& wind) {
  if (room_->set_wind(wind)) wind_ = wind;
}

}  // namespace hairnet::viewer
