#pragma once

#include "server/room/counter.hpp"

namespace hairnet::server {

struct TransportCounters : CounterSet {
  Counter connections_accepted{*this, "connections_accepted"};
  Counter connections_closed{*this, "connections_closed"};
  Counter accepts_failed{*this, "accepts_failed"};
  Counter bytes_read{*this, "bytes_read"};
  Counter bytes_written{*this, "bytes_written"};
};

}  // namespace hairnet::server
