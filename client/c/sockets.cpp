#include "client/c/sockets.hpp"

#include "client/c/handles.hpp"
#include "client/link/link.hpp"

namespace hairnet::c {

hairnet_error connect(const hairnet_options& options, const link::LinkCoreOptions& core, const wire::Observe& observe,
                      std::unique_ptr<room::Room>& room, char* error, std::size_t error_size) {
  link::LinkOptions link;
  link.core = core;
  if (options.server != nullptr) {
    const Result<link::Address> address = link::parse_address(options.server);
    if (!address) return refuse(HAIRNET_INVALID, "server: " + address.error(), error, error_size);
    link.server = *address;
  }
  link.tls.ca_file = text_or_empty(options.ca_file);
  if (options.address_only != 0) link.transport = link::TransportChoice::address;
  auto connection = std::make_unique<link::Link>(link);
  if (const Result<wire::Welcome> welcome = connection->connect(); !welcome) {
    bool is_refused = false;
    for (const link::Event& event : connection->poll()) {
      const auto* end = std::get_if<link::Disconnected>(&event);
      // A goodbye with another reason than these two is a refusal by a server of ours. Without one, or with an answer
      // in another protocol, no server of ours is there.
      is_refused = is_refused || (end != nullptr && end->reason != wire::GoodbyeReason::none &&
                                  end->reason != wire::GoodbyeReason::protocol_error);
    }
    return refuse(is_refused ? HAIRNET_REFUSED : HAIRNET_UNREACHABLE, welcome.error(), error, error_size);
  }
  room = std::make_unique<room::Room>(std::move(connection), observe);
  return HAIRNET_OK;
}

}  // namespace hairnet::c
