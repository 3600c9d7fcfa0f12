#pragma once

#include <boost/asio/awaitable.hpp>
#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <memory>

#include "client/link/server_stream.hpp"

namespace hairnet::link {

// Finds the addresses of a host. The system's own call cannot be interrupted: after cancel() its result is ignored. One
// thread.
class NameLookup {
 public:
  using Found = asio::ip::tcp::resolver::results_type;

  explicit NameLookup(const asio::any_io_executor& executor);
  NameLookup(const NameLookup&) = delete;
  NameLookup& operator=(const NameLookup&) = delete;
  ~NameLookup() { cancel(); }

  // Call it once. After cancel(), also one before this call, `error` is operation_aborted at once.
  asio::awaitable<Found> find(const Address& address, boost::system::error_code& error);
  void cancel();

 private:
  struct State;
  std::shared_ptr<State> state_;
};

}  // namespace hairnet::link
