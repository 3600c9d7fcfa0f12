#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/result.hpp"

namespace hairnet {

// Ogawa, the container of Alembic files: a tree of groups, whose children are groups and blocks of data. A group is a
// view of the file's bytes, which must outlive it.
class OgawaGroup {
 public:
  OgawaGroup() = default;

  [[nodiscard]] std::size_t child_count() const { return child_count_; }
  // Children are numbered from 0, groups and blocks together.
  [[nodiscard]] bool is_group(std::size_t child) const;
  [[nodiscard]] bool is_data(std::size_t child) const;
  // Empty for a child that is not there, or is of the other kind.
  [[nodiscard]] OgawaGroup group(std::size_t child) const;
  [[nodiscard]] std::span<const std::byte> data(std::size_t child) const;

 private:
  friend class OgawaCheck;
  friend Result<OgawaGroup> open_ogawa(std::span<const std::byte> bytes);
  OgawaGroup(std::span<const std::byte> file, std::size_t at, std::size_t child_count)
      : file_(file), at_(at), child_count_(child_count) {}
  [[nodiscard]] std::uint64_t child_word(std::size_t child) const;

  std::span<const std::byte> file_;
  // The place of the group in the file, where its count stands, and that count.
  std::size_t at_ = 0, child_count_ = 0;
};

// The root group. Checks the whole tree first, so that the views need no checks: each group and block lies within the
// file, no group is its own ancestor, none is deeper than 256, and no more children are walked than the file has room
// for. Takes no memory but for that depth. HDF5 archives and files that were not written to their end have errors of
// their own.
Result<OgawaGroup> open_ogawa(std::span<const std::byte> bytes);

}  // namespace hairnet
