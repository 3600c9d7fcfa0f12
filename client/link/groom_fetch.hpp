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

// Grooms of other clients that are being downloaded in pieces and checked against their hashes. No I/O; one thread.
class GroomFetch {
 public:
  // The present round of downloads: the files on their way, and those that have arrived since last no file was on its
  // way.
  struct Progress {
    // `bytes` have arrived, of the `byte_count` of all files whose size is known.
    std::uint64_t bytes = 0, byte_count = 0;
  };
  [[nodiscard]] Progress progress() const;
  // The request to send; none if the groom is already being downloaded.
  std::optional<wire::GroomRequest> request(const wire::GroomHash& hash);
  // Requests to repeat over a new connection. Each continues at the first byte that is missing.
  [[nodiscard]] std::vector<wire::GroomRequest> request_again() const;
  // Returns the whole groom, or the reason why it cannot be used, once that is known.
  std::optional<GroomFetched> take(const wire::GroomData& data);
  // The server refused the request: it has no such groom, or sends too many already. False: not requested.
  bool refuse(const wire::GroomHash& hash) { return fetches_.erase(hash) != 0; }

 private:
  GroomFetched fail(const wire::GroomHash& hash, std::string error);

  struct Fetch {
    // The bytes that have arrived.
    std::vector<std::uint8_t> bytes;
    // The size of the file; zero until a piece has arrived.
    std::uint64_t byte_count = 0;
  };
  // The files that are on their way.
  std::map<wire::GroomHash, Fetch> fetches_;
  // The bytes of the files that have arrived whole in this round.
  std::uint64_t arrived_bytes_ = 0;
};

}  // namespace hairnet::link
