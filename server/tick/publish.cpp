#include "server/tick/publish.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <optional>
#include <utility>

#include "core/assert.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "schema/wire/frame_datagram.hpp"

namespace hairnet::server {
namespace {

static_assert(kStrideMax == wire::kStrideMax);

// The errors at which frames are coded, 0.25 mm times 2^(t / 2) for the tolerance t. Each is half an octave above the
// last, so observers that want nearly the same error share a coding. The coarsest is 0.25 mm times 2^11.5, 0.7 m.
constexpr std::uint8_t kToleranceCount = 24;
// The tolerance of a frame without coefficients: the client evaluates the hair itself. It is one above the last real
// tolerance.
constexpr std::uint8_t kPoseOnly = kToleranceCount;
constexpr float kFinestTolerance_m = 0.25e-3f;
// The bytes of a packet beside its frames and their generations are at most this many.
constexpr std::size_t kBatchBytes = 128;
// A head that is smaller than this share of the screen's height is coded as one of this size: its frames may have 50
// times the error of a head that fills the screen.
constexpr float kSmallestHeight = 0.02f;

float tolerance_m(std::uint8_t tolerance) {
  HAIRNET_ASSERT(tolerance < kToleranceCount);
  return kFinestTolerance_m * std::exp2(0.5f * static_cast<float>(tolerance));
}

// The coarsest tolerance that is not above the wanted error; the finest where all are above it.
std::uint8_t tolerance_within(float wanted_m) {
  const float steps = 2 * std::log2(std::max(wanted_m / kFinestTolerance_m, 1.0f));
  return static_cast<std::uint8_t>(std::min(static_cast<int>(steps), kToleranceCount - 1));
}

// Finds or adds the character's coding for a tolerance. Observers with the same tolerance share it; the memory of
// earlier ticks' codings is used again. Only the loop over rooms calls it, and a character is in one room.
std::uint32_t variant_of(Character& character, std::uint8_t tolerance) {
  HAIRNET_ASSERT(character.variant_count <= character.variants.size());
  for (std::size_t i = 0; i < character.variant_count; ++i) {
    if (character.variants[i].tolerance == tolerance) return static_cast<std::uint32_t>(i);
  }
  if (character.variant_count == character.variants.size()) character.variants.emplace_back();
  character.variants[character.variant_count].tolerance = tolerance;
  return static_cast<std::uint32_t>(character.variant_count++);
}

}  // namespace

void Publisher::publish(Rooms& rooms, const Simulation& simulation, const wire::RecordedTick& tick,
                        const ParallelFor& parallel_for, std::int64_t now_ns) {
  const Terms terms{rooms, simulation, tick, now_ns};
  const std::span<Character* const> everyone = rooms.everyone();
  observers_.clear();
  for (auto& [session, observer] : rooms.observers()) {
    observer.requests.clear();
    observer.sent_bytes = 0;
    observer.send_ns = 0;
    if (observer.sink) observers_.push_back(&observer);
  }
  // The loops run one after the other: requests need what has changed, codings need all requests, packets need all
  // codings.
  const auto request_for = [&](std::size_t i) { request(terms, rooms.rooms()[i]); };
  const auto encode_batch = [&](std::size_t i) { encode(terms, batches_[i]); };
  const auto send_to = [&](std::size_t i) {
    Observer& observer = *observers_[i];
    send(terms, observer);
    observer.throttle.end_tick(observer.sent_bytes, def_.tick_s, observer.observe.bytes_per_s,
                               observer.sink->bytes_per_s());
  };
  run_chunks(parallel_for, everyone.size(), [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) begin_frame(terms, *everyone[i]);
  });
  // The loop goes by rooms and not by observers, since observers of one room ask for codings of the same characters.
  run_loop(parallel_for, rooms.rooms().size(), request_for);
  gather_batches(everyone);
  run_loop(parallel_for, batches_.size(), encode_batch);
  run_loop(parallel_for, observers_.size(), send_to);
}

void Publisher::forget_groom(const wire::GroomHash& groom) {
  bases_.erase(groom);
  learnt_.erase(groom);
}

void Publisher::put_learnt(const wire::GroomHash& groom, const wire::GroomHash& learnt) {
  learnt_.insert_or_assign(groom, learnt);
}

void Publisher::put_basis(const wire::GroomHash& groom, const wire::GroomHash& basis,
                          const std::shared_ptr<const LevelSet>& levels) {
  HAIRNET_ASSERT(levels && levels->modes);
  bases_.insert_or_assign(groom,
                          KnownBasis{basis, levels->modes, codec::CoefficientCode(levels->modes->basis.deviation_m)});
}

// Null while the groom has no basis, and while the character still has a lattice of an earlier build of its levels.
const Publisher::KnownBasis* Publisher::basis_of(const Character& character) const {
  const auto found = bases_.find(character.groom);
  if (found == bases_.end()) return nullptr;
  const LatticeView& lattice = character.lattice;
  // Rigid and learnt hair have no lattice whose size could tell.
  if (!lattice.model) return &found->second;
  // Rebuilt levels may have another lattice than the one that the character still has. Its map would not fit.
  const auto node_count = static_cast<Eigen::Index>(lattice.displacement.size());
  return found->second.modes->map(lattice.level).matrix().cols() == 3 * node_count ? &found->second : nullptr;
}

void Publisher::begin_frame(const Terms& terms, Character& character) {
  character.variant_count = 0;
  character.changed = false;
  if (!character.in_world || !terms.simulation.contains(character.key)) return;
  const LatticeView lattice = character.lattice = terms.simulation.lattice(character.key);
  HAIRNET_ASSERT(has_lattice(lattice.level) == (lattice.model != nullptr));
  character.discontinuous = character.discontinuous || (lattice.stepped && lattice.discontinuous);
  // A change of level or a discontinuity is always sent, even if nothing has been stepped.
  const bool is_marked = character.discontinuous || lattice.level != character.shown;
  character.shown = lattice.level;
  character.asleep = lattice.asleep && !is_marked;
  character.changed = (lattice.stepped && !lattice.asleep) || is_marked;
  if (!character.changed) return;
  // Clients cannot show such numbers. The World returns the lattice to rest, and later frames are valid again.
  const bool valid = std::all_of(lattice.displacement.begin(), lattice.displacement.end(),
                                 [](const Vec3f& d) { return d.allFinite(); });
  if (valid) return;
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
  // The frames that wait in the outbox are older than this tick; to send them first would only delay the newest frames
  // further.
  if (observer.sink->drop_if_congested()) {
    observer.forget_sent();
    observer.throttle.on_lost_frames();
    counters_->observers_congested.add();
  }
  const int octaves = observer.throttle.coarser_octaves();
  const auto stride =
      std::max<std::uint64_t>(observer.observe.stride, static_cast<std::uint64_t>(observer.throttle.stride()));
  // An observer may want the error 0, which doubling does not change, so a coarser error is a multiple of the finest
  // tolerance at least.
  const float error_m = octaves == 0 ? observer.observe.error_m
                                     : std::ldexp(std::max(observer.observe.error_m, kFinestTolerance_m), octaves);
  observer.views.resize(room.slots.size());
  for (std::size_t s = 0; s < room.slots.size(); ++s) {
    Character* character = room.slots[s].character;
    if (!character || !character->in_world) continue;
    View& view = observer.views[s];
    HAIRNET_ASSERT(character->slot == s);
    if (!character->asleep) view.sleep_sent = false;
    if (!view.wanted || !view.in_view || !observer.knows(character->slot)) continue;
    view.discontinuity_pending = view.discontinuity_pending || character->discontinuous;
    // The stride counts from the last frame, so characters that change at different ticks do not all come at once.
    const bool due = character->changed && (!view.sent || tick - *view.sent >= stride);
    // Hair that comes to rest gets one last frame, whatever the stride: without it the client would go on from an older
    // one.
    if (!due && (!character->asleep || view.sleep_sent)) continue;
    announce_basis(terms, *character, observer);
    // The wanted error is for a head that fills the screen's height; a head of half of it may have twice the error.
    const float height = view.screen_height < 0 ? 1 : std::clamp(view.screen_height, kSmallestHeight, 1.0f);
    const std::uint8_t tolerance =
        note_learnt(terms, *character, observer, view) ? kPoseOnly : tolerance_within(error_m / height);
    observer.requests.push_back({character, variant_of(*character, tolerance), view.discontinuity_pending});
    view.sent = tick;
    view.sleep_sent = character->asleep;
    // The mark is on its way now. forget_sent() sets it again when this frame may have been lost.
    view.discontinuity_pending = false;
  }
  return static_cast<int>(stride);
}

void Publisher::announce_basis(const Terms& terms, const Character& character, Observer& observer) const {
  const KnownBasis* const basis = basis_of(character);
  if (!basis || !observer.bases_sent.insert(character.groom).second) return;
  counters_->bases_announced.add();
  observer.sink->push(wire::GroomBasis{character.groom, basis->hash}, terms.now_ns);
}

// A network forgets its earlier state within kLearntSettled_ticks (core/learnt/learnt_hair.hpp). So a client that has
// had all poses for so long evaluates about the same hair as the World, whenever its network began.
bool Publisher::note_learnt(const Terms& terms, const Character& character, Observer& observer, View& view) const {
  const std::uint64_t tick = terms.tick.tick;
  const auto learnt = learnt_.find(character.groom);
  if (character.shown != LevelIndex::learnt || learnt == learnt_.end()) {
    view.learnt_since.reset();
    return false;
  }
  LearntAnnounced& announced = observer.learnt_announced[character.groom];
  // Hair may be learnt again, and then has another file: the session must evaluate the new one or nothing.
  if (announced.file != learnt->second) {
    announced = {learnt->second, std::nullopt};
    counters_->learnt_announced.add();
    observer.sink->push(wire::GroomLearnt{character.groom, announced.file}, terms.now_ns);
  }
  const Room& room = terms.rooms.room(character.room);
  const Wind& wind = room.wind_in_world ? *room.wind_in_world : room.wind;
  // Clients evaluate hair in still air of the room: they do not download a network's weights of the wind.
  if (wind.carried || !is_still(wind)) {
    view.learnt_since.reset();
    return false;
  }
  // A client's network begins again after such a gap, and until it has settled its hair differs from the World's.
  if (!view.learnt_since || !view.sent || tick - *view.sent > kLearntGapMax_ticks) view.learnt_since = tick;
  // A fade is added to the coefficients here; a client that evaluates by itself would not see it.
  if (!announced.evaluated_since || character.coefficients.is_fading()) return false;
  return tick - std::max(*view.learnt_since, *announced.evaluated_since) >= kLearntSettled_ticks;
}

void Publisher::gather_batches(std::span<Character* const> everyone) {
  batches_.clear();
  // The newest batch of each basis and level, which may have room. Order and batches do not depend on pointers: they
  // follow the order of characters.
  std::map<std::pair<const KnownBasis*, LevelIndex>, std::size_t> unfilled;
  for (Character* character : everyone) {
    if (character->variant_count == 0) continue;
    const KnownBasis* const basis = basis_of(*character);
    const LatticeView& lattice = character->lattice;
    const ModeMap* const map = basis && lattice.model ? &basis->modes->map(lattice.level) : nullptr;
    const auto [found, is_new] = unfilled.try_emplace({basis, lattice.level}, batches_.size());
    if (is_new || batches_[found->second].count == kModeMapWidth) {
      found->second = batches_.size();
      batches_.push_back({basis, map});
    }
    Batch& batch = batches_[found->second];
    batch.characters[batch.count++] = character;
  }
}

void Publisher::encode(const Terms& terms, const Batch& batch) const {
  const std::int64_t begun_ns = clock_ns();
  const std::span characters(batch.characters.data(), batch.count);
  // The arrays are not cleared, because only what the map has written is read.
  std::array<std::array<float, kModeCountMax>, kModeMapWidth> computed;
  if (batch.map) {
    std::array<std::span<const Vec3f>, kModeMapWidth> displacements;
    std::array<std::span<float>, kModeMapWidth> out;
    for (std::size_t i = 0; i < batch.count; ++i) {
      displacements[i] = characters[i]->lattice.displacement;
      out[i] = std::span(computed[i]).first(batch.basis->modes->basis.mode_count());
    }
    batch.map->coefficients_of(std::span(displacements).first(batch.count), std::span(out).first(batch.count));
  }
  for (std::size_t i = 0; i < batch.count; ++i) {
    const std::span<const float> own = computed[i];
    encode(terms, *characters[i], batch.basis, {batch.map, batch.map ? own : characters[i]->lattice.coefficients});
  }
  // Reading the clock for each character would take as long as encoding the shortest frames.
  const std::int64_t each_ns = (clock_ns() - begun_ns) / static_cast<std::int64_t>(batch.count);
  for (Character* const character : characters) character->encode_ns = each_ns;
}

void Publisher::encode(const Terms& terms, Character& character, const KnownBasis* basis,
                       const HairMotion& motion) const {
  const std::span variants(character.variants.data(), character.variant_count);
  const LatticeView& lattice = character.lattice;
  HAIRNET_ASSERT(lattice.pose);
  std::span<const float> coefficients;
  if (basis) {
    // Also when only poses are sent: a fade begins from there, and what a network gives is merely copied.
    coefficients = character.coefficients.at(terms.tick.tick, def_.tick_s, motion, basis->modes->basis.mode_count(),
                                             character.discontinuous);
  }
  for (FrameVariant& variant : variants) {
    const bool has_hair = basis && variant.tolerance != kPoseOnly;
    variant.detail =
        has_hair ? codec::detail_for(basis->code, coefficients, tolerance_m(variant.tolerance)) : codec::Detail{};
  }
  for (unsigned step = 0; step < codec::kStepCount; ++step) {
    // One coding with the most coefficients of this step of rounding serves all variants of it: each is a prefix.
    std::optional<std::size_t> most;
    for (const FrameVariant& variant : variants) {
      if (variant.detail.step == step) most = std::max(most.value_or(0), variant.detail.count);
    }
    if (!most) continue;
    codec::encode_frame(*lattice.pose, basis ? &basis->code : nullptr, coefficients.first(*most), step,
                        character.coded);
    for (FrameVariant& variant : variants) {
      if (variant.detail.step != step) continue;
      const std::span<const std::uint8_t> content = character.coded.prefix(variant.detail.count);
      variant.content.assign(content.begin(), content.end());
    }
  }
  counters_->frames_encoded.add(variants.size());
}

// Gathers frames into packets. The frames of one packet have at most `bytes_max` bytes together, unless it is a single
// frame.
class Publisher::Packer {
 public:
  // A reliable packet arrives, in order. An unreliable packet may get lost. A datagram is an unreliable packet without
  // an envelope around its frames.
  enum class Kind : std::uint8_t { reliable, unreliable, datagram };
  Packer(const Terms& terms, std::size_t bytes_max, Kind kind, std::vector<FramePacket>& packets)
      : terms_(&terms), bytes_max_(bytes_max), kind_(kind), packets_(&packets) {}

  void add(const wire::Frame& frame, std::uint8_t generation, std::size_t frame_bytes) {
    HAIRNET_ASSERT(batch_.frames.empty() || batch_.frames.back().member < frame.member);
    if (bytes_ + frame_bytes > bytes_max_) flush();
    bytes_ += frame_bytes;
    batch_.frames.push_back(frame);
    // The generation tells an old character in a slot from its successor. Only an unreliable frame can overtake the
    // message that announces the successor, so only there the generation is sent.
    if (kind_ != Kind::reliable) batch_.generations.push_back(generation);
  }
  void flush() {
    if (batch_.frames.empty()) return;
    batch_.tick = terms_->tick.tick;
    batch_.sample_time_ns = terms_->tick.sample_time_ns;
    const std::size_t frame_count = batch_.frames.size();
    wire::FrameBatch batch = std::exchange(batch_, {});
    packets_->push_back({kind_ == Kind::datagram ? wire::encode_frame_datagram(terms_->now_ns, batch)
                                                 : wire::encode_packet({terms_->now_ns, std::move(batch)}),
                         frame_count, kind_ != Kind::reliable});
    // A packet of frames fits the protocol's bound; one that does not would be encoded as no bytes.
    HAIRNET_ASSERT(!packets_->back().bytes.empty());
    bytes_ = 0;
  }

 private:
  const Terms* terms_;
  std::size_t bytes_max_, bytes_ = 0;
  Kind kind_;
  std::vector<FramePacket>* packets_;
  wire::FrameBatch batch_;
};

void Publisher::send(const Terms& terms, Observer& observer) const {
  // An empty packet would say nothing that the next one does not.
  if (observer.requests.empty() && observer.hand_packets.empty()) return;
  const std::int64_t begun_ns = clock_ns();
  std::size_t evaluated_count = 0;
  std::vector<FramePacket> packets;
  const std::size_t datagram_bytes_max = observer.sink->datagram_bytes_max();
  const bool has_envelope = !observer.sink->takes_frame_datagrams();
  const std::size_t head_bytes = has_envelope ? kBatchBytes : wire::frame_datagram_head_bytes(terms.tick.tick);
  // A datagram is never split by QUIC: packets fit into one, or go by the channel.
  const std::size_t unreliable_bytes_max = datagram_bytes_max > head_bytes ? datagram_bytes_max - head_bytes : 0;
  // Requests come in the order of slots, so members ascend in every packet, as the protocol wants.
  Packer reliable(terms, def_.packet_bytes_max, Packer::Kind::reliable, packets);
  Packer unreliable(terms, unreliable_bytes_max, has_envelope ? Packer::Kind::unreliable : Packer::Kind::datagram,
                    packets);
  for (const Observer::Request& request : observer.requests) {
    const Character& character = *request.character;
    HAIRNET_ASSERT(request.variant < character.variant_count);
    const FrameVariant& variant = character.variants[request.variant];
    wire::Frame frame;
    frame.member = member_of(character);
    frame.level = character.shown;
    frame.discontinuous = request.discontinuous;
    frame.asleep = character.asleep;
    frame.evaluated = variant.tolerance == kPoseOnly;
    evaluated_count += frame.evaluated ? 1 : 0;
    frame.step_stride = static_cast<std::uint8_t>(character.stride);
    frame.content = variant.content;
    // The frame, and one byte of its generation.
    const std::size_t frame_bytes = wire::frame_bytes(frame) + 1;
    // A frame with one of these marks must arrive: the next frame does not repeat the mark.
    const bool may_be_lost = !frame.asleep && !frame.discontinuous && frame_bytes <= unreliable_bytes_max;
    (may_be_lost ? unreliable : reliable).add(frame, character.generation, frame_bytes);
  }
  reliable.flush();
  unreliable.flush();
  counters_->frames_published.add(observer.requests.size());
  counters_->frames_evaluated_by_clients.add(evaluated_count);
  const auto bytes_of = [](std::span<const FramePacket> some) {
    std::size_t bytes = 0;
    for (const FramePacket& packet : some) bytes += packet.bytes.size();
    return bytes;
  };
  const std::size_t frame_bytes = bytes_of(packets), hand_bytes = bytes_of(observer.hand_packets);
  // The throttle counts hands, too: they share the connection.
  observer.sent_bytes = frame_bytes + hand_bytes;
  counters_->frame_bytes_published.add(frame_bytes);
  counters_->hand_bytes_published.add(hand_bytes);
  std::ranges::move(observer.hand_packets, std::back_inserter(packets));
  observer.hand_packets.clear();
  observer.sink->push_frames(std::move(packets));
  observer.send_ns += clock_ns() - begun_ns;
}

}  // namespace hairnet::server
