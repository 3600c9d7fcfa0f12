#pragma once

#include <array>
#include <cstring>
#include <exception>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "client/draw/groom_geometry.hpp"
#include "client/draw/hair_points.hpp"
#include "client/hairnet.h"
#include "client/link/conversation.hpp"
#include "client/room/room.hpp"
#include "core/ffd/skin_push.hpp"
#include "core/levels/level.hpp"
#include "core/touch/touch_body.hpp"
#include "schema/wire/groom_file.hpp"

struct hairnet_groom {
  std::shared_ptr<const hairnet::Groom> groom;
  hairnet::link::RequestedState::Bytes file;
  hairnet::wire::GroomHash hash{};
  // Lines, each ended by a line break.
  std::string remarks = {};
};

struct hairnet_geometry {
  hairnet::draw::GroomGeometry geometry;
};

namespace hairnet::c {

// Gives each basis a number, from 1, for as long as the basis exists. Callers of the C functions name a basis on their
// GPU by its number; an address could be used again for another basis.
class BasisNumbers {
 public:
  std::uint32_t number_of(const std::shared_ptr<const Basis>& basis) {
    const auto [known, is_new] = numbers_.try_emplace(basis, last_ + 1);
    last_ += is_new;
    return known->second;
  }
  void forget_unused() {
    std::erase_if(numbers_, [](const auto& entry) { return entry.first.expired(); });
  }

 private:
  std::map<std::weak_ptr<const Basis>, std::uint32_t, std::owner_less<>> numbers_;
  std::uint32_t last_ = 0;
};

}  // namespace hairnet::c

// What a room or a world shows now.
struct hairnet_scene {
  struct Shown {
    std::shared_ptr<const hairnet::room::Member> member;
    hairnet::MovedLattice lattice;
    std::shared_ptr<const hairnet::LevelGeometry> geometry;
  };
  std::vector<Shown> shown;
  // The prepared points of each groom with each geometry; all characters that share both share an entry.
  // forget_unused() drops the entries that no shown character needs.
  mutable std::map<std::pair<const hairnet::Groom*, const hairnet::LevelGeometry*>, hairnet::draw::HairPoints> points;
  mutable hairnet::c::BasisNumbers bases;
  // The result of the last hairnet_shown_skin(), to which the caller has pointers.
  mutable std::optional<hairnet::SkinPush> skin;
  mutable std::vector<hairnet_skin_grid> skin_grids;
};

struct hairnet_levels {
  hairnet::wire::GroomHash groom{};
  std::shared_ptr<const hairnet::LevelSet> levels;
};

struct hairnet_room {
  // Set for a room of hairnet_open(), whose sockets are the caller's; null for one of hairnet_connect().
  std::unique_ptr<hairnet::link::LinkCore> core;
  // The conversation of `core`, which the room owns.
  hairnet::link::CoreConversation* conversation = nullptr;
  std::unique_ptr<hairnet::room::Room> room;
  hairnet_scene scene;
  // The events that were taken from the room; hairnet_next_event() hands out the one at next_event.
  std::vector<hairnet::room::Event> events;
  std::size_t next_event = 0;
  // Texts and bytes to which the caller got pointers, valid until the next call of the same function.
  std::string event_text, host;
  std::vector<std::uint8_t> packet;
  // The shapes of the last hairnet_get_hands(), to which the caller has pointers.
  mutable std::vector<hairnet_hand_shape> hand_shapes;
};

namespace hairnet::c {

// Writes one line into the caller's buffer; a null buffer gets none.
inline void tell(std::string_view line, char* error, std::size_t error_size) {
  if (error == nullptr || error_size == 0) return;
  // A line that does not fit is cut, and always ends by a 0.
  const std::size_t length = line.copy(error, error_size - 1);
  error[length] = 0;
}

inline hairnet_error refuse(hairnet_error code, std::string_view line, char* error, std::size_t error_size) {
  tell(line, error, error_size);
  return code;
}

inline hairnet_error no_such_character(char* error, std::size_t error_size) {
  return refuse(HAIRNET_NOT_THERE, "there is no such own character", error, error_size);
}

// Runs what may run out of memory. The library throws nothing else, and no exception may reach a caller in C. A
// function of hairnet.h checks numbers, texts and bytes, and returns an error; it trusts pointers, except where the
// header says NULL.
template <class Function>
hairnet_error guarded(Function&& function, char* error = nullptr, std::size_t error_size = 0) {
#if defined(__cpp_exceptions)
  try {
    return function();
  } catch (const std::exception& thrown) {
    return refuse(HAIRNET_OUT_OF_MEMORY, thrown.what(), error, error_size);
  }
#else
  (void)error, (void)error_size;
  return function();
#endif
}

inline std::string text_or_empty(const char* text) {
  return text == nullptr ? std::string() : std::string(text);
}

// `size` 0: the tag ends before its first byte of 0.
inline std::string tag_of(const char* tag, std::size_t size) {
  return tag == nullptr || size == 0 ? text_or_empty(tag) : std::string(tag, size);
}

// Makes a groom's file and handle; what is wrong with it is `error`.
hairnet_error keep(Result<Groom>&& groom, hairnet_error code, hairnet_groom** out, char* error, std::size_t error_size);

// Refuses options of a size that this library does not know.
Refusal of_another_size(const char* macro);

// Returns the caller's options with a default for each field that the caller's version of the struct lacks. Null
// options are all default. `macro` is the name of the macro that fills in the defaults, for the error.
template <class Options>
Result<Options> full_options(const Options* given, Options defaults, const char* macro) {
  if (given == nullptr) return defaults;
  // A size of 0 means options that were not made by the macro. A larger one has fields that this library would silently
  // ignore.
  if (given->size < sizeof given->size || given->size > sizeof defaults) return of_another_size(macro);
  // A smaller struct is that of an older header; fields are only appended, so the rest keeps its defaults.
  std::memcpy(&defaults, given, given->size);
  return defaults;
}

// Returns HAIRNET_OK, or HAIRNET_INVALID with the result's error as the line.
template <class T>
hairnet_error done_or_error(const Result<T>& result, char* error, std::size_t error_size) {
  return result ? hairnet_error{HAIRNET_OK} : refuse(HAIRNET_INVALID, result.error(), error, error_size);
}

// Rotations are quaternions in the order x y z w.
RigidTransform place_of(const double rotation[4], const double position[3]);
void write_place(const RigidTransform& place, double* rotation, double* position);
// The error is one line. Sizes and place are not checked here; validate() does so.
Result<TouchBody> body_of(const hairnet_touch_body& given);
hairnet_touch_body body_of(const wire::Prop& prop);
Pose pose_of(const double* numbers);
void write_pose(const Pose& pose, double* numbers);
wire::Appearance appearance_of(const hairnet_appearance& appearance);
hairnet_appearance appearance_of(const wire::Appearance& appearance);
// An error is one line.
Result<std::optional<wire::Appearance>> checked(const hairnet_appearance* appearance);
// Fields that the caller's version does not know have their defaults. The error is one line.
Result<room::CharacterOptions> character_options_of(const hairnet_character_options* given);
MaterialScale scale_of(const hairnet_material& material);
// Drops what was made for grooms and bases that nobody shows any more.
void forget_unused(hairnet_scene& scene);
Wind wind_of(const hairnet_wind& wind);
hairnet_wind wind_of(const Wind& wind);

}  // namespace hairnet::c
