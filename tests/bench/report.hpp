#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace hairnet::bench {

using Json = nlohmann::ordered_json;

// All rows of a run of the benchmarks, for files, and the errors that it has found. With any error the program exits
// with 1.
class Report {
 public:
  explicit Report(Json header) : header_(std::move(header)) {}

  void add(Json row) { rows_.push_back(std::move(row)); }
  void fail(std::string what) { failures_.push_back(std::move(what)); }

  [[nodiscard]] const std::vector<std::string>& failures() const { return failures_; }
  [[nodiscard]] Json json() const;
  // Returns a table. Its columns are the values of the header and then all keys that any row has. A cell is empty where
  // a row does not have the key.
  [[nodiscard]] std::string csv() const;

 private:
  Json header_;
  std::vector<Json> rows_;
  std::vector<std::string> failures_;
};

}  // namespace hairnet::bench
