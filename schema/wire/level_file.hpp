#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/levels/level.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::wire {

// The levels built of a groom, with its modes and its learnt hair if it has any, as a file: a header, then a
// FlatBuffer of levels.fbs. The checksum covers every byte; numbers are little endian.
//
//   offset  bytes  header
//        0      8  magic "HNLEVELS"
//        8      4  version of this layout
//       12      4  kBuildVersion: of what makes levels of a groom
//       16     96  the levels' specs as asked for, four times: nodes x, y, z, springs, attachments, contact points
//      112     32  hash of the groom
//      144      8  bytes of the payload
//      152     32  BLAKE2b-256 of all the bytes before and after this
//      184         payload
inline constexpr std::size_t kLevelFileHeaderBytes = 184;
inline constexpr std::size_t kLevelFileBytesMax = std::size_t{256} << 20;

enum class LevelFileError : std::uint8_t {
  none,
  not_a_level_file,
  // The version of the layout or of the build differs, or the specs do.
  other_version,
  other_groom,
  // Bytes are missing, surplus or changed.
  damaged,
  // The bytes are those that were written, and yet no levels that may be run.
  invalid,
};

struct DecodedLevels {
  LevelFileError error = LevelFileError::none;
  // One line, when there is an error.
  std::string detail;
  // Every level is valid. The maps between levels are not part of the file.
  std::shared_ptr<LevelSet> levels;
};

// Deterministic. The levels must pass validate().
std::vector<std::uint8_t> encode_levels(const GroomHash& groom, const LevelSet& set);
DecodedLevels decode_levels(std::span<const std::uint8_t> bytes, const GroomHash& groom);

// The name of the file in a level cache: the hash as hexadecimal digits, and the suffix.
inline constexpr const char* kLevelFileSuffix = ".hnlevels";
std::string level_file_name(const GroomHash& groom);

// Writes payload length and checksum into the header. `bytes` must have at least a header.
void set_level_file_checksum(std::span<std::uint8_t> bytes);

}  // namespace hairnet::wire
