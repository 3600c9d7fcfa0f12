#include "tests/bench/report.hpp"

#include <algorithm>

namespace hairnet::bench {
namespace {

// Commas separate cells, so those within a text become semicolons.
std::string cell(const Json& value) {
  if (value.is_null()) return {};
  std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  std::ranges::replace(text, ',', ';');
  return text;
}

}  // namespace

Json Report::json() const {
  Json all = header_;
  all["rows"] = rows_;
  all["failures"] = failures_;
  return all;
}

// Rows of different sections have different keys. The columns are those of the header, which are the same in each row,
// and then all keys in the order in which they first come.
std::string Report::csv() const {
  std::vector<std::string> keys;
  for (const Json& row : rows_) {
    for (const auto& [key, value] : row.items()) {
      if (std::ranges::find(keys, key) == keys.end()) keys.push_back(key);
    }
  }
  std::string text, fixed;
  for (const auto& [key, value] : header_.items()) {
    text += key + ",";
    fixed += cell(value) + ",";
  }
  for (std::size_t k = 0; k < keys.size(); ++k) text += (k ? "," : "") + keys[k];
  text += "\n";
  for (const Json& row : rows_) {
    text += fixed;
    for (std::size_t k = 0; k < keys.size(); ++k) {
      if (k) text += ",";
      if (row.contains(keys[k])) text += cell(row[keys[k]]);
    }
    text += "\n";
  }
  return text;
}

}  // namespace hairnet::bench
