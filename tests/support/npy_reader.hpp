#pragma once

#include <cstddef>
#include <cstring>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

// Reads back the .npy arrays that the tools write: version 1.0, little-endian float32 or int64, C order. Throws
// std::runtime_error for any other file.
namespace hairnet::support {

template <class T>
struct NpyArray {
  std::vector<std::size_t> shape;
  std::vector<T> values;
  // A row is one entry of the first axis, such as a frame; its size is the product of the other axes.
  [[nodiscard]] std::size_t row_count() const { return shape.at(0); }
  [[nodiscard]] std::size_t row_size() const { return row_count() == 0 ? 0 : values.size() / row_count(); }
  [[nodiscard]] const T* row(std::size_t i) const { return values.data() + i * row_size(); }
};

template <class T>
NpyArray<T> read_npy(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  if (bytes.size() < 10 || bytes.substr(0, 8) != std::string("\x93NUMPY\x01\x00", 8))
    throw std::runtime_error(path + " is no .npy file");
  // The header begins after 10 bytes: magic, version and its own length in two bytes, low byte first.
  const std::size_t data = 10 + static_cast<unsigned char>(bytes[8]) + 256u * static_cast<unsigned char>(bytes[9]);
  const std::string header = bytes.substr(10, data - 10);
  if (header.find(sizeof(T) == 4 ? "'<f4'" : "'<i8'") == std::string::npos)
    throw std::runtime_error(path + " has another type");
  NpyArray<T> array;
  std::size_t count = 1;
  const std::size_t end = header.find(')');
  // The header holds the shape as a Python tuple, such as (250, 40, 3).
  for (std::size_t at = header.find('(') + 1; at < end; at = header.find_first_not_of(", ", at)) {
    std::size_t used = 0;
    array.shape.push_back(std::stoul(header.substr(at), &used));
    count *= array.shape.back();
    at += used;
  }
  if (bytes.size() != data + count * sizeof(T)) throw std::runtime_error(path + " is cut off");
  array.values.resize(count);
  if (count > 0) std::memcpy(array.values.data(), bytes.data() + data, count * sizeof(T));
  return array;
}

}  // namespace hairnet::support
