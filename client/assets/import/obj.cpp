#include "client/assets/import/obj.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "client/assets/import/text.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

std::string read_vertex(std::string_view numbers, std::vector<Vec3f>& vertices) {
  Vec3f vertex;
  for (int axis = 0; axis < 3; ++axis) {
    const std::string_view word = take_word(numbers);
    const std::optional<float> value = parse_number<float>(word);
    if (!value) return word.empty() ? "a vertex needs 3 numbers" : "not a finite number: " + shown(word);
    vertex[axis] = *value;
  }
  vertices.push_back(vertex);
  return {};
}

// The vertex of "7", "7/1", "7//3", "7/1/3", "-2/…": 1 is the first, -1 the last one read so far.
std::optional<std::uint32_t> vertex_index(std::string_view corner, std::size_t vertex_count) {
  const std::string_view number = corner.substr(0, corner.find('/'));
  const std::optional<std::int64_t> index = parse_number<std::int64_t>(number);
  if (!index || *index == 0) return {};
  const auto count = static_cast<std::int64_t>(vertex_count);
  if (*index > count || *index < -count) return {};
  return static_cast<std::uint32_t>(*index > 0 ? *index - 1 : count + *index);
}

std::string read_face(std::string_view corners, TriangleMesh& mesh) {
  std::uint32_t first = 0, last = 0;
  std::size_t corner_count = 0;
  for (std::string_view word = take_word(corners); !word.empty() && word.front() != '#'; word = take_word(corners)) {
    const std::optional<std::uint32_t> index = vertex_index(word, mesh.vertices.size());
    if (!index)
      return "no vertex " + shown(word) + " among the " + std::to_string(mesh.vertices.size()) + " read so far";
    if (corner_count == 0) first = *index;
    if (corner_count >= 2) mesh.triangles.push_back({first, last, *index});
    last = *index;
    ++corner_count;
  }
  return corner_count < 3 ? "a face needs 3 vertices" : "";
}

// `last` is the vertex at which the last line ended, if there was one.
std::string read_line(std::string_view corners, const std::vector<Vec3f>& vertices, ImportedStrands& strands,
                      std::optional<std::uint32_t>& last) {
  std::size_t corner_count = 0;
  for (std::string_view word = take_word(corners); !word.empty() && word.front() != '#'; word = take_word(corners)) {
    const std::optional<std::uint32_t> index = vertex_index(word, vertices.size());
    if (!index) return "no vertex " + shown(word) + " among the " + std::to_string(vertices.size()) + " read so far";
    const bool goes_on = corner_count++ == 0 && last == index;
    if (corner_count == 1 && !goes_on) strands.strand_begin.push_back(strands.strand_begin.back());
    if (!goes_on) {
      strands.points.push_back(vertices[*index]);
      ++strands.strand_begin.back();
    }
    last = index;
  }
  return corner_count < 2 ? "a line needs 2 vertices" : "";
}

}  // namespace

Result<ImportedStrands> decode_obj_strands(std::string_view text) {
  std::vector<Vec3f> vertices;
  ImportedStrands strands;
  std::optional<std::uint32_t> last;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = take_line(text);
    const std::string_view keyword = take_word(line);
    std::string fault;
    if (keyword == "v") {
      fault = read_vertex(line, vertices);
    } else if (keyword == "l") {
      fault = read_line(line, vertices, strands, last);
    }
    if (!fault.empty()) return Refusal("line " + std::to_string(line_number) + ": " + fault);
  }
  return strands;
}

Result<TriangleMesh> decode_obj(std::string_view text) {
  TriangleMesh mesh;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = take_line(text);
    const std::string_view keyword = take_word(line);
    std::string fault;
    if (keyword == "v") {
      fault = read_vertex(line, mesh.vertices);
    } else if (keyword == "f") {
      fault = read_face(line, mesh);
    }
    if (!fault.empty()) return Refusal("line " + std::to_string(line_number) + ": " + fault);
  }
  if (mesh.vertices.empty()) return Refusal("not a mesh: no vertices (lines that begin with v)");
  if (mesh.triangles.empty()) return Refusal("not a mesh: no faces (lines that begin with f)");
  return mesh;
}

}  // namespace hairnet
