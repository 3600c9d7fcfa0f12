#include "client/files/npy_writer.hpp"

#include <bit>
#include <cerrno>
#include <cstring>
#include <utility>

#include "client/files/system_refusal.hpp"
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
  NpyWriter writer;
  writer.path_ = path;
  writer.temporary_ = path + ".part";
  writer.type_ = type;
  writer.row_shape_ = std::move(row_shape);
  writer.row_bytes_ = item_bytes(type);
  for (const std::size_t extent : writer.row_shape_) writer.row_bytes_ *= extent;
  writer.file_.reset(std::fopen(writer.temporary_.c_str(), "wb"));
  if (!writer.file_) return system_refusal("cannot be written there");
  writer.write_header();
  return writer;
}

NpyWriter::~NpyWriter() {
  if (!file_) return;
  file_.reset();
  std::remove(temporary_.c_str());
}

void NpyWriter::write_header() {
  std::string shape = std::to_string(row_count_);
  for (const std::size_t extent : row_shape_) shape += ", " + std::to_string(extent);
  if (row_shape_.empty()) shape += ",";  // a Python tuple of one
  const char* descr = type_ == NpyType::float32 ? "<f4" : "<i8";
  std::string header = {'\x93', 'N', 'U', 'M', 'P', 'Y', '\1', '\0', '\0', '\0'};
  header += std::string("{'descr': '") + descr + "', 'fortran_order': False, 'shape': (" + shape + "), }";
  HAIRNET_ASSERT(header.size() < kHeaderBytes);
  header[8] = static_cast<char>(kHeaderBytes - 10);  // bytes after this field, u16
  header.resize(kHeaderBytes - 1, ' ');
  header += '\n';
  append_bytes(std::as_bytes(std::span(header)));
}

void NpyWriter::append(std::span<const float> values) {
  HAIRNET_ASSERT(type_ == NpyType::float32);
  append_bytes(std::as_bytes(values));
  row_count_ += row_bytes_ > 0 ? values.size_bytes() / row_bytes_ : 1;
}

void NpyWriter::append(std::span<const std::int64_t> values) {
  HAIRNET_ASSERT(type_ == NpyType::int64);
  append_bytes(std::as_bytes(values));
  row_count_ += row_bytes_ > 0 ? values.size_bytes() / row_bytes_ : 1;
}

void NpyWriter::append_bytes(std::span<const std::byte> bytes) {
  std::fwrite(bytes.data(), 1, bytes.size(), file_.get());
}

Result<void> NpyWriter::finish() {
  HAIRNET_ASSERT(file_);
  std::fseek(file_.get(), 0, SEEK_SET);
  write_header();
  const bool written = std::ferror(file_.get()) == 0;
  const bool closed = std::fclose(file_.release()) == 0;
  if (written && closed && std::rename(temporary_.c_str(), path_.c_str()) == 0) return {};
  const int fault = errno;
  std::remove(temporary_.c_str());
  errno = fault;
  return system_refusal("cannot be written");
}

}  // namespace hairnet
