#include "server/tick/publish.hpp"

#include <algorithm>
#include <cmath>

#include "core/assert.hpp"

namespace hairnet::server {
namespace {

using codec::ErrorClass;

static_assert(kStrideMax == wire::kStrideMax);

// The error class asked for, or the next coarser one whose 16-bit integers cover every displacement of the level.
ErrorClass error_class_that_fits(ErrorClass wanted, const Level* level) {
  auto index = static_cast<std::size_t>(wanted);
  while (level && index + 1 < codec::kErrorClassCount && 32767 * codec::kStep_m[index] < level->displacement_max_m)
    ++index;
  return static_cast<ErrorClass>(index);
}

// Tolerances of coefficients, half an octave apart, so that observers share codings. Numbers begin with 1, the finest.
constexpr std::uint8_t kToleranceCount = 24;
constexpr float kFinestTolerance_m = 0.25e-3f;

float tolerance_m(std::uint8_t tolerance) {
  HAIRNET_ASSERT(tolerance >= 1 && tolerance <= kToleranceCount);
  return kFinestTolerance_m * std::exp2(0.5f * static_cast<float>(tolerance - 1));
}

// The coarsest that is not above, or the finest.
std::uint8_t tolerance_within(float wanted_m) {
  const float steps = 2 * std::log2(std::max(wanted_m / kFinestTolerance_m, 1.0f));
  return static_cast<std::uint8_t>(1 + std::min(static_cast<int>(steps), kToleranceCount - 1));
}

struct Coding {
  std::uint8_t order = 0, stride = 1;
};

// The highest order for which server and client both have the earlier frames.
Coding coding_for(const View& view, const Character& character, ErrorClass error_class, std::uint64_t tick) {
  HAIRNET_ASSERT(view.sent_count <= view.sent.size());
  HAIRNET_ASSERT(view.sent_count == 0 || view.sent[0] < tick);  // one frame a tick
  if (view.sent_count == 0 || view.level != character.shown || view.error_class != error_class) return {};
  const std::uint64_t stride = tick - view.sent[0];
  if (!wire::is_stride(stride)) return {};
  Coding coding{0, static_cast<std::uint8_t>(stride)};
  while (coding.order < view.sent_count && view.sent[coding.order] == tick - stride * (coding.order + 1u) &&
         character.history.find(error_class, view.sent[coding.order]))
    ++coding.order;
  HAIRNET_ASSERT(coding.order <= codec::kHistoryMax);
  return coding.order == 0 ? Coding{} : coding;
}

std::uint32_t variant_of(Character& character, ErrorClass error_class, Coding coding, bool velocities,
                         std::uint8_t tolerance = 0) {
  HAIRNET_ASSERT(character.variant_count <= character.variants.size());
  for (std::size_t i = 0; i < character.variant_count; ++i) {
    const FrameVariant& v = character.variants[i];
    if (v.error_class == error_class && v.order == coding.order && v.stride == coding.stride &&
        v.velocities == velocities && v.tolerance == tolerance)
      return static_cast<std::uint32_t>(i);
  }
  if (character.variant_count == character.variants.size()) character.variants.emplace_back();
  FrameVariant& added = character.variants[character.variant_count];
  added.error_class = error_class;
  added.order = coding.order;
  added.stride = coding.stride;
  added.velocities = velocities;
  added.tolerance = tolerance;
  return static_cast<std::uint32_t>(character.variant_count++);
}

void note_sent(View& view, const Character& character, ErrorClass error_class, std::uint64_t tick) {
  if (view.level != character.shown || view.error_class != error_class) view.sent_count = 0;
  view.level = character.shown;
  view.error_class = error_class;
  std::shift_right(view.sent.begin(), view.sent.end(), 1);
  view.sent[0] = tick;
  view.sent_count = static_cast<std::uint8_t>(std::min<std::size_t>(view.sent_count + 1u, view.sent.size()));
  view.sleep_sent = character.asleep;
  view.discontinuity_pending = false;
}

}  // namespace

void Publisher::publish(Rooms& rooms, const Simulation& simulation, const wire::RecordedTick& tick,
                        const ParallelFor& parallel_for, std::int64_t now_ns) {
  const Terms terms{rooms, simulation, tick, now_ns};
  const std::span<Character* const> everyone = rooms.everyone();
  observers_.clear();
  for (auto& [session, observer] : rooms.observers()) {
    observer.requests.clear();
    observer.send_ns = 0;
    if (observer.sink) observers_.push_back(&observer);
  }
  const auto begin_frame_of = [&](std::size_t i) { begin_frame(terms, *everyone[i]); };
  const auto request_for = [&](std::size_t i) { request(terms, rooms.rooms()[i]); };
  const auto encode_one = [&](std::size_t i) { encode(terms, *everyone[i]); };
  const auto send_to = [&](std::size_t i) { send(terms, *observers_[i]); };
  run_loop(parallel_for, everyone.size(), begin_frame_of);
  run_loop(parallel_for, rooms.rooms().size(), request_for);
  run_loop(parallel_for, everyone.size(), encode_one);
  run_loop(parallel_for, observers_.size(), send_to);
}

void Publisher::follow_level(const LatticeView& lattice, Character& character) {
  HAIRNET_ASSERT((lattice.level == LevelIndex::rigid) == (lattice.model == nullptr));
  if (lattice.level == character.shown) return;
  character.shown = lattice.level;
  character.switched = true;
  character.history.clear();
  character.neighbours = nullptr;
  if (!lattice.model) return;
  const std::lock_guard lock(neighbours_mutex_);
  auto& neighbours = neighbours_[{character.groom, lattice.level}];
  if (!neighbours) neighbours = std::make_shared<const codec::Neighbours>(lattice.model->geometry);
  HAIRNET_ASSERT(neighbours->node_count() == lattice.displacement.size());
  character.neighbours = neighbours;
}

void Publisher::forget_groom(const wire::GroomHash& groom) {
  std::erase_if(neighbours_, [&](const auto& entry) { return entry.first.first == groom; });
  bases_.erase(groom);
}

void Publisher::put_basis(const wire::GroomHash& groom, const wire::GroomHash& basis,
                          const std::shared_ptr<const LevelSet>& levels) {
  HAIRNET_ASSERT(levels && levels->modes);
  bases_.insert_or_assign(groom,
                          KnownBasis{basis, levels->modes, codec::CoefficientCode(levels->modes->basis.deviation_m)});
}

// Null as well while the character's lattice is of levels that were built before.
const Publisher::KnownBasis* Publisher::basis_of(const Character& character) const {
  const auto found = bases_.find(character.groom);
  if (found == bases_.end()) return nullptr;
  const LatticeView& lattice = character.lattice;
  if (!lattice.model) return &found->second;
  const auto node_count = static_cast<Eigen::Index>(lattice.displacement.size());
  return found->second.modes->map(lattice.level).matrix().cols() == 3 * node_count ? &found->second : nullptr;
}

void Publisher::begin_frame(const Terms& terms, Character& character) {
  character.variant_count = 0;
  character.changed = false;
  if (!character.in_world || !terms.simulation.contains(character.key)) return;
  const LatticeView lattice = character.lattice = terms.simulation.lattice(character.key);
  follow_level(lattice, character);
  if (lattice.stepped) character.shown_bones = character.bones.bones;
  character.discontinuous = character.discontinuous || (lattice.stepped && lattice.discontinuous);
  const bool is_marked = character.discontinuous || character.switched;
  character.asleep = lattice.asleep && !is_marked;
  character.changed = (lattice.stepped && !lattice.asleep) || is_marked;
  if (!character.changed) return;
  const bool sound = std::all_of(lattice.displacement.begin(), lattice.displacement.end(),
                                 [](const Vec3f& d) { return d.allFinite(); });
  if (sound) return;
  counters_->frames_dropped_not_finite.add();
  character.changed = character.asleep = false;
}

void Publisher::request(const Terms& terms, Room& room) const {
  if (!room.in_use) return;
  room.stride_max = 1;
  for (Observer* observer : room.observers) {
    if (!observer->sink) continue;
    const std::int64_t begun_ns = clock_ns();
    room.stride_max = std::max(room.stride_max, request(terms, room, *observer));
    observer->send_ns = clock_ns() - begun_ns;
  }
}

int Publisher::request(const Terms& terms, const Room& room, Observer& observer) const {
  const std::uint64_t tick = terms.tick.tick;
  if (observer.sink->drop_if_congested()) {
    observer.forget_sent();
    observer.congestion_stride = std::min(2 * observer.congestion_stride, kStrideMax);
    observer.congestion_eases_at = tick + def_.congestion_ticks;
    counters_->observers_congested.add();
  } else if (observer.congestion_stride > 1 && tick >= observer.congestion_eases_at) {
    observer.congestion_stride /= 2;
    observer.congestion_eases_at = tick + def_.congestion_ticks;
  }
  const auto stride =
      std::max<std::uint64_t>(observer.observe.stride, static_cast<std::uint64_t>(observer.congestion_stride));
  observer.views.resize(room.slots.size());
  for (std::size_t s = 0; s < room.slots.size(); ++s) {
    Character* character = room.slots[s].character;
    if (!character || !character->in_world) continue;
    View& view = observer.views[s];
    HAIRNET_ASSERT(character->slot == s);
    if (!character->asleep) view.sleep_sent = false;
    if (!view.wanted || !view.in_view || !observer.knows(character->slot)) continue;
    const KnownBasis* const basis = observer.observe.error_m > 0 ? basis_of(*character) : nullptr;
    view.discontinuity_pending =
        view.discontinuity_pending || character->discontinuous || (character->switched && !basis);
    const bool due = character->changed && (view.sent_count == 0 || tick - view.sent[0] >= stride);
    if (!due && (!character->asleep || view.sleep_sent)) continue;
    if (basis) {
      request_coefficients(terms, *basis, view, *character, observer);
      continue;
    }
    if (view.coefficients) view.sent_count = 0;  // the client has no nodes to predict from
    view.coefficients = false;
    const Level* model = character->lattice.model;
    const bool has_record = view.sent_count > 0 && view.level == character->shown;
    if (model && !has_record && observer.records_sent.emplace(character->groom, character->shown).second) {
      counters_->level_records_sent.add();
      observer.sink->push(wire::LevelRecord{character->groom, character->shown, model->geometry}, terms.now_ns);
    }
    const ErrorClass error_class = error_class_that_fits(observer.observe.error_class, model);
    const Coding coding = coding_for(view, *character, error_class, tick);
    const bool velocities = observer.observe.velocities && model;
    observer.requests.push_back(
        {character, variant_of(*character, error_class, coding, velocities), view.discontinuity_pending});
    note_sent(view, *character, error_class, tick);
  }
  return static_cast<int>(stride);
}

void Publisher::request_coefficients(const Terms& terms, const KnownBasis& basis, View& view, Character& character,
                                     Observer& observer) const {
  if (observer.bases_sent.insert(character.groom).second) {
    counters_->bases_announced.add();
    observer.sink->push(wire::GroomBasis{character.groom, basis.hash}, terms.now_ns);
  }
  constexpr float kSmallest = 0.02f;  // of the screen's height; a head's
  const float height = view.screen_height < 0 ? 1 : std::clamp(view.screen_height, kSmallest, 1.0f);
  const std::uint8_t tolerance = tolerance_within(observer.observe.error_m / height);
  observer.requests.push_back(
      {&character, variant_of(character, ErrorClass::half_mm, {}, false, tolerance), view.discontinuity_pending});
  note_sent(view, character, ErrorClass::half_mm, terms.tick.tick);
  view.coefficients = true;
}

void Publisher::encode(const Terms& terms, Character& character) const {
  const std::span variants(character.variants.data(), character.variant_count);
  if (variants.empty()) return;
  const std::int64_t begun_ns = clock_ns();
  const auto has_coefficients = [](const FrameVariant& v) { return v.tolerance > 0; };
  if (!std::ranges::all_of(variants, has_coefficients)) encode_nodes(terms, character);
  if (std::ranges::any_of(variants, has_coefficients)) encode_coefficients(terms, character);
  counters_->frames_encoded.add(variants.size());
  character.encode_ns = clock_ns() - begun_ns;
}

void Publisher::encode_coefficients(const Terms& terms, Character& character) const {
  const LatticeView& lattice = character.lattice;
  const KnownBasis* const basis = basis_of(character);
  HAIRNET_ASSERT(basis && lattice.pose);
  const ModeMap* const map = lattice.model ? &basis->modes->map(lattice.level) : nullptr;
  const std::span<const float> coefficients =
      character.coefficients.at(terms.tick.tick, def_.tick_s, map, lattice.displacement,
                                basis->modes->basis.mode_count(), character.discontinuous);
  std::array<codec::EncodedFrame, codec::kStepCount> coded;
  for (FrameVariant& variant : std::span(character.variants.data(), character.variant_count)) {
    if (variant.tolerance == 0) continue;
    const codec::Detail detail = codec::detail_for(coefficients, tolerance_m(variant.tolerance));
    codec::EncodedFrame& frame = coded[detail.step];
    if (frame.bytes.empty()) codec::encode_frame(*lattice.pose, &basis->code, coefficients, detail.step, frame);
    const std::span<const std::uint8_t> content = frame.prefix(detail.count);
    variant.content.assign(content.begin(), content.end());
  }
}

void Publisher::encode_nodes(const Terms& terms, Character& character) const {
  const std::span variants(character.variants.data(), character.variant_count);
  const LatticeView& lattice = character.lattice;
  const std::uint64_t tick = terms.tick.tick;
  HAIRNET_ASSERT(lattice.level == character.shown);
  HAIRNET_ASSERT(lattice.displacement.size() == (character.neighbours ? character.neighbours->node_count() : 0));
  const auto strides =
      static_cast<std::uint64_t>(std::max(terms.rooms.room(character.room).stride_max, character.stride));
  std::uint64_t history_ticks = codec::kHistoryMax * strides;
  for (const FrameVariant& v : variants)  // an observer that had a longer stride before still refers to older frames
    history_ticks = std::max(history_ticks, std::uint64_t{v.order} * v.stride);
  const std::uint64_t keep_from = tick - std::min(tick, history_ticks);
  std::array<codec::FrameIntegers*, codec::kErrorClassCount> integers{};
  for (const FrameVariant& variant : variants) {
    if (variant.tolerance > 0) continue;
    codec::FrameIntegers*& now = integers[static_cast<std::size_t>(variant.error_class)];
    if (now) continue;
    now = &character.history.add(variant.error_class, tick, keep_from);
    now->bones = character.shown_bones;
    codec::quantise_nodes(lattice.displacement, variant.error_class, now->nodes);
    now->velocities.clear();
  }
  // Frames with velocities are coded last: the integers have no velocities until then.
  for (const bool velocities : {false, true}) {
    for (FrameVariant& variant : variants) {
      if (variant.velocities != velocities || variant.tolerance > 0) continue;
      codec::FrameIntegers& now = *integers[static_cast<std::size_t>(variant.error_class)];
      if (velocities && now.velocities.empty())
        codec::quantise_velocities(terms.simulation.velocity(character.key), variant.error_class, now.velocities);
      std::array<const codec::FrameIntegers*, codec::kHistoryMax> history{};
      for (std::size_t k = 0; k < variant.order; ++k) {
        history[k] = character.history.find(variant.error_class, tick - variant.stride * (k + 1));
        HAIRNET_ASSERT(history[k]);
      }
      variant.content.clear();
      codec::encode_frame(now, std::span(history).first(variant.order), character.neighbours.get(), variant.content);
    }
  }
}

void Publisher::send(const Terms& terms, Observer& observer) const {
  if (observer.requests.empty()) return;
  const std::int64_t begun_ns = clock_ns();
  std::vector<FramePacket> packets;
  wire::FrameBatch batch{terms.tick.tick, terms.tick.sample_time_ns, {}};
  std::size_t bytes = 0;
  const auto flush = [&] {
    const std::size_t frame_count = batch.frames.size();
    HAIRNET_ASSERT(frame_count > 0);
    packets.push_back({wire::encode_packet({terms.now_ns, std::move(batch)}), frame_count});
    HAIRNET_ASSERT(!packets.back().bytes.empty());  // a packet of frames fits the protocol's bound
    batch = {terms.tick.tick, terms.tick.sample_time_ns, {}};
    bytes = 0;
  };
  for (const Observer::Request& request : observer.requests) {
    const Character& character = *request.character;
    HAIRNET_ASSERT(request.variant < character.variant_count);
    HAIRNET_ASSERT(batch.frames.empty() || batch.frames.back().member < member_of(character));
    const FrameVariant& variant = character.variants[request.variant];
    wire::Frame frame;
    frame.member = member_of(character);
    frame.level = character.shown;
    frame.error_class = variant.error_class;
    frame.discontinuous = request.discontinuous;
    frame.asleep = character.asleep;
    frame.velocities = variant.velocities;
    frame.coefficients = variant.tolerance > 0;
    frame.order = variant.order;
    frame.stride = variant.stride;
    frame.step_stride = static_cast<std::uint8_t>(character.stride);
    frame.content = variant.content;
    const std::size_t frame_bytes = wire::frame_bytes(frame);
    if (bytes + frame_bytes > def_.packet_bytes_max && !batch.frames.empty()) flush();
    bytes += frame_bytes;
    batch.frames.push_back(frame);
  }
  flush();
  counters_->frames_published.add(observer.requests.size());
  for (const FramePacket& packet : packets) counters_->frame_bytes_published.add(packet.bytes.size());
  observer.sink->push_frames(std::move(packets));
  observer.send_ns += clock_ns() - begun_ns;
}

}  // namespace hairnet::server
