#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "schema/channel/token.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::whole {

// The assets of all trials, which are made once: grooms with as little hair as levels can be built from, a token key,
// and a folder on disk.
struct Assets {
  struct GroomFile {
    wire::GroomHash hash{};
    std::shared_ptr<const std::vector<std::uint8_t>> bytes;
  };
  // The last groom is so large that it travels in several chunks.
  std::vector<GroomFile> grooms;
  // Grooms whose builds would take too long or too much memory: strands that zigzag, a body of many triangles.
  std::vector<GroomFile> costly;
  std::string token_key_file, level_cache;
  channel::TokenKey token_key;
  // Makes a token for the room. An empty `subject` makes one without a subject; `moderates` makes its holder a
  // moderator.
  std::string token(bool expired, const std::string& room, const std::string& subject, bool moderates = false) const;
};
const Assets& assets();
// Returns the bytes with their hash. They need not be a valid groom.
Assets::GroomFile groom_file(std::vector<std::uint8_t> bytes);

// From now on this thread's random bytes (session secrets) follow from the seed.
void seed_secrets(std::uint64_t seed);

}  // namespace hairnet::whole
