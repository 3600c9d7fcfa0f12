#pragma once

#include <cstdint>
#include <string>

namespace hairnet::whole {

// A TCP port of the loopback that nobody listens at.
std::uint16_t free_port();

// The body that GET answers at a numeric address, within a second or so; empty when nothing answers.
std::string get(const std::string& address, std::uint16_t port, const std::string& path);
inline std::string get(std::uint16_t port, const std::string& path) {
  return get("127.0.0.1", port, path);
}

}  // namespace hairnet::whole
