#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "client/assets/import/imported_body.hpp"
#include "core/result.hpp"

// A glTF 2 file: its JSON, and the numbers in its buffers. Debian's assimp 5.2 crashed on 4 of 6000 mutated avatars and
// does not read meshoptimizer's packing. So this reader uses nlohmann-json, and libmeshoptimizer and libdraco unpack.
// Damage never throws: what is missing or of the wrong type is null, empty or an error.
namespace hairnet::gltf {

using Json = nlohmann::json;

// The member of an object; none where `value` is no object or has no such member.
const Json* member(const Json& value, const char* name);
const Json* member(const Json* value, const char* name);
// Element `index` of the array of this name.
const Json* element(const Json& value, const char* name, std::size_t index);
// A whole number that is not negative.
std::optional<std::size_t> whole(const Json* value);
// Reads a list of exactly `count` finite numbers; none for anything else.
std::optional<std::vector<double>> numbers(const Json* value, std::size_t count);
// The elements of an array; none where it is missing or something else.
const std::vector<Json>& elements(const Json* value);
std::string text_of(const Json* value);

// Rows of numbers in a buffer. All of them lie in `bytes`. `numbers` of File makes them, and has compared count, stride
// and width with the bytes.
struct Numbers {
  std::span<const std::byte> bytes;
  // `count` is the number of rows, `width` that of the numbers in each row.
  std::size_t count = 0, width = 0;
  // A row begins stride_bytes behind the row before; a number has number_bytes.
  std::size_t stride_bytes = 0, number_bytes = 0;
  // The type of a number, as glTF's componentType, such as 5126 for floats.
  std::size_t component = 0;
  bool is_normalized = false;

  [[nodiscard]] double at(std::size_t row, std::size_t column) const;
};

// An open file. It keeps unpacked and foreign buffers as long as it lives, at most 512 MB of them. Reading is not
// const, since it fills them.
class File {
 public:
  // `bytes` must outlive the file. Text or binary is decided by the first bytes, not by a name. Only the JSON is
  // checked here; buffers are when they are needed.
  static Result<File> open(std::span<const std::byte> bytes, const ReadBeside& read_beside);

  [[nodiscard]] const Json& json() const { return json_; }
  // The numbers of accessor `index`, each row of that width. The row's width must be that of the accessor's type: 1, 3,
  // 4 or 16. The result points into the file or its buffers. Sparse accessors are refused.
  Result<Numbers> numbers(std::size_t index, std::size_t width);
  // The bytes of a buffer view, unpacked. The span stays valid as long as the file.
  Result<std::span<const std::byte>> view(std::size_t index);

 private:
  Result<std::span<const std::byte>> buffer(std::size_t index);
  Result<std::span<const std::byte>> part_of_buffer(const Json& view);
  Result<std::span<const std::byte>> unpacked(std::size_t index, const Json& packed);

  Json json_;
  // The part of a .glb behind its JSON.
  std::span<const std::byte> binary_;
  ReadBeside read_beside_;
  std::map<std::size_t, std::vector<std::byte>> buffers_, unpacked_;
  // The number of bytes in both maps, which may have 512 MB.
  std::size_t taken_bytes_ = 0;
};

}  // namespace hairnet::gltf
