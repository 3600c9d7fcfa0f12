#pragma once

#include <memory>
#include <string>

#include "client/link/link_core.hpp"
#include "tests/load/protocol_client.hpp"

namespace hairnet::load {

// The identity of each client.
struct ProtocolOptions {
  std::string name, room, token;
  // These three are as in Plan.
  std::string observe = "all";
  double hair_error_mm = 1, frame_bytes_per_s = 0;
  std::uint64_t seed = 1;
  double decode_share = 1;
  bool evaluate_learnt = true;
  // All clients share it, on one thread, so that each file is downloaded once.
  std::shared_ptr<link::FileCatalog> catalog;
};

// The client library's own core.
std::unique_ptr<ProtocolClient> make_link_protocol_client(ProtocolOptions options);

}  // namespace hairnet::load
