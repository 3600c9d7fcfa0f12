#include "client/c/sockets.hpp"

#include "client/c/handles.hpp"
#include "client/room/connect.hpp"

namespace hairnet::c {

hairnet_error connect(const hairnet_options& options, const link::LinkCoreOptions& core, const wire::Observe& observe,
                      std::unique_ptr<room::Room>& room, char* why, std::size_t why_size) {
  link::LinkOptions link;
  link.core = core;
  if (options.server != nullptr) {
    const Result<link::Address> address = link::parse_address(options.server);
    if (!address) return refuse(HAIRNET_INVALID, "server: " + address.error(), why, why_size);
    link.server = *address;
  }
  link.tls.ca_file = text_or_empty(options.ca_file);
  if (options.address_only != 0) link.transport = link::TransportChoice::address;
  Result<std::unique_ptr<room::Room>> joined = room::connect(link, observe);
  if (!joined) return refuse(HAIRNET_UNREACHABLE, joined.error(), why, why_size);
  room = std::move(*joined);
  return HAIRNET_OK;
}

}  // namespace hairnet::c
