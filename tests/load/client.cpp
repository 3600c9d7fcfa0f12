#include "tests/load/client.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "schema/limits.hpp"

namespace hairnet::load {
namespace {

// A client whose session has ended joins again after kRejoinMin_ns and a random part of kBeginAgainSpread_ns, as a
// person would. The random part keeps clients that ended together from joining together.
constexpr std::int64_t kRejoinMin_ns = 500'000'000;
constexpr std::int64_t kBeginAgainSpread_ns = 1'000'000'000;
// A slow client reads 1 kB a second, less than the frames of one character (README.md, Measured).
constexpr std::int64_t kSlowReadInterval_ns = 1'000'000'000;
constexpr std::size_t kSlowReadBytes = 1024;
// A client drops its poses while more bytes than this wait to be sent.
constexpr std::size_t kUnsentBytesMax = 256u << 10;
// When a client leaves, a pose older than this counts as unanswered. A prompt server needs much less: its pose delay of
// 25 ms and a tick.
constexpr std::int64_t kAnswerWait_ns = 250'000'000;
// A longer gap between ticks is an interruption, and does not count as jitter.
constexpr std::uint64_t kTicksForJitter = 8;
// The people of a room stand in rows, so that hands reach neighbours and heads do not overlap.
constexpr double kPlaceSpacing_m = 1.5;
constexpr std::uint32_t kPlacesInARow = 8;

}  // namespace

Client::Client(const ClientContext& context, std::uint32_t number, std::uint32_t place, bool slow)
    : context_(&context),
      number_(number),
      place_(place),
      slow_(slow),
      random_(context.seed, number),
      clock_{0, 1e9 / context.pose_hz} {
  // The clients with hands are spread evenly: with a share of a half, each second client has them. Among these the
  // clients with props are spread in the same way.
  const auto part_of = [](std::uint32_t all, double share) {
    return static_cast<std::uint32_t>(std::floor(all * share));
  };
  const std::uint32_t touchers_before = part_of(place, context.touch_share);
  if (slow || part_of(place + 1, context.touch_share) == touchers_before) return;
  toucher_.emplace(number);
  const std::uint32_t prop = context.place_in_room(place);
  // A room has no numbers for the props of further clients.
  if (prop >= wire::kPropsMax) return;
  if (part_of(touchers_before + 1, context.props_share) > part_of(touchers_before, context.props_share))
    prop_setter_.emplace(number, static_cast<std::uint8_t>(prop));
}

void Client::join(std::uint32_t characters, const std::vector<LevelIndex>& levels, std::int64_t intended_ns,
                  std::int64_t now_ns) {
  for (std::uint32_t i = 0; i < characters; ++i) {
    characters_.push_back(make_character(i + 1, levels));
    characters_.back().join_ns = intended_ns;
  }
  clock_.phase_ns = intended_ns + static_cast<std::int64_t>(random_.unit() * clock_.interval_ns);
  begin(now_ns);
}

Client::Character Client::make_character(std::uint32_t number, const std::vector<LevelIndex>& levels) const {
  Random random(context_->seed, (std::uint64_t{number_} << 32) + number);
  Character character;
  character.number = number;
  const std::uint32_t turn = place_ + number - 1;
  character.groom = turn % context_->grooms->size();
  character.motion = random.next() % context_->motions->count();
  character.motion_step = random.next() >> 32;
  character.level = levels[turn % levels.size()];
  // Clients of a room stand in rows, each client's further characters behind it.
  const std::uint32_t place = context_->place_in_room(place_);
  character.place = kPlaceSpacing_m * Vec3(place % kPlacesInARow, 0, place / kPlacesInARow + 0.1 * (number - 1));
  return character;
}

void Client::begin(std::int64_t now_ns) {
  begin_ns_ = kNever_ns;
  state_ = State::away;
  others_.clear();
  protocol_ = context_->make_protocol_client(number_, place_);
  for (const EncodedGroom& groom : *context_->grooms) protocol_->offer(groom);
  for (const Character& character : characters_) add_to_server(character);
  drive(now_ns);
}

void Client::add_to_server(const Character& character) {
  protocol_->add_character(character.number, (*context_->grooms)[character.groom].hash, character.level);
  if (context_->touch_share > 0) protocol_->allow_touch(character.number);
}

// Opens, closes or sends on the connection as the protocol client wants. Call it after anything that may change that.
void Client::drive(std::int64_t now_ns) {
  if (!protocol_) return;
  protocol_->poll(now_ns);
  protocol_->tell(*this, now_ns);
  if (connection_ && protocol_->wants_close()) {
    connection_.reset();
    protocol_->on_closed(now_ns);
    protocol_->tell(*this, now_ns);
  }
  if (!connection_ && protocol_->wants_connection()) {
    protocol_->on_opening(now_ns);
    connection_ = context_->connector->connect(*this, context_->host_of(number_));
  }
  while (connection_) {
    const std::vector<std::uint8_t> packet = protocol_->take_packet(now_ns);
    if (packet.empty()) break;
    if (!slow_) context_->tally->count(now_ns, &Counts::bytes_out, packet.size());
    if (protocol_->taken_may_be_lost())
      connection_->send_unreliably(packet);
    else
      connection_->send(packet);
  }
  if (connection_ && protocol_->wants_half_close()) connection_->close_sending();
  if (state_ == State::gone) {
    close_connection();
    return context_->wake(number_, now_ns);
  }
  context_->wake(number_, std::min(protocol_->next_deadline_ns(), begin_ns_));
}

void Client::on_open(std::int64_t now_ns) {
  protocol_->on_open(now_ns, connection_->has_datagrams());
  drive(now_ns);
}

void Client::on_packet(std::span<const std::uint8_t> packet, std::int64_t arrival_ns) {
  if (!slow_) context_->tally->count(arrival_ns, &Counts::bytes_in, packet.size());
  protocol_->on_packet(packet, arrival_ns, *this);
  drive(arrival_ns);
}

void Client::on_closed(std::string_view reason, std::int64_t now_ns) {
  closed_ = reason;
  connection_.reset();
  protocol_->on_closed(now_ns);
  drive(now_ns);
}

void Client::on_welcome(const wire::Welcome& welcome, std::int64_t now_ns) {
  pass_poses(now_ns);
  if (started_) context_->tally->count(now_ns, welcome.resumed ? &Counts::resumes : &Counts::restarts);
  if (state_ != State::leaving) state_ = State::active;
  started_ = true;
  if (context_->watcher) context_->watcher->on_welcome(number_);
  if (toucher_) {
    if (!welcome.resumed) toucher_->begin();
    (*context_->hand_clocks)[welcome.session] = clock_;
  }
  if (prop_setter_ && !welcome.resumed) prop_setter_->begin();
  may_set_props_ = welcome.may_set_props;
  hands_ns_.clear();
  seen_props_ = context_->sent_props->until_now(context_->room_of(place_));
  tick_ns_ = 1'000'000'000 / std::max(1u, welcome.tick_rate_hz);
  tick_ = 0;
  for (auto& [member, other] : others_) other.arrival_ns = 0;
  for (Character& character : characters_) {
    character.tick = 0;
    character.asleep = false;
    // Only poses from now on belong to this session. Earlier ones were counted when the connection was lost.
    character.answered = next_pose_ - 1;
  }
  if (slow_) {
    connection_->limit_reading(kSlowReadBytes);
    read_ns_ = now_ns + kSlowReadInterval_ns;
  }
  context_->wake(number_, clock_.time_ns(next_pose_));
}

void Client::on_lost(std::string_view reason, std::int64_t now_ns) {
  lose(reason, now_ns);
}

void Client::on_end(std::string_view reason, std::int64_t now_ns) {
  if (state_ == State::leaving) {
    state_ = State::gone;
    return;
  }
  lose(reason, now_ns);
  begin_ns_ = now_ns + kRejoinMin_ns + static_cast<std::int64_t>(random_.unit() * kBeginAgainSpread_ns);
}

// Counts the loss of a connection under the server's reason, or under how the connection ended. A loss that the plan
// wanted is no error.
void Client::lose(std::string_view reason, std::int64_t now_ns) {
  const bool meant = std::exchange(meant_to_lose_, false);
  const std::string error = !reason.empty()   ? "goodbye_" + std::string(reason)
                            : closed_.empty() ? "no_welcome"
                                              : "closed_" + closed_;
  if (slow_)
    context_->tally->count_bad_client_end(now_ns, "slow", error);
  else if (!meant && state_ != State::leaving)
    context_->tally->count_error(now_ns, error);
  closed_.clear();
  give_up_poses(now_ns, now_ns, !meant);
  if (state_ == State::active) state_ = State::away;
  read_ns_ = kNever_ns;
  for (Character& character : characters_)
    if (character.join_ns == kNever_ns) character.join_ns = now_ns;
}

std::int64_t Client::act(std::int64_t now_ns) {
  if (state_ == State::gone) return kNever_ns;
  if (now_ns >= begin_ns_) begin(now_ns);
  if (now_ns >= read_ns_ && connection_) {
    connection_->limit_reading(kSlowReadBytes);
    read_ns_ = now_ns + kSlowReadInterval_ns;
  }
  if (state_ != State::leaving) pass_poses(now_ns);
  drive(now_ns);
  if (state_ == State::gone) return kNever_ns;
  const std::int64_t pose_ns = state_ == State::leaving ? kNever_ns : clock_.time_ns(next_pose_);
  return std::min({pose_ns, begin_ns_, read_ns_, protocol_->next_deadline_ns()});
}

// Sends every pose that is due, with the time at which it was meant to be captured, however late this call comes. Poses
// count from the first welcome on. Without a session they are due all the same, and count as not sent.
void Client::pass_poses(std::int64_t now_ns) {
  const bool can_send = state_ == State::active && connection_ && connection_->unsent_bytes() <= kUnsentBytesMax;
  while (clock_.time_ns(next_pose_) <= now_ns) {
    const std::int64_t captured_ns = clock_.time_ns(next_pose_);
    if (!slow_ && started_) {
      context_->tally->record_lag(captured_ns, now_ns);
      context_->tally->count(captured_ns, &Counts::poses_intended, characters_.size());
      context_->tally->count(captured_ns, can_send ? &Counts::poses_sent : &Counts::poses_unsent, characters_.size());
    }
    if (can_send) {
      protocol_->push_poses(make_poses(next_pose_));
      pass_hands(next_pose_);
      pass_props(next_pose_);
    }
    ++next_pose_;
  }
}

void Client::pass_hands(std::int64_t pose) {
  if (!toucher_ || characters_.empty()) return;
  const Character& own = characters_.front();
  const Vec3 head = own.place + own.last_pose->bones[static_cast<std::size_t>(Bone::head)].position;
  const std::int64_t captured_ns = clock_.time_ns(pose);
  protocol_->push_hands(toucher_->move(captured_ns, head, *protocol_), captured_ns);
  context_->tally->count(captured_ns, &Counts::hands_sent);
}

// The prop is where hair falls on it: at the head that the hands touch.
void Client::pass_props(std::int64_t pose) {
  if (!prop_setter_ || !may_set_props_) return;
  const std::optional<Vec3> head = toucher_->touched_head();
  if (!head) return;
  const std::int64_t captured_ns = clock_.time_ns(pose);
  std::optional<wire::SetProps> change = prop_setter_->move(captured_ns, *head);
  if (!change) return;
  context_->sent_props->add(context_->room_of(place_), number_, captured_ns, *change);
  context_->tally->count(captured_ns, &Counts::props_sent);
  protocol_->set_props(std::move(*change));
}

// Records the latency of each pose of the hands that this message is the first to show: those captured after the last
// message's sample time and up to this one's.
void Client::on_hands(const HandsSeen& hands, std::int64_t now_ns) {
  if (slow_) return;
  const auto clock = context_->hand_clocks->find(hands.session);
  if (clock == context_->hand_clocks->end()) return;
  std::int64_t& seen_ns = hands_ns_.try_emplace(hands.session, hands.sample_time_local_ns).first->second;
  const std::int64_t newest = clock->second.newest_at(hands.sample_time_local_ns);
  for (std::int64_t pose = clock->second.newest_at(seen_ns) + 1; pose <= newest; ++pose)
    context_->tally->record_hands(clock->second.time_ns(pose), now_ns);
  seen_ns = std::max(seen_ns, hands.sample_time_local_ns);
}

void Client::on_props(const wire::RoomProps& props, std::int64_t now_ns) {
  if (slow_) return;
  for (const std::int64_t sent_ns : context_->sent_props->show(context_->room_of(place_), number_, props, seen_props_))
    context_->tally->record_props(sent_ns, now_ns);
}

void Client::on_held(std::uint32_t points, std::int64_t now_ns) {
  context_->tally->count(now_ns, points > 0 ? &Counts::holds : &Counts::holds_empty);
  context_->tally->count(now_ns, &Counts::held_points, points);
}

std::vector<wire::PoseSample> Client::make_poses(std::int64_t pose) {
  std::vector<wire::PoseSample> samples(characters_.size());
  for (std::size_t i = 0; i < characters_.size(); ++i) {
    Character& character = characters_[i];
    const MotionBank::Step step =
        context_->motions->step(character.motion, character.motion_step + static_cast<std::uint64_t>(pose));
    wire::PoseSample& sample = samples[i];
    sample.character = character.number;
    sample.sequence = static_cast<std::uint32_t>(pose);
    sample.capture_time_ns = clock_.time_ns(pose);
    sample.teleport = step.teleport;
    sample.pose = *step.pose;
    for (RigidTransform& bone : sample.pose.bones) bone.position += character.place;
    if (character.asleep && !slow_) {
      const auto same = [](const RigidTransform& a, const RigidTransform& b) {
        return a.position == b.position && a.rotation.coeffs() == b.rotation.coeffs();
      };
      if (std::ranges::equal(step.pose->bones, character.last_pose->bones, same)) {
        context_->tally->count(sample.capture_time_ns, &Counts::poses_asleep);
        character.answered = pose;
      } else {
        // The server owes frames again, from this pose on. No gap is counted from the last frame before the rest.
        character.asleep = false;
        character.tick = 0;
      }
    }
    character.last_pose = step.pose;
  }
  return samples;
}

void Client::on_frame(const FrameSeen& frame, std::int64_t now_ns) {
  if (slow_) return;
  Tally& tally = *context_->tally;
  const bool own = frame.character != 0;
  tally.record_frame(now_ns, frame.level, frame.stride, frame.content_bytes, frame.discontinuous, own);
  if (frame.undecodable) tally.count(now_ns, &Counts::frames_undecodable);
  if (frame.tick > tick_) {
    tally.record_frame_age(frame.sample_time_local_ns, now_ns);
    const std::uint64_t ticks = frame.tick - tick_;
    if (tick_ > 0 && ticks <= kTicksForJitter)
      tally.record_jitter(now_ns, now_ns - tick_arrival_ns_ - static_cast<std::int64_t>(ticks) * tick_ns_);
    tick_ = frame.tick;
    tick_arrival_ns_ = now_ns;
  }
  if (!own) {
    if (toucher_ && frame.pose)
      toucher_->see(frame.member, frame.pose->bones[static_cast<std::size_t>(Bone::head)].position);
    return watch_other(frame, now_ns);
  }
  // The frame was under way when the client removed the character.
  if (frame.character > characters_.size()) return;
  Character& character = characters_[frame.character - 1];
  answer(character, frame, now_ns);
  if (context_->watcher) context_->watcher->on_frame(number_, frame);
}

void Client::watch_other(const FrameSeen& frame, std::int64_t now_ns) {
  Other& other = others_[frame.member];
  context_->tally->record_frame_of_other(frame.sample_time_local_ns, now_ns, other.arrival_ns);
  other.arrival_ns = frame.asleep ? 0 : now_ns;
}

// This frame answers all poses up to the one it was sampled at.
void Client::answer(Character& character, const FrameSeen& frame, std::int64_t now_ns) {
  Tally& tally = *context_->tally;
  if (character.join_ns != kNever_ns) tally.record_join(std::exchange(character.join_ns, kNever_ns), now_ns, true);
  if (character.tick > 0 && frame.tick > character.tick)
    tally.record_gap(now_ns, frame.tick - character.tick, character.stride);
  character.tick = frame.tick;
  character.stride = std::max(1u, frame.stride);
  const std::int64_t newest = std::min(clock_.newest_at(frame.sample_time_local_ns), next_pose_ - 1);
  for (std::int64_t pose = character.answered + 1; pose <= newest; ++pose)
    tally.record_answer(clock_.time_ns(pose), now_ns, 1);
  character.answered = std::max(character.answered, newest);
  character.asleep = frame.asleep && character.last_pose != nullptr;
  if (character.asleep) {
    // Poses that were sent after this frame's sample may have woken the character. Only the next frame shows this, so
    // the poses until now count as those of a character at rest.
    tally.count(now_ns, &Counts::poses_asleep, static_cast<std::uint64_t>(next_pose_ - 1 - character.answered));
    character.answered = next_pose_ - 1;
  }
}

void Client::on_refusal(std::string_view reason, std::int64_t now_ns) {
  if (!slow_) context_->tally->count_error(now_ns, "error_" + std::string(reason));
}

void Client::lose_connection(std::int64_t intended_ns, std::int64_t now_ns) {
  if (!connection_ || state_ == State::leaving || state_ == State::gone) return;
  meant_to_lose_ = true;
  for (Character& character : characters_)
    if (character.join_ns == kNever_ns) character.join_ns = intended_ns;
  connection_.reset();
  protocol_->on_closed(now_ns);
  drive(now_ns);
}

void Client::set_characters(std::uint32_t characters, const std::vector<LevelIndex>& levels, std::int64_t now_ns) {
  while (characters_.size() > characters) {
    protocol_->remove_character(characters_.back().number);
    characters_.pop_back();
  }
  while (characters_.size() < characters) {
    Character& character =
        characters_.emplace_back(make_character(static_cast<std::uint32_t>(characters_.size() + 1), levels));
    character.join_ns = now_ns;
    character.answered = next_pose_ - 1;
    add_to_server(character);
  }
  drive(now_ns);
}

void Client::leave(bool politely, std::int64_t now_ns) {
  if (state_ == State::gone || state_ == State::leaving) return;
  settle(now_ns);
  if (politely && state_ == State::active) {
    state_ = State::leaving;
    protocol_->leave(now_ns);
    drive(now_ns);
  } else {
    close_connection();
    state_ = State::gone;
  }
}

// Counts old poses that no frame has answered as unanswered; a younger pose may still get its frame.
void Client::settle(std::int64_t now_ns) {
  if (slow_) return;
  for (Character& character : characters_) {
    if (character.join_ns != kNever_ns && now_ns - character.join_ns > kAnswerWait_ns)
      context_->tally->record_join(character.join_ns, now_ns, false);
    character.join_ns = kNever_ns;
  }
  give_up_poses(now_ns - kAnswerWait_ns, now_ns, true);
}

// Expects no more answers to poses that were captured up to `until_ns` and sent in this session. `count` says whether
// they count as unanswered.
void Client::give_up_poses(std::int64_t until_ns, std::int64_t now_ns, bool count) {
  if (slow_ || state_ != State::active) return;
  const std::int64_t newest = std::min(clock_.newest_at(until_ns), next_pose_ - 1);
  for (Character& character : characters_) {
    if (count && !character.asleep) {
      for (std::int64_t pose = character.answered + 1; pose <= newest; ++pose)
        context_->tally->record_unanswered(clock_.time_ns(pose), now_ns, 1);
    }
    character.answered = std::max(character.answered, newest);
  }
}

void Client::close_connection() {
  connection_.reset();
  protocol_.reset();
  read_ns_ = begin_ns_ = kNever_ns;
}

std::int64_t PoseClock::time_ns(std::int64_t pose) const {
  return phase_ns + std::llround(static_cast<double>(pose) * interval_ns);
}

std::int64_t PoseClock::newest_at(std::int64_t at_ns) const {
  // The quotient may be off by one after rounding, so the two loops correct it.
  auto pose = static_cast<std::int64_t>(std::floor(static_cast<double>(at_ns - phase_ns) / interval_ns));
  pose = std::max<std::int64_t>(pose, -1);
  while (pose >= 0 && time_ns(pose) > at_ns) --pose;
  while (time_ns(pose + 1) <= at_ns) ++pose;
  return pose;
}

}  // namespace hairnet::load
