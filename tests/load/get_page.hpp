#pragma once

#include <boost/asio.hpp>
#include <chrono>
#include <functional>
#include <string_view>

namespace hairnet::load {

// GET of a path; `done` gets the body of the answer, and nothing if it does not come in time or is not of status 200.
// Does not block; `io` must outlive it.
void get_page(boost::asio::io_context& io, const boost::asio::ip::tcp::endpoint& server, std::string_view path,
              std::chrono::seconds wait, std::function<void(std::string_view body)> done);

}  // namespace hairnet::load
