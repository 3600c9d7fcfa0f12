#pragma once

#include <boost/asio.hpp>
#include <functional>

#include "tests/load/exposition.hpp"

namespace hairnet::load {

// GET /metrics; `done` gets the answer if it comes within a second, and nothing if it is not valid. Does not block;
// `io` must outlive it.
void scrape(boost::asio::io_context& io, const boost::asio::ip::tcp::endpoint& server,
            std::function<void(Exposition)> done);

}  // namespace hairnet::load
