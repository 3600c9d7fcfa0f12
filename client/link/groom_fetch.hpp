#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/link/events.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Grooms of others on their way from the server, piece by piece, checked against their hashes. No I/O; one thread.
class GroomFetch {
 public:
  // The request to send, or none: it is on its way already.
  std::optional<wire::GroomRequest> request(const wire::GroomHash& hash);
  // What there is to ask again over a new connection: each from where its pieces broke off.
  [[nodiscard]] std::vector<wire::GroomRequest> request_again() const;
  // The whole groom, or what is wrong with it, once that is known.
  std::optional<GroomFetched> take(const wire::GroomData& data);
  // The server does not have it, or sends no more grooms at once. False when it was not asked for.
  bool refuse(const wire::GroomHash& hash) { return fetches_.erase(hash) != 0; }

 private:
  GroomFetched fail(const wire::GroomHash& hash, std::string why);

  std::map<wire::GroomHash, std::vector<std::uint8_t>> fetches_;  // what has come of each
};

}  // namespace hairnet::link
