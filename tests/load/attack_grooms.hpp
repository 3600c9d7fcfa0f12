#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

#include "tests/load/protocol_client.hpp"

// Grooms that attackers upload, as files: valid within the default limits of a server, and costly.
namespace hairnet::load {

// Their name. An attacker changes the digits: each is another groom to the server.
inline constexpr std::string_view kAttackGroomName = "attack-00000000";

// One strand of 7 MB that runs from end to end of its box: a spring for each lattice plane, each time.
std::vector<std::uint8_t> make_zigzag_groom();
// A strand over a body of a million vertices and two million triangles, all through each other.
std::vector<std::uint8_t> make_body_groom();
// Nearly the largest hairstyle that a build's memory allows: 90 000 strands of 20 points.
std::vector<std::uint8_t> make_big_groom();
// Not a groom.
std::vector<std::uint8_t> make_rubbish(std::size_t byte_count);

// A few strands that no groom of another seed has: what a user uploads who comes during an attack.
EncodedGroom make_late_joiner_groom(std::uint64_t seed);

}  // namespace hairnet::load
