#include "server/agones/sidecar_api.hpp"
#include "server/fleet/fleet_values.hpp"
#include "tests/fuzz/target.hpp"

// Any text of Agones' sidecar is refused with a reason, or gives an address that clients can use.
int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hairnet;
  using namespace hairnet::server;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto address = agones::parse_address(text);
  fuzz::require(address.has_value() || !address.error().empty(), "a reason");
  if (address && *address) fuzz::require((*address)->port != 0 && validate(**address).empty(), "an address");
  const auto port = agones::parse_port(text);
  fuzz::require(port ? *port != 0 : !port.error().empty(), "a port");
  return 0;
}
