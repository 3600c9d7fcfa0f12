#include "client/room/connect.hpp"

namespace hairnet::room {

Result<std::unique_ptr<Room>> connect(const link::LinkOptions& options, const wire::Observe& observe) {
  auto link = std::make_unique<link::Link>(options);
  if (const auto welcome = link->connect(); !welcome) return Refusal(welcome.error());
  return std::make_unique<Room>(std::move(link), observe);
}

}  // namespace hairnet::room
