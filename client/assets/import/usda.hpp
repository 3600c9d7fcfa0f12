#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "core/geometry/vec.hpp"
#include "core/result.hpp"

// The text form of USD, .usda: which prims there are, and where the text of their values is. A value is parsed only
// when it is asked for; until then the reader only finds its closing bracket. All texts are views of the file's, which
// must outlive them.
namespace hairnet::usda {

// The greatest depth of prims within prims, and of brackets within brackets, in text and in crates. It bounds the
// memory for files that were made to exhaust it.
inline constexpr std::size_t kDepthMax = 256;

// Stands for no prim, such as the parent of the file.
inline constexpr std::size_t kNone = static_cast<std::size_t>(-1);

// A value at a time code; its text is a part of the file.
struct Sample {
  double time = 0;
  std::string_view value;
};

// One statement about an attribute or a relationship. An attribute may have several: a value, samples, metadata.
struct Statement {
  // A type such as "point3f[]", or "rel" for a relationship.
  std::string_view type;
  std::string_view name;
  // Empty without a value.
  std::string_view value;
  std::vector<Sample> samples;
  // The text between the statement's parentheses.
  std::string_view metadata;
};

// Name and type are views of the file; the metadata is what stands between its parentheses.
struct Prim {
  std::size_t parent = kNone;
  // Words such as "def", "BasisCurves" and "hair".
  std::string_view specifier, type, name;
  std::string_view metadata;
  std::vector<Statement> statements;
};

// The prims, each behind its parent; the first is the file itself. The prims and statements of a variant are those of
// the prim if it selects that variant. References, payloads and sublayers are named in metadata and never followed, so
// the result depends on one file alone.
struct Layer {
  std::vector<Prim> prims;
  // The names of variants that have curves and are not selected.
  std::vector<std::string> skipped_variants;
};

// Returns an error with its line for text that is not valid USD, is nested deeper than kDepthMax, or has more than 500
// 000 prims and statements. Values are not checked before they are read.
Result<Layer> parse(std::string_view text);

// The text of a value in metadata such as `upAxis = "Z"`; empty: none.
std::string_view field(std::string_view metadata, std::string_view key);

// An attribute of a prim: its value, or those at the times of its samples. It joins all statements about the attribute.
struct Attribute {
  std::string_view value, metadata;
  // The values at several times, sorted by time.
  std::vector<Sample> samples;

  [[nodiscard]] bool exists() const { return !value.empty() || !samples.empty(); }
  // The sample that holds at this time, or the first; the value where there are no samples.
  [[nodiscard]] std::string_view at(double time) const;
};
Attribute attribute(const Prim& prim, std::string_view name);

// Returns a string, token, path or asset without its quotes, and any other text as it stands.
std::string unquoted(std::string_view value);
// All strings of an array, or the one.
std::vector<std::string> strings(std::string_view value);
// All numbers of a value, without its brackets; inf and nan are numbers. None when it holds anything else.
std::optional<std::vector<double>> numbers(std::string_view value);
std::optional<std::vector<std::int64_t>> integers(std::string_view value);
// An array of triples of numbers. None when brackets divide a triple, or when a number is left over.
std::optional<std::vector<Vec3f>> triples(std::string_view value);

}  // namespace hairnet::usda
