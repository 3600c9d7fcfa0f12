#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <string>

#include "client/link/name_lookup.hpp"
#include "client/link/server_stream.hpp"

namespace hairnet::link {

// Resolves and connects. Returns an empty string, or one line with the reason of the failure. Ends soon after both
// `lookup` is cancelled and the socket is closed.
asio::awaitable<std::string> connect_socket(asio::ip::tcp::socket& socket, NameLookup& lookup,
                                            const StreamOptions& options);

// Describes the end of a connection in one line.
std::string describe_failure(const boost::system::error_code& error, const Address& address);

}  // namespace hairnet::link
