#pragma once

#include <boost/asio.hpp>
#include <functional>

#include "tests/load/exposition.hpp"

namespace hairnet::load {

// GET /metrics; `done` gets what came within a second, nothing when it was no exposition. Does not block; `io` outlives
// it.
void scrape(boost::asio::io_context& io, const boost::asio::ip::tcp::endpoint& server,
            std::function<void(Exposition)> done);

}  // namespace hairnet::load
