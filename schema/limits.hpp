#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <string_view>

// The limits of messages, and the version of the protocol. Limits of grooms: GroomLimits (core/groom/groom.hpp). The
// TypeScript constants are generated from these lines (client/web/scripts/generate.mjs), and PROTOCOL.md has a row for
// each: write one plain number a line.
namespace hairnet::wire {

// Servers refuse every other version. PROTOCOL.md, Versions, says which changes raise it.
inline constexpr std::uint16_t kProtocolVersion = 4;
// Bounds the memory that a packet which is not yet whole takes at its receiver.
inline constexpr std::size_t kPacketBytesMax = 4'194'304;
// A prefix, the root, the identifier and an empty table take so much.
inline constexpr std::size_t kPacketBytesMin = 16;
// Any packet takes at most so much beside its poses, frames, geometry or chunk.
inline constexpr std::size_t kPacketOverheadBytesMax = 4096;
// Some browsers take no more.
inline constexpr std::size_t kDatagramBytesMax = 1024;
// A packet with one chunk fits the window of a download's stream (client/link/download_reader.hpp).
inline constexpr std::size_t kGroomChunkBytesMax = 262'144;
// Limits a groom's file, packed and unpacked: a small file must not unpack into more.
inline constexpr std::size_t kGroomBytesMax = 268'435'456;
inline constexpr std::size_t kPosesPerBatchMax = 4096;
// Limits one batch.
inline constexpr std::size_t kEarlierPosesMax = 16;
// Limits Observe and ReportImportance.
inline constexpr std::size_t kMembersPerMessageMax = 4096;
// The largest lattice has so many integers.
inline constexpr std::size_t kHairStateIntegersMax = 786'432;
inline constexpr std::size_t kRoomNameBytesMax = 64;
// A Hello must stay small, since anyone may send one.
inline constexpr std::size_t kTokenBytesMax = 4096;
// Counts the servers that a welcome names beside the one that sends it.
inline constexpr std::size_t kServersMax = 8;
// Limits a character's tag.
inline constexpr std::size_t kTagBytesMax = 256;
// Limits the bytes of one person's hands: all valid ones keep to it, as does any mixture of them.
inline constexpr std::size_t kHandsBytesMax = 1041;
// Limits the props of a room: their numbers are below it.
inline constexpr std::size_t kPropsMax = 128;
// Limits the sessions that a character's owner chooses.
inline constexpr std::size_t kTouchChosenMax = 64;
inline constexpr std::uint32_t kStrideMax = 4;  // ticks
inline constexpr float kObserveRadiusMax_m = 20'000;
inline constexpr float kObserveErrorMax_m = 1;
inline constexpr float kHairStateStepMax_m = 0.001f;
// Limits a head's height over the screen's.
inline constexpr float kScreenHeightMax = 100;
// Limits any string.
inline constexpr std::size_t kTextBytesMax = 1024;
// Limits any coordinate of a pose, absolute.
inline constexpr double kPositionMax_m = 10'000;
// Limits any time, absolute: sums cannot overflow.
inline constexpr std::int64_t kTimeMax_ns = 2'305'843'009'213'693'952;
inline constexpr std::uint32_t kTickRateMax_hz = 1000;
// A peer is lost when nothing comes from it for so long.
inline constexpr std::uint32_t kSilence_ms = 10'000;
inline constexpr std::uint32_t kLatticeNodesPerAxisMax = 64;
// Limits the origin and the spacing, absolute.
inline constexpr float kLatticeCoordinateMax_m = 100;

constexpr bool is_stride(std::uint64_t ticks) {
  return ticks == 1 || ticks == 2 || ticks == kStrideMax;
}

inline constexpr const char* kRoomNameRule = "a room's name is up to 64 letters, digits, '.', '_' and '-'";
// Whether a text keeps to that rule, with letters and digits of ASCII. The empty name is the lobby.
constexpr bool is_room_name(std::string_view text) {
  return text.size() <= kRoomNameBytesMax && std::all_of(text.begin(), text.end(), [](char c) {
           return (c >= '0' && c <= '9') || (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == '.' || c == '_' ||
                  c == '-';
         });
}

}  // namespace hairnet::wire
