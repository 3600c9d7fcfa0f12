#include "client/viewer/sources/live_room.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <utility>

#include "client/viewer/characters/hair_colour.hpp"

namespace hairnet::viewer {
namespace {

constexpr const char* kWaiting = "waiting for the lattices";
constexpr std::int64_t kUprightMin_ns = 1'000'000'000;
constexpr std::int64_t kGroomsReady_ns_max = 600'000'000'000;
constexpr std::int64_t kCoarser_ns = 3'000'000'000;  // at a coarser level for this time: the server gives no finer one
// an error within this time has the reason why a groom was refused
constexpr std::int64_t kRefusalDetail_ns = 500'000'000;
constexpr double kLateMax = 4;                            // periods; poses later than that are skipped
constexpr std::uint64_t kOther = std::uint64_t{1} << 32;  // ids from here on belong to others

std::int64_t to_ns(double seconds) {
  return static_cast<std::int64_t>(std::llround(seconds * 1e9));
}

std::string plain(const wire::Error& error) {
  std::string text = std::string("the server refuses: ") + wire::to_string(error.reason);
  if (error.character != 0) text += ", character " + std::to_string(error.character);
  return error.detail.empty() ? text : text + " (" + error.detail + ")";
}

// Observes only this client's own characters.
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
  // An observer may not set the wind.
  if (options.characters.empty() && !options.wind) link.core.role = wire::Role::observer;
  link.core.reconnect = options.reconnect_s > 0;
  link.core.give_up_after_s = std::isfinite(options.reconnect_s) ? options.reconnect_s : 0;
  return link;
}

LiveRoom::LiveRoom(const ViewOptions& options, const std::vector<CharacterSetup>& characters, bool tolerant)
    : options_(options),
      characters_(characters),
      tolerant_(tolerant),
      link_(link_options(options)),
      wind_(options.wind.value_or(Wind{})) {
  const Loop loop = std::isfinite(options.duration_s) ? Loop::plain : Loop::smooth;
  for (const CharacterSetup& setup : characters) {
    OwnCharacter& own = own_characters_.emplace_back(setup.motion, options.duration_s, loop);
    own.level_wanted = setup.level;
    if (setup.material) own.material = scale_between(setup.groom->materials.base, *setup.material);
  }
}

Result<void> LiveRoom::open() {
  const Result<wire::Welcome> welcome = link_.connect();
  if (!welcome) return Refusal(welcome.error());
  session_ = welcome->session;
  for (std::size_t i = 0; i < characters_.size(); ++i) {
    const auto same = std::find_if(characters_.begin(), characters_.begin() + static_cast<std::ptrdiff_t>(i),
                                   [&](const CharacterSetup& a) { return a.groom == characters_[i].groom; });
    const auto first = static_cast<std::size_t>(same - characters_.begin());
    own_characters_[i].groom =
        first == i ? link_.upload(*characters_[i].groom, characters_[i].learnt.get()) : own_characters_[first].groom;
    const auto character = static_cast<std::uint32_t>(i + 1);
    link_.add_character(character, own_characters_[i].groom, characters_[i].level, characters_[i].name,
                        appearance_of(characters_[i].hair_colour));
    if (characters_[i].material) link_.set_material(character, own_characters_[i].material);
  }
  if (options_.wind) link_.set_wind(*options_.wind);
  link_.observe(options_.observe.value_or(nobody()));
  opened_ns_ = poses_begun_ns_ = next_pose_ns_ = link_.now_ns();
  status_ = characters_.empty() ? "" : kWaiting;
  return {};
}

Result<void> LiveRoom::turn(std::int64_t now_ns) {
  if (Result<void> taken = take_events(); !taken) return taken;
  if (!zero_ns_) begin_when_ready(now_ns);
  if (refused_ns_ && now_ns - *refused_ns_ > kRefusalDetail_ns) return Refusal("the server refused a groom");
  if (!tolerant_ && !zero_ns_ && now_ns - opened_ns_ > kGroomsReady_ns_max)
    return Refusal("the lattices never arrived");
  if (now_ns >= next_pose_ns_) push_poses(now_ns);
  return {};
}

Result<void> LiveRoom::take_events() {
  for (link::Event& event : link_.poll()) {
    const Result<void> taken = std::visit([this](auto& e) { return take(e); }, event);
    if (!taken) return taken;
  }
  return {};
}

Result<void> LiveRoom::take(const link::Disconnected& end) {
  return Refusal(end.detail);
}

Result<void> LiveRoom::take(const link::Connected& connected) {
  session_ = connected.welcome.session;
  std::string transport = link_.transport();
  if (const std::string why = link_.fallback_reason(); !why.empty()) transport += " (" + why + ")";
  if (!transport.empty() && transport != std::exchange(transport_, transport))
    std::fprintf(stderr, "hairnet-view: connected over %s\n", transport_.c_str());
  status_ = zero_ns_ || characters_.empty() ? "" : kWaiting;
  return {};
}

Result<void> LiveRoom::take(const link::Reconnecting& lost) {
  const std::string line = lost.detail + "; reconnecting";
  if (line != status_) std::fprintf(stderr, "hairnet-view: %s\n", line.c_str());  // print the same line once only
  status_ = line;
  for (OwnCharacter& own : own_characters_) own.playout.freeze();
  other_characters_.freeze();
  return {};
}

Result<void> LiveRoom::refuse_or_note(const std::string& line) {
  if (!tolerant_) return Refusal(line);
  status_ = line;
  return {};
}

Result<void> LiveRoom::take(const wire::Error& error) {
  if (error.reason == wire::ErrorReason::state_invalid) return {};  // the hair starts at rest
  const bool may_come_later =
      error.reason == wire::ErrorReason::groom_unavailable || error.reason == wire::ErrorReason::limit_exceeded;
  if (may_come_later && other_characters_.retry(error.groom, link_.now_ns())) return {};
  note_refused(error);
  return refuse_or_note(plain(error));
}

// Notes the refusal for the character that the error names, or for all characters with the groom that it names.
void LiveRoom::note_refused(const wire::Error& error) {
  for (std::size_t i = 0; i < own_characters_.size(); ++i) {
    const bool by_groom = error.groom != wire::GroomHash{} && error.groom == own_characters_[i].groom;
    own_characters_[i].refused = own_characters_[i].refused || by_groom || error.character == i + 1;
  }
}

Result<void> LiveRoom::take(const wire::CharacterAdded& added) {
  if (added.character >= 1 && added.character <= own_characters_.size())
    own_characters_[added.character - 1].member = added.member;
  return {};
}

Result<void> LiveRoom::take(const wire::MemberJoined& joined) {
  if (options_.observe) other_characters_.take(joined);
  return {};
}

Result<void> LiveRoom::take(const wire::MemberChanged& changed) {
  other_characters_.take(changed);
  return {};
}

Result<void> LiveRoom::take(const wire::RoomWind& told) {
  wind_ = told.wind;
  return {};
}

Result<void> LiveRoom::take(const wire::MemberLeft& left) {
  other_characters_.take(left);
  statistics_.forget(left.member);
  return {};
}

Result<void> LiveRoom::take(const link::GroomFetched& fetched) {
  const Result<void> taken = other_characters_.take(fetched);
  return taken ? taken : refuse_or_note(taken.error());
}

Result<void> LiveRoom::take(const wire::GroomStatus& status) {
  if (status.state != wire::GroomState::refused) return {};
  if (!tolerant_) refused_ns_ = link_.now_ns();
  for (OwnCharacter& own : own_characters_) own.refused = own.refused || own.groom == status.hash;
  return {};
}

Result<void> LiveRoom::take(const link::FrameBatch& batch) {
  const std::int64_t now = link_.now_ns(), sampled = link_.to_local_ns(batch.sample_time_ns);
  const bool is_repeated = !batch.frames.empty() && batch.frames[0].repeated;
  if (!is_repeated) {
    latency_ms_ = 1e-6 * static_cast<double>(now - sampled);
    statistics_.count_frames(batch, now - sampled);
  }
  for (const link::Frame& frame : batch.frames) take(frame, batch, sampled, now);
  return {};
}

void LiveRoom::take(const link::Frame& frame, const link::FrameBatch& batch, std::int64_t sampled_ns,
                    std::int64_t now_ns) {
  if (frame.character != 0 || on_frame_) link::displacements_of(frame, displacement_);
  if (frame.character == 0) {
    if (other_characters_.push(frame, sampled_ns, now_ns) && on_frame_ && !frame.repeated)
      on_frame_(frame, batch.tick, displacement_, other_characters_.name_of(frame.member));
    return;
  }
  OwnCharacter& own = own_characters_[frame.character - 1];
  own.at_level = own.at_level || frame.level == own.level_wanted;
  if (!own.first_lattice_ns && frame.basis) own.first_lattice_ns = now_ns;
  own.playout.push(frame, sampled_ns, now_ns);
  statistics_.count_displacement(frame.character, displacement_);
  if (on_frame_ && !frame.repeated) on_frame_(frame, batch.tick, displacement_, session_ << 32 | frame.character);
}

// All clips begin together, once every character that is not refused is simulated at its level.
void LiveRoom::begin_when_ready(std::int64_t now_ns) {
  const bool ready = std::all_of(own_characters_.begin(), own_characters_.end(), [&](const OwnCharacter& own) {
    return own.refused || own.at_level || (own.first_lattice_ns && now_ns - *own.first_lattice_ns > kCoarser_ns);
  });
  if (!ready || now_ns < opened_ns_ + kUprightMin_ns) return;
  zero_ns_ = now_ns + to_ns(MotionTimeline::kLeadIn_s);
  paused_s_ = 0;
  if (status_ == kWaiting) status_.clear();
}

std::optional<double> LiveRoom::clip_time_s(std::int64_t now_ns) const {
  if (!zero_ns_) return {};
  return 1e-9 * static_cast<double>(now_ns - *zero_ns_) - paused_s_;
}

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

void LiveRoom::push_poses(std::int64_t now_ns) {
  const double to_s = motion_time_s(now_ns);
  std::vector<wire::PoseSample> poses;
  ++sequence_;
  for (std::size_t i = 0; i < own_characters_.size(); ++i) {
    wire::PoseSample sample;
    sample.character = static_cast<std::uint32_t>(i + 1);
    sample.sequence = sequence_;
    sample.capture_time_ns = now_ns;
    sample.teleport = own_characters_[i].timeline.teleports(last_pose_s_, to_s) ||
                      std::exchange(own_characters_[i].teleport_pending, false);
    sample.pose = pose_of(i, to_s);
    poses.push_back(sample);
  }
  last_pose_s_ = to_s;
  statistics_.count_poses(poses.size());
  link_.push_poses(std::move(poses));

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

void LiveRoom::play(std::int64_t now_ns, std::ptrdiff_t moment) {
  for (OwnCharacter& own : own_characters_) own.sample = own.playout.sample(now_ns);
  other_characters_.play(now_ns, moment);
}

std::vector<Moment> LiveRoom::moments() const {
  std::vector<Moment> moments;
  for (const OwnCharacter& own : own_characters_) {
    if (!own.sample.valid) continue;
    moments.emplace_back(own.sample);
    moments.back().skin = link_.skin_of(own.groom);
  }
  return moments;
}

Result<void> LiveRoom::advance(std::int64_t now_ns) {
  const double elapsed_s = 1e-9 * static_cast<double>(now_ns - advanced_ns_.value_or(now_ns));
  advanced_ns_ = now_ns;
  if (paused_ && clip_time_s(now_ns).value_or(-1) > 0) paused_s_ += elapsed_s;
  for (OwnCharacter& own : own_characters_) own.grab.advance(elapsed_s);
  if (Result<void> turned = turn(now_ns); !turned) return turned;
  play(now_ns, -1);
  show(now_ns);
  return {};
}

// Frames have the nodes of the finest level.
std::shared_ptr<const Level> LiveRoom::model_of(const std::shared_ptr<const Groom>& groom,
                                                const LevelGeometry* geometry) const {
  if (builder_ == nullptr || geometry == nullptr) return nullptr;
  const std::shared_ptr<const LevelSet> levels = builder_->levels_of(groom);
  if (!levels) return nullptr;
  const std::shared_ptr<const Level> model(levels, &(*levels)[LevelIndex::high]);
  return model->geometry.active_nodes == geometry->active_nodes ? model : nullptr;
}

void LiveRoom::show(std::int64_t now_ns) {
  viewed_.clear();
  const auto add = [&](const std::shared_ptr<const Groom>& groom, const wire::GroomHash& hash,
                       const link::Playout::Sample& sample) -> ViewedCharacter& {
    ViewedCharacter& character = viewed_.emplace_back();
    character.groom = groom;
    character.skin = link_.skin_of(hash);
    character.pose = sample.pose;
    character.lattice = lattice_of(sample);
    character.level = sample.level;
    character.geometry = sample.geometry();
    character.model = model_of(groom, character.geometry.get());
    return character;
  };
  for (std::size_t i = 0; i < own_characters_.size(); ++i) {
    const OwnCharacter& own = own_characters_[i];
    ViewedCharacter& character = add(characters_[i].groom, own.groom, own.sample);
    character.id = i + 1;
    character.name =
        characters_[i].name.empty() ? characters_[i].groom->name + " " + std::to_string(i + 1) : characters_[i].name;
    character.hair_colour = characters_[i].hair_colour;
    character.pose = pose_of(i, motion_time_s(now_ns));
    character.material = own.material;
    character.level_wanted = own.level_wanted;
    character.own = true;
  }
  for (const auto& [number, member] : other_characters_.members()) {
    const std::shared_ptr<const Groom> groom = other_characters_.groom_of(member);
    if (!member.here || !groom || !member.sample.valid) continue;
    ViewedCharacter& character = add(groom, member.joined.groom, member.sample);
    character.id = kOther + number;
    const std::string person = member.name();
    character.name = (person.empty() ? groom->name : person) + ", member " + std::to_string(number);
    character.hair_colour = default_hair_colour(number - 1);
    character.appearance = member.joined.appearance;
  }
}

void LiveRoom::report_importance(const Seen& seen) {
  std::vector<wire::MemberImportance> members;
  const auto add = [&](std::uint32_t member, const Pose& pose) {
    wire::MemberImportance importance = seen(pose);
    importance.member = member;
    members.push_back(importance);
  };
  for (std::size_t i = 0; i < own_characters_.size(); ++i) {
    if (own_characters_[i].member != 0) add(own_characters_[i].member, pose_of(i, motion_time_s(link_.now_ns())));
  }
  for (const auto& [number, member] : other_characters_.members()) {
    if (member.here && member.sample.valid) add(number, member.sample.pose);
  }
  members.resize(std::min<std::size_t>(members.size(), wire::kMembersPerMessageMax));
  if (!members.empty()) link_.report_importance(members);
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
  if (own == nullptr || !validate(scale).empty()) return;
  own->material = scale;
  link_.set_material(static_cast<std::uint32_t>(id), scale);
}

void LiveRoom::set_level(std::uint64_t id, LevelIndex level) {
  OwnCharacter* own = own_character(id);
  if (own == nullptr) return;
  own->level_wanted = level;
  link_.set_level(static_cast<std::uint32_t>(id), level);
}

void LiveRoom::teleport(std::uint64_t id) {
  OwnCharacter* own = own_character(id);
  if (own == nullptr) return;
  own->aside = !own->aside;
  own->teleport_pending = true;
}

void LiveRoom::set_wind(const Wind& wind) {
  if (!validate(wind).empty()) return;
  wind_ = wind;
  link_.set_wind(wind);
}

}  // namespace hairnet::viewer
