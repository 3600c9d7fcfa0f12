#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <span>
#include <utility>

#include "core/result.hpp"
#include "schema/files/output_file.hpp"

namespace hairnet {

// Writes Ogawa, the container of Alembic files. Groups and blocks of data are written at once, and a word names each of
// them to the group around it. So nothing but the words is kept in memory. A failure to write shows in `finish`. The
// container cannot change what it has written, except for its header.
class OgawaWriter {
 public:
  using Word = std::uint64_t;

  explicit OgawaWriter(OutputFile file);
  // A block of all parts, one behind the other.
  Word data(std::initializer_list<std::span<const std::byte>> parts);
  // `children` are words that `data` and `group` have returned. Several groups may name the same child.
  Word group(std::span<const Word> children);
  // Until here, the header tells readers that the file is not complete.
  Result<void> finish(Word root);

 private:
  void write_header(bool is_complete, Word root);
  void write(std::span<const std::byte> bytes);

  OutputFile file_;
  std::uint64_t at_ = 0;
};

}  // namespace hairnet
