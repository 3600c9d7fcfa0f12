#pragma once

#include <cstddef>

namespace hairnet::channel {

// When bulk (pieces of grooms) goes before what must go soon (poses, frames, answers) on one connection. As a rule it
// goes when nothing else waits. Where something always does, on a thin line, it gets at least one byte in four all the
// same: without that it would never arrive. One thread.
class BulkShare {
 public:
  explicit BulkShare(std::size_t piece_bytes) : piece_bytes_(piece_bytes) {}

  void sent_soon(std::size_t bytes, bool bulk_waits) { credit_bytes_ = bulk_waits ? credit_bytes_ + bytes : 0; }
  void sent_bulk() { credit_bytes_ = 0; }
  [[nodiscard]] bool is_due() const { return credit_bytes_ >= 3 * piece_bytes_; }

 private:
  std::size_t piece_bytes_;
  std::size_t credit_bytes_ = 0;  // sent since the last piece, while one waited
};

}  // namespace hairnet::channel
