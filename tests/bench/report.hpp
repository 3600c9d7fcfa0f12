#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace hairnet::bench {

using Json = nlohmann::ordered_json;

// All rows of a run, for files, and the errors that were found.
class Report {
 public:
  explicit Report(Json header) : header_(std::move(header)) {}

  void add(Json row) { rows_.push_back(std::move(row)); }
  void fail(std::string what) { failures_.push_back(std::move(what)); }

  [[nodiscard]] const std::vector<std::string>& failures() const { return failures_; }
  [[nodiscard]] Json json() const;
  // The header's values, then the union of all rows' keys, empty where a row has none.
  [[nodiscard]] std::string csv() const;

 private:
  Json header_;
  std::vector<Json> rows_;
  std::vector<std::string> failures_;
};

}  // namespace hairnet::bench
