#include "client/assets/import/obj.hpp"

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "client/assets/import/edge_chains.hpp"
#include "client/assets/import/parse_text.hpp"
#include "core/groom/groom.hpp"
#include "core/shown_text.hpp"

namespace hairnet {
namespace {

// Further numbers, such as weights or colours, are ignored.
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

// The vertex of "7", "7/1", "7//3", "7/1/3", "-2/…": 1 is the first, -1 the last one read so far. Indices behind a
// slash name texture and normals, which hair does not have.
std::optional<std::uint32_t> vertex_index(std::string_view corner, std::size_t vertex_count) {
  const std::string_view number = corner.substr(0, corner.find('/'));
  const std::optional<std::int64_t> index = parse_number<std::int64_t>(number);
  if (!index || *index == 0) return {};
  const auto count = static_cast<std::int64_t>(vertex_count);
  // Only vertices read so far count, because negative indices count back from here.
  if (*index > count || *index < -count) return {};
  return static_cast<std::uint32_t>(*index > 0 ? *index - 1 : count + *index);
}

// A polygon becomes a fan about its first corner. Concave ones may overlap themselves.
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

// The lines of a file, as vertices of polylines. A line that begins where the one before ended continues it, since some
// programs write one line for each edge.
struct ObjLines {
  std::vector<std::uint32_t> vertices;
  // Each polyline ends here in `vertices`, and has this group.
  std::vector<std::size_t> end;
  std::vector<std::string_view> groups;
  // All lines, as long as they have two vertices each.
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::string_view> edge_groups;
  bool has_longer = false;

  std::string read(std::string_view corners, std::size_t vertex_count, std::string_view group) {
    std::size_t corner_count = 0;
    std::array<std::uint32_t, 2> edge{};
    for (std::string_view word = take_word(corners); !word.empty() && word.front() != '#'; word = take_word(corners)) {
      const std::optional<std::uint32_t> index = vertex_index(word, vertex_count);
      if (!index) return "no vertex " + shown(word) + " among the " + std::to_string(vertex_count) + " read so far";
      if (corner_count < 2) edge[corner_count] = *index;
      if (corner_count++ == 0) {
        // A line of another group never continues the one before.
        if (!end.empty() && vertices.back() == *index && groups.back() == group) continue;
        end.push_back(vertices.size());
        groups.push_back(group);
      }
      vertices.push_back(*index);
      end.back() = vertices.size();
    }
    has_longer = has_longer || corner_count > 2;
    if (!has_longer) {
      edges.push_back(edge);
      edge_groups.push_back(group);
    }
    return corner_count < 2 ? "a line needs 2 vertices" : "";
  }

  // Lines of two vertices each that do not follow each other are edges of strands in any order, as of a mesh.
  void join_edges(std::size_t vertex_count) {
    std::size_t single = 0;
    for (std::size_t i = 0; i < end.size(); ++i) single += end[i] - (i > 0 ? end[i - 1] : 0) == 2;
    // Files with longer lines, or whose lines mostly follow each other, already have their strands. Joining would then
    // only risk to connect strands that touch.
    if (has_longer || 2 * single < end.size()) return;
    Chains chains = chain_edges(edges, vertex_count);
    // Chains that do not reduce the number of lines show that the edges were strands of two points each.
    if (chains.count() >= end.size()) return;
    vertices = std::move(chains.vertices);
    end.assign(chains.begin.begin() + 1, chains.begin.end());
    groups.clear();
    for (const std::uint32_t edge : chains.first_edge) groups.push_back(edge_groups[edge]);
  }
};

}  // namespace

// The views of names point into `text`, so groups are compared without copies.
Result<ImportedStrands> decode_obj_strands(std::string_view text) {
  std::vector<Vec3f> vertices;
  ObjLines lines;
  std::string_view group;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = take_line(text);
    const std::string_view keyword = take_word(line);
    std::string error;
    if (keyword == "v") {
      error = read_vertex(line, vertices);
    } else if (keyword == "l") {
      error = lines.read(line, vertices.size(), group);
    } else if (keyword == "o" || keyword == "g") {
      group = take_word(line);
    }
    if (!error.empty()) return Refusal("line " + std::to_string(line_number) + ": " + error);
  }
  lines.join_edges(vertices.size());
  ImportedStrands strands;
  std::map<std::string_view, std::uint32_t> numbers;
  for (std::size_t i = 0; i < lines.end.size(); ++i) {
    for (std::size_t at = strands.points.size(); at < lines.end[i]; ++at)
      strands.points.push_back(vertices[lines.vertices[at]]);
    strands.strand_begin.push_back(static_cast<std::uint32_t>(lines.end[i]));
    strands.groups.push_back(
        numbers.try_emplace(lines.groups[i], static_cast<std::uint32_t>(numbers.size())).first->second);
  }
  // A single group says nothing, and more than a groom may have are dropped.
  if (numbers.size() < 2 || numbers.size() > GroomLimits{}.group_count_max) {
    strands.groups.clear();
    return strands;
  }
  strands.group_names.resize(numbers.size());
  for (const auto& [name, number] : numbers) strands.group_names[number] = name.empty() ? "hair" : name;
  return strands;
}

// Only the mesh is read here; `add_file` has tried the lines before.
Result<TriangleMesh> decode_obj(std::string_view text) {
  TriangleMesh mesh;
  for (std::size_t line_number = 1; !text.empty(); ++line_number) {
    std::string_view line = take_line(text);
    const std::string_view keyword = take_word(line);
    std::string error;
    if (keyword == "v") {
      error = read_vertex(line, mesh.vertices);
    } else if (keyword == "f") {
      error = read_face(line, mesh);
    }
    if (!error.empty()) return Refusal("line " + std::to_string(line_number) + ": " + error);
  }
  if (mesh.vertices.empty()) return Refusal("not a mesh: no vertices (lines that begin with v)");
  if (mesh.triangles.empty()) return Refusal("not a mesh: no faces (lines that begin with f)");
  return mesh;
}

}  // namespace hairnet
