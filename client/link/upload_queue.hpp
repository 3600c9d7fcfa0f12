#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "core/assert.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Groom bytes for the server, sent in chunks when the server requests them. No I/O; one thread.
class UploadQueue {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  explicit UploadQueue(std::size_t chunk_bytes) : chunk_bytes_(chunk_bytes) { HAIRNET_ASSERT(chunk_bytes > 0); }

  // Returns the offer to send; none if this groom is already being uploaded. Asserts that `bytes` is not null.
  std::optional<wire::GroomOffer> offer(const wire::GroomHash& hash, Bytes bytes);
  // The server wants the bytes from `need.offset` on. An offset equal to the groom's size means that it wants none now:
  // another client may be uploading them, and if it leaves, the server asks again. False for an unknown groom, or an
  // offset beyond its size.
  bool need(const wire::GroomNeed& need);
  // Frees the bytes of a groom: the server has all of them, or refused the groom.
  void drop(const wire::GroomHash& hash);
  // Forgets all uploads: the connection is lost, and the grooms will be offered again.
  void clear();
  // The next chunk of the groom that was requested first; none when nothing is requested.
  std::optional<wire::GroomChunk> next_chunk();

  [[nodiscard]] bool is_waiting() const { return !wanted_.empty(); }
  [[nodiscard]] std::size_t groom_count() const { return uploads_.size(); }

 private:
  void check_invariants() const;

  struct Upload {
    Bytes bytes;
    // The next chunk begins here.
    std::uint64_t sent_bytes = 0;
  };
  std::size_t chunk_bytes_;
  std::map<wire::GroomHash, Upload> uploads_;
  // The grooms whose bytes the server waits for, in the order of its requests.
  std::deque<wire::GroomHash> wanted_;
};

}  // namespace hairnet::link
