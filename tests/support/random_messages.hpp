#pragma once

#include <cstdint>
#include <random>

#include "core/groom/groom.hpp"
#include "schema/wire/messages.hpp"
#include "schema/wire/recording.hpp"

namespace hairnet::wire {

// Draws valid messages, grooms and recording entries of random content. The same seed gives the same content with
// the same standard library.
class RandomMessages {
 public:
  explicit RandomMessages(std::uint64_t seed) : random_(seed) {}

  // Makes a message of the kind at this index of Message (schema/wire/messages.hpp).
  Message message(std::size_t kind);
  Envelope envelope(std::size_t kind) { return {time_ns(), message(kind)}; }
  // Makes a lattice of 2 to 6 nodes on each axis, each node active or trimmed at random.
  LevelGeometry geometry();
  // Makes a frame of member 0. The frame's content points into `content`, which must outlive it.
  Frame frame(std::vector<std::uint8_t>& content);
  FrameBatch frame_batch();
  HairState hair_state();
  Observe observe();
  Pose pose();
  // The coordinates are rounded as those of hands that were sent, so encoding them again loses nothing.
  std::vector<Hand> hands();
  Material material();
  MaterialScale material_scale();
  Wind wind();
  Groom groom(std::size_t strand_count);
  RecordingHeader recording_header();
  RecordedTick recorded_tick();

  // Return random numbers between both limits; the integer may equal either.
  std::uint64_t integer(std::uint64_t least, std::uint64_t most) {
    return std::uniform_int_distribution<std::uint64_t>(least, most)(random_);
  }
  double real(double least, double most) { return std::uniform_real_distribution<double>(least, most)(random_); }
  bool coin() { return integer(0, 1) == 1; }

 private:
  std::int64_t time_ns();
  std::string text();
  std::uint32_t u32() { return static_cast<std::uint32_t>(integer(0, 0xFFFFFFFF)); }
  std::uint64_t u64() { return integer(0, ~std::uint64_t{0}); }
  GroomHash hash();
  // Draws a level from the finest to `last`.
  LevelIndex level(LevelIndex last = LevelIndex::rigid);
  // Draws each coordinate from [-most, most].
  Vec3f vector(float most);
  // Draws a rotation of up to 3 rad, and a position of up to max_m on each axis. The position's numbers are floats.
  RigidTransform place(float max_m);
  std::vector<std::uint8_t> prop_numbers();
  // Adds threads, cards, cloths, knots, clumps and root blends.
  void add_features(Groom& groom);
  TouchBody touch_body(std::uint8_t number);
  void add_touch(RecordedTick& tick);
  std::vector<std::uint8_t> bytes(std::size_t count);

  // Draws a value of any type, of a struct field by field. The overloads are for types whose values have limits.
  template <class T>
  void draw(T& value);
  void draw(std::int64_t& time) { time = time_ns(); }
  void draw(std::string& string) { string = text(); }
  void draw(LevelIndex& index) { index = level(); }
  void draw(GroomState& state) { state = static_cast<GroomState>(integer(0, 3)); }
  void draw(ModerateAction& action) { action = static_cast<ModerateAction>(integer(0, 4)); }
  void draw(TouchAudience& audience) { audience = static_cast<TouchAudience>(integer(0, 3)); }
  void draw(Release& release) { release = static_cast<Release>(integer(0, 2)); }
  void draw(std::vector<Hand>& any) { any = hands(); }
  void draw(PoseBatch& batch);
  void draw(Prop& prop);
  void draw(SetProps& set);
  void draw(RoomProps& room);
  void draw(Pose& valid) { valid = pose(); }
  void draw(MaterialScale& scale) { scale = material_scale(); }
  void draw(Wind& any) { any = wind(); }
  void draw(HairState& state) { state = hair_state(); }
  void draw(Hello& hello);
  void draw(GroomOffer& offer);
  void draw(Observe& any) { any = observe(); }
  void draw(Welcome& welcome);
  void draw(GroomData& data);
  void draw(FrameBatch& batch) { batch = frame_batch(); }
  void draw(ServerAt& server);
  void draw(Error& error);
  void draw(Goodbye& goodbye);

  std::mt19937_64 random_;
};

inline constexpr std::size_t kMessageKinds = std::variant_size_v<Message>;

}  // namespace hairnet::wire
