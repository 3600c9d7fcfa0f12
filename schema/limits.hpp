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
// The most bytes of a packet. They bound the memory that a packet which is not yet complete takes at its receiver.
inline constexpr std::size_t kPacketBytesMax = 4'194'304;
// The fewest bytes of a packet: those of a prefix, the root, the identifier and an empty table.
inline constexpr std::size_t kPacketBytesMin = 16;
// The most bytes of a packet beside its poses, frames, geometry or chunk.
inline constexpr std::size_t kPacketOverheadBytesMax = 4096;
// The most bytes of a datagram. Some browsers send no larger ones.
inline constexpr std::size_t kDatagramBytesMax = 1024;
// The most bytes of a groom in one chunk. A packet with one chunk fits the window of a download's stream
// (client/link/download_reader.hpp).
inline constexpr std::size_t kGroomChunkBytesMax = 262'144;
// The most bytes of a groom's file, packed and unpacked, since a small file must not unpack into more.
inline constexpr std::size_t kGroomBytesMax = 268'435'456;
inline constexpr std::size_t kPosesPerBatchMax = 4096;
// The most earlier poses in one batch.
inline constexpr std::size_t kEarlierPosesMax = 16;
// The most members in an Observe or a ReportImportance.
inline constexpr std::size_t kMembersPerMessageMax = 4096;
// The most integers of a hair state's displacements, and of its velocities: the largest lattice has 64 nodes an axis
// and 3 integers a node.
inline constexpr std::size_t kHairStateIntegersMax = 786'432;
inline constexpr std::size_t kRoomNameBytesMax = 64;
// The most bytes of a token. A Hello must stay small, since anyone may send one.
inline constexpr std::size_t kTokenBytesMax = 4096;
// The most servers that a Welcome names beside the one that sends it.
inline constexpr std::size_t kServersMax = 8;
// The most bytes of a character's tag.
inline constexpr std::size_t kTagBytesMax = 256;
// The most bytes of one person's encoded hands; all valid hands keep to it.
inline constexpr std::size_t kHandsBytesMax = 1041;
// The most props of a room. A prop's number is below this.
inline constexpr std::size_t kPropsMax = 128;
// The most sessions that a character's owner can choose (SetTouch).
inline constexpr std::size_t kTouchChosenMax = 64;
inline constexpr std::uint32_t kStrideMax = 4;  // ticks
inline constexpr float kObserveRadiusMax_m = 20'000;
inline constexpr float kObserveErrorMax_m = 1;
inline constexpr float kHairStateStepMax_m = 0.001f;
// The greatest height of a head over the screen's.
inline constexpr float kScreenHeightMax = 100;
// The most bytes of a string, where no other limit is stated.
inline constexpr std::size_t kTextBytesMax = 1024;
// The greatest size of any coordinate of a pose.
inline constexpr double kPositionMax_m = 10'000;
// The greatest size of any time, so that sums of two times cannot overflow.
inline constexpr std::int64_t kTimeMax_ns = 2'305'843'009'213'693'952;
inline constexpr std::uint32_t kTickRateMax_hz = 1000;
// A peer from which nothing comes for so long is lost.
inline constexpr std::uint32_t kSilence_ms = 10'000;
inline constexpr std::uint32_t kLatticeNodesPerAxisMax = 64;
// The greatest size of a lattice's origin and spacing along any axis.
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
