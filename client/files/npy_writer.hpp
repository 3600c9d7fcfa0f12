#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "core/result.hpp"
#include "schema/files/output_file.hpp"

namespace hairnet {

enum class NpyType : std::uint8_t { float32, int64 };

// What a .npy file has before its values, for `type` such as "<f4": 128 bytes, whatever the shape.
std::string npy_header(std::string_view type, std::span<const std::size_t> shape);

// One array of NumPy's .npy format 1.0 (little endian, C order). Its first axis grows row by row, and finish() writes
// its length into the header. It reads no arrays. Errors do not name the file.
class NpyWriter {
 public:
  // Rows have `row_shape`: {} for a plain list, {nodes, 3} for a list of node positions.
  static Result<NpyWriter> create(const std::string& path, NpyType type, std::vector<std::size_t> row_shape);

  // Whole rows, one or more, of the type given to create(). A failure to write shows in finish().
  void append(std::span<const float> values);
  void append(std::span<const std::int64_t> values);
  // Writes the row count and gives the file its name; without it there is no file.
  Result<void> finish();

 private:
  explicit NpyWriter(OutputFile file) : file_(std::move(file)) {}
  void write_header();

  OutputFile file_;
  NpyType type_ = NpyType::float32;
  std::vector<std::size_t> row_shape_;
  std::size_t row_bytes_ = 0, row_count_ = 0;
};

}  // namespace hairnet
