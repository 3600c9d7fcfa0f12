#pragma once

#include <cstddef>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "core/result.hpp"

namespace hairnet {

enum class NpyType : std::uint8_t { float32, int64 };

// One array of NumPy's .npy format 1.0 (little endian, C order). Its first axis grows row by row. Errors do not name
// the file.
class NpyWriter {
 public:
  // Rows have `row_shape`: {} for a plain list, {nodes, 3} for a list of node positions.
  static Result<NpyWriter> create(const std::string& path, NpyType type, std::vector<std::size_t> row_shape);
  NpyWriter(NpyWriter&&) noexcept = default;
  NpyWriter& operator=(NpyWriter&&) noexcept = default;
  ~NpyWriter();  // without finish() the unfinished file is removed

  // Whole rows, one or more, of the type given to create(). A failure to write shows in finish().
  void append(std::span<const float> values);
  void append(std::span<const std::int64_t> values);
  // Writes the row count and gives the file its name.
  Result<void> finish();

 private:
  struct CloseFile {
    void operator()(std::FILE* file) const { std::fclose(file); }
  };
  NpyWriter() = default;
  void append_bytes(std::span<const std::byte> bytes);
  void write_header();

  std::string path_, temporary_;
  NpyType type_ = NpyType::float32;
  std::vector<std::size_t> row_shape_;
  std::size_t row_bytes_ = 0, row_count_ = 0;
  std::unique_ptr<std::FILE, CloseFile> file_;
};

}  // namespace hairnet
