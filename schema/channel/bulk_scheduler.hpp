#pragma once

#include <cstddef>

#include "core/assert.hpp"

namespace hairnet::channel {

// Decides when the bulk data of a connection (pieces of grooms) goes before its urgent messages (poses, frames,
// answers). Normally bulk data waits until nothing else is queued. On a slow line something is always queued, so there
// bulk data gets at least a quarter of the bytes. One thread uses it.
class BulkScheduler {
 public:
  explicit BulkScheduler(std::size_t piece_bytes) : piece_bytes_(piece_bytes) { HAIRNET_ASSERT(piece_bytes > 0); }

  // `bulk_waits`: bulk data was queued while these bytes were sent.
  void sent_urgent(std::size_t bytes, bool bulk_waits) { credit_bytes_ = bulk_waits ? credit_bytes_ + bytes : 0; }
  void sent_bulk() { credit_bytes_ = 0; }
  // Three times the piece makes bulk data a quarter of all bytes while something urgent always waits.
  [[nodiscard]] bool is_due() const { return credit_bytes_ >= 3 * piece_bytes_; }

 private:
  // The size of one piece of bulk data.
  std::size_t piece_bytes_;
  // The urgent bytes since the last piece of bulk, while a piece waited.
  std::size_t credit_bytes_ = 0;
};

}  // namespace hairnet::channel
