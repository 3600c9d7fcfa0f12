#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <vector>

#include "schema/wire/messages.hpp"

namespace hairnet::link {

// Groom bytes on their way to the server, chunk by chunk as it asks for them. No I/O; one thread.
class UploadQueue {
 public:
  using Bytes = std::shared_ptr<const std::vector<std::uint8_t>>;
  explicit UploadQueue(std::size_t chunk_bytes) : chunk_bytes_(chunk_bytes) {}

  // The offer to send, or none: this groom is on its way already.
  std::optional<wire::GroomOffer> offer(const wire::GroomHash& hash, Bytes bytes);
  // The server wants the bytes from `need.offset` on, or with the groom's size none now: another client may be sending
  // them, and should it leave, the server asks again. False for an unknown groom, or an offset beyond it.
  bool need(const wire::GroomNeed& need);
  // Frees the bytes of a groom: the server has all of them, or refused the groom.
  void drop(const wire::GroomHash& hash);
  // Forgets all uploads: the connection is lost, and the grooms will be offered again.
  void clear();
  // The next piece of the groom that has been asked for longest; none when nothing is wanted.
  std::optional<wire::GroomChunk> next_chunk();

  [[nodiscard]] bool is_waiting() const { return !wanted_.empty(); }
  [[nodiscard]] std::size_t groom_count() const { return uploads_.size(); }

 private:
  struct Upload {
    Bytes bytes;
    std::uint64_t sent_bytes = 0;
  };
  std::size_t chunk_bytes_;
  std::map<wire::GroomHash, Upload> uploads_;
  std::deque<wire::GroomHash> wanted_;  // by when they were asked for
};

}  // namespace hairnet::link
