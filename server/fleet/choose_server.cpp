#include "server/fleet/choose_server.hpp"

#include <cmath>

#include "core/random.hpp"

namespace hairnet::server {
namespace {

// Free shares are rounded up to eighths, so that a change of load seldom changes the choice.
constexpr double kShareSteps = 8;

// FNV-1a. All servers must compute the same number, so std::hash, which differs between libraries, will not do.
std::uint64_t hash_of(std::string_view text) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  for (const char c : text) hash = (hash ^ static_cast<unsigned char>(c)) * 0x100000001b3u;
  return hash;
}

// Weighted rendezvous hashing: with u uniform in (0, 1), the greatest -w / ln u is server i's with probability
// w_i / sum of w.
double score(std::uint64_t room_hash, const ServerStatus& server) {
  const double weight = std::ceil(server.load.free_share * kShareSteps) / kShareSteps;
  // The upper 53 bits plus one half, over 2^53: the half keeps u above 0, and below 1 but for the rounding of the
  // largest value.
  const double u = (static_cast<double>(Random(room_hash, server.id).next() >> 11) + 0.5) * 0x1p-53;
  return -weight / std::log(u);
}

// How well a server suits a room, whatever its score.
enum class Fit : std::uint8_t { beside_big_room, beside_rooms, good };

Fit fit_of(const ServerStatus& server, bool is_big) {
  if (server.load.has_big_room) return Fit::beside_big_room;
  return is_big && server.load.rooms > 0 ? Fit::beside_rooms : Fit::good;
}

}  // namespace

std::optional<std::uint64_t> choose_server(std::string_view room, std::span<const ServerStatus> servers, bool is_big) {
  const std::uint64_t room_hash = hash_of(room);
  std::optional<std::uint64_t> chosen;
  double highest = 0;
  Fit best = Fit::beside_big_room;
  for (const ServerStatus& server : servers) {
    if (server.draining || server.load.free_share < kFreeShareMin || server.load.free_characters == 0) continue;
    const Fit fit = fit_of(server, is_big);
    if (fit < best) continue;
    // A better fit beats every score of a worse one.
    if (fit > best) chosen.reset();
    best = fit;
    const double own = score(room_hash, server);
    // The id breaks ties, so that the order of the list does not matter.
    if (chosen && (own < highest || (own == highest && server.id > *chosen))) continue;
    chosen = server.id;
    highest = own;
  }
  return chosen;
}

}  // namespace hairnet::server
