#include "client/files/npy_writer.hpp"

#include <bit>
#include <utility>

#include "core/assert.hpp"

namespace hairnet {
namespace {

static_assert(std::endian::native == std::endian::little, "arrays are written as they lie in memory");

// NumPy wants data aligned to 64 bytes. Two such blocks fit the longest row count, so the header never moves the data.
constexpr std::size_t kHeaderBytes = 128;

std::size_t item_bytes(NpyType type) {
  return type == NpyType::float32 ? 4 : 8;
}

}  // namespace

Result<NpyWriter> NpyWriter::create(const std::string& path, NpyType type, std::vector<std::size_t> row_shape) {
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return Refusal(file.error());
  NpyWriter writer(std::move(*file));
  writer.type_ = type;
  writer.row_shape_ = std::move(row_shape);
  writer.row_bytes_ = item_bytes(type);
  for (const std::size_t extent : writer.row_shape_) writer.row_bytes_ *= extent;
  writer.write_header();
  return writer;
}

std::string npy_header(std::string_view type, std::span<const std::size_t> shape) {
  std::string axes;
  for (const std::size_t extent : shape) axes += (axes.empty() ? "" : ", ") + std::to_string(extent);
  // Python writes a tuple of one with a comma.
  if (shape.size() == 1) axes += ",";
  std::string header = {'\x93', 'N', 'U', 'M', 'P', 'Y', '\1', '\0', '\0', '\0'};
  header += "{'descr': '" + std::string(type) + "', 'fortran_order': False, 'shape': (" + axes + "), }";
  HAIRNET_ASSERT(header.size() < kHeaderBytes);
  // This field of two bytes counts the bytes that follow it.
  header[8] = static_cast<char>(kHeaderBytes - 10);
  header.resize(kHeaderBytes - 1, ' ');
  header += '\n';
  return header;
}

void NpyWriter::write_header() {
  std::vector<std::size_t> shape{row_count_};
  shape.insert(shape.end(), row_shape_.begin(), row_shape_.end());
  const std::string header = npy_header(type_ == NpyType::float32 ? "<f4" : "<i8", shape);
  file_.write(std::as_bytes(std::span(header)));
}

void NpyWriter::append(std::span<const float> values) {
  HAIRNET_ASSERT(type_ == NpyType::float32);
  file_.write(std::as_bytes(values));
  row_count_ += row_bytes_ > 0 ? values.size_bytes() / row_bytes_ : 1;
}

void NpyWriter::append(std::span<const std::int64_t> values) {
  HAIRNET_ASSERT(type_ == NpyType::int64);
  file_.write(std::as_bytes(values));
  row_count_ += row_bytes_ > 0 ? values.size_bytes() / row_bytes_ : 1;
}

Result<void> NpyWriter::finish() {
  // The number of rows is known only now. The header has the same size as before, so it takes the place of the first
  // one.
  file_.go_to_begin();
  write_header();
  return file_.finish();
}

}  // namespace hairnet
